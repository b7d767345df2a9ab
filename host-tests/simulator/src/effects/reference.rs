//! Effects on the reference's increments.
//!
//! From the true increment, body frame, and the table's angle, in rad, the increment measured by the reference, in rad.
//!
//! Equations: misaligned by the rotation vector r it measures Rᵀ(r) ω, which is ω − r × ω for a small r; with a scale error
//! (1 + r_i) times that; an encoder adds the increments of cos · cos nθ + sin · sin nθ at the table angle θ, 0 at the
//! start.

use super::Effects;
use nalgebra::{Rotation3, Vector3};

/// `reference_harmonic`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// Axis of the encoder.
    pub axis: usize,
    /// Order n of the harmonic.
    pub order: f64,
    /// Amplitude of cos nθ \[rad\].
    pub cos: f64,
    /// Amplitude of sin nθ \[rad\].
    pub sin: f64,
}

impl Effects {
    /// Increment measured by the reference, without its harmonics \[rad\].
    pub fn reference_reads(&self, case_rad: &Vector3<f64>) -> Vector3<f64> {
        let mut turned = *case_rad;
        // a product with zeros would still round −0.0 away
        if self.reference_misalignment_rad != Vector3::zeros() {
            turned = Rotation3::from_scaled_axis(-self.reference_misalignment_rad) * case_rad;
        }
        turned + self.reference_scale.component_mul(&turned)
    }

    /// Error of the encoder of `axis` at a table angle \[rad\].
    pub fn encoder_error_rad(&self, axis: usize, table_rad: f64) -> f64 {
        self.harmonics
            .iter()
            .filter(|harmonic| harmonic.axis == axis)
            .map(|harmonic| {
                let (sin, cos) = (harmonic.order * table_rad).sin_cos();
                harmonic.cos * cos + harmonic.sin * sin
            })
            .sum()
    }

    /// Delay of the reference \[s\].
    pub fn reference_delay_s(&self) -> f64 {
        self.reference_delay_s
    }
}
