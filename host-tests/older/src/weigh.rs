//! What an explanation is worth: priors, chances and shares.
//!
//! Enters: what a fit says, the catalogue's cards. Leaves: how wide a prior is, how rare a likelihood ratio, whether a loser
//! may still be the truth, and how much of the family's significance a hypothesis may use up. The search is select.rs.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::declare::{FIT_PRIOR, SEPARATION};
use super::hypotheses::CATALOGUE;
use super::information::{Information, Solution};
use super::workbench::Parameters;

/// Width of the prior in a fit: the effect's typical size times [`FIT_PRIOR`], or up to ten times that where the recording
/// knows less; for a term found in the data a thousand of its own standard errors, for a number of the mounting a
/// million. Each leaves the value alone.
pub fn prior_width(parameters: &Parameters, information: &Information, index: usize) -> f64 {
    const LOOSE: f64 = 1e3;
    /// Any tilt: where it binds, a misalignment would have to take the tilt's place.
    const FLAT: f64 = 1e6;
    /// In standard errors: takes a part in a thousand off a value.
    const LOOSE_ENOUGH: f64 = 30.0;
    /// Times [`FIT_PRIOR`]: beyond that an effect imitates what it is not.
    const LOOSEST: f64 = 10.0;
    let known = information.fisher[(index, index)].max(f64::MIN_POSITIVE);
    let standard_error = known.sqrt().recip();
    match parameters.id(index) {
        Some(id) => {
            let usual = FIT_PRIOR * CATALOGUE[id.effect].card().typical_of(id.parameter);
            (LOOSE_ENOUGH * standard_error).clamp(usual, LOOSEST * usual)
        }
        None if index + information.of_mounting >= information.parameters => FLAT * standard_error,
        None => LOOSE * standard_error,
    }
}

/// The width w of a prior N(0, w²) of `count` parameters from `first` on that makes their fit most likely: each
/// eigendirection of their covariance, of variance c, shows a value of variance w² + c.
pub(super) fn likeliest_width(fitted: &Solution, first: usize, count: usize) -> f64 {
    /// Candidates a decade; the evidence is flat to a hundredth between them.
    const PER_DECADE: f64 = 8.0;
    if count == 0 {
        return 0.0;
    }
    let covariance = fitted.covariance.view((first, first), (count, count));
    let root = covariance.into_owned().symmetric_eigen();
    let values = root.eigenvectors.transpose() * fitted.values.rows(first, count);
    let least = root.eigenvalues.iter().copied().fold(f64::MAX, f64::min);
    let most = values.norm_squared();
    if least <= 0.0 || least.is_nan() || most <= least {
        return 0.0;
    }
    let log_likelihood = |square: f64| -> f64 {
        let directions = values.iter().zip(&root.eigenvalues);
        let each = directions.map(|(value, variance)| {
            let total = square + variance;
            -0.5 * (total.ln() + value * value / total)
        });
        each.sum()
    };
    let steps = (PER_DECADE * (most / least).log10()).ceil().max(1.0);
    let squares = (0..=steps as usize).map(|step| least * (most / least).powf(step as f64 / steps));
    squares
        .max_by(|a, b| log_likelihood(*a).total_cmp(&log_likelihood(*b)))
        .map_or(0.0, f64::sqrt)
}

/// Chance of a likelihood ratio of `degrees` numbers where the noise is known from `noise_degrees`.
pub(super) fn chance(ratio: f64, degrees: f64, noise_degrees: f64) -> f64 {
    /// From here on Fisher's law is that of χ² to a tenth, as far out as any decision is made.
    const MANY: f64 = 1e4;
    if noise_degrees > MANY || noise_degrees.is_nan() {
        return ChiSquared::new(degrees).map_or(1.0, |law| law.sf(ratio));
    }
    FisherSnedecor::new(degrees, noise_degrees).map_or(1.0, |law| law.sf(ratio / degrees))
}

/// Whether a rival explains the data to within [`SEPARATION`], and either as probably or without any loss that
/// noise would show. `lost` in 2 Δ ln L, `behind` in ln evidence.
pub(super) fn is_close(lost: f64, behind: f64) -> bool {
    /// ln of the odds below which a loser stays in the class.
    const CLOSE_EVIDENCE: f64 = 7.0;
    /// Likelihood ratio that a right hypothesis loses to chance in one case of a hundred (3 degrees).
    const NO_LOSS: f64 = 11.3;
    lost < SEPARATION * SEPARATION && (behind < CLOSE_EVIDENCE || lost < NO_LOSS)
}

/// Share of the family's significance that a hypothesis may use up: by its prior odds among the candidates. A kind
/// that another contains is no question of its own.
pub fn share(candidates: &[usize], effect: usize) -> f64 {
    let odds = |effect: usize| CATALOGUE[effect].card().log_prior_odds.exp();
    let kinds: Vec<&str> = candidates
        .iter()
        .map(|&other| CATALOGUE[other].card().kind)
        .collect();
    let contained = |effect: usize| {
        let wholes = CATALOGUE[effect].card().special_case_of;
        wholes.iter().any(|whole| kinds.contains(whole))
    };
    let asked = candidates
        .iter()
        .copied()
        .filter(|&other| !contained(other));
    let all: f64 = asked.map(odds).sum();
    odds(effect) / all.max(odds(effect))
}
