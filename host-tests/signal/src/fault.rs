//! Faults of a channel, and faultless repeats of a channel with coarse pulses.

use std::collections::HashMap;
use std::ops::Range;

use rlg_plan::ChannelPulsePlan;

/// One fault of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// One of [`rlg_model::kinds::FAULT_KINDS`].
    pub kind: &'static str,
    /// Kinds not distinguishable from it.
    pub indistinguishable_from: &'static [&'static str],
    /// `gyro_x`, `dither_y`, `reference_z`.
    pub channel: String,
    /// Rows, guard left out.
    pub rows: Range<usize>,
    /// Further properties.
    pub detail: Detail,
}

/// Properties of a fault besides its place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Detail {
    /// Nothing.
    #[default]
    None,
    /// Many places between the first and the last row.
    Places {
        /// Number of places.
        places: usize,
        /// Rows of all of them.
        rows: usize,
    },
    /// Samples are held over several rows.
    Hold {
        /// Mean number of rows per sample.
        rows_per_reading: f64,
    },
    /// The range overflowed: the sample is wrapped to its other end.
    Wrapped,
    /// A single outlier.
    Spike {
        /// Sample less the mean of its neighbours.
        size_rad: f64,
    },
}

/// Smallest nonzero distance of a channel's samples from a value.
fn step_from(stuck: f64, values: &[f64]) -> f64 {
    /// Share of the largest value below which a step is rounding.
    const ROUNDING: f64 = 1e-12;
    let largest = values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    values
        .iter()
        .map(|value| (value - stuck).abs())
        .filter(|step| *step > ROUNDING * largest)
        .fold(f64::INFINITY, f64::min)
}

/// Returns the pulse of a coarse channel: the smallest distance from its most frequent value; 0 where no value occurs often,
/// as under noise finer than a pulse.
pub fn pulse(values: &[f64], plan: &ChannelPulsePlan) -> f64 {
    let mut counts: HashMap<u64, usize> = HashMap::new();
    for value in values {
        *counts.entry(value.to_bits()).or_default() += 1;
    }
    let most = counts
        .into_iter()
        .max_by_key(|(bits, count)| (*count, *bits));
    match most {
        Some((bits, count)) if count * plan.often > values.len() => {
            step_from(f64::from_bits(bits), values)
        }
        _ => 0.0,
    }
}

/// True if a coarse gyro without dither merely turns by less than a pulse a row: it enters and leaves such a stretch by
/// single pulses, a failed one by jumps. The pulse is the channel's smallest distance from the repeated value: a channel
/// written in a finer unit than its pulses takes smaller steps elsewhere.
pub(super) fn is_between_pulses(fault: &Fault, values: &[f64], plan: &ChannelPulsePlan) -> bool {
    let stuck = values[fault.rows.start];
    let pulse = step_from(stuck, values);
    let near = |row: usize| {
        values
            .get(row)
            .is_none_or(|value| (value - stuck).abs() < plan.single * pulse)
    };
    fault.kind != "saturation"
        && near(fault.rows.end)
        && fault.rows.start.checked_sub(1).is_none_or(near)
}

/// Finds runs of two rows and more, each of which is the `same` as its predecessor.
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
