//! What a hypothesis about the accelerometers may look at.
//!
//! Enters: rows, carried motion and the vertical. Leaves: [`Felt`], the specific force each accelerometer should
//! have felt over its rows \[m/s²\], the same later or earlier, the forces of lever arms, and the way from a force
//! to a velocity increment.
//!
//! Columns use this force, not the measured one: noise in a regressor would pull its coefficient to zero.

use nalgebra::Vector3;
use std::sync::OnceLock;

use super::carried::Carried;
use super::rows::Rows;
use super::vertical::Vertical;
use crate::motion::{Reading, Spectrum};
use crate::streams::Triad;

/// See the page above.
pub struct Felt {
    /// The accelerometers' rows.
    pub rows: Rows,
    /// Attitude and lever-arm forces.
    pub carried: Carried,
    /// The vertical as known so far.
    pub vertical: Vertical,
    /// Mean specific force over each row \[m/s²\].
    pub force_m_s2: Triad,
    /// Scale error of the model, for the 1/(1 − s_i) of a reading.
    pub scale_error: [f64; 3],
    /// Of the force, once they are asked for.
    spectra: OnceLock<[Spectrum; 3]>,
}

impl Felt {
    /// Predicts the force.
    pub fn new(rows: Rows, carried: Carried, vertical: Vertical, scale_error: [f64; 3]) -> Self {
        let force_m_s2 = vertical.force_m_s2(&rows, &carried);
        Self {
            spectra: OnceLock::new(),
            rows,
            carried,
            vertical,
            force_m_s2,
            scale_error,
        }
    }

    /// Takes over what was learned of the vertical.
    pub fn moved(&mut self, unknowns: &[f64]) {
        self.vertical = self.vertical.moved(unknowns);
        self.force_m_s2 = self.vertical.force_m_s2(&self.rows, &self.carried);
        self.spectra = OnceLock::new();
    }

    /// The force `ahead_s` later than each row says, differentiated `derivative` times.
    pub fn force_ahead(&self, axis: usize, derivative: i32, ahead_s: f64) -> Vec<f64> {
        // It is computed, not measured: nothing in it is noise.
        let whole_band_hz = self.rows.rate_hz;
        let spectrum =
            |axis: usize| Spectrum::new(&self.force_m_s2[axis], self.rows.rate_hz, whole_band_hz);
        self.spectra.get_or_init(|| [0, 1, 2].map(spectrum))[axis].read(Reading {
            derivative,
            ahead_s,
            undo_row_mean: false,
        })
    }

    /// What a force felt by accelerometer `axis` \[m/s²\] adds to its velocity increments \[m/s\]: × T/(1 − s_i).
    pub fn sensed_from_force(&self, axis: usize, force: impl Iterator<Item = f64>) -> Vec<f64> {
        let factor = self.rows.period_s() / (1.0 - self.scale_error[axis]);
        force.map(|force| force * factor).collect()
    }

    /// What accelerometer `axis` would read beyond its prediction \[m/s\] were the body turned by `more` than it is taken to
    /// be over each row, given that row's ∫ω dt and ∫α dt: −φ × f.
    pub fn sensed_if_turned(
        &self,
        axis: usize,
        more: impl Fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>,
    ) -> Vec<f64> {
        let turned = self.carried.turned_beyond_rad(more);
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let forces = self.force_m_s2[j].iter().zip(&self.force_m_s2[k]);
        let beyond = turned.iter().zip(forces);
        self.sensed_from_force(
            axis,
            beyond.map(|(by, (at_j, at_k))| by[k] * at_j - by[j] * at_k),
        )
    }

    /// The same from a velocity gained over each row \[m/s\].
    pub fn sensed_from_velocity(&self, axis: usize, mut velocity: Vec<f64>) -> Vec<f64> {
        let keep = 1.0 - self.scale_error[axis];
        velocity.iter_mut().for_each(|value| *value /= keep);
        velocity
    }

    /// Velocity increments of accelerometers without any effect: (f + b/(1 − s)) T/(1 − s) \[m/s\].
    pub fn sensed_m_s(&self, axis: usize, bias_m_s2: f64) -> Vec<f64> {
        let bias = bias_m_s2 / (1.0 - self.scale_error[axis]);
        self.sensed_from_force(axis, self.force_m_s2[axis].iter().map(|force| force + bias))
    }
}
