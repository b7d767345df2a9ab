//! A response to the square of the rate.
//!
//! ω_i + q_i ω_i².

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::AXES;

/// See the page above.
pub struct GyroScaleQuadratic;

static CARD: Card = Card {
    kind: "gyro_scale_quadratic",
    equation: "omega_i += q_i omega_i^2",
    shape: Shape::Axes,
    unit: "s/rad",
    typical: 1e-5,
    largest: 0.1,
    positive: false,
    others: &[],
    log_prior_odds: -2.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The gyro has a small term in the square of its rate, so an oscillation leaves a drift that grows as its square.",
    next_experiment: "Slews at several rates, both senses: this effect is even in the rate and grows as its square.",
};

impl Hypothesis for GyroScaleQuadratic {
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
        Some(scene.sensed_from_rate_at_middles(
            axis,
            scene.rate_rad_s[axis].iter().map(|rate| rate * rate),
        ))
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        CARD.shape.second(parameter, axis)?;
        Some(format!("omega_{0}*omega_{0}", AXES[axis]))
    }
}
