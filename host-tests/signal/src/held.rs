//! Finds channels with each sample held over several rows: a slow instrument recorded by a faster recorder.
//!
//! Such a channel changes in every k-th row and in no other. A coarse channel in slow motion repeats itself too, but for
//! varying numbers of rows, and then changes by one pulse.

use rlg_plan::HoldPlan;
use std::ops::Range;

use crate::quantiles::median;

/// A held channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Hold {
    /// Mean number of rows per sample.
    pub rows_per_reading: f64,
    /// Rows from the first sample to the end of the last.
    pub span: Range<usize>,
    /// Rows with a new sample; a sample equal to its predecessor is placed at its regular time.
    pub fresh: Vec<usize>,
}

impl Hold {}

/// Returns the hold of `values`, rows that were not `measured` excluded; `None` where they are not held.
pub fn find(values: &[f64], measured: &[bool], plan: &HoldPlan) -> Option<Hold> {
    let changes: Vec<usize> = (1..values.len())
        .filter(|&row| measured[row] && measured[row - 1] && values[row] != values[row - 1])
        .collect();
    if changes.len() < plan.least_readings || moves_by_pulses(values, &changes, plan) {
        return None;
    }
    let stretches: Vec<usize> = changes.windows(2).map(|two| two[1] - two[0]).collect();
    let lengths = stretches.iter().map(|&length| length as f64);
    let usual = median(lengths).unwrap_or(0.0) as usize;
    if usual < 2 {
        return None;
    }
    let near: Vec<usize> = stretches
        .iter()
        .copied()
        .filter(|stretch| stretch.abs_diff(usual) <= plan.jitter_rows)
        .collect();
    let mean = near.iter().sum::<usize>() as f64 / near.len().max(1) as f64;
    // Two equal samples make one run of twice the length.
    let readings = |stretch: usize| (stretch as f64 / mean).round().max(1.0);
    let slack = |stretch: usize| {
        let jitter = if near.iter().all(|one| *one == usual) {
            0
        } else {
            plan.jitter_rows
        };
        jitter as f64 + plan.period_error_rows * readings(stretch)
    };
    let is_whole = |stretch: &&usize| {
        (**stretch as f64 - readings(**stretch) * mean).abs() <= slack(**stretch)
    };
    let whole = stretches.iter().filter(is_whole).count();
    // Single rows between samples of two rows would be chance.
    let is_regular = whole as f64 >= plan.regular * stretches.len() as f64;
    let is_short = near.iter().any(|one| *one < 2);
    if !is_regular || is_short {
        return None;
    }
    let mut fresh = Vec::new();
    for two in changes.windows(2) {
        let count = readings(two[1] - two[0]);
        let step = (two[1] - two[0]) as f64 / count;
        fresh.extend((0..count as usize).map(|k| two[0] + (k as f64 * step).round() as usize));
    }
    fresh.extend(changes.last());
    let (first, last) = (*fresh.first()?, *fresh.last()?);
    Some(Hold {
        rows_per_reading: mean,
        span: first..(last + mean.round() as usize).min(values.len()),
        fresh,
    })
}

/// True if the median change hardly exceeds the smallest.
fn moves_by_pulses(values: &[f64], changes: &[usize], plan: &HoldPlan) -> bool {
    /// Share of the largest change below which a change is rounding.
    const ROUNDING: f64 = 1e-9;
    let mut sizes: Vec<f64> = changes
        .iter()
        .map(|&row| (values[row] - values[row - 1]).abs())
        .collect();
    sizes.sort_by(f64::total_cmp);
    let largest = sizes[sizes.len() - 1];
    let least = sizes.iter().find(|size| **size > ROUNDING * largest);
    least.is_none_or(|least| sizes[sizes.len() / 2] < plan.least_steps * least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rlg_plan::HoldPlan;

    /// A motion that never repeats itself.
    fn smooth(row: usize) -> f64 {
        (row as f64 * 0.013).sin() + 0.4 * (row as f64 * 0.0371).cos()
    }

    fn held(rows: usize, per_reading: f64) -> Vec<f64> {
        let reading = |row: usize| ((row as f64 / per_reading).floor() * per_reading).ceil();
        (0..rows).map(|row| smooth(reading(row) as usize)).collect()
    }

    #[test]
    fn readings_of_any_number_of_rows_are_found() {
        for per_reading in [2.0, 3.0, 7.0, 12.0, 6.67, 20.0] {
            let values = held(6000, per_reading);
            let found = find(&values, &[true; 6000], &HoldPlan::default());
            let found = found.unwrap_or_else(|| panic!("{per_reading}"));
            assert!((found.rows_per_reading - per_reading).abs() < 0.05 * per_reading);
            for &row in &found.fresh[1..] {
                assert!(values[row] != values[row - 1], "{per_reading}: {row}");
            }
        }
    }

    #[test]
    fn coarse_readings_that_repeat_now_and_then_are_still_held() {
        let values: Vec<f64> = held(8000, 7.0)
            .iter()
            .map(|value| (value * 300.0).round() / 300.0)
            .collect();
        let found = find(&values, &[true; 8000], &HoldPlan::default()).expect("held");
        assert!((found.rows_per_reading - 7.0).abs() < 1e-9);
    }

    #[test]
    fn fine_and_coarse_channels_and_staircases_are_not_held() {
        let fine: Vec<f64> = (0..6000).map(smooth).collect();
        let coarse: Vec<f64> = fine.iter().map(|value| (value * 50.0).round()).collect();
        let coarser: Vec<f64> = fine.iter().map(|value| (value * 5.0).round()).collect();
        let staircase: Vec<f64> = (0..6000).map(|row| (row as f64 / 7.0).floor()).collect();
        let still = vec![0.0; 6000];
        for values in [fine, coarse, coarser, staircase, still] {
            assert_eq!(find(&values, &[true; 6000], &HoldPlan::default()), None);
        }
    }
}
