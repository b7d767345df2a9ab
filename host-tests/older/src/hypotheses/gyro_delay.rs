//! Gyro samples that are late.
//!
//! ω_i(t − d_i) instead of ω_i(t): solved by Gauss–Newton with exact shifts of the reference.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::Triad;

/// See the page above.
pub struct GyroDelay;

static CARD: Card = Card {
    kind: "gyro_delay",
    equation: "omega_i(t - d_i) instead of omega_i(t)",
    shape: Shape::Axes,
    unit: "s",
    typical: 2e-5,
    largest: 0.02,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The gyro channel is late (or early) against the reference by a fixed time that the model does not know.",
    next_experiment: "Any vigorous oscillation; two frequencies tell a delay from a phase.",
};

impl Hypothesis for GyroDelay {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn column(&self, scene: &Scene, at: &[f64], parameter: usize, axis: usize) -> Option<Vec<f64>> {
        CARD.shape.second(parameter, axis)?;
        let slope = scene.case_ahead_rad(axis, 1, -at[parameter]);
        Some(
            slope
                .into_iter()
                .map(|slope| -slope / (1.0 - scene.scale_error[axis]))
                .collect(),
        )
    }

    fn prediction(&self, scene: &Scene, at: &[f64]) -> Triad {
        [0, 1, 2].map(|axis| {
            let late = scene.case_ahead_rad(axis, 0, -at[axis]);
            let now = scene.case_ahead_rad(axis, 0, 0.0);
            let sensed = 1.0 / (1.0 - scene.scale_error[axis]);
            late.iter()
                .zip(now)
                .map(|(late, now)| (late - now) * sensed)
                .collect()
        })
    }

    fn is_linear(&self) -> bool {
        false
    }
}
