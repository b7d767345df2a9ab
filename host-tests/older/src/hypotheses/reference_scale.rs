//! A reference with a scale error.
//!
//! It reads (1 + r_i) times the case's increment, so the gyro shows r_i ω_i less. Unlike a scale error of the
//! gyro it leaves the dither alone.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::AXES;

/// See the page above.
pub struct ReferenceScale;

static CARD: Card = Card {
    kind: "reference_scale",
    equation: "reference_i = (1 + r_i) case_i",
    shape: Shape::Axes,
    unit: "1",
    typical: 1e-5,
    largest: 0.05,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The reference itself has a scale error; the gyro and its dither agree with each other and not with it.",
    next_experiment: "Whole turns of the table against an optical mark calibrate the reference.",
};

impl Hypothesis for ReferenceScale {
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
            scene
                .sensed_from_rate_at_middles(axis, scene.rate_rad_s[axis].iter().map(|rate| -rate)),
        )
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        CARD.shape.second(parameter, axis)?;
        Some(format!("omega_{}", AXES[axis]))
    }
}
