//! Sensing axes that turn with temperature.
//!
//! δ_ij = c_ij (T_i − T_i at the start), acting as in `installation`.

use super::{Card, Hypothesis, Shape};
use crate::scene::{Scene, tilt_senses};
use crate::streams::AXES;

/// See the page above.
pub struct InstallationTemperature;

static CARD: Card = Card {
    kind: "installation_temperature",
    equation: "delta_ij = c_ij (T_i - T_i(start))",
    shape: Shape::Six,
    unit: "rad/K",
    typical: 1e-5,
    largest: 1e-2,
    positive: false,
    others: &[],
    log_prior_odds: -2.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The sensing axes turn with the temperature of the block and the model keeps the installation constant.",
    next_experiment: "Repeat the same slew at two temperatures.",
};

impl Hypothesis for InstallationTemperature {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn refines(&self) -> Option<&'static str> {
        Some("installation")
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
        let change = scene.temperature_change_k(axis, 0)?;
        let product = scene.rate_rad_s[k]
            .iter()
            .zip(change)
            .map(|(rate, change)| sign * rate * change);
        Some(scene.sensed_from_rate_at_middles(axis, product))
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        let other = CARD.shape.second(parameter, axis)?;
        let (k, _) = tilt_senses(axis, other);
        Some(format!("omega_{}*temperature_{}", AXES[k], AXES[axis]))
    }

    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .temperature_k
            .is_none()
            .then_some("no temperature channels")
    }
}
