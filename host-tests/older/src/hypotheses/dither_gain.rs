//! A pickoff whose gain is not the model's.
//!
//! The block's rate is (1 + g_i) × what the pickoff says.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::AXES;

/// See the page above.
pub struct DitherGain;

static CARD: Card = Card {
    kind: "dither_gain",
    equation: "block rate_i = (1 + g_i) pickoff rate_i",
    shape: Shape::Axes,
    unit: "1",
    typical: 1e-4,
    largest: 0.2,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The dither pickoff reads the block motion with a wrong gain, so stripping leaves a residue of the dither in the increments.",
    next_experiment: "None needed: the dither itself shows it at rest.",
};

impl Hypothesis for DitherGain {
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
        scene.dither_increment_rad(axis)
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        CARD.shape.second(parameter, axis)?;
        Some(format!("dither_rate_{}", AXES[axis]))
    }

    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .pickoff_rad
            .is_none()
            .then_some("no dither pickoff channels")
    }
}
