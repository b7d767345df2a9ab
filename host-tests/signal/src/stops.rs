//! Finds rows of a channel at the end of its range, or wrapped past it to the other end.
//!
//! An integer overflow jumps by the whole range in one row. Jumps are counted by sign: rows whose count differs from the
//! median one are wrapped. A limited channel repeats one value, farther out than half its largest, in successive rows, and
//! never repeats itself elsewhere.

use rlg_plan::StopPlan;
use std::ops::Range;

/// Limited and wrapped rows of a channel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Stops {
    /// Rows at the limit.
    pub limited: Vec<Range<usize>>,
    /// Wrapped rows.
    pub wrapped: Vec<Range<usize>>,
}

/// Finds limited and wrapped rows of `values`, rows that were not `measured` excluded.
pub fn find(values: &[f64], measured: &[bool], plan: &StopPlan) -> Stops {
    let wrapped = wrapped(values, measured, plan);
    let limits = limits(values, measured, &wrapped, plan);
    let is_limited =
        |row: usize| !wrapped[row] && measured[row] && limits.contains(&values[row].to_bits());
    let limited: Vec<bool> = (0..values.len()).map(is_limited).collect();
    Stops {
        limited: runs(&limited),
        wrapped: runs(&wrapped),
    }
}

/// Mask of the rows displaced by a whole range.
fn wrapped(values: &[f64], measured: &[bool], plan: &StopPlan) -> Vec<bool> {
    let rows = values.len();
    let largest = largest(values, measured);
    let mut steps: Vec<f64> = (1..rows)
        .filter(|&row| measured[row] && measured[row - 1])
        .map(|row| (values[row] - values[row - 1]).abs())
        .collect();
    if steps.is_empty() || largest == 0.0 {
        return vec![false; rows];
    }
    let place = (steps.len() * 99 / 100).min(steps.len() - 1);
    let (_, usual, _) = steps.select_nth_unstable_by(place, f64::total_cmp);
    let usual = *usual;
    let mut turns = vec![0_i32; rows];
    for row in 1..rows {
        let (before, now) = (values[row - 1], values[row]);
        let is_jump = measured[row]
            && measured[row - 1]
            && before * now < 0.0
            && before.abs().min(now.abs()) >= plan.near_end * largest
            && (now - before).abs() > plan.over_steps * usual;
        turns[row] = turns[row - 1]
            + match is_jump {
                true if before > 0.0 => 1,
                true => -1,
                false => 0,
            };
    }
    let mut sorted = turns.clone();
    sorted.sort_unstable();
    let usual_turn = sorted[rows / 2];
    let wrapped: Vec<bool> = turns.iter().map(|turn| *turn != usual_turn).collect();
    let count = wrapped.iter().filter(|wrapped| **wrapped).count();
    match count as f64 > plan.most_wrapped * rows as f64 {
        true => vec![false; rows],
        false => wrapped,
    }
}

/// Limiting values of a channel, as bits.
fn limits(values: &[f64], measured: &[bool], wrapped: &[bool], plan: &StopPlan) -> Vec<u64> {
    let largest = largest(values, measured);
    let whole = || (0..values.len()).filter(|&row| measured[row] && !wrapped[row]);
    let ends = [f64::min, f64::max].map(|further| whole().map(|row| values[row]).reduce(further));
    let has_wrapped = wrapped.contains(&true);
    let is_repeat = |row: usize| values[row] == values[row - 1] && measured[row];
    let mut shown: Vec<(u64, usize)> = Vec::new();
    let (mut begin, mut repeats) = (0, 0);
    for row in 1..=values.len() {
        if row < values.len() && is_repeat(row) {
            continue;
        }
        let run = row - begin;
        let value = values[begin];
        // A limit is an extreme value: a steady rate of few pulses repeats several values. Wrapped samples hide the order of
        // the ends.
        let is_end = has_wrapped || ends.contains(&Some(value));
        let is_far = value.abs() >= plan.limit * largest && measured[begin];
        if is_end && is_far && run >= plan.least_run {
            match shown.iter_mut().find(|(bits, _)| *bits == value.to_bits()) {
                Some((_, count)) => *count += run,
                None => shown.push((value.to_bits(), run)),
            }
        } else {
            repeats += run - 1;
        }
        begin = row;
    }
    if repeats as f64 > plan.most_repeats * values.len() as f64 {
        return Vec::new();
    }
    // A single run at a value is a stuck channel; a limit is reached repeatedly, or occurs next to a wrap.
    let comes = |bits: u64| {
        let starts = (1..values.len())
            .filter(|&row| values[row].to_bits() == bits && !is_repeat(row) && !wrapped[row]);
        starts.count()
    };
    shown.retain(|(bits, count)| *count >= plan.least_rows && (has_wrapped || comes(*bits) > 1));
    shown.into_iter().map(|(bits, _)| bits).collect()
}

fn largest(values: &[f64], measured: &[bool]) -> f64 {
    let known = values.iter().zip(measured).filter(|(_, known)| **known);
    known.fold(0.0, |most: f64, (value, _)| most.max(value.abs()))
}

/// Runs of marked rows.
pub(crate) fn runs(marked: &[bool]) -> Vec<Range<usize>> {
    let mut all: Vec<Range<usize>> = Vec::new();
    for (row, _) in marked.iter().enumerate().filter(|(_, marked)| **marked) {
        match all.last_mut() {
            Some(last) if last.end == row => last.end = row + 1,
            _ => all.push(row..row + 1),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use rlg_plan::StopPlan;

    /// Rates of an instrument of whole counts, beyond its range by a tenth.
    fn rate(row: usize) -> f64 {
        36_000.0 * (row as f64 * 0.007).sin() + 40.0 * (row as f64 * 1.7).sin()
    }

    fn counted(stop: f64, offset: f64) -> Vec<f64> {
        let wrap = |value: f64| (value + 32_768.0).rem_euclid(65_536.0) - 32_768.0;
        (0..9000)
            .map(|row| wrap(rate(row).round().clamp(-stop, stop) + offset))
            .collect()
    }

    fn count(runs: &[Range<usize>]) -> usize {
        runs.iter().map(|run| run.len()).sum()
    }

    #[test]
    fn a_limited_rate_with_an_offset_wraps_at_one_end_and_stands_at_the_other() {
        let values = counted(32_767.0, 40.0);
        let found = find(&values, &[true; 9000], &StopPlan::default());
        let beyond = |sign: f64| (0..9000).filter(|&row| sign * rate(row) > 32_767.0).count();
        assert!(count(&found.wrapped).abs_diff(beyond(1.0)) < beyond(1.0) / 10);
        assert!(count(&found.limited).abs_diff(beyond(-1.0)) < beyond(-1.0) / 10);
    }

    #[test]
    fn an_overflow_without_a_limit_is_wrapped() {
        let values = counted(1e9, 0.0);
        let found = find(&values, &[true; 9000], &StopPlan::default());
        let beyond = (0..9000).filter(|&row| rate(row).abs() > 32_768.0).count();
        assert!(count(&found.wrapped).abs_diff(beyond) < 20);
        assert!(found.limited.is_empty());
    }

    #[test]
    fn a_limit_alone_is_no_wrap() {
        let values: Vec<f64> = counted(30_000.0, 0.0);
        let found = find(&values, &[true; 9000], &StopPlan::default());
        assert!(found.wrapped.is_empty());
        assert!(count(&found.limited) > 500);
    }

    #[test]
    fn free_motion_noise_spikes_and_one_stuck_stretch_are_none() {
        let free: Vec<f64> = (0..9000).map(|row| 0.5 * rate(row)).collect();
        let mut state = 1_u64;
        let noise: Vec<f64> = (0..9000)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 40) as f64 - f64::from(1 << 23)
            })
            .collect();
        let mut spikes = vec![0.0; 9000];
        for row in (0..9000).step_by(300) {
            spikes[row] = if row % 600 == 0 { 1000.0 } else { -1000.0 };
        }
        let mut stuck = free.clone();
        let value = stuck[4000];
        stuck[4000..4100].fill(value);
        for values in [free, noise, spikes, stuck] {
            let found = find(&values, &[true; 9000], &StopPlan::default());
            assert_eq!(found, Stops::default());
        }
    }
}
