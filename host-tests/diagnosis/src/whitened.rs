//! Rows whitened as in the likelihood: divided by the root of their noise, frequency by frequency.

use rlg_inference::normal_equations::Transform;
use rlg_inference::{NoiseBasis, NoiseLevels, Observations};
use rlg_signal::partition::Use;

use super::data::Data;

/// Whitens the seen rows of each gyro.
pub(super) struct Whitener {
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
    /// Whitener of the rows to fit, under noise of `levels`; `None` where too few of them are measured.
    pub fn new(data: &Data, levels: &[NoiseLevels]) -> Option<Self> {
        let seen = data.rows_of(&[Use::Fit]);
        Some(Self::of(data.observed(&seen)?, seen, levels))
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
