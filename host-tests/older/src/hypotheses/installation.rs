//! A constant tilt of the sensing axes that the model lacks.
//!
//! Gyro i senses sign·δ_ij ω_k (physics §1). Confused with: a turned reference, whose tilts are antisymmetric.

use super::{Card, Hypothesis, Shape};
use crate::scene::{Scene, tilt_senses};
use crate::streams::AXES;

/// See the page above.
pub struct Installation;

static CARD: Card = Card {
    kind: "installation",
    equation: "delta_ij constant",
    shape: Shape::Six,
    unit: "rad",
    typical: 3e-5,
    largest: 0.02,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The sensing axes do not lie where the installation matrix of the model puts them, so each gyro sees a share of the rates across it.",
    next_experiment: "A slew about each axis shows the angles; none of them leaves a drift under vibration.",
};

impl Hypothesis for Installation {
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
        let (k, sign) = tilt_senses(axis, other);
        Some(
            scene.sensed_from_rate_at_middles(
                axis,
                scene.rate_rad_s[k].iter().map(|rate| sign * rate),
            ),
        )
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        let other = CARD.shape.second(parameter, axis)?;
        let (k, _) = tilt_senses(axis, other);
        Some(format!("omega_{}", AXES[k]))
    }
}
