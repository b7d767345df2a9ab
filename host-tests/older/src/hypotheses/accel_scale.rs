//! A scale error of an accelerometer.
//!
//! Reading of i: f_i (1 + s_i)/(1 − s_i0), s_i0 the model's own. Confused with: a bias where an axis feels one force; a
//! wrong gravity of the site, where all three are equal.

use super::{Card, Hypothesis, Shape, Subject};
use crate::scene::Scene;

/// See the page above.
pub struct AccelScale;

static CARD: Card = Card {
    kind: "accel_scale",
    equation: "f_i *= 1 + s_i",
    shape: Shape::Axes,
    unit: "1",
    typical: 1e-4,
    largest: 0.05,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The accelerometer reads a fixed share too much or too little of the force.",
    next_experiment: "Turn each axis from up to down: a scale error then changes its sign and a bias does not.",
};

impl Hypothesis for AccelScale {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn subject(&self) -> Subject {
        Subject::Accelerometers
    }

    fn column(
        &self,
        scene: &Scene,
        _at: &[f64],
        parameter: usize,
        axis: usize,
    ) -> Option<Vec<f64>> {
        CARD.shape.second(parameter, axis)?;
        let felt = scene.felt.as_ref()?;
        Some(felt.sensed_from_force(axis, felt.force_m_s2[axis].iter().copied()))
    }
}
