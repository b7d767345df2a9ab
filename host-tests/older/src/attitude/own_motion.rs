//! The case's motion as its own gyros tell it.
//!
//! Enters: aligned channels and the model. Leaves: case increments \[rad\] by row, body frame: dither stripped
//! with the model's pickoff gain, scale and bias taken out, Eq. (7) of the paper; the inverse of what the contract
//! says the model predicts.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::streams::{Streams, Triad};
use rlg_model::Model;

/// Fills the case's increments.
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

/// Takes out of the case's increments what goes with the dithers' angles and rates: what a wrong gain or a late pickoff
/// leaves of them is no motion, and a derivative of it would explain itself. Fitted to second differences, in which the
/// case hardly moves.
pub(super) fn without_dither(streams: &mut Streams) {
    let Some(pickoff) = &streams.pickoff_rad else {
        return;
    };
    const COLUMNS: usize = 6;
    let rows = streams.rows;
    let dithered = |row: usize| {
        SVector::<f64, COLUMNS>::from_fn(|column, _| {
            let angle = &pickoff[column % 3];
            match column < 3 {
                true => angle[row + 1] - angle[row],
                false => 0.5 * (angle[row + 1] + angle[row]),
            }
        })
    };
    let in_use = |row: usize| {
        streams.usable[row - 1..row + 2]
            .iter()
            .all(|usable| *usable)
    };
    let mut gram = SMatrix::<f64, COLUMNS, COLUMNS>::zeros();
    let mut right = SMatrix::<f64, COLUMNS, 3>::zeros();
    for row in (1..rows.saturating_sub(1)).filter(|&row| in_use(row)) {
        let column = dithered(row - 1) - dithered(row) * 2.0 + dithered(row + 1);
        let case = &streams.case_rad;
        let moved = Vector3::from_fn(|axis, _| {
            case[axis][row - 1] - 2.0 * case[axis][row] + case[axis][row + 1]
        });
        gram += column * column.transpose();
        right += column * moved.transpose();
    }
    let Some(inverse) = gram.try_inverse() else {
        return;
    };
    let sizes = inverse * right;
    for row in 0..rows {
        let part = sizes.tr_mul(&dithered(row));
        for axis in 0..3 {
            streams.case_rad[axis][row] -= part[axis];
        }
    }
}

/// Adds to the case's increments what increments the gyros sensed are worth \[rad\].
pub(super) fn add_sensed(
    case_rad: &mut Triad,
    sensed_rad: &Triad,
    model: &Model,
    body_from_sensing: &Matrix3<f64>,
) {
    let keep = model.gyro.scale_error.map(|scale| 1.0 - scale);
    for row in 0..case_rad[0].len() {
        let sensed = Vector3::from_fn(|axis, _| keep[axis] * sensed_rad[axis][row]);
        let part = body_from_sensing * sensed;
        for axis in 0..3 {
            case_rad[axis][row] += part[axis];
        }
    }
}
