//! One fault of a channel, and how a channel that counts coarse pulses repeats itself without one.

use std::collections::HashMap;
use std::ops::Range;

/// Rows on either side of a run of repeats that tell how usual repeats are there.
pub(super) const SURROUNDINGS_ROWS: usize = 200;

/// One fault of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// One of [`rlg_model::kinds::FAULT_KINDS`].
    pub kind: &'static str,
    /// Kinds that look the same.
    pub indistinguishable_from: &'static [&'static str],
    /// `gyro_x`, `dither_y`, `reference_z`.
    pub channel: String,
    /// Rows, guard left out.
    pub rows: Range<usize>,
    /// What else is known of it.
    pub detail: Detail,
}

/// What is known of a fault beside where it is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Detail {
    /// Nothing.
    #[default]
    None,
    /// Many places between the first and the last row.
    Places {
        /// How many.
        places: usize,
        /// Rows of all of them.
        rows: usize,
    },
    /// Each reading stands for so many rows, on the mean.
    Hold {
        /// Rows a reading.
        rows_per_reading: f64,
    },
    /// The range overflowed: the reading has come out at its other end.
    Wrapped,
    /// One reading alone is off by so much \[rad\].
    Spike {
        /// Reading less the mean of its neighbours.
        size_rad: f64,
    },
}

/// The smallest step that a channel takes away from a value, anywhere.
fn step_from(stuck: f64, values: &[f64]) -> f64 {
    /// Of the largest value: smaller steps are rounding.
    const ROUNDING: f64 = 1e-12;
    let largest = values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    values
        .iter()
        .map(|value| (value - stuck).abs())
        .filter(|step| *step > ROUNDING * largest)
        .fold(f64::INFINITY, f64::min)
}

/// The pulse of a coarse channel: the least that it is away from its most frequent value; nothing where no value comes
/// in one row of a hundred, as noise finer than a pulse never lets one.
pub fn pulse(values: &[f64]) -> f64 {
    const OFTEN: usize = 100;
    let mut counts: HashMap<u64, usize> = HashMap::new();
    for value in values {
        *counts.entry(value.to_bits()).or_default() += 1;
    }
    let most = counts
        .into_iter()
        .max_by_key(|(bits, count)| (*count, *bits));
    match most {
        Some((bits, count)) if count * OFTEN > values.len() => {
            step_from(f64::from_bits(bits), values)
        }
        _ => 0.0,
    }
}

/// A coarse gyro without dither repeats itself while it turns by less than a pulse a row: it comes to such a
/// stretch and leaves it by single pulses. One that fails jumps. A pulse is the least that the channel ever is away from
/// that value: what is written in a finer unit than its pulses takes smaller steps elsewhere.
pub(super) fn is_between_pulses(fault: &Fault, values: &[f64]) -> bool {
    let stuck = values[fault.rows.start];
    let pulse = step_from(stuck, values);
    let near = |row: usize| {
        values
            .get(row)
            .is_none_or(|value| (value - stuck).abs() < 1.5 * pulse)
    };
    fault.kind != "saturation"
        && near(fault.rows.end)
        && fault.rows.start.checked_sub(1).is_none_or(near)
}

/// Stretches of two rows and more, each of which is the `same` as the one before it.
pub(super) fn repeats(rows: usize, same: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut begin = 0;
    for row in 1..=rows {
        if row == rows || !same(row) {
            if row - begin > 1 {
                runs.push(begin..row);
            }
            begin = row;
        }
    }
    runs
}
