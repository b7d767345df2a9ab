//! Velocity increments \[m/s\] and chain codes from accelerometer channels.
//!
//! Increments are per period, along body axes, on the gyros' rows; codes are in units of [`VELOCITY_WEIGHT_M_S`].
//!
//! `velocity_increment` passes unchanged; `specific_force` (a mean over the row) is multiplied by the period. Codes are
//! those of the *running* velocity: the remainder of one carries over to the next. Increments that were recorded in codes,
//! as whole numbers of their scale, keep them.
//!
//! Channels with gaps or on another clock are not used: a velocity must be measured throughout.

use std::ops::Range;

use rlg_recording::{Axis, Quantity, Recording, Table};
use trueaxis::design_parameters::ACCELEROMETER_WEIGHT_RANGE_M_S;

use crate::whole_codes::own_scale;

/// Velocity of one code for channels that were not recorded in codes \[m/s\], 1.9e-9: an `i32` holds ±4 m/s a period, 1600
/// g at 4 kHz, and the chain accepts no weight below 1e-9.
pub const VELOCITY_WEIGHT_M_S: f64 = 1.0 / (1u64 << 29) as f64;

/// Velocity of one code of the accelerometers x, y, z \[m/s\]: the recorded one if they were recorded in codes.
pub fn velocity_weight_m_s(recording: &Recording, kept: Range<usize>) -> [f64; 3] {
    Axis::ALL.map(|axis| {
        recording
            .channel(&Quantity::VelocityIncrement, axis.label())
            .and_then(|(_, channel)| {
                own_scale(channel, kept.clone(), ACCELEROMETER_WEIGHT_RANGE_M_S)
            })
            .unwrap_or(VELOCITY_WEIGHT_M_S)
    })
}

/// Velocity increments of the rows `kept`; `None` without accelerometers; or the reason why they are not usable. A first
/// row that only `primes` the chain, which ignores its velocity, may be missing.
pub fn velocity_rows(
    recording: &Recording,
    kept: Range<usize>,
    primes: bool,
    rate_hz: f64,
    same_clock: &dyn Fn(&Table) -> bool,
) -> Result<Option<Vec<[f64; 3]>>, String> {
    for (quantity, unit_s) in [
        (Quantity::VelocityIncrement, 1.0),
        (Quantity::SpecificForce, 1.0 / rate_hz),
    ] {
        let found = Axis::ALL.map(|axis| recording.channel(&quantity, axis.label()));
        let [Some((table_x, x)), Some((table_y, y)), Some((table_z, z))] = found else {
            if found.iter().any(Option::is_some) {
                return Err(format!("{} lacks an axis", quantity.name()));
            }
            continue;
        };
        if ![table_x, table_y, table_z].into_iter().all(same_clock) {
            return Err(format!(
                "{} runs on another clock than the gyros",
                quantity.name()
            ));
        }
        let limit_m_s = f64::from(i32::MAX) * VELOCITY_WEIGHT_M_S;
        let first = kept.start;
        return kept
            .map(|row| {
                let read = [x, y, z].map(|channel| channel.values[row] * unit_s);
                if primes && row == first && read.iter().any(|value| value.is_nan()) {
                    Ok([0.0; 3])
                } else if read.iter().all(|value| value.abs() < limit_m_s) {
                    Ok(read)
                } else {
                    Err(format!(
                        "{} was not measured, or is beyond {limit_m_s:.0} m/s, in row {row}",
                        quantity.name()
                    ))
                }
            })
            .collect::<Result<_, _>>()
            .map(Some);
    }
    Ok(None)
}

/// Codes of the running velocity of x, y, z in units of `weight_m_s`.
pub fn codes(velocity_m_s: &[[f64; 3]], weight_m_s: [f64; 3]) -> impl Iterator<Item = [i32; 3]> {
    let mut remainder = [0.0; 3];
    velocity_m_s.iter().map(move |read| {
        [0, 1, 2].map(|axis| {
            let velocity = read[axis] / weight_m_s[axis] + remainder[axis];
            let code = velocity.round();
            remainder[axis] = velocity - code;
            // within ±2³¹ − 1 by `velocity_rows` or `own_scale`; the cast would saturate
            code as i32
        })
    })
}
