//! The dither suspension lets the block lag its case: the sensing axis tilts with angular acceleration.
//!
//! δ_ij = −K_ij α_j, K = J/k > 0 (Cheng 2023, Eqs. 3–6 with the signs of physics §2). Under coning the product
//! α_j ω_k has a mean, so vibration rectifies into drift; of the six K a stationary oscillation shows only the
//! three sums K_ij + K_ik.

use super::{Card, Hypothesis, Shape};
use crate::scene::{Scene, tilt_senses};
use crate::streams::AXES;

/// See the page above.
pub struct AxisFlexure;

static CARD: Card = Card {
    kind: "axis_flexure",
    equation: "delta_ij = -K_ij alpha_j",
    shape: Shape::Six,
    unit: "s^2",
    typical: 1e-7,
    // 1/Ω0² of a suspension that resonates at 50 Hz; below that it is no spring any more but a mode.
    largest: 1e-5,
    positive: true,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The dither suspension is not stiff: under angular acceleration each laser block lags its case, its sensing axis tilts by K times the acceleration, and the tilt times the cross rate rectifies into a drift whenever the motion cones.",
    next_experiment: "Spin at a steady rate about one axis while oscillating at the same frequency about a second (spin-synchronous oscillation), both spin senses and two phases for every pair of axes: this separates the single coefficients of a pair, which coning and vibration never do.",
};

impl Hypothesis for AxisFlexure {
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
        let product = scene.rate_rad_s[k]
            .iter()
            .zip(&scene.acceleration_rad_s2[other]);
        Some(scene.sensed_from_rate_at_middles(
            axis,
            product.map(|(rate, acceleration)| -sign * rate * acceleration),
        ))
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        let other = CARD.shape.second(parameter, axis)?;
        let (k, _) = tilt_senses(axis, other);
        Some(format!("omega_{}*alpha_{}", AXES[k], AXES[other]))
    }
}
