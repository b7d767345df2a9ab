//! How strongly each effect would show at its typical size.
//!
//! Enters: the information about everything fitted. Leaves: a matched-filter SNR for each effect.

use nalgebra::{DMatrix, DVector};

use crate::diagnose::hypotheses::CATALOGUE;
use crate::diagnose::information::{Information, stable_inverse};
use crate::diagnose::workbench::Parameters;

/// Matched-filter SNR of each effect at its typical size, the strongest parameter's, with the vertical not known: a
/// bias of a unit that keeps its attitude is a tilt.
pub fn reach(
    information: &Information,
    parameters: &Parameters,
    allowed: &[usize],
    unknowns: &[usize],
) -> Vec<(usize, f64)> {
    let scale: Vec<f64> = unknowns
        .iter()
        .map(|&u| {
            information.fisher[(u, u)]
                .max(f64::MIN_POSITIVE)
                .sqrt()
                .recip()
        })
        .collect();
    let count = unknowns.len();
    let gram = DMatrix::from_fn(count, count, |a, b| {
        information.fisher[(unknowns[a], unknowns[b])] * scale[a] * scale[b]
    });
    let inverse = stable_inverse(&gram);
    let own = |index: usize| {
        let shared = DVector::from_fn(count, |a, _| {
            information.fisher[(index, unknowns[a])] * scale[a]
        });
        information.fisher[(index, index)] - shared.dot(&(&inverse * &shared))
    };
    allowed
        .iter()
        .map(|&effect| {
            let power = parameters.of(effect).map(own).fold(0.0, f64::max);
            (effect, CATALOGUE[effect].card().typical * power.sqrt())
        })
        .collect()
}
