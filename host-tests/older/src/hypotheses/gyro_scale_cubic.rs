//! A response to the cube of the rate.
//!
//! ω_i + q_i ω_i³.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;

/// See the page above.
pub struct GyroScaleCubic;

static CARD: Card = Card {
    kind: "gyro_scale_cubic",
    equation: "omega_i += q_i omega_i^3",
    shape: Shape::Axes,
    unit: "s^2/rad^2",
    typical: 1e-5,
    largest: 0.1,
    positive: false,
    others: &[],
    log_prior_odds: -2.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The scale of the gyro changes with the square of its rate.",
    next_experiment: "Slews at several rates: the scale error of this effect grows as the square of the rate.",
};

impl Hypothesis for GyroScaleCubic {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn refines(&self) -> Option<&'static str> {
        Some("gyro_scale")
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
            scene.rate_rad_s[axis].iter().map(|rate| rate.powi(3)),
        ))
    }
}
