//! Sensitivity to the magnetic field (Faraday rotation in the cavity).
//!
//! ω_i + Σ_j c_ij B_j.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::AXES;

/// See the page above.
pub struct GyroBiasMagnetic;

static CARD: Card = Card {
    kind: "gyro_bias_magnetic",
    equation: "omega_i += sum_j c_ij B_j",
    shape: Shape::Nine,
    unit: "rad/s/T",
    typical: 1e-3,
    largest: 10.0,
    positive: false,
    others: &[],
    log_prior_odds: -2.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The gyro output moves with the magnetic field at the block and the model takes the field for harmless.",
    next_experiment: "Turn a known field (a coil) on and off on each axis with the case at rest.",
};

impl Hypothesis for GyroBiasMagnetic {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn column(
        &self,
        scene: &Scene,
        _at: &[f64],
        parameter: usize,
        axis: usize,
    ) -> Option<Vec<f64>> {
        let other = CARD.shape.second(parameter, axis)?;
        let field = &scene.streams.magnetic_t.as_ref()?[other];
        Some(scene.sensed_from_rate(axis, field.iter().copied()))
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        let other = CARD.shape.second(parameter, axis)?;
        Some(format!("field_{}", AXES[other]))
    }

    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .magnetic_t
            .is_none()
            .then_some("no magnetic field channels")
    }
}
