//! Selects one row per sample of channels whose recorder holds each sample over several rows.
//!
//! Enters: the aligned channels. Leaves: the same with one row per sample, and a fault per held channel. The other channels
//! are reduced to the row itself or the mean of all rows since the previous sample, by the better correlation with the held
//! samples.

use crate::held::{Hold, find};
use rlg_plan::FaultPlan;

use super::fault::{Detail, Fault};
use super::streams::{AXES, Streams, Triad};

/// Kind of a held sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reading {
    /// The instantaneous value in its row.
    OfRow,
    /// The mean since the previous sample.
    OfBlock,
}

/// Held channels.
struct Held {
    gyros: [Option<Hold>; 3],
    reference: [Option<Hold>; 3],
}

impl Held {
    fn of(streams: &Streams, plan: &FaultPlan) -> Self {
        let of = |triad: &Triad| {
            [0, 1, 2].map(|axis: usize| {
                let hold = find(&triad[axis], &streams.measured, &plan.hold)?;
                (hold.span.len() as f64 > plan.held_throughout * streams.rows as f64)
                    .then_some(hold)
            })
        };
        Self {
            gyros: of(&streams.sensed_rad),
            reference: of(&streams.case_rad),
        }
    }

    fn all(&self) -> Vec<(String, &Hold)> {
        let named = |stem: &'static str, holds: &'_ [Option<Hold>; 3]| -> Vec<String> {
            let each = (0..3).filter(|&axis| holds[axis].is_some());
            each.map(|axis| format!("{stem}_{}", AXES[axis])).collect()
        };
        let mut names = named("gyro", &self.gyros);
        names.extend(named("reference", &self.reference));
        let holds = self.gyros.iter().chain(&self.reference).flatten();
        names.into_iter().zip(holds).collect()
    }
}

/// Selects one row per sample where channels are held throughout.
///
/// # Returns
/// A fault for each held channel, on the remaining rows.
pub fn read_once(streams: &mut Streams, plan: &FaultPlan) -> Vec<Fault> {
    if streams.pickoff_rad.is_some() || streams.own_motion || streams.at_rest.is_some() {
        return Vec::new();
    }
    let held = Held::of(streams, plan);
    let named: Vec<(String, f64)> = held
        .all()
        .into_iter()
        .map(|(name, hold)| (name, hold.rows_per_reading))
        .collect();
    let most = held
        .all()
        .into_iter()
        .map(|(_, hold)| hold)
        .max_by_key(|hold| hold.fresh.len());
    let Some(first) = most.cloned() else {
        return Vec::new();
    };
    let is_together = |hold: &Hold| {
        let fresh = hold.fresh.iter();
        let shared = fresh.filter(|row| first.fresh.binary_search(row).is_ok());
        shared.count() as f64 >= plan.held_together * hold.fresh.len() as f64
    };
    if !held.all().iter().all(|(_, hold)| is_together(hold)) {
        return Vec::new();
    }
    let reading = reading(streams, &held, &first, plan);
    take(streams, &held, &first, reading);
    named
        .into_iter()
        .map(|(channel, rows_per_reading)| Fault {
            kind: "held_values",
            indistinguishable_from: &[],
            channel,
            rows: 0..streams.rows,
            detail: Detail::Hold { rows_per_reading },
        })
        .collect()
}

/// Rows of a sample's block, up to its own; `None` before the record.
fn block(row: usize, rows_per_reading: f64) -> Option<std::ops::RangeInclusive<usize>> {
    let length = rows_per_reading.round() as usize;
    Some((row + 1).checked_sub(length)?..=row)
}

/// Selects the kind of the held samples, by the correlation with the channels that are not held.
fn reading(streams: &Streams, held: &Held, hold: &Hold, plan: &FaultPlan) -> Reading {
    let mut left = [0.0; 2];
    for axis in 0..3 {
        let (gyro, case) = (&streams.sensed_rad[axis], &streams.case_rad[axis]);
        let (kept, free) = match (&held.gyros[axis], &held.reference[axis]) {
            (Some(_), None) => (gyro, case),
            (None, Some(_)) => (case, gyro),
            _ => continue,
        };
        let mut rows = hold.fresh.iter().filter_map(|&row| {
            let rows = block(row, hold.rows_per_reading)?;
            let count = rows.clone().count() as f64;
            let mean = free[rows].iter().sum::<f64>() / count;
            Some([kept[row], free[row], mean])
        });
        let all: Vec<[f64; 3]> = rows.by_ref().collect();
        let unlike = |place: usize| 1.0 - correlation(&all, place).powi(2);
        // An axis is weighted by the better squared correlation: one at rest correlates with neither.
        let weight = 1.0 - unlike(1).min(unlike(2));
        left[0] += weight * unlike(1);
        left[1] += weight * unlike(2);
    }
    match left[1] < plan.mean_leaves * left[0] {
        true => Reading::OfBlock,
        false => Reading::OfRow,
    }
}

/// Correlation of the first values with those at a place.
fn correlation(all: &[[f64; 3]], place: usize) -> f64 {
    let count = all.len().max(1) as f64;
    let mean = |of: usize| all.iter().map(|one| one[of]).sum::<f64>() / count;
    let means = [mean(0), mean(place)];
    let mut sums = [0.0; 3];
    for one in all {
        let (a, b) = (one[0] - means[0], one[place] - means[1]);
        sums[0] += a * a;
        sums[1] += a * b;
        sums[2] += b * b;
    }
    sums[1] / (sums[0] * sums[2]).sqrt().max(f64::MIN_POSITIVE)
}

/// Reduces all channels to one row per sample, with increments scaled to the sample's period.
fn take(streams: &mut Streams, held: &Held, hold: &Hold, reading: Reading) {
    let length = hold.rows_per_reading;
    let fresh: Vec<usize> = hold
        .fresh
        .iter()
        .copied()
        .filter(|&row| reading == Reading::OfRow || block(row, length).is_some())
        .collect();
    let rows_of = |row: usize| match reading {
        Reading::OfRow => row..=row,
        Reading::OfBlock => block(row, length).unwrap_or(row..=row),
    };
    let thin = |values: &[f64], is_held: bool| -> Vec<f64> {
        let of = |&row: &usize| {
            let rows = if is_held { row..=row } else { rows_of(row) };
            let count = rows.clone().count() as f64;
            values[rows].iter().sum::<f64>() * length / count
        };
        fresh.iter().map(of).collect()
    };
    for axis in 0..3 {
        let (gyro, case) = (held.gyros[axis].is_some(), held.reference[axis].is_some());
        streams.sensed_rad[axis] = thin(&streams.sensed_rad[axis], gyro);
        streams.case_rad[axis] = thin(&streams.case_rad[axis], case);
    }
    let at = |values: &[f64]| fresh.iter().map(|&row| values[row]).collect::<Vec<f64>>();
    for triad in [
        &mut streams.force_m_s2,
        &mut streams.temperature_k,
        &mut streams.magnetic_t,
    ]
    .into_iter()
    .flatten()
    {
        triad.iter_mut().for_each(|values| *values = at(values));
    }
    streams
        .others
        .iter_mut()
        .for_each(|(_, values)| *values = at(values));
    if let Some(stamps_s) = &mut streams.stamps_s {
        *stamps_s = at(stamps_s);
    }
    let all = |mask: &[bool]| -> Vec<bool> {
        let of = |&row: &usize| mask[rows_of(row)].iter().all(|one| *one);
        fresh.iter().map(of).collect()
    };
    streams.usable = all(&streams.usable);
    streams.measured = all(&streams.measured);
    streams.select_unmeasured(&fresh);
    // Start time such that the first row's middle is that of the sample.
    let first = rows_of(fresh[0]);
    let middle = 0.5 * (first.start() + first.end() + 1) as f64;
    streams.start_s += (middle - 0.5 * length) / streams.rate_hz;
    streams.rate_hz /= length;
    streams.rows = fresh.len();
}
