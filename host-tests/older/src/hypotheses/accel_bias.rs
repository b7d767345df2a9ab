//! A constant on an accelerometer.
//!
//! Reading of i: (f_i + b_i)/(1 − s_i) (contract; Groves 2013, sec. 4.4.1). Confused with: the tilt of the start, unless
//! gravity changes its direction in the body; a scale error, unless an axis feels more than one force.

use super::{Card, Hypothesis, Shape, Subject};
use crate::scene::Scene;

/// See the page above.
pub struct AccelBias;

static CARD: Card = Card {
    kind: "accel_bias",
    equation: "f_i += b_i",
    shape: Shape::Axes,
    unit: "m/s^2",
    typical: 1e-3,
    largest: 0.5,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The model lacks a constant on the accelerometer: a bias, the same in every attitude.",
    next_experiment: "Stand still in six attitudes: a bias keeps its sign when gravity changes its own.",
};

impl Hypothesis for AccelBias {
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
        Some(felt.sensed_from_force(axis, std::iter::repeat_n(1.0, felt.rows.count)))
    }
}
