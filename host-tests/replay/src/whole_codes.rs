//! Detection of the integer codes of a recorded channel, so that a replay gives the chain the same codes.

use std::ops::Range;

use rlg_recording::Channel;

/// Largest distance from a whole number of codes \[1\]: the f64 rounding of code · scale / scale at 2³¹ codes is a
/// millionth.
const TOLERANCE: f64 = 1e-6;

/// Channel's own scale, if it lies in `allowed` and every value of the rows is an `i32` multiple of it. Missing values are
/// ignored.
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
