//! How strongly each effect would show at its typical size.
//!
//! Enters: the information about everything fitted. Leaves: a matched-filter SNR for each effect.

use nalgebra::{DMatrix, DVector};

use crate::hypotheses::CATALOGUE;
use crate::information::{Information, scaled_inverse};
use crate::workbench::Parameters;

/// Matched-filter SNR of each effect at its typical size, the strongest parameter's, with the vertical not known: a
/// bias of a unit that keeps its attitude is a tilt.
pub fn reach(
    information: &Information,
    parameters: &Parameters,
    allowed: &[usize],
    unknowns: &[usize],
) -> Vec<(usize, f64)> {
    let count = unknowns.len();
    let of_unknowns = |a: usize, b: usize| information.fisher[(unknowns[a], unknowns[b])];
    let inverse = scaled_inverse(&DMatrix::from_fn(count, count, of_unknowns));
    let own = |index: usize| {
        let shared = DVector::from_fn(count, |a, _| information.fisher[(index, unknowns[a])]);
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
