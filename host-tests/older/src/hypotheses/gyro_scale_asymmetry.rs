//! A scale that differs between the two senses of rotation.
//!
//! ω_i + a_i |ω_i|.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::AXES;

/// See the page above.
pub struct GyroScaleAsymmetry;

static CARD: Card = Card {
    kind: "gyro_scale_asymmetry",
    equation: "omega_i += a_i |omega_i|",
    shape: Shape::Axes,
    unit: "1",
    typical: 1e-5,
    largest: 0.05,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The gyro has a different scale for positive and negative rotation, so an oscillation leaves a drift.",
    next_experiment: "Equal slews forward and back: the difference of the two angles is this effect.",
};

impl Hypothesis for GyroScaleAsymmetry {
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
            scene.rate_rad_s[axis].iter().map(|rate| rate.abs()),
        ))
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        CARD.shape.second(parameter, axis)?;
        Some(format!("abs_omega_{}", AXES[axis]))
    }
}
