//! Residual of the gyros: sensed increments less the model's prediction without its effects.
//!
//! Contract, "The model without effects predicts": sensed increment of gyro i =
//! \[M⁻¹ (case increment) + b_i T/(1 − s_i)\]_i/(1 − s_i) + pickoff_gain_i · (pickoff difference), M the matrix
//! of Eq. (7).

use nalgebra::{Matrix3, Vector3};
use rlg_model::Model;

use super::axes::Triad;
pub use super::installation::body_from_sensing;
use super::streams::Streams;

/// Computes sensed increments less the model's prediction without its effects \[rad\].
///
/// # Inputs
/// `sensing_from_body`: the inverse of Eq. (7)'s matrix; `dither_rad`: increments of block against case.
pub fn without_effects(
    streams: &Streams,
    model: &Model,
    sensing_from_body: Matrix3<f64>,
    dither_rad: Option<&Triad>,
) -> Triad {
    let period_s = 1.0 / streams.rate_hz;
    std::array::from_fn(|axis| {
        let one_less_scale = 1.0 - model.gyro.scale_error[axis];
        let bias_rad = model.gyro.bias_rad_s[axis] * period_s / one_less_scale;
        let gain = model.pickoff_gain(axis);
        (0..streams.rows)
            .map(|row| {
                let case = Vector3::from_fn(|axis, _| streams.case_rad[axis][row]);
                let along = sensing_from_body.row(axis).transpose().dot(&case);
                let dither = dither_rad.map_or(0.0, |dither| dither[axis][row]);
                streams.sensed_rad[axis][row] - (along + bias_rad) / one_less_scale - gain * dither
            })
            .collect()
    })
}
