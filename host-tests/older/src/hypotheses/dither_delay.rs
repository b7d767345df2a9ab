//! A pickoff that is late.
//!
//! The pickoff shows the block d_i late: block(t) = p(t + d_i), solved by Gauss–Newton with exact shifts.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::Triad;

/// See the page above.
pub struct DitherDelay;

static CARD: Card = Card {
    kind: "dither_delay",
    equation: "block_i(t) = pickoff_i(t + d_i)",
    shape: Shape::Axes,
    unit: "s",
    typical: 1e-6,
    largest: 1e-3,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The dither pickoff is sampled late against the pulse counter, so stripping leaves a residue in quadrature with the dither.",
    next_experiment: "None needed: the dither itself shows it at rest.",
};

impl Hypothesis for DitherDelay {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn column(&self, scene: &Scene, at: &[f64], parameter: usize, axis: usize) -> Option<Vec<f64>> {
        CARD.shape.second(parameter, axis)?;
        scene.dither_ahead_rad(axis, 1, at[parameter])
    }

    fn prediction(&self, scene: &Scene, at: &[f64]) -> Triad {
        [0, 1, 2].map(|axis| {
            let rows = scene.streams.rows;
            let ahead = scene
                .dither_ahead_rad(axis, 0, at[axis])
                .unwrap_or_else(|| vec![0.0; rows]);
            let now = scene
                .dither_ahead_rad(axis, 0, 0.0)
                .unwrap_or_else(|| vec![0.0; rows]);
            ahead
                .iter()
                .zip(now)
                .map(|(ahead, now)| ahead - now)
                .collect()
        })
    }

    fn is_linear(&self) -> bool {
        false
    }
    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .pickoff_rad
            .is_none()
            .then_some("no dither pickoff channels")
    }
}
