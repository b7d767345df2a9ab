//! A pickoff that is not linear.
//!
//! The block's angle has + c_i p_i³.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;

/// See the page above.
pub struct DitherCubic;

static CARD: Card = Card {
    kind: "dither_cubic",
    equation: "block angle_i += c_i pickoff_i^3",
    shape: Shape::Axes,
    unit: "1/rad^2",
    typical: 1e2,
    largest: 1e6,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The dither pickoff is not linear: a cubic term leaves lines at one and three times the dither frequency after stripping.",
    next_experiment: "None needed: the dither itself shows it at rest.",
};

impl Hypothesis for DitherCubic {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn refines(&self) -> Option<&'static str> {
        Some("dither_gain")
    }

    fn column(
        &self,
        scene: &Scene,
        _at: &[f64],
        parameter: usize,
        axis: usize,
    ) -> Option<Vec<f64>> {
        CARD.shape.second(parameter, axis)?;
        let pickoff = &scene.streams.pickoff_rad.as_ref()?[axis];
        Some(
            pickoff
                .windows(2)
                .map(|pair| pair[1].powi(3) - pair[0].powi(3))
                .collect(),
        )
    }

    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .pickoff_rad
            .is_none()
            .then_some("no dither pickoff channels")
    }
}
