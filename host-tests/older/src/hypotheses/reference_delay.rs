//! A reference whose stamps are late.
//!
//! Its row for t shows the case at t − d, so the case at t is what it says at t + d. The same d on all gyros.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::Triad;

/// See the page above.
pub struct ReferenceDelay;

static CARD: Card = Card {
    kind: "reference_delay",
    equation: "reference(t) = case(t - d)",
    shape: Shape::All,
    unit: "s",
    typical: 2e-5,
    largest: 0.02,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &["gyro_delay"],
    resembles_untested: &[],
    left_out: "The clock of the reference and the clock of the gyros differ by a fixed time.",
    next_experiment: "A second reference, or an event marked on both clocks, tells a late reference from late gyros.",
};

impl Hypothesis for ReferenceDelay {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn column(&self, scene: &Scene, at: &[f64], parameter: usize, axis: usize) -> Option<Vec<f64>> {
        debug_assert_eq!(parameter, 0);
        let slope = scene.case_ahead_rad(axis, 1, at[0]);
        Some(
            slope
                .into_iter()
                .map(|slope| slope / (1.0 - scene.scale_error[axis]))
                .collect(),
        )
    }

    fn prediction(&self, scene: &Scene, at: &[f64]) -> Triad {
        [0, 1, 2].map(|axis| {
            let ahead = scene.case_ahead_rad(axis, 0, at[0]);
            let now = scene.case_ahead_rad(axis, 0, 0.0);
            let sensed = 1.0 / (1.0 - scene.scale_error[axis]);
            ahead
                .iter()
                .zip(now)
                .map(|(ahead, now)| (ahead - now) * sensed)
                .collect()
        })
    }

    fn is_linear(&self) -> bool {
        false
    }
}
