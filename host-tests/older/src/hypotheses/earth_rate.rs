//! The Earth's rotation, which the reference motion does not contain.
//!
//! A vector fixed in space: its components in the body frame at the start, carried by the attitude that the
//! reference integrates to. Confused with a bias while the attitude stays.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::Triad;
use strapdown::earth::ROTATION_RAD_S;

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

/// Whether what is left is a rotation in space as fast as the Earth's: a model that says the reference has it is wrong by
/// the whole of it or not at all.
pub fn is_left(scene: &Scene, residual_rad: &Triad) -> bool {
    /// Biases and drift add to it.
    const NEAR: f64 = 0.2;
    let rate = scene.mean_rate_in_space_rad_s(residual_rad).norm();
    (rate / ROTATION_RAD_S - 1.0).abs() < NEAR
}

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
