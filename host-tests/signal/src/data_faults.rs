//! Faults of rates: readings at the ends of their range, or past them, single ones that are off, and blocks of rows that
//! were written twice.
//!
//! Enters: the aligned channels. Leaves: [`Fault`]s, to be taken out of use. Increments and counts are left to the search of
//! events: one row that is off is a jump of the angle there, and of a rate a reading alone.

use std::ops::Range;

use super::data_plan::{DataPlan, SpikePlan};
use super::fault::{Detail, Fault};
use super::repeated::Repeat;
use super::streams::{AXES, Streams};
use super::{repeated, stops};

/// Rows in which gyros without a dither stand at the ends of their range, or are wrapped.
pub(super) fn stops(streams: &Streams) -> Vec<Fault> {
    if streams.pickoff_rad.is_some() {
        return Vec::new();
    }
    let of_axis = |axis: usize| {
        let found = stops::find(
            &streams.sensed_rad[axis],
            &streams.measured,
            &DataPlan::default().stops,
        );
        // A turn at a steady rate shows one value again and again as well; where the range overflowed it has an end.
        let is_limit = !found.wrapped.is_empty()
            || (has_reference(streams) && turns_on(streams, axis, &found.limited));
        let limited = found.limited.into_iter().filter(move |_| is_limit);
        let limited = limited.map(|rows| (rows, Detail::None));
        let wrapped = found
            .wrapped
            .into_iter()
            .map(|rows| (rows, Detail::Wrapped));
        limited.chain(wrapped).map(move |(rows, detail)| Fault {
            kind: "saturation",
            indistinguishable_from: &[],
            channel: format!("gyro_{}", AXES[axis]),
            rows,
            detail,
        })
    };
    let mut faults: Vec<Fault> = (0..3).flat_map(of_axis).collect();
    faults.sort_by(|a, b| (&a.channel, a.rows.start).cmp(&(&b.channel, b.rows.start)));
    faults
}

/// Whether a reference was recorded on the gyros' rows.
fn has_reference(streams: &Streams) -> bool {
    streams.at_rest.is_none() && !streams.own_motion
}

/// Noise of a row of a channel that is smooth but for it: from each value less the mean of its neighbours.
fn row_noise(values: &[f64]) -> f64 {
    /// Of white noise: the median size of what it is called, in its standard deviations.
    const MEDIAN: f64 = 0.6745 * 1.224_744_871;
    let off = |three: &[f64]| (three[1] - 0.5 * (three[0] + three[2])).abs();
    let mut sizes: Vec<f64> = values.windows(3).map(off).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    *median / MEDIAN
}

/// Whether the reference goes on changing in stretches in which a gyro shows one value.
fn turns_on(streams: &Streams, axis: usize, limited: &[Range<usize>]) -> bool {
    let plan = DataPlan::default();
    let case_rad = &streams.case_rad[axis];
    let noise_rad = row_noise(case_rad);
    limited.iter().any(|rows| {
        let means = case_rad[rows.clone()]
            .windows(plan.smoothed_rows)
            .map(|window| window.iter().sum::<f64>() / plan.smoothed_rows as f64);
        let (least, most) = means.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), one| {
            (least.min(one), most.max(one))
        });
        let value_rad = streams.sensed_rad[axis][rows.start].abs();
        most - least > (plan.turned * value_rad).max(plan.clear * noise_rad)
    })
}

/// Whether a channel hardly ever shows the value of the row before.
fn is_fine(values: &[f64]) -> bool {
    let repeats = values.windows(2).filter(|two| two[0] == two[1]).count();
    (repeats as f64) < DataPlan::default().fine * values.len() as f64
}

/// Whether the reference says that a block of rows is no motion that came again: it moved otherwise, or was written twice
/// as well.
fn was_written_twice(streams: &Streams, repeat: &Repeat) -> bool {
    if !has_reference(streams) {
        return streams.sensed_rad.iter().all(|values| is_fine(values));
    }
    let pairs = || repeat.rows.clone().zip(repeat.from..);
    streams.case_rad.iter().any(|case_rad| {
        if pairs().all(|(row, from)| case_rad[row] == case_rad[from]) {
            return is_fine(case_rad);
        }
        let power: f64 = pairs()
            .map(|(row, from)| (case_rad[row] - case_rad[from]).powi(2))
            .sum();
        let by_chance = 2.0 * row_noise(case_rad).powi(2) * repeat.rows.len() as f64;
        power > DataPlan::default().clear.powi(2) * by_chance
    })
}

/// Blocks of rows in which gyros without a dither repeat earlier rows exactly.
pub(super) fn repeated(streams: &Streams) -> Vec<Fault> {
    if streams.pickoff_rad.is_some() {
        return Vec::new();
    }
    let channels = [0, 1, 2].map(|axis: usize| &streams.sensed_rad[axis][..]);
    repeated::find(&channels, &streams.measured, &DataPlan::default().repeats)
        .into_iter()
        .filter(|repeat| was_written_twice(streams, repeat))
        .map(|repeat| Fault {
            kind: "repeated_rows",
            indistinguishable_from: &[],
            channel: "gyro".to_string(),
            rows: repeat.rows,
            detail: Detail::None,
        })
        .collect()
}

/// Single readings of rates that are off, against the reference where there is one.
pub(super) fn spikes(streams: &Streams) -> Vec<Fault> {
    let plan = &DataPlan::default().spikes;
    if !streams.reports_rates || streams.pickoff_rad.is_some() || streams.own_motion {
        return Vec::new();
    }
    let of_axis = |axis: usize| -> Vec<Fault> {
        let sensed = &streams.sensed_rad[axis];
        let pairs = sensed.iter().zip(&streams.case_rad[axis]);
        let beyond: Vec<f64> = pairs.map(|(sensed, case)| sensed - case).collect();
        // Off in itself, and off the reference: where gyros are late a step of the rate is off the reference for a row, and
        // stays.
        let own = Bend::of(sensed, &streams.usable, plan);
        let against = Bend::of(&beyond, &streams.usable, plan);
        let rows: Vec<usize> = (2..streams.rows.saturating_sub(2))
            .filter(|&row| streams.usable[row - 1..row + 2].iter().all(|one| *one))
            .filter(|&row| own.is_alone(row, plan) && against.is_alone(row, plan))
            .collect();
        let is_told =
            rows.len() >= plan.least && rows.len() as f64 <= plan.most * streams.rows as f64;
        let told = if is_told { rows } else { Vec::new() };
        told.into_iter()
            .map(|row| Fault {
                kind: "spikes",
                indistinguishable_from: &["counter_slip"],
                channel: format!("gyro_{}", AXES[axis]),
                rows: row..row + 1,
                detail: Detail::Spike {
                    size_rad: own.off[row],
                },
            })
            .collect()
    };
    (0..3).flat_map(of_axis).collect()
}

/// Each reading less the mean of its neighbours, and how large that is by chance.
struct Bend {
    off: Vec<f64>,
    least: Vec<f64>,
}

impl Bend {
    fn of(values: &[f64], usable: &[bool], plan: &SpikePlan) -> Self {
        let rows = values.len();
        let mut off = vec![0.0; rows];
        for row in 1..rows.saturating_sub(1) {
            off[row] = values[row] - 0.5 * (values[row - 1] + values[row + 1]);
        }
        let mut least = vec![f64::INFINITY; rows];
        for first in (0..rows).step_by(plan.around) {
            let window = first..(first + plan.around).min(rows);
            let mut sizes: Vec<f64> = window
                .clone()
                .filter(|&row| usable[row])
                .map(|row| off[row].abs())
                .collect();
            if sizes.len() < plan.around / 4 {
                continue;
            }
            let middle = sizes.len() / 2;
            let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
            // A median of 0 says that the channel is too coarse to scatter.
            if *median > 0.0 {
                least[window].fill(plan.off * *median / 0.6745);
            }
        }
        Self { off, least }
    }

    fn stands_out(&self, row: usize) -> bool {
        self.off[row].abs() > self.least[row]
    }

    /// Off by itself: the neighbours by half to the other side, the next not at all.
    fn is_alone(&self, row: usize, plan: &SpikePlan) -> bool {
        let share = |near: usize| self.off[near] / self.off[row];
        self.stands_out(row)
            && [row - 1, row + 1]
                .iter()
                .all(|&near| (share(near) + 0.5).abs() < plan.near)
            && [row - 2, row + 2]
                .iter()
                .all(|&near| share(near).abs() < plan.near)
    }
}
