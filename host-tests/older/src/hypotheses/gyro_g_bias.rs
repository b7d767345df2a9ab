//! Sensitivity to specific force.
//!
//! ω_i + Σ_j G_ij f_j. Confused with: a bias while the case keeps its attitude.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::AXES;

/// See the page above.
pub struct GyroGBias;

static CARD: Card = Card {
    kind: "gyro_g_bias",
    equation: "omega_i += sum_j G_ij f_j",
    shape: Shape::Nine,
    unit: "rad/s per m/s^2",
    typical: 1e-7,
    largest: 1e-4,
    positive: false,
    others: &[],
    log_prior_odds: -1.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The gyro output moves with the specific force (g-sensitivity) and the model lets gravity pass unnoticed.",
    next_experiment: "Tumble the case through six attitudes: gravity then changes sign on each axis and a bias does not.",
};

impl Hypothesis for GyroGBias {
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
        Some(scene.sensed_from_rate(axis, scene.force_m_s2(other, 0)?.into_iter()))
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        let other = CARD.shape.second(parameter, axis)?;
        Some(format!("force_{}", AXES[other]))
    }

    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .force_m_s2
            .is_none()
            .then_some("no specific force channels")
    }
}
