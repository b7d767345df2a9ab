//! Rectification of vibration by a quadratic response to force.
//!
//! ω_i + g_i f_i².

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::AXES;

/// See the page above.
pub struct GyroG2Bias;

static CARD: Card = Card {
    kind: "gyro_g2_bias",
    equation: "omega_i += g_i f_i^2",
    shape: Shape::Axes,
    unit: "rad/s per (m/s^2)^2",
    typical: 1e-8,
    largest: 1e-5,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The gyro answers to the square of the force along its axis, so vibration leaves a drift.",
    next_experiment: "Vibrate linearly along each axis at two levels: the drift of this effect grows as the square of the level.",
};

impl Hypothesis for GyroG2Bias {
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
        CARD.shape.second(parameter, axis)?;
        Some(
            scene.sensed_from_rate(
                axis,
                scene
                    .force_m_s2(axis, 0)?
                    .into_iter()
                    .map(|force| force * force),
            ),
        )
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        CARD.shape.second(parameter, axis)?;
        Some(format!("force_{0}*force_{0}", AXES[axis]))
    }

    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .force_m_s2
            .is_none()
            .then_some("no specific force channels")
    }
}
