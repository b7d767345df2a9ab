//! A gyro that senses its neighbour's dither.
//!
//! Gyro i has + c_ij × the dither rate of block j.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::AXES;

/// See the page above.
pub struct DitherCrosstalk;

static CARD: Card = Card {
    kind: "dither_crosstalk",
    equation: "omega_i += c_ij dither rate_j",
    shape: Shape::Six,
    unit: "1",
    typical: 1e-4,
    largest: 0.1,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The gyro senses a share of the dither of a neighbouring block, through the structure or the electronics.",
    next_experiment: "Switch the dithers off one at a time.",
};

impl Hypothesis for DitherCrosstalk {
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
        let other = CARD.shape.second(parameter, axis)?;
        scene.dither_increment_rad(other)
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        let other = CARD.shape.second(parameter, axis)?;
        Some(format!("dither_rate_{}", AXES[other]))
    }

    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .pickoff_rad
            .is_none()
            .then_some("no dither pickoff channels")
    }
}
