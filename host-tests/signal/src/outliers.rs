//! Single outliers, deviating in one sample only, and a channel held at one value while gyro and reference diverge.
//!
//! Enters: the aligned channels, with longer faults masked. Leaves: [`Fault`]s. The threshold of a sample's deviation from
//! its neighbours is a robust scale estimate over the rows around it.

use super::extremes::beyond_rad;
use super::fault::{Detail, Fault, is_between_pulses, pulse, repeats};
use super::quantiles::median;
use super::streams::{AXES, Streams};
use rlg_plan::{ChannelPulsePlan, FaultPlan, SpikePlan};

/// Deviation of each angle sample from the mean of its neighbours, half the difference of successive increments less case
/// and dither, with its threshold.
struct Off {
    off_rad: Vec<f64>,
    /// Threshold of significance by row; infinite where too few rows are in use for the scale estimate.
    least_rad: Vec<f64>,
}

impl Off {
    /// Deviations of a gyro's increments less case and dither.
    fn of(streams: &Streams, axis: usize, plan: &SpikePlan) -> Self {
        Self::of_increments(streams, &beyond_rad(streams, axis), plan)
    }

    fn of_increments(streams: &Streams, increments: &[f64], plan: &SpikePlan) -> Self {
        // Sample less the mean of its predecessor and successor.
        let off_rad: Vec<f64> = increments
            .windows(2)
            .map(|two| 0.5 * (two[0] - two[1]))
            .collect();
        let mut least_rad = vec![f64::INFINITY; off_rad.len()];
        for first in (0..off_rad.len()).step_by(plan.around) {
            let window = first..(first + plan.around).min(off_rad.len());
            let sizes: Vec<f64> = window
                .clone()
                .filter(|&row| are_usable(streams, row))
                .map(|row| off_rad[row].abs())
                .collect();
            if sizes.len() < plan.around / 4 {
                continue;
            }
            let usual_rad = median(sizes).unwrap_or(0.0);
            least_rad[window].fill(plan.angle_off * usual_rad / 0.6745);
        }
        Self { off_rad, least_rad }
    }

    /// True if a row is a single outlier: its two neighbours deviate by −1/2 of its deviation and the next ones by nothing,
    /// unlike the onset of a physical effect.
    fn is_alone(&self, row: usize, plan: &SpikePlan) -> bool {
        let off = &self.off_rad;
        let share = |near: usize| off.get(near).map_or(f64::NAN, |near| near / off[row]);
        let half = -0.5 - plan.near..-0.5 + plan.near;
        row >= 2
            && [row - 1, row + 1]
                .iter()
                .all(|&near| half.contains(&share(near)))
            && [row - 2, row + 2]
                .iter()
                .all(|&near| share(near).abs() < plan.near)
    }

    /// True if a row's deviation exceeds a share of the threshold.
    fn stands_out(&self, row: usize, share: f64) -> bool {
        let off = self.off_rad.get(row).zip(self.least_rad.get(row));
        off.is_some_and(|(off, least)| off.abs() > share * *least)
    }
}

/// True if a row and the next are in use.
fn are_usable(streams: &Streams, row: usize) -> bool {
    streams.usable[row..row + 2].iter().all(|usable| *usable)
}

/// True if a coarse gyro's repeated value agrees with the reference to its own pulse: at rest no other value is possible.
pub(super) fn agrees(
    fault: &Fault,
    values: &[f64],
    case_rad: &[f64],
    plan: &ChannelPulsePlan,
) -> bool {
    let value = values[fault.rows.start];
    let pulse = pulse(values, plan);
    fault.kind != "saturation"
        && pulse > 0.0
        && fault
            .rows
            .clone()
            .all(|row| (case_rad[row] - value).abs() < plan.agree * pulse)
}

/// A gyro as the witness of its encoder: a table at rest or at a constant rate reads the same in every row.
pub(super) struct Witness<'a> {
    reference_rad: &'a [f64],
    gyro_rad: &'a [f64],
    /// Regression of the gyro on the reference: offset \[rad\] and slope \[1\].
    offset_rad: f64,
    slope: f64,
    /// Root mean square of the gyro's motion in a row \[rad\].
    moving_rad: f64,
    pulse_rad: f64,
    pulses: ChannelPulsePlan,
    /// Rows of the average that separates motion from noise.
    averaged: usize,
}

impl<'a> Witness<'a> {
    /// Compares increments of one axis \[rad\].
    pub(super) fn new(
        reference_rad: &'a [f64],
        gyro_rad: &'a [f64],
        rate_hz: f64,
        plan: &FaultPlan,
    ) -> Self {
        let rows = reference_rad.len() as f64;
        let mean = |of: &[f64]| of.iter().sum::<f64>() / rows;
        let [reference_mean, gyro_mean] = [mean(reference_rad), mean(gyro_rad)];
        let (mut both, mut own, mut square) = (0.0, 0.0, 0.0);
        for (reference, gyro) in reference_rad.iter().zip(gyro_rad) {
            let (reference, gyro) = (reference - reference_mean, gyro - gyro_mean);
            both += reference * gyro;
            own += reference * reference;
            square += gyro * gyro;
        }
        let slope = if own > 0.0 { both / own } else { 0.0 };
        Self {
            reference_rad,
            gyro_rad,
            offset_rad: gyro_mean - slope * reference_mean,
            slope,
            moving_rad: (square / rows).sqrt(),
            pulse_rad: pulse(reference_rad, &plan.pulses),
            pulses: plan.pulses,
            averaged: ((plan.confirmed_over_s * rate_hz) as usize).max(1),
        }
    }

    /// True if the gyro confirms a repeated reading; the ends of the run are left to delays.
    ///
    /// # Inputs
    /// `share`: largest deviation beyond a pulse, of the gyro's motion \[1\].
    pub(super) fn confirms(&self, fault: &Fault, share: f64) -> bool {
        if fault.kind == "saturation" || self.slope == 0.0 {
            return false;
        }
        let quarter = fault.rows.len() / 4;
        let middle: Vec<usize> = (fault.rows.start + quarter..fault.rows.end - quarter).collect();
        let averaged = self.averaged.min(middle.len());
        // An encoder does not see less than a pulse.
        let most_rad =
            averaged as f64 * share * self.moving_rad + self.pulses.agree * self.pulse_rad;
        let off = |row: &usize| {
            self.gyro_rad[*row] - self.offset_rad - self.slope * self.reference_rad[*row]
        };
        let mut windows = middle.chunks_exact(averaged);
        windows.all(|window| window.iter().map(off).sum::<f64>().abs() < most_rad)
    }
}

/// Finds repeated values of a channel while gyro and reference diverge; the runs are too short for rejection by chance
/// alone.
pub(super) fn held(streams: &Streams, plan: &FaultPlan) -> Vec<Fault> {
    if streams.own_motion || streams.at_rest.is_some() {
        return Vec::new();
    }
    let of_axis = |axis: usize| -> Vec<Fault> {
        let off = Off::of(streams, axis, &plan.spikes);
        let pickoff = streams.pickoff_rad.as_ref();
        let channels = [
            ("gyro", Some(&streams.sensed_rad[axis][..])),
            ("reference", Some(&streams.case_rad[axis][..])),
            ("dither", pickoff.map(|pickoff| &pickoff[axis][1..])),
        ];
        let mut faults = Vec::new();
        let mut witness = None;
        for (stem, values) in channels {
            let Some(values) = values else { continue };
            let same = |row: usize| values[row] == values[row - 1];
            for run in repeats(values.len(), same) {
                if run.len() < plan.short_holds.least_rows
                    || !streams.usable[run.clone()].iter().all(|one| *one)
                {
                    continue;
                }
                let around = run.start.saturating_sub(plan.around_rows).max(1)
                    ..(run.end + plan.around_rows).min(values.len());
                let rows = around.len() as f64;
                let by_chance = around.filter(|&row| same(row)).count() as f64 / rows;
                let mut touched = run.start.saturating_sub(1)..run.end;
                if by_chance.powi(run.len() as i32 - 1) < plan.short_holds.chance
                    && touched.any(|row| off.stands_out(row, plan.short_holds.share))
                {
                    let fault = Fault {
                        kind: "stuck_channel",
                        indistinguishable_from: if values[run.start] == 0.0 {
                            &["lost_samples"]
                        } else {
                            &[]
                        },
                        channel: format!("{stem}_{}", AXES[axis]),
                        rows: run,
                        detail: Detail::None,
                    };
                    // A counter without a dither always differs from the case by up to a pulse.
                    let counts_freely = stem == "gyro" && pickoff.is_none();
                    let is_right = match stem {
                        "gyro" => {
                            counts_freely
                                && (is_between_pulses(&fault, values, &plan.pulses)
                                    || agrees(
                                        &fault,
                                        values,
                                        &streams.case_rad[axis],
                                        &plan.pulses,
                                    ))
                        }
                        "reference" => {
                            let gyro = &streams.sensed_rad[axis];
                            let new = || Witness::new(values, gyro, streams.rate_hz, plan);
                            // A reading without pulses has no room for a deviation.
                            witness.get_or_insert_with(new).confirms(&fault, 0.0)
                        }
                        _ => false,
                    };
                    if !is_right {
                        faults.push(fault);
                    }
                }
            }
        }
        faults
    };
    (0..3).flat_map(of_axis).collect()
}

/// Finds single outliers of an angle: the excess of a row is lost in the next.
pub(super) fn spikes(streams: &Streams, plan: &FaultPlan) -> Vec<Fault> {
    let criteria = &plan.spikes;
    // The case's motion estimated from the gyros contains their spikes.
    if streams.own_motion {
        return Vec::new();
    }
    let of_axis = |axis: usize| -> Vec<Fault> {
        let around = Off::of(streams, axis, criteria);
        // Without a dither the gyro's own increments must deviate as well: under a delay, a lasting step of the rate
        // deviates from the reference in a single sample.
        let own = streams
            .pickoff_rad
            .is_none()
            .then(|| Off::of_increments(streams, &streams.sensed_rad[axis], criteria));
        let off = &around.off_rad;
        let is_spike = |row: &usize| {
            are_usable(streams, *row)
                && around.stands_out(*row, 1.0)
                && around.is_alone(*row, criteria)
                && own.as_ref().is_none_or(|own| own.is_alone(*row, criteria))
        };
        let mut found: Vec<usize> = (0..off.len()).filter(is_spike).collect();
        if !found.is_empty() {
            let pulse_rad =
                pulse(&streams.sensed_rad[axis], &plan.pulses).max(streams.pulse_rad[axis]);
            found.retain(|&row| off[row].abs() > criteria.angle_least * pulse_rad);
        }
        let faults = found.into_iter().map(|row| Fault {
            kind: "lost_samples",
            indistinguishable_from: &[],
            channel: format!("gyro_{}", AXES[axis]),
            rows: row..row + 2,
            detail: Detail::None,
        });
        faults.collect()
    };
    let found: Vec<Fault> = (0..3).flat_map(of_axis).collect();
    if found.len() as f64 > criteria.angle_most * streams.rows as f64 {
        Vec::new()
    } else {
        found
    }
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;
    use crate::streams::Triad;

    /// Uniform noise of the given width, by a congruential generator.
    fn noise(width: f64) -> impl FnMut() -> f64 {
        let mut state = 1_u64;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            ((state >> 40) as f64 / f64::from(1 << 24) - 0.5) * width
        }
    }

    #[test]
    fn a_reading_that_is_off_and_back_is_lost_and_a_jump_that_stays_is_not() {
        let rows = 12_000;
        let still: Triad = [0, 1, 2].map(|_| vec![0.0; rows]);
        let mut streams = Streams::of_motion(1000.0, still);
        streams.own_motion = false;
        // An angle with white noise of about a microradian.
        let mut noise = noise(3.5e-6);
        for values in &mut streams.sensed_rad {
            let mut before = noise();
            for value in values.iter_mut() {
                let now = noise();
                *value = now - before;
                before = now;
            }
        }
        assert!(spikes(&streams, &FaultPlan::default()).is_empty());
        streams.sensed_rad[0][4_000] += 3e-5;
        let found = spikes(&streams, &FaultPlan::default());
        assert!(found.is_empty(), "{found:?}");
        streams.sensed_rad[2][7_000] += 3e-5;
        streams.sensed_rad[2][7_001] -= 3e-5;
        let found = spikes(&streams, &FaultPlan::default());
        assert_eq!(found.len(), 1);
        assert_eq!(
            (found[0].channel.as_str(), found[0].rows.clone()),
            ("gyro_z", 7_000..7_002)
        );
    }

    #[test]
    fn readings_that_are_off_now_and_then_are_lost_and_a_gyro_that_scatters_so_is_none() {
        let rows = 12_000;
        let still: Triad = [0, 1, 2].map(|_| vec![0.0; rows]);
        let with_every = |every: usize| {
            let mut streams = Streams::of_motion(1000.0, still.clone());
            streams.own_motion = false;
            let mut noise = noise(1e-6);
            for value in streams.sensed_rad.iter_mut().flatten() {
                *value = noise();
            }
            for row in (100..rows - 100).step_by(every) {
                streams.sensed_rad[1][row] += 3e-5;
                streams.sensed_rad[1][row + 1] -= 3e-5;
            }
            spikes(&streams, &FaultPlan::default()).len()
        };
        assert_eq!(with_every(1_000), 12);
        assert_eq!(with_every(100), 0);
    }

    #[test]
    fn a_counter_without_a_dither_is_silent_between_its_pulses_and_not_stuck() {
        let rows = 12_000;
        // Swings by some tens of pulses, with repeated zero crossings of the rate.
        let swing = |row: usize| 8e-5 * (row as f64 * 0.02).sin();
        let case: Triad = [0, 1, 2].map(|_| {
            let angle = (0..rows).map(|row| swing(row + 1) - swing(row));
            angle.collect()
        });
        let mut streams = Streams::of_motion(1000.0, case);
        streams.own_motion = false;
        let pulse_rad = 5e-6;
        let counted = |row: usize| (swing(row) / pulse_rad).floor() * pulse_rad;
        let gyro = |row: usize| counted(row + 1) - counted(row);
        streams.sensed_rad = [0, 1, 2].map(|_| (0..rows).map(gyro).collect());
        let found = held(&streams, &FaultPlan::default());
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn a_reading_that_is_repeated_while_the_case_turns_is_stuck() {
        let rows = 12_000;
        // Both measure the same swing of some tens of microradians a row, each with noise of its own.
        let mut noise = noise(1e-6);
        let swing = |row: usize| 4e-5 * (row as f64 * 0.3).sin();
        let mut seen = || [0, 1, 2].map(|_| (0..rows).map(|row| swing(row) + noise()).collect());
        let mut streams = Streams::of_motion(1000.0, seen());
        streams.sensed_rad = seen();
        streams.own_motion = false;
        assert!(held(&streams, &FaultPlan::default()).is_empty());
        for row in [3_000, 5_000, 5_001, 5_002, 9_000, 9_001, 9_002, 9_003] {
            streams.case_rad[1][row] = streams.case_rad[1][row - 1];
        }
        let faults = held(&streams, &FaultPlan::default());
        let found: Vec<(&str, Range<usize>)> = faults
            .iter()
            .map(|fault| (fault.channel.as_str(), fault.rows.clone()))
            .collect();
        // Two equal samples may be chance.
        let expected = [("reference_y", 4_999..5_003), ("reference_y", 8_999..9_004)];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_table_at_rest_is_confirmed_by_its_gyro_and_one_that_turns_unread_is_not() {
        let (rows, pulse_rad) = (6_000, 1e-5);
        let mut noise = noise(2e-6);
        // Five moves with rests of six seconds between, read by an encoder; the gyro has a bias and a scale error.
        let rate_rad = |row: usize| match row % 1_200 {
            first @ 0..600 => 2e-3 * (std::f64::consts::PI * first as f64 / 600.0).sin(),
            _ => 0.0,
        };
        let mut angle = 0.0;
        let (mut reference, mut gyro) = (Vec::new(), Vec::new());
        for row in 0..rows {
            let before = f64::floor(angle / pulse_rad);
            angle += rate_rad(row);
            reference.push(pulse_rad * ((angle / pulse_rad).floor() - before));
            gyro.push(1.1 * rate_rad(row) + 3e-4 + noise());
        }
        let run = |rows: Range<usize>| Fault {
            kind: "lost_samples",
            indistinguishable_from: &[],
            channel: "reference_x".to_string(),
            rows,
            detail: Detail::None,
        };
        let is_right = |reference: &[f64], rows: Range<usize>| {
            Witness::new(reference, &gyro, 100.0, &FaultPlan::default()).confirms(&run(rows), 0.1)
        };
        assert!(is_right(&reference, 1_801..2_400));
        let mut unread = reference.clone();
        unread[2_400..3_000].fill(0.0);
        assert!(!is_right(&unread, 2_400..3_000));
    }
}
