//! Faults of a single channel: values repeated improbably long, and values that accumulate at an extreme.
//!
//! The probability of a repeat is estimated from the channel.

use std::ops::Range;

use super::fault::{Detail, Fault, repeats};
use rlg_plan::{ClippingPlan, FaultPlan};

/// Finds faults of one channel; runs of repeats are kept only where `is_fault` holds.
///
/// # Inputs
/// `together`: largest gap in rows between two clipped rows of one stretch.
pub(super) fn of_channel(
    channel: &str,
    values: &[f64],
    (measured, together): (&[bool], usize),
    is_fault: &dyn Fn(&Fault) -> bool,
    plan: &FaultPlan,
) -> Vec<Fault> {
    let mut faults = Vec::new();
    let same = |row: usize| values[row] == values[row - 1] && measured[row] && measured[row - 1];
    let repeated = (1..values.len()).filter(|&row| same(row)).count();
    // A stuck stretch consists of repeats itself; the smaller repeat probability of the two halves keeps it detectable.
    let half = values.len() / 2;
    let in_halves = [1..half.max(1), half.max(1)..values.len()].map(|part| {
        part.clone().filter(|&row| same(row)).count() as f64 / part.len().max(1) as f64
    });
    let by_chance = in_halves[0]
        .min(in_halves[1])
        .clamp(plan.least_by_chance, 1.0);
    if repeated > 0 && by_chance < plan.most_by_chance {
        let longest =
            |by_chance: f64| 2.0 + (plan.run_chance / values.len() as f64).ln() / by_chance.ln();
        let around = |run: &Range<usize>| {
            let reach = run.len().max(plan.around_rows);
            let before = run.start.saturating_sub(reach).max(1)..run.start.max(1);
            let after = (run.end + 1).min(values.len())..(run.end + reach).min(values.len());
            let count = (before.len() + after.len()).max(1) as f64;
            before.chain(after).filter(|&row| same(row)).count() as f64 / count
        };
        let taken = values
            .iter()
            .zip(measured)
            .filter(|(_, measured)| **measured);
        let (least, most) = taken.fold(
            (f64::INFINITY, f64::NEG_INFINITY),
            |(least, most), (v, _)| (least.min(*v), most.max(*v)),
        );
        let mut runs = repeats(values.len(), same);
        runs.retain(|run| {
            let length = run.len() as f64;
            length > longest(by_chance)
                && length > longest(around(run).clamp(by_chance, plan.most_by_chance))
        });
        // A limit is an extreme of the channel or a level common to several runs; values of chance runs differ, and noise
        // exceeds them.
        let is_limit = |value: f64| {
            let alike = runs
                .iter()
                .filter(|run| values[run.start].abs() == value.abs());
            value == most || value == least || alike.count() > 1
        };
        for run in &runs {
            let value = values[run.start];
            let (kind, or): (_, &'static [&'static str]) = match value {
                0.0 => ("lost_samples", &["stuck_channel"]),
                _ if is_limit(value) => ("stuck_channel", &["saturation"]),
                _ => ("stuck_channel", &[]),
            };
            faults.push(Fault {
                kind,
                indistinguishable_from: or,
                channel: channel.to_string(),
                rows: run.clone(),
                detail: Detail::None,
            });
        }
    }
    let repeats_nothing = faults.is_empty();
    faults.retain(is_fault);
    // A stuck channel reaches its extreme once, a clipped one repeatedly.
    let clipped = clipped_rows(values, (measured, together), &plan.clipping);
    let comes = clipped.windows(2).filter(|two| two[1] > two[0] + 1).count();
    let limits: Vec<f64> = clipped.iter().map(|&row| values[row].abs()).collect();
    let at_limit = |fault: &Fault| limits.contains(&values[fault.rows.start].abs());
    if repeats_nothing || (comes >= plan.clipping.least_returns && faults.iter().any(at_limit)) {
        faults.retain(|fault| !at_limit(fault));
        faults.extend(stretches(channel, clipped, together));
    }
    faults
}

/// Returns the rows of a channel that repeatedly reaches one of its own extremes.
fn clipped_rows(
    values: &[f64],
    (measured, together): (&[bool], usize),
    plan: &ClippingPlan,
) -> Vec<usize> {
    let on_both_sides = |rows: &dyn Fn(f64) -> Vec<usize>| -> Vec<usize> {
        [1.0, -1.0].into_iter().flat_map(rows).collect()
    };
    let mut at_extreme = on_both_sides(&|side| rows_at_extreme(values, measured, side, plan));
    if at_extreme.is_empty() {
        at_extreme = on_both_sides(&|side| {
            rows_clipped_for_a_while(values, (measured, together), side, plan)
        });
    }
    at_extreme.sort_unstable();
    at_extreme
}

/// Groups clipped rows into stretches.
fn stretches(channel: &str, at_extreme: Vec<usize>, together: usize) -> Vec<Fault> {
    let mut faults: Vec<Fault> = Vec::new();
    for row in at_extreme {
        match faults.last_mut() {
            Some(fault) if row <= fault.rows.end + together => fault.rows.end = row + 1,
            _ => faults.push(Fault {
                kind: "saturation",
                indistinguishable_from: &[],
                channel: channel.to_string(),
                rows: row..row + 1,
                detail: Detail::None,
            }),
        }
    }
    faults
}

/// Rows at the upper (`side` 1) or lower (−1) extreme, if the channel accumulates there.
fn rows_at_extreme(
    values: &[f64],
    measured: &[bool],
    side: f64,
    plan: &ClippingPlan,
) -> Vec<usize> {
    let seen = || {
        (0..values.len())
            .filter(|&row| measured[row])
            .map(|row| (row, side * values[row]))
    };
    let top = seen()
        .map(|(_, value)| value)
        .fold(f64::NEG_INFINITY, f64::max);
    let next = seen()
        .map(|(_, value)| value)
        .filter(|value| *value < top)
        .fold(f64::NEG_INFINITY, f64::max);
    let at_top: Vec<usize> = seen()
        .filter(|(_, value)| *value == top)
        .map(|(row, _)| row)
        .collect();
    let at_next = seen().filter(|(_, value)| *value == next).count();
    // A channel with few values (at rest, coarse) accumulates everywhere.
    let below = seen().filter(|(_, value)| *value < next).count();
    let piles_up = at_top.len() >= plan.least_rows
        && at_top.len() >= plan.over_next * at_next
        && below > at_top.len();
    if piles_up { at_top } else { Vec::new() }
}

/// Rows at a level that temporarily limits a channel and is exceeded at other times: cycle after cycle of a dither ends
/// there. A channel held at a level reaches it once.
fn rows_clipped_for_a_while(
    values: &[f64],
    (measured, together): (&[bool], usize),
    side: f64,
    plan: &ClippingPlan,
) -> Vec<usize> {
    // Windows overlap by half: one lies inside any stretch of one and a half windows.
    let windows = (0..values.len().saturating_sub(together)).step_by(together / 2);
    let ends: Vec<(Range<usize>, f64)> = windows
        .filter_map(|begin| {
            let window = begin..begin + together;
            let own = &values[window.clone()];
            let found = rows_at_extreme(own, &measured[window.clone()], side, plan);
            let comes = found.windows(2).filter(|pair| pair[1] > pair[0] + 1);
            let first = found
                .first()
                .filter(|_| comes.count() >= plan.least_cycles)?;
            Some((window, own[*first]))
        })
        .collect();
    let alike = |level: f64| ends.iter().filter(|(_, other)| *other == level).count();
    let Some((_, level)) = ends.iter().max_by_key(|(_, level)| alike(*level)) else {
        return Vec::new();
    };
    if alike(*level) < plan.least_windows {
        return Vec::new();
    }
    // The stretch begins after the last row beyond the level, and ends before the next.
    let beyond = |row: usize| measured[row] && side * values[row] > side * level;
    let mut rows: Vec<usize> = ends
        .iter()
        .filter(|(_, own)| own == level)
        .flat_map(|(window, _)| {
            let before = (0..window.start).rev().find(|&row| beyond(row));
            let after = (window.end..values.len()).find(|&row| beyond(row));
            before.map_or(0, |row| row + 1)..after.unwrap_or(values.len())
        })
        .filter(|&row| measured[row] && values[row] == *level)
        .collect();
    rows.sort_unstable();
    rows.dedup();
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dither_cut_off_for_a_while_is_found_and_a_held_or_whole_one_is_not() {
        // 90 counts a row at 400 Hz of 4000, the amplitude varying by a fifth.
        let swing = |row: usize| {
            let amplitude = 80.0 + 16.0 * (row as f64 * 1.7e-3).sin();
            (amplitude * (row as f64 * std::f64::consts::TAU * 0.1003).sin()).floor()
        };
        let whole: Vec<f64> = (0..20_000).map(swing).collect();
        let mut cut = whole.clone();
        let span = 8_000..13_000;
        for value in &mut cut[span.clone()] {
            *value = value.min(47.0);
        }
        let mut held: Vec<f64> = (0..20_000).map(|row| (row as f64).min(9_000.0)).collect();
        held[15_000] = 9_500.0;
        let all = vec![true; 20_000];
        let measured = (&all[..], 1000);
        let found = stretches(
            "gyro_x",
            clipped_rows(&cut, measured, &ClippingPlan::default()),
            1000,
        );
        assert_eq!(found.len(), 1);
        assert!(
            found[0].rows.start.abs_diff(span.start) < 20,
            "{:?}",
            found[0].rows
        );
        assert!(
            found[0].rows.end.abs_diff(span.end) < 20,
            "{:?}",
            found[0].rows
        );
        assert!(clipped_rows(&whole, measured, &ClippingPlan::default()).is_empty());
        assert!(clipped_rows(&held, measured, &ClippingPlan::default()).is_empty());
    }
}
