//! Brings a recording's temperatures to the chain's output periods, as the main loop of a unit would read them.
//!
//! From `temperature` channels \[K\] of axes x, y, z it gives a row per output period and its derivative \[K/s\] over `RATE_SPAN_S`.

use rlg_recording::{Axis, Clock, Quantity, Recording};
use trueaxis::SlowReadings;

/// Time over which the derivative is taken \[s\]: a unit's temperature changes within minutes.
const RATE_SPAN_S: f64 = 10.0;

/// Temperatures at the begin of `count` output periods of `period_s` from `start_s`: the last that was measured before.
/// `None` where a gyro has none.
pub fn at_outputs(
    recording: &Recording,
    start_s: f64,
    period_s: f64,
    count: usize,
) -> Option<Vec<[f64; 3]>> {
    let mut rows = vec![[0.0; 3]; count];
    for axis in Axis::ALL {
        let (table, channel) = recording.channel(&Quantity::Temperature, axis.label())?;
        let measured_s = |row: usize| match &table.clock {
            Clock::Uniform { rate_hz, start_s } => start_s + (row + 1) as f64 / rate_hz,
            Clock::Stamped { stamps_s, .. } => stamps_s[row],
        };
        let mut measured = (0..table.rows).filter(|row| channel.values[*row].is_finite());
        let mut row = measured.next()?;
        let mut next = measured.next();
        for (at, values) in rows.iter_mut().enumerate() {
            let time_s = start_s + at as f64 * period_s;
            while let Some(later) = next
                && measured_s(later) <= time_s
            {
                row = later;
                next = measured.next();
            }
            values[axis.index()] = channel.values[row];
        }
    }
    Some(rows)
}

/// The slow readings of output periods of `period_s` with these temperatures \[K\].
pub fn slow_readings(rows: &[[f64; 3]], period_s: f64) -> impl Iterator<Item = SlowReadings> + '_ {
    let span = (RATE_SPAN_S / period_s).round().max(1.0) as usize;
    rows.iter().enumerate().map(move |(at, now)| {
        let before = at.saturating_sub(span);
        let elapsed_s = (at - before).max(1) as f64 * period_s;
        SlowReadings {
            temperature_k: now.map(|value| value as f32),
            temperature_rate_k_s: [0, 1, 2]
                .map(|axis| ((now[axis] - rows[before][axis]) / elapsed_s) as f32),
        }
    })
}
