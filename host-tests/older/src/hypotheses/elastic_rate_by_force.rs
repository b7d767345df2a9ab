//! Elastic turning of the block with the change of force.
//!
//! ω_i + Σ_j U_ij df_j/dt: the derivative of an angle proportional to force, so it leaves no drift by itself.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;

/// See the page above.
pub struct ElasticRateByForce;

static CARD: Card = Card {
    kind: "elastic_rate_by_force",
    equation: "omega_i += sum_j U_ij df_j/dt",
    shape: Shape::Nine,
    unit: "rad per m/s^2",
    typical: 1e-7,
    largest: 1e-3,
    positive: false,
    others: &[],
    log_prior_odds: -2.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The block turns elastically with the force on it; the gyro reports that turning as a rate of the case.",
    next_experiment: "Linear vibration along each axis without rotation.",
};

impl Hypothesis for ElasticRateByForce {
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
        Some(scene.sensed_from_rate(axis, scene.force_m_s2(other, 1)?.into_iter()))
    }

    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .force_m_s2
            .is_none()
            .then_some("no specific force channels")
    }
}
