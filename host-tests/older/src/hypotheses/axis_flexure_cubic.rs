//! A suspension that stiffens or softens: a tilt with the cube of the angular acceleration.
//!
//! δ_ij = −Q_ij α_j³.

use super::{Card, Hypothesis, Shape};
use crate::scene::{Scene, tilt_senses};

/// See the page above.
pub struct AxisFlexureCubic;

static CARD: Card = Card {
    kind: "axis_flexure_cubic",
    equation: "delta_ij = -Q_ij alpha_j^3",
    shape: Shape::Six,
    unit: "s^6/rad^2",
    typical: 1e-12,
    largest: 1e-8,
    positive: false,
    others: &[],
    log_prior_odds: -5.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The dither suspension bends more than in proportion: the tilt has a term in the cube of the angular acceleration.",
    next_experiment: "The same coning at two amplitudes: the drift of this effect grows as the fourth power, that of linear flexure as the square.",
};

impl Hypothesis for AxisFlexureCubic {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn refines(&self) -> Option<&'static str> {
        Some("axis_flexure")
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
        let product = scene.rate_rad_s[k]
            .iter()
            .zip(&scene.acceleration_rad_s2[other]);
        Some(scene.sensed_from_rate_at_middles(
            axis,
            product.map(|(rate, acceleration)| -sign * rate * acceleration.powi(3)),
        ))
    }
}
