//! The Earth's rotation, which the reference motion does not contain.
//!
//! A vector fixed in space: its components in the body frame at the start, carried by the attitude that the
//! reference integrates to. Confused with a bias while the attitude stays.

use super::{Card, Hypothesis, Shape};
use crate::diagnose::scene::Scene;

/// See the page above.
pub struct EarthRate;

static CARD: Card = Card {
    kind: "earth_rate",
    equation: "omega += C(t)^T omega_earth(start)",
    shape: Shape::Axes,
    unit: "rad/s",
    typical: 5e-5,
    largest: 8e-5,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The reference reports motion against the Earth and the gyros against space: the rotation of the Earth is missing from the prediction.",
    next_experiment: "A still record at two attitudes tells the rotation of the Earth from bias.",
};

impl Hypothesis for EarthRate {
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
        let carried = scene.space_vector_in_body(parameter, axis);
        Some(scene.sensed_from_rate(axis, carried.into_iter()))
    }
}
