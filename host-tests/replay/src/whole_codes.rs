//! Finds out in which codes a channel was recorded, so that a replay gives the chain the same ones.

use std::ops::Range;

use rlg_recording::Channel;

/// How far a value may be from a whole number of codes \[1\]: what f64 leaves of code · scale / scale at 2³¹ codes is a
/// millionth.
const TOLERANCE: f64 = 1e-6;

/// The channel's own scale, if it lies in `allowed` and every value of the rows is a whole number of it that an `i32` holds.
/// Values that were not measured say nothing.
pub fn own_scale(channel: &Channel, rows: Range<usize>, allowed: (f64, f64)) -> Option<f64> {
    let (least, most) = allowed;
    let possible = channel.offset == 0.0 && (least..=most).contains(&channel.scale);
    let is_code = |value: &f64| {
        let code = value / channel.scale;
        value.is_nan()
            || (code.abs() <= f64::from(i32::MAX) && (code - code.round()).abs() < TOLERANCE)
    };
    (possible && channel.values[rows].iter().all(is_code)).then_some(channel.scale)
}
