//! A finding: a named member of the set with its place in the final fit, its class and its numbers.

use rlg_plan::{CombinationPlan, Plan};
use std::collections::BTreeSet;

use nalgebra::DMatrix;
use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::Variant;
use rlg_catalogue::entries::{self, Card};
use rlg_catalogue::entry::Law;
use rlg_catalogue::signals::AXES;
use rlg_findings::combinations::{Number as Known, identifiable, written};
use rlg_findings::result::{Identifiable, RegimeEntry};
use rlg_inference::{Fit, NoiseLevels};
use rlg_signal::partition::Use;
use rlg_signal::streams::{Triad, each_axis};

use super::by_regime;
use crate::confirm::Share;
use crate::confirm::bootstrap::Bootstrap;
use crate::confirm::whitened::Whitener;
use crate::rows::data::Data;
use crate::search::structure::{Found, Searched, effect_rad};
use crate::tiles::regimes::Regime;

/// One finding.
pub(crate) struct Finding<'a> {
    /// Criteria for its estimable combinations.
    pub(crate) combinations: CombinationPlan,
    pub(crate) candidate: &'a Candidate,
    /// Its parameters in the final fit.
    pub(crate) block: std::ops::Range<usize>,
    pub(crate) squared_size: f64,
    pub(crate) rank: usize,
    /// Gyros whose own data determine its parameter, where all share one.
    pub(crate) supported: [bool; 3],
    /// Recording in which it acts, of several; `None` if in all.
    pub(crate) recording: Option<&'a str>,
    /// Kinds not distinguishable from it in the recording.
    pub(crate) alike: Vec<String>,
    /// Drift explains it as well.
    pub(crate) or_drift: bool,
    pub(crate) cost_without: f64,
    pub(crate) confirmed_gain: f64,
    pub(crate) bootstrap: Bootstrap,
    /// Standard deviation of its instant \[rows\], where it has one.
    pub(crate) instant_std_rows: Option<f64>,
    /// Share of the residual's power explained by it, given the others \[1\].
    pub(crate) share: f64,
    /// It is significant, but of no practical size.
    pub(crate) is_slight: bool,
    /// Its size in each regime of motion that determines it.
    pub(crate) regimes: Vec<RegimeEntry>,
}

pub(crate) fn findings<'a>(
    of: Searched<'a>,
    share: &'a Share,
    regimes: &[Regime],
    plan: &Plan,
) -> Vec<Finding<'a>> {
    let Searched { data, found } = of;
    let (confirmed, left_rad) = (&share.set, &share.left_rad);
    let fit = &confirmed.fit;
    let is_any = !confirmed.named.is_empty();
    let whitener = Whitener::new(data, &fit.levels).ok().filter(|_| is_any);
    let left_sigma = whitener
        .as_ref()
        .map(|whitener| each_axis(|gyro| whitener.rows(gyro, &left_rad[gyro])));
    let of_place = |place: usize| {
        let effect_rad = effect_rad(found, fit, place);
        let mut one = finding(of, share, place, &effect_rad, plan);
        if let (Some(whitener), Some(left_sigma)) = (&whitener, &left_sigma) {
            one.regimes = by_regime::sizes(
                whitener,
                &effect_rad,
                left_sigma,
                regimes,
                &plan.judgement.regimes,
            );
        }
        one
    };
    (0..confirmed.named.len()).map(of_place).collect()
}

fn finding<'a>(
    Searched { data, found }: Searched<'a>,
    share: &'a Share,
    place: usize,
    effect_rad: &Triad,
    plan: &Plan,
) -> Finding<'a> {
    let confirmed = &share.set;
    let member = confirmed.named[place];
    let fit = &confirmed.fit;
    let judged = &found.judged[member];
    let candidate = &found.candidates[fit.members[place]];
    let alike: BTreeSet<&str> = judged
        .rivals
        .iter()
        .map(|(rival, _)| *rival)
        .chain(found.spanned_by[member].iter().copied())
        .chain([judged.hypothesis])
        .map(|rival| found.candidates[rival].kind)
        .filter(|kind| *kind != candidate.kind)
        .collect();
    let of_power = share_of_power(data, found, &share.left_rad, effect_rad);
    Finding {
        combinations: plan.findings.combinations,
        candidate,
        recording: share.recordings[place].as_deref(),
        block: fit.blocks[place].clone(),
        // The parameters of a resonance or a threshold have no size without its fixed part: its likelihood ratio replaces
        // it.
        squared_size: if candidate.hypothesis.fixed.is_empty() {
            fit.squared_sizes[place]
        } else {
            let without = &found.without[member];
            2.0 * (found.fit.log_likelihood - without.log_likelihood).max(0.0)
        },
        rank: fit.ranks[place],
        supported: confirmed.supported[place],
        alike: alike.into_iter().map(str::to_string).collect(),
        or_drift: judged.cost_against_drift < plan.judgement.drift_within,
        cost_without: judged.cost_without,
        confirmed_gain: confirmed.predictions[member].gain,
        bootstrap: confirmed.reenactments[place],
        instant_std_rows: confirmed.instant_std_rows[place],
        share: of_power,
        is_slight: of_power < plan.judgement.practical_share && !turns(effect_rad, &fit.levels),
        regimes: Vec::new(),
    }
}

/// Catalogue card of a kind.
pub(crate) fn card(kind: &str) -> Card {
    entries::card(kind).expect("a candidate is of the catalogue")
}

/// A parameter of a finding.
pub(crate) struct Number {
    pub(crate) name: String,
    pub(crate) value: f64,
    pub(crate) unit: &'static str,
    /// Standard deviation of its prior.
    pub(crate) prior_std: f64,
}

/// Sentence on the gyros whose data do not determine a shared parameter; empty if none.
pub(crate) fn of_the_others(supported: [bool; 3]) -> String {
    let others = (0..3)
        .filter(|&axis| !supported[axis])
        .map(|axis| AXES[axis]);
    let others: Vec<&str> = others.collect();
    match others[..] {
        [] => String::new(),
        [one] => format!(" Not determined for gyro {one}: too little motion."),
        _ => format!(
            " Not determined for gyros {}: too little motion.",
            others.join(" and ")
        ),
    }
}

/// Unit of a kind's parameter.
pub(crate) fn unit_of(kind: &str, name: &str) -> &'static str {
    if name.ends_with("frequency_hz") {
        "Hz"
    } else if name.ends_with("pole_s") {
        "s"
    } else if name.ends_with("damping") {
        "1"
    } else {
        card(kind).unit
    }
}

/// Identifiable parameters and combinations of parameters.
pub(crate) fn fixed(
    numbers: &[Number],
    covariance: &DMatrix<f64>,
    plan: &CombinationPlan,
) -> Vec<Identifiable> {
    identifiable(&known(numbers), covariance, plan)
}

fn known(numbers: &[Number]) -> Vec<Known> {
    let of = |number: &Number| Known {
        name: number.name.clone(),
        value: number.value,
        prior_std: number.prior_std,
    };
    numbers.iter().map(of).collect()
}

/// Parameters of a finding as written, and the arbitrary choices among them.
pub(crate) struct Numbers {
    pub(crate) each: Vec<Number>,
    pub(crate) covariance: DMatrix<f64>,
    pub(crate) choice: Option<String>,
}

/// Parameters of a finding, unidentified ones at their prior expectation given the identifiable combinations (least harm).
pub(crate) fn numbers(one: &Finding, fit: &Fit) -> Numbers {
    let (mut each, covariance) = estimated(one, fit);
    let known = known(&each);
    let written = written(
        &known,
        &identifiable(&known, &covariance, &one.combinations),
    );
    for (number, value) in each.iter_mut().zip(written.values) {
        number.value = value;
    }
    Numbers {
        each,
        covariance,
        choice: written.choice,
    }
}

/// Estimated parameters of a finding, with their covariance.
fn estimated(one: &Finding, fit: &Fit) -> (Vec<Number>, DMatrix<f64>) {
    let at = one.block.start;
    let kind = one.candidate.kind;
    let stated = |k: usize| entries::value_of(kind, one.candidate.base[k] + fit.estimate[at + k]);
    // A value shared by all gyros is written for each gyro that determines it.
    let shared = (one.candidate.variant == Variant::Common
        && matches!(
            entries::find(kind).map(|entry| entry.law),
            Some(Law::Axes(_))
        ))
    .then(|| {
        (0..3)
            .filter(|&axis| one.supported[axis])
            .map(|axis| (AXES[axis].to_string(), 0))
    });
    let names: Vec<(String, usize)> = match shared {
        Some(shared) => shared.collect(),
        None => one.candidate.names.iter().cloned().zip(0..).collect(),
    };
    let covariance = DMatrix::from_fn(names.len(), names.len(), |a, b| {
        let (a, b) = (names[a].1, names[b].1);
        fit.covariance[(at + a, at + b)] * stated(a).1 * stated(b).1
    });
    let numbers = names.into_iter().map(|(name, k)| Number {
        value: stated(k).0,
        prior_std: one.candidate.hypothesis.bound(k).std * stated(k).1,
        unit: unit_of(kind, &name),
        name,
    });
    (numbers.collect(), covariance)
}

/// Share of the residual's power explained by an effect, given the others, on the fitted rows \[1\].
fn share_of_power(data: &Data, found: &Found, left_rad: &Triad, effect_rad: &Triad) -> f64 {
    let rows = data.ranges_of(&[Use::Fit]);
    let sum = |of: &dyn Fn(usize, usize) -> f64| -> f64 {
        let rows = rows.iter().cloned().flatten();
        rows.map(|row| (0..3).map(|gyro| of(gyro, row)).sum::<f64>())
            .sum()
    };
    let power = sum(&|gyro, row| found.residual_rad[gyro][row].powi(2));
    let explained = sum(&|gyro, row| {
        let effect = effect_rad[gyro][row];
        effect * (effect + 2.0 * left_rad[gyro][row])
    });
    (explained / power.max(f64::MIN_POSITIVE)).max(0.0)
}

/// True if the angle of an effect over the record exceeds 1 σ of the gyro's noise.
fn turns(effect_rad: &Triad, levels: &[NoiseLevels]) -> bool {
    effect_rad.iter().zip(levels).any(|(effect, levels)| {
        let turned: f64 = effect.iter().sum();
        turned.abs() > (levels.white * effect.len() as f64).sqrt()
    })
}

#[cfg(test)]
mod tests {
    use super::card;

    #[test]
    fn every_kind_of_the_catalogue_has_its_sentences() {
        let listed = rlg_catalogue::CATALOGUE.iter().map(|entry| entry.kind);
        let scanned = rlg_catalogue::entries::SCANNED.iter().map(|card| card.kind);
        for kind in listed.chain(scanned) {
            let card = card(kind);
            let texts = [card.equation, card.unit, card.meaning, card.experiment];
            assert!(texts.iter().all(|text| !text.is_empty()));
        }
    }
}
