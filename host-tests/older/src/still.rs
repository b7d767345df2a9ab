//! What a unit at rest shows, and which biases nothing tells from the Earth's rotation.

use super::declare::FIT_PRIOR;
use super::hypotheses::CATALOGUE;
use super::scene::Scene;
use super::select::Chosen;
use super::streams::Triad;
use nalgebra::Vector3;
pub use rlg_signal::still::{AtRest, shown_rad};

/// Kinds that show without motion.
pub const KINDS: [&str; 8] = [
    "gyro_bias",
    "gyro_bias_temperature",
    "gyro_bias_temperature_rate",
    "gyro_bias_magnetic",
    "dither_gain",
    "dither_delay",
    "dither_cubic",
    "dither_crosstalk",
];

/// Widens the covariance of constant biases by what was taken for the Earth's rotation: nothing tells it from them.
pub fn widen(rest: &AtRest, chosen: &mut [Chosen]) {
    let constants = chosen
        .iter_mut()
        .filter(|one| CATALOGUE[one.effect].card().kind == "gyro_bias");
    for one in constants {
        let width = FIT_PRIOR * CATALOGUE[one.effect].card().typical;
        for direction in rest.taken_for_the_earths() {
            for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
                one.covariance[(a, b)] += width * width * direction[a] * direction[b];
            }
        }
    }
}

/// Lays the Earth's rotation to what the model's effects leave of the mean rate: the channels alone do not know of them.
pub fn lay(scene: &Scene, residual_rad: &mut Triad) {
    let streams = &scene.streams;
    let Some(rest) = streams
        .at_rest
        .as_ref()
        .filter(|_| streams.pieces.len() == 1)
    else {
        return;
    };
    let rows = (0..streams.rows / 2).filter(|&row| streams.usable[row]);
    let count = rows.clone().count().max(1) as f64;
    let one_less_scale = |gyro: usize| 1.0 - scene.scale_error[gyro];
    let left_rad_s = Vector3::from_fn(|gyro, _| {
        let sum: f64 = rows.clone().map(|row| residual_rad[gyro][row]).sum();
        sum / count * streams.rate_hz * one_less_scale(gyro)
    });
    let Some(body_from_sensing) = scene.sensing_from_body.try_inverse() else {
        return;
    };
    let constant_rad_s = body_from_sensing * left_rad_s + rest.earth_rad_s;
    let change = rest.nearest_earth_rad_s(constant_rad_s) - rest.earth_rad_s;
    let along = scene.sensing_from_body * change;
    for (gyro, values) in residual_rad.iter_mut().enumerate() {
        let change_rad = along[gyro] / one_less_scale(gyro) / streams.rate_hz;
        values.iter_mut().for_each(|value| *value -= change_rad);
    }
}
