//! What dithers leave in the case's motion as its own gyros tell it, which `rlg_signal::own_motion` takes from the streams.

use nalgebra::{SMatrix, SVector, Vector3};

pub use rlg_signal::own_motion::{add_sensed, take_own_motion};

use crate::streams::Streams;

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
