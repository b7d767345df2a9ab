//! A bias that follows the block's temperature.
//!
//! ω_i + c_i (T_i − T_i at the start). Confused with: slow drift of any other cause while the temperature only
//! climbs.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::AXES;

/// See the page above.
pub struct GyroBiasTemperature;

static CARD: Card = Card {
    kind: "gyro_bias_temperature",
    equation: "omega_i += c_i (T_i - T_i(start))",
    shape: Shape::Axes,
    unit: "rad/s/K",
    typical: 1e-6,
    largest: 1e-3,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The gyro bias moves with the temperature of its block and the model keeps it constant.",
    next_experiment: "Cycle the temperature up and down: a bias that retraces its path is temperature, one that does not is time or gradient.",
};

impl Hypothesis for GyroBiasTemperature {
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
        Some(scene.sensed_from_rate(axis, scene.temperature_change_k(axis, 0)?.into_iter()))
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        CARD.shape.second(parameter, axis)?;
        Some(format!("temperature_{}", AXES[axis]))
    }

    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .temperature_k
            .is_none()
            .then_some("no temperature channels")
    }
}
