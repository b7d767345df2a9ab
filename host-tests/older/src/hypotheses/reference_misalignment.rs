//! A reference that is mounted turned.
//!
//! The whole reference is turned by r (right-hand rotation): it reads ω − r × ω, so the gyros show r × ω more.
//! Three angles for all gyros; `installation` contains them as its antisymmetric part.

use super::{Card, Hypothesis, Shape};
use crate::scene::{Scene, tilt_senses};

/// See the page above.
pub struct ReferenceMisalignment;

static CARD: Card = Card {
    kind: "reference_misalignment",
    equation: "reference reads omega - r x omega",
    shape: Shape::Axes,
    unit: "rad",
    typical: 1e-4,
    largest: 0.05,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &["installation"],
    resembles_untested: &[],
    left_out: "The reference does not sit square to the case: all three gyros show the same small rotation against it.",
    next_experiment: "Remount the reference: a turned reference changes, the installation of the gyros does not.",
};

impl Hypothesis for ReferenceMisalignment {
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
        // (r × ω)_i of the unit turn about `parameter`.
        if parameter == axis {
            return None;
        }
        let (k, sign) = tilt_senses(axis, parameter);
        Some(
            scene.sensed_from_rate_at_middles(
                axis,
                scene.rate_rad_s[k].iter().map(|rate| -sign * rate),
            ),
        )
    }
}
