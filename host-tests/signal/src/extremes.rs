//! A dithered or moving gyro at its own extremes: a limit of its range cuts samples off, a quantisation level does not.

use std::ops::Range;

use super::streams::Streams;
use rlg_plan::ExtremePlan;

/// Gyro increment less case and dither \[rad\], by row.
pub(super) fn beyond_rad(streams: &Streams, axis: usize) -> Vec<f64> {
    let rows = streams.sensed_rad[axis].iter().zip(&streams.case_rad[axis]);
    rows.enumerate()
        .map(|(row, (sensed, case))| sensed - case - swung_rad(streams, axis, row))
        .collect()
}

/// Dither increment of a gyro in a row \[rad\]; 0 without a pickoff.
fn swung_rad(streams: &Streams, axis: usize, row: usize) -> f64 {
    let pickoff = streams.pickoff_rad.as_ref().map(|pickoff| &pickoff[axis]);
    pickoff.map_or(0.0, |angle| angle[row + 1] - angle[row])
}

/// Returns the sample mean if it exceeds zero significantly (one-sided z-test).
fn clear_mean(values: impl Iterator<Item = f64>, plan: &ExtremePlan) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / count;
    (mean > plan.clear * (variance / count).sqrt()).then_some(mean)
}

/// True if a gyro's samples at its own extremes fall short of case and dither, as those of a clipped gyro do, or if case and
/// dither do not predict its samples. The extreme values of a coarse gyro are quantisation levels, without shortfall.
pub(super) fn falls_short(
    streams: &Streams,
    axis: usize,
    rows: &Range<usize>,
    plan: &ExtremePlan,
) -> bool {
    let values = &streams.sensed_rad[axis];
    let beyond = beyond_rad(streams, axis);
    let seen: Vec<usize> = rows.clone().filter(|&row| streams.measured[row]).collect();
    let sum = |of: &dyn Fn(usize) -> f64| seen.iter().map(|&row| of(row).abs()).sum::<f64>();
    if sum(&|row| beyond[row]) > plan.predicted * sum(&|row| values[row]) {
        return true;
    }
    let read = || seen.iter().map(|&row| values[row]);
    let (least, most) = (
        read().fold(f64::INFINITY, f64::min),
        read().fold(f64::NEG_INFINITY, f64::max),
    );
    let missing = seen.iter().filter_map(|&row| match values[row] {
        value if value == most => Some(-beyond[row]),
        value if value == least => Some(beyond[row]),
        _ => None,
    });
    clear_mean(missing, plan).is_some()
}

/// Without a reference: true if a dithered gyro's increment less dither is smaller in the rows at its own extremes than in
/// neighbouring rows. A regular dither reaches the same sample value at the end of every swing; a clipped one shows less
/// than the case's turn. True without a pickoff: no test is possible.
pub(super) fn dips(
    streams: &Streams,
    axis: usize,
    rows: &Range<usize>,
    plan: &ExtremePlan,
) -> bool {
    if streams.pickoff_rad.is_none() {
        return true;
    }
    let values = &streams.sensed_rad[axis];
    let case = |row: usize| values[row] - swung_rad(streams, axis, row);
    let largest = rows
        .clone()
        .map(|row| values[row].abs())
        .fold(0.0, f64::max);
    let is_at_end = |row: usize| streams.measured[row] && values[row].abs() == largest;
    let is_free = |row: &usize| streams.measured[*row] && values[*row].abs() < largest;
    let missing = rows
        .clone()
        .filter(|&row| is_at_end(row))
        .filter_map(|row| {
            let before = (row.saturating_sub(plan.near_rows)..row)
                .rev()
                .find(is_free)?;
            let after = (row + 1..(row + 1 + plan.near_rows).min(streams.rows)).find(is_free)?;
            Some(values[row].signum() * (0.5 * (case(before) + case(after)) - case(row)))
        });
    clear_mean(missing, plan).is_some_and(|mean| mean > plan.shortfall * largest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::streams::Triad;

    #[test]
    fn a_regular_dither_ends_at_one_reading_and_one_that_is_cut_off_dips() {
        let rows = 12_000;
        let pulse_rad = 4e-6;
        let swing = |row: usize| 3e-4 * (row as f64 * 0.4 * std::f64::consts::PI).sin();
        let mut streams = Streams::of_motion(2000.0, [0, 1, 2].map(|_| vec![2e-4; rows]));
        streams.own_motion = true;
        streams.pickoff_rad = Some([0, 1, 2].map(|_| (0..=rows).map(swing).collect()));
        let whole = |row: usize| ((swing(row) + 2e-4 * row as f64) / pulse_rad).floor();
        streams.sensed_rad[0] = (0..rows)
            .map(|row| (whole(row + 1) - whole(row)) * pulse_rad)
            .collect();
        let most = |streams: &Streams| streams.sensed_rad[0].iter().copied().fold(0.0, f64::max);
        let regular = most(&streams);
        assert!(!dips(&streams, 0, &(0..rows), &ExtremePlan::default()));
        for value in &mut streams.sensed_rad[0] {
            *value = value.min(0.9 * regular);
        }
        assert!(dips(&streams, 0, &(0..rows), &ExtremePlan::default()));
    }

    #[test]
    fn few_values_of_a_coarse_counter_are_not_cut_off_and_a_swing_that_ends_early_is() {
        let rows = 12_000;
        let pulse_rad = 2e-6;
        // Four and a half pulses at the most, in step with the rows now and then.
        let swing = |row: usize| 4.5 * pulse_rad * (row as f64 * 2.1).sin();
        let case: Triad = [0, 1, 2].map(|_| (0..rows).map(swing).collect());
        let mut streams = Streams::of_motion(1000.0, case);
        let angle = |row: usize| (0..=row).map(swing).sum::<f64>() / pulse_rad;
        let mut counted = 0.0;
        for row in 0..rows / 4 {
            let whole = angle(row).floor();
            streams.sensed_rad[0][row] = (whole - counted) * pulse_rad;
            counted = whole;
        }
        let part = 0..rows / 4;
        assert!(!falls_short(&streams, 0, &part, &ExtremePlan::default()));
        for value in &mut streams.sensed_rad[0] {
            *value = value.clamp(-3.0 * pulse_rad, 3.0 * pulse_rad);
        }
        assert!(falls_short(&streams, 0, &part, &ExtremePlan::default()));
    }
}
