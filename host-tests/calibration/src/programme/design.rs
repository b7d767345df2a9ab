//! Optimal duration of each move: the A-optimal design, of least total variance of the six K.
//!
//! From candidates with their information per second, and the total time: seconds at full motion for each useful candidate.
//! A-optimality: minimise tr M⁻¹ with M = Σ t_c F_c, Σ t_c fixed, by multiplicative steps t_c ← t_c √(tr(M⁻¹F_cM⁻¹)/tr M⁻¹
//! · T), which converge monotonically (Silvey, Titterington and Torsney 1978).

use nalgebra::DMatrix;

use super::candidates::Candidate;
use crate::unknowns::{COEFFICIENTS, flexure_std_s2};

/// Number of steps; the weights of useless candidates halve every few.
const STEPS: usize = 400;

/// Shares of the time, one for each candidate, with sum 1; those below `least_share` are 0.
pub fn shares(candidates: &[Candidate], time_s: f64, least_share: f64) -> Vec<f64> {
    let mut shares = vec![1.0 / candidates.len() as f64; candidates.len()];
    // The prior of unobserved directions keeps M invertible.
    let prior = flexure_std_s2().powi(-2);
    // In units of a typical K the numbers are near one.
    const UNIT: f64 = 1e-8;
    let information: Vec<DMatrix<f64>> = candidates
        .iter()
        .map(|candidate| &candidate.information_per_s * (time_s * UNIT * UNIT))
        .collect();
    let improve = |shares: &mut Vec<f64>| {
        let mut total = DMatrix::identity(COEFFICIENTS, COEFFICIENTS) * (prior * UNIT * UNIT);
        for (share, information) in shares.iter().zip(&information) {
            total += information * *share;
        }
        let Some(inverse) = total.try_inverse() else {
            return;
        };
        let square = &inverse * &inverse;
        for (share, information) in shares.iter_mut().zip(&information) {
            *share *= (&square * information).trace().max(0.0).sqrt();
        }
        let sum: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|share| *share /= sum);
    };
    for _ in 0..STEPS {
        improve(&mut shares);
    }
    // Neighbours on the grid of rates split one share: the best of each kind takes all of it.
    for one in 0..candidates.len() {
        for other in 0..one {
            if same_directions(&candidates[one], &candidates[other]) {
                let (keep, drop) = if shares[one] > shares[other] {
                    (one, other)
                } else {
                    (other, one)
                };
                shares[keep] += shares[drop];
                shares[drop] = 0.0;
            }
        }
    }
    for share in &mut shares {
        if *share < least_share {
            *share = 0.0;
        }
    }
    for _ in 0..STEPS {
        improve(&mut shares);
    }
    shares
}

/// True if two candidates inform about the same coefficients.
fn same_directions(one: &Candidate, other: &Candidate) -> bool {
    let touched = |candidate: &Candidate| -> Vec<bool> {
        (0..COEFFICIENTS)
            .map(|k| candidate.information_per_s[(k, k)] > 0.0)
            .collect()
    };
    touched(one) == touched(other)
}
