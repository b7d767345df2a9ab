//! Turns accelerometer readings into velocity increments of the body origin \[m/s\].
//!
//! It takes, per period, velocity increments as read \[m/s\], the case's increment and α̂T² \[rad\]. The result is in
//! the body frame.
//!
//! u = (1 − s) reading − b T; then M u with M of the pattern of Eq. (7); then the size effect off, row i of
//! T (α × r_i + ω × (ω × r_i)): the acceleration of accelerometer i, at r_i, by the body's rotation alone.
//!
//! ω is the period's mean. That ω × (ω × r) is formed from means and not the mean of it costs
//! (ΩT)²/12 of itself: 0.2 % at 100 Hz and 4 kHz. Products of misalignment and size effect are left out.

use super::{Six, equation_7};
use nalgebra::Vector3;

/// Calibration of the accelerometers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccelerometerCalibration {
    /// b \[m/s²\].
    pub bias_m_s2: [f64; 3],
    /// s \[1\].
    pub scale_error: [f64; 3],
    /// Angles of the pattern of Eq. (7) \[rad\].
    pub misalignment_rad: Six,
    /// Row i: r_i, from the body origin \[m\].
    pub lever_arm_m: [[f64; 3]; 3],
}

impl AccelerometerCalibration {
    /// Velocity increment over `elapsed_s`, which the readings cover; no size effect.
    pub fn increment(&self, read_m_s: [f64; 3], elapsed_s: f64) -> Vector3<f64> {
        let read = Vector3::from(read_m_s);
        let kept = read
            - Vector3::from(self.scale_error).component_mul(&read)
            - Vector3::from(self.bias_m_s2) * elapsed_s;
        equation_7(&self.misalignment_rad) * kept
    }

    /// Part of the readings by the body's rotation \[m/s\].
    pub fn size_effect(
        &self,
        case_rad: &Vector3<f64>,
        turn_per_period2_rad: &Vector3<f64>,
        period_s: f64,
    ) -> Vector3<f64> {
        Vector3::from_fn(|i, _| {
            let arm = Vector3::from(self.lever_arm_m[i]);
            let felt = turn_per_period2_rad.cross(&arm) + case_rad.cross(&case_rad.cross(&arm));
            felt[i] / period_s
        })
    }
}
