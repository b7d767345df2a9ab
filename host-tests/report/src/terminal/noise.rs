//! Text on the residual relative to the motion, and on the noise of a unit at rest in the terms of IEEE 952, a line each.

use rlg_findings::absolute::{grade, share_percent};
use rlg_findings::numbers::Scale;
use rlg_findings::result::{Diagnosis, LevelEntry, NoiseEntry, NoiseTermsEntry};
use rlg_recording::AXES;

use super::sizes::to_two_digits;

/// Term of IEEE 952: its letter, its unit, its field, and true if an upper bound is reported too.
type Term = (
    &'static str,
    &'static str,
    fn(&NoiseTermsEntry) -> LevelEntry,
    bool,
);

/// Terms in the order of their slopes. Data sheets state N, B and K, so their upper bounds are reported too.
const TERMS: [Term; 4] = [
    ("Q", "rad", |terms| terms.quantisation_rad, false),
    (
        "N",
        "rad/√s",
        |terms| terms.angle_random_walk_rad_sqrt_s,
        true,
    ),
    ("B", "rad/s", |terms| terms.bias_instability_rad_s, true),
    (
        "K",
        "rad/s/√s",
        |terms| terms.rate_random_walk_rad_s_sqrt_s,
        true,
    ),
];

/// Residual relative to the motion, and the noise fitted to it beside that of instruments.
pub(super) fn residual(diagnosis: &Diagnosis) -> Option<String> {
    // At rest there is no motion, and the noise has a line of its own.
    let share = share_percent(diagnosis.residual.as_ref()?.share_of_motion);
    let share = format!("{share} % of the motion");
    let noise = (!diagnosis.noise.is_empty()).then(|| {
        let grade = grade(largest_walk(&diagnosis.noise));
        let fitted = fitted(&diagnosis.noise);
        match diagnosis.verdict.is_consistent() {
            true => format!("like noise of {fitted} ({grade} grade, reference included)"),
            false => format!("more than noise of {fitted}"),
        }
    });
    let parts: Vec<String> = [share].into_iter().chain(noise).collect();
    Some(format!("Residual: {}.", parts.join(", ")))
}

/// Terms of every gyro with estimates: value ± σ, or the upper bound of an insignificant term.
pub(super) fn noise(diagnosis: &Diagnosis) -> Option<String> {
    let said = TERMS.iter().filter_map(|term| one_term(diagnosis, term));
    let said: Vec<String> = said.collect();
    let grade = grade(largest_walk(&diagnosis.noise));
    (!said.is_empty()).then(|| format!("Noise: {} ({grade} grade).", said.join("; ")))
}

/// One term of all gyros; `None` if it is unknown or not worth reporting.
fn one_term(diagnosis: &Diagnosis, (letter, unit, of, is_bounded): &Term) -> Option<String> {
    let known = diagnosis.noise.iter().filter_map(|noise| {
        let axis = noise.channel.rsplit('_').next()?;
        Some((axis, of(noise.terms.as_ref()?)))
    });
    let known: Vec<(&str, LevelEntry)> = known.collect();
    let plan = &diagnosis.thresholds().findings;
    let bound = |(_, level): &(&str, LevelEntry)| level.bound(plan);
    let largest = known.iter().map(bound).fold(0.0, f64::max);
    let scale = Scale::of("noise", unit, largest);
    let is_bound_alone = known.iter().all(|(_, level)| !level.is_measured(plan));
    if is_bound_alone {
        let below = format!("{letter} < {}", to_two_digits(largest * scale.factor));
        return (*is_bounded && !known.is_empty()).then(|| scale.with_unit(&below));
    }
    let each = known.iter().filter_map(|(axis, level)| {
        if level.is_measured(plan) {
            return Some(format!("{axis} {}", scale.pair(level.value, level.std)));
        }
        is_bounded.then(|| {
            let below = to_two_digits(level.bound(plan) * scale.factor);
            format!("{axis} < {below}")
        })
    });
    let each: Vec<String> = each.collect();
    Some(format!("{letter} {}", scale.with_unit(&each.join(", "))))
}

/// Largest angle random walk of the gyros \[rad/√s\].
fn largest_walk(noise: &[NoiseEntry]) -> f64 {
    noise
        .iter()
        .map(NoiseEntry::walk_rad_sqrt_s)
        .fold(0.0, f64::max)
}

/// Noise used for the whitening: angle random walk by gyro.
fn fitted(noise: &[NoiseEntry]) -> String {
    let scale = Scale::of("noise", "rad/√s", largest_walk(noise));
    let each = AXES.iter().zip(noise).map(|(axis, one)| {
        let walk = one.angle_random_walk_rad_sqrt_s * scale.factor;
        format!("{axis} {}", to_two_digits(walk))
    });
    let each: Vec<String> = each.collect();
    format!("N {}", scale.with_unit(&each.join(", ")))
}
