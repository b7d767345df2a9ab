//! The case's motion from its own gyros.
//!
//! Enters: aligned channels and the model. Leaves: case increments \[rad\] by row, body frame: dither stripped with the
//! model's pickoff gain, scale and bias removed, Eq. (7) of the paper; the inverse of the contract's prediction by the
//! model.

use nalgebra::{Matrix3, Vector3};

use crate::streams::Streams;
use rlg_model::Model;

/// Computes the case's increments.
pub fn take_own_motion(streams: &mut Streams, model: &Model, body_from_sensing: &Matrix3<f64>) {
    let period_s = 1.0 / streams.rate_hz;
    for row in 0..streams.rows {
        let sensed = Vector3::from_fn(|axis, _| {
            let mut value = streams.sensed_rad[axis][row];
            if let Some(pickoff) = &streams.pickoff_rad {
                value -= model.pickoff_gain(axis) * (pickoff[axis][row + 1] - pickoff[axis][row]);
            }
            (1.0 - model.gyro.scale_error[axis]) * value - model.gyro.bias_rad_s[axis] * period_s
        });
        let case = body_from_sensing * sensed;
        for axis in 0..3 {
            streams.case_rad[axis][row] = case[axis];
        }
    }
}
