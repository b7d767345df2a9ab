//! Path between the reference and the gyros by a set, and convergence of the columns linearised about it.

use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::{Variant, delay_sign, is_delay};
use rlg_catalogue::entries::MOUNT;
use rlg_catalogue::signals::Path;
use rlg_inference::Fit;
use rlg_plan::RatesPlan;

/// Estimate of a member's parameters beyond its base; minus the base for an insignificant low pass.
pub(crate) fn shown(
    fit: &Fit,
    candidate: &Candidate,
    block: &std::ops::Range<usize>,
    plan: &RatesPlan,
) -> Vec<f64> {
    block
        .clone()
        .zip(&candidate.base)
        .map(|(k, base)| {
            let std = fit.covariance[(k, k)].max(0.0).sqrt();
            let is_shown = base + fit.estimate[k] > plan.path_deviations * std;
            if candidate.variant == Variant::LowPass && !is_shown {
                -base
            } else {
                fit.estimate[k]
            }
        })
        .collect()
}

/// True if a candidate is part of the path between the reference and the gyros.
pub(crate) fn is_of_path(one: &Candidate) -> bool {
    is_delay(one.kind) || one.kind == MOUNT || one.variant == Variant::LowPass
}

/// Path of a set: its delays, mounts and low passes.
pub(crate) fn path_of(fit: &Fit, candidates: &[Candidate], plan: &RatesPlan) -> Path {
    let mut path = Path {
        delay_s: shown_delays(fit, candidates, plan).0,
        ..Path::default()
    };
    for (&place, block) in fit.members.iter().zip(&fit.blocks) {
        let candidate = &candidates[place];
        let estimate = shown(fit, candidate, block, plan);
        if candidate.kind == MOUNT {
            path.mount = candidate.mounts(&estimate);
        } else if candidate.variant == Variant::LowPass {
            path.low_pass = candidate.low_passes(&estimate);
        }
    }
    path
}

/// True if two candidates are the same, columns aside.
pub fn is_same(a: &Candidate, b: &Candidate) -> bool {
    // A low pass that is insignificant on one gyro stays the same candidate on the others.
    let same_parts = a.names == b.names || a.variant == Variant::LowPass;
    a.kind == b.kind && a.variant == b.variant && same_parts
}

/// Delay of each gyro by the set \[s\], with its standard deviation; infinite without a delay.
pub(crate) fn delays(fit: &Fit, candidates: &[Candidate]) -> ([f64; 3], [f64; 3]) {
    let mut delay_s = [0.0; 3];
    let mut std_s = [f64::INFINITY; 3];
    for (&place, block) in fit.members.iter().zip(&fit.blocks) {
        let candidate = &candidates[place];
        if is_delay(candidate.kind) {
            for term in &candidate.hypothesis.terms {
                let at = block.start + term.parameter;
                let value = candidate.base[term.parameter] + fit.estimate[at];
                delay_s[term.record] += delay_sign(candidate.kind) * value;
                std_s[term.record] = fit.covariance[(at, at)].sqrt();
            }
        }
    }
    (delay_s, std_s)
}

/// The same for significant delays, 0 for others: the linearisation point of the columns.
fn shown_delays(fit: &Fit, candidates: &[Candidate], plan: &RatesPlan) -> ([f64; 3], [f64; 3]) {
    let (mut delay_s, std_s) = delays(fit, candidates);
    for (delay_s, std_s) in delay_s.iter_mut().zip(&std_s) {
        if std_s.is_finite() && delay_s.abs() < plan.path_deviations * std_s {
            *delay_s = 0.0;
        }
    }
    (delay_s, std_s)
}

/// True if two paths have delays, mounts and low passes on the same gyros.
pub(crate) fn is_alike(a: &Path, b: &Path) -> bool {
    (0..3).all(|gyro| {
        (a.delay_s[gyro] == 0.0) == (b.delay_s[gyro] == 0.0)
            && a.mount[gyro].is_some() == b.mount[gyro].is_some()
            && a.low_pass[gyro].is_some() == b.low_pass[gyro].is_some()
    })
}

/// True if a set has parameters about which columns are linearised.
pub(crate) fn is_nonlinear(fit: &Fit, candidates: &[Candidate], plan: &RatesPlan) -> bool {
    let (delay_s, _) = shown_delays(fit, candidates, plan);
    let mut members = fit.members.iter();
    delay_s != [0.0; 3]
        || members.any(|&place| candidates[place].base.iter().any(|base| *base != 0.0))
}

/// True if the linearisation point of the columns agrees with the estimates.
pub(crate) fn is_settled(
    fit: &Fit,
    candidates: &[Candidate],
    made_with_s: [f64; 3],
    plan: &RatesPlan,
) -> bool {
    let (delay_s, std_s) = shown_delays(fit, candidates, plan);
    let mut numbers = fit.members.iter().zip(&fit.blocks);
    let stands = numbers.all(|(&place, block)| {
        let base = candidates[place].base.iter().zip(block.clone());
        base.filter(|(base, _)| **base != 0.0)
            .all(|(_, at)| fit.estimate[at].abs() < plan.settled * fit.covariance[(at, at)].sqrt())
    });
    stands
        && (0..3).all(|axis| {
            let change = (delay_s[axis] - made_with_s[axis]).abs();
            if std_s[axis].is_finite() {
                change < plan.settled * std_s[axis]
            } else {
                change == 0.0
            }
        })
}
