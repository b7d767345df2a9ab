//! Rows whitened as in the likelihood: divided by the root of their noise, frequency by frequency.

use rlg_inference::transform::Transform;
use rlg_inference::{Hypothesis, NoiseBasis, NoiseLevels, Observations, TooFewRows};
use rlg_signal::partition::Use;
use rlg_signal::streams::add;

use crate::rows::data::Data;

/// Whitens the seen rows of each gyro.
pub(crate) struct Whitener {
    /// Transform of the seen rows.
    pub transform: Transform,
    /// Noise basis of the transform.
    pub basis: NoiseBasis,
    /// Root of the noise of each coefficient, gyro by gyro \[rad\].
    roots: [Vec<f64>; 3],
    /// True for seen rows.
    pub seen: Vec<bool>,
}

impl Whitener {
    /// Whitener of the rows to fit, under noise of `levels`.
    ///
    /// # Errors
    /// Too few of them are measured.
    pub fn new(data: &Data, levels: &[NoiseLevels]) -> Result<Self, TooFewRows> {
        let seen = data.rows_of(&[Use::Fit]);
        Ok(Self::of(data.observed(&seen)?, seen, levels))
    }

    /// Whitener of the rows that are `seen`, as a span.
    pub fn of(observations: Observations, seen: Vec<bool>, levels: &[NoiseLevels]) -> Self {
        let (transform, basis) = Transform::with_basis(observations, NoiseLevels::mean(levels));
        let roots = std::array::from_fn(|gyro| basis.roots(levels[gyro]));
        Self {
            transform,
            basis,
            roots,
            seen,
        }
    }

    /// Whitened rows of a gyro \[σ\]; 0 for unseen rows.
    pub fn rows(&self, gyro: usize, rows_rad: &[f64]) -> Vec<f64> {
        let mut rows = self.transform.whitened(rows_rad, &self.roots[gyro]);
        for (value, _) in rows.iter_mut().zip(&self.seen).filter(|(_, seen)| !**seen) {
            *value = 0.0;
        }
        rows
    }
}

/// Forms the whitened columns of a set's parameters, by gyro and parameter; empty where a parameter has no effect.
///
/// # Inputs
/// `values`: values of a column by row.
pub(crate) fn columns_of(
    set: &[Hypothesis],
    rows: usize,
    values: &impl Fn(usize) -> Vec<f64>,
    whitened: &impl Fn(usize, &[f64]) -> Vec<f64>,
) -> Vec<Vec<Vec<f64>>> {
    let mut columns: Vec<Vec<Vec<f64>>> = vec![Vec::new(); 3];
    for whole in set {
        for (gyro, columns) in columns.iter_mut().enumerate() {
            for parameter in 0..whole.parameters {
                let mut sum: Vec<f64> = Vec::new();
                let mut terms = whole.terms.iter();
                let acts = terms.any(|term| term.record == gyro && term.parameter == parameter);
                if acts {
                    sum = vec![0.0; rows];
                    let terms = whole.terms.iter();
                    for term in terms.filter(|one| one.record == gyro && one.parameter == parameter)
                    {
                        add(&mut sum, &values(term.column), term.coefficient);
                    }
                    sum = whitened(gyro, &sum);
                }
                columns.push(sum);
            }
        }
    }
    columns
}
