//! A bias the model lacks.
//!
//! ω_i + b_i: a constant rate, whatever the motion. Confused with: Earth's rotation and g-sensitivity while
//! the case keeps its attitude.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;

/// See the page above.
pub struct GyroBias;

static CARD: Card = Card {
    kind: "gyro_bias",
    equation: "omega_i += b_i",
    shape: Shape::Axes,
    unit: "rad/s",
    typical: 5e-7,
    largest: 1e-3,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The model lacks a constant rate on the gyro: a bias, present at rest and in motion alike.",
    next_experiment: "A still record of some minutes at two opposite attitudes separates bias from Earth rate and g-sensitivity.",
};

impl Hypothesis for GyroBias {
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
        Some(scene.sensed_from_rate(axis, std::iter::repeat_n(1.0, scene.streams.rows)))
    }
}
