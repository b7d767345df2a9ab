//! A bias that follows how fast the block's temperature changes.
//!
//! ω_i + c_i dT_i/dt; the derivative is taken below the band in which converter steps live.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::AXES;

/// See the page above.
pub struct GyroBiasTemperatureRate;

static CARD: Card = Card {
    kind: "gyro_bias_temperature_rate",
    equation: "omega_i += c_i dT_i/dt",
    shape: Shape::Axes,
    unit: "rad/K",
    typical: 1e-5,
    largest: 1e-1,
    positive: false,
    others: &[],
    log_prior_odds: -1.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The gyro bias follows the rate of temperature change (a gradient across the block) and the model knows no such term.",
    next_experiment: "Hold, ramp and hold the temperature: the bias then steps with the ramp rate and returns.",
};

impl Hypothesis for GyroBiasTemperatureRate {
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
        Some(scene.sensed_from_rate(axis, scene.temperature_change_k(axis, 1)?.into_iter()))
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        CARD.shape.second(parameter, axis)?;
        Some(format!("temperature_rate_{}", AXES[axis]))
    }

    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .temperature_k
            .is_none()
            .then_some("no temperature channels")
    }
}
