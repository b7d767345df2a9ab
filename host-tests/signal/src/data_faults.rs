//! Faults of rates: samples at the ends of their range, or wrapped, single outliers, and blocks of rows written twice.
//!
//! Enters: the aligned channels. Leaves: [`Fault`]s, to be masked. Increments and counts are left to the search of events:
//! one deviating row is a step of the angle there, but a single outlier of a rate.

use rlg_plan::{FaultPlan, SpikePlan};
use std::ops::Range;

use super::fault::{Detail, Fault};
use super::quantiles::median;
use super::repeated::Repeat;
use super::streams::{AXES, Streams};
use super::{repeated, stops};

/// Finds rows of gyros without a dither at the ends of their range, or wrapped.
pub(super) fn stops(streams: &Streams, plan: &FaultPlan) -> Vec<Fault> {
    if streams.pickoff_rad.is_some() {
        return Vec::new();
    }
    let of_axis = |axis: usize| {
        let found = stops::find(&streams.sensed_rad[axis], &streams.measured, &plan.stops);
        // A steady rate repeats one value as well; an overflow proves the range.
        let is_limit = !found.wrapped.is_empty()
            || (has_reference(streams) && turns_on(streams, axis, &found.limited, plan));
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

/// True if a reference was recorded on the gyros' rows.
fn has_reference(streams: &Streams) -> bool {
    streams.at_rest.is_none() && !streams.own_motion
}

/// Estimates the white noise of a row of an otherwise smooth channel \[unit of the channel\], from the median absolute value
/// of each sample less the mean of its neighbours.
fn row_noise(values: &[f64]) -> f64 {
    /// Median absolute value of that difference for white noise, in standard deviations of the noise.
    const MEDIAN: f64 = 0.6745 * 1.224_744_871;
    let off = |three: &[f64]| (three[1] - 0.5 * (three[0] + three[2])).abs();
    median(values.windows(3).map(off)).unwrap_or(0.0) / MEDIAN
}

/// True if the reference keeps changing in a stretch with one constant gyro value.
fn turns_on(streams: &Streams, axis: usize, limited: &[Range<usize>], plan: &FaultPlan) -> bool {
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

/// True if a channel seldom repeats the value of the row before.
fn is_fine(values: &[f64], plan: &FaultPlan) -> bool {
    let repeats = values.windows(2).filter(|two| two[0] == two[1]).count();
    (repeats as f64) < plan.fine * values.len() as f64
}

/// True if a block of rows is no repeated motion: the reference differs between both, or repeats exactly as well.
fn was_written_twice(streams: &Streams, repeat: &Repeat, plan: &FaultPlan) -> bool {
    if !has_reference(streams) {
        return streams
            .sensed_rad
            .iter()
            .all(|values| is_fine(values, plan));
    }
    let pairs = || repeat.rows.clone().zip(repeat.from..);
    streams.case_rad.iter().any(|case_rad| {
        if pairs().all(|(row, from)| case_rad[row] == case_rad[from]) {
            return is_fine(case_rad, plan);
        }
        let power: f64 = pairs()
            .map(|(row, from)| (case_rad[row] - case_rad[from]).powi(2))
            .sum();
        let by_chance = 2.0 * row_noise(case_rad).powi(2) * repeat.rows.len() as f64;
        power > plan.clear.powi(2) * by_chance
    })
}

/// Finds blocks of rows in which gyros without a dither repeat earlier rows exactly.
pub(super) fn repeated(streams: &Streams, plan: &FaultPlan) -> Vec<Fault> {
    if streams.pickoff_rad.is_some() {
        return Vec::new();
    }
    let channels = [0, 1, 2].map(|axis: usize| &streams.sensed_rad[axis][..]);
    repeated::find(&channels, &streams.measured, &plan.repeats)
        .into_iter()
        .filter(|repeat| was_written_twice(streams, repeat, plan))
        .map(|repeat| Fault {
            kind: "repeated_rows",
            indistinguishable_from: &[],
            channel: "gyro".to_string(),
            rows: repeat.rows,
            detail: Detail::None,
        })
        .collect()
}

/// Finds single outliers of rates, against the reference where one exists.
pub(super) fn spikes(streams: &Streams, plan: &SpikePlan) -> Vec<Fault> {
    if streams.own_motion {
        return Vec::new();
    }
    // An outlier in itself and against the reference: under a delay of the gyros, a lasting step of the rate deviates
    // from the reference for a row.
    spikes_of(streams, plan, |axis| {
        let pairs = streams.sensed_rad[axis].iter().zip(&streams.case_rad[axis]);
        let beyond: Vec<f64> = pairs.map(|(sensed, case)| sensed - case).collect();
        Some(Bend::of(&beyond, &streams.usable, plan))
    })
}

/// Finds single outliers of the gyros' rates alone, which may be blows to the case.
pub(super) fn own_spikes(streams: &Streams, plan: &SpikePlan) -> Vec<Fault> {
    spikes_of(streams, plan, |_| None)
}

/// Single outliers of rates, in themselves and in another record of the axis if there is one.
fn spikes_of(
    streams: &Streams,
    plan: &SpikePlan,
    against: impl Fn(usize) -> Option<Bend>,
) -> Vec<Fault> {
    if !streams.reports_rates || streams.pickoff_rad.is_some() {
        return Vec::new();
    }
    let of_axis = |axis: usize| -> Vec<Fault> {
        let own = Bend::of(&streams.sensed_rad[axis], &streams.usable, plan);
        let against = against(axis);
        let rows: Vec<usize> = (2..streams.rows.saturating_sub(2))
            .filter(|&row| streams.usable[row - 1..row + 2].iter().all(|one| *one))
            .filter(|&row| own.is_alone(row, plan))
            .filter(|&row| against.as_ref().is_none_or(|one| one.is_alone(row, plan)))
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

/// Each sample less the mean of its neighbours, and its threshold.
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
            let sizes: Vec<f64> = window
                .clone()
                .filter(|&row| usable[row])
                .map(|row| off[row].abs())
                .collect();
            if sizes.len() < plan.around / 4 {
                continue;
            }
            let usual = median(sizes).unwrap_or(0.0);
            // A median of 0: the channel is too coarse for a scale estimate.
            if usual > 0.0 {
                least[window].fill(plan.off * usual / 0.6745);
            }
        }
        Self { off, least }
    }

    fn stands_out(&self, row: usize) -> bool {
        self.off[row].abs() > self.least[row]
    }

    /// True for a single outlier: its neighbours deviate by −1/2 of its deviation, the next ones by nothing.
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
