//! Quantisation of undithered gyros whose pulses are coarser than the model's.
//!
//! Input: the gyros' increments, the model. Output: the pulse of each such gyro \[rad\], estimated from its values
//! ([`Lattice`]). The quantisation error of an undithered counter consists of tones and windows that correlate with the
//! motion and resemble physical effects, but it never exceeds a pulse: an effect with a smaller angle is rejected there, and
//! its residual is quantisation noise. Where the gyro turns so slowly that its pulses are rare, the same applies to pulses
//! that the model knows: their error is not white.

use crate::tiles::locate::Location;
use crate::tiles::noise_spectrum::Declared;
use rlg_findings::excess::{self, Excess, excess_square};
use rlg_inference::events::{Event, EventKind};
use rlg_model::Model;
use rlg_plan::{ChannelPulsePlan, LatticePlan, Plan};
use rlg_signal::streams::Streams;

/// Quantisation of each gyro, see the module.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lattice {
    /// Quantisation step of each gyro \[rad\]; 0 if too fine to be detected.
    pub counted_rad: [f64; 3],
    /// The same where it is coarser than the model's; else 0.
    pub pulse_rad: [f64; 3],
    /// Part of it already in the model as an effect \[rad\].
    known_rad: [f64; 3],
    /// Pulses are so rare that the quantisation error persists for many rows: the angle noise is not white.
    pub is_rare: [bool; 3],
    plan: LatticePlan,
}

impl Lattice {
    /// Estimates the pulses of a recording's gyros.
    ///
    /// # Inputs
    /// `is_seen`: true if a row may be used.
    pub fn of(
        streams: &Streams,
        model: &Model,
        is_seen: &dyn Fn(usize) -> bool,
        plan: &Plan,
    ) -> Self {
        let pulses = &plan.signal.faults.pulses;
        let plan = &plan.judgement.lattice;
        // Rounding of rates leaves an unbounded angle error; at rest the spectrum distinguishes it from counting.
        let may_count = !streams.reports_rates || streams.at_rest.is_some();
        if streams.pickoff_rad.is_some() || !may_count {
            return Self {
                plan: *plan,
                ..Self::default()
            };
        }
        let is_coarser =
            |axis: usize, seen: f64| seen > plan.coarser * model.gyro.pulse_weight_rad[axis];
        let counted = |axis: usize| {
            let rows = streams.sensed_rad[axis].iter().enumerate();
            let seen = rows.filter(|(row, _)| is_seen(*row));
            let values: Vec<f64> = seen.map(|(_, value)| *value).collect();
            let exact = pulse_rad(&values, (plan, pulses));
            if is_coarser(axis, exact) {
                exact
            } else {
                written_pulse_rad(&values, plan).max(exact)
            }
        };
        let counted_rad = [0, 1, 2].map(counted);
        let is_rare = |axis: usize| {
            let values = &streams.sensed_rad[axis];
            let seen: Vec<f64> = (0..values.len())
                .filter(|row| is_seen(*row))
                .map(|row| values[row])
                .collect();
            counted_rad[axis] > 0.0 && stays(&seen, plan)
        };
        Self {
            is_rare: [0, 1, 2].map(is_rare),
            pulse_rad: [0, 1, 2].map(|axis| {
                if is_coarser(axis, counted_rad[axis]) {
                    counted_rad[axis]
                } else {
                    0.0
                }
            }),
            counted_rad,
            plan: *plan,
            known_rad: [0, 1, 2].map(|axis| excess_square(model, excess::PULSES.kind, axis).sqrt()),
        }
    }

    /// Adds the quantisation noise of the pulses to the declared noise.
    pub fn beside(&self, mut declared: [Declared; 3]) -> [Declared; 3] {
        for (axis, declared) in declared.iter_mut().enumerate() {
            let unknown = self.unknown_rad2(axis) / 12.0;
            declared.white_angle = declared.white_angle.map(|level| level + unknown);
        }
        declared
    }

    /// Square of the pulse minus its part in the model \[rad²\].
    pub fn unknown_rad2(&self, axis: usize) -> f64 {
        (self.pulse_rad[axis].powi(2) - self.known_rad[axis].powi(2)).max(0.0)
    }

    /// True if the angle of a gyro's increments \[rad per row\], scaled by `size`, is masked by its quantisation.
    pub fn hides(&self, axis: usize, increments_rad: &[f64], size: f64) -> bool {
        size.abs() * angle_rms_rad(increments_rad)
            <= self.plan.hidden_pulses * self.hiding_rad(axis)
    }

    /// True if a motion \[rad per row\] is within the quantisation error of a gyro with rare pulses: it is then its own
    /// pulses, seen through its residual.
    pub fn hides_motion(&self, axis: usize, increments_rad: &[f64]) -> bool {
        self.is_rare[axis] && self.hides_angle(axis, angle_rms_rad(increments_rad))
    }

    /// Pulse whose quantisation error is not in the model as white angle noise \[rad\]; 0 of others.
    fn hiding_rad(&self, axis: usize) -> f64 {
        match self.is_rare[axis] {
            true => self.counted_rad[axis],
            false => self.pulse_rad[axis],
        }
    }

    /// True if any gyro has a pulse coarser than the model's.
    pub fn is_any(&self) -> bool {
        self.pulse_rad != [0.0; 3]
    }

    /// True if an angle of this root mean square \[rad\] is within the quantisation error.
    pub fn hides_angle(&self, axis: usize, rms_rad: f64) -> bool {
        rms_rad <= self.plan.hidden_pulses * self.counted_rad[axis]
    }

    /// True if an event is a jump within the quantisation error, not a slip: the error is up to a pulse, slips are whole
    /// pulses.
    pub fn hides_event(&self, axis: usize, event: &Event) -> bool {
        let jump_rad = (event.size * event.std).abs() * event.rows as f64;
        event.kind != EventKind::Step && jump_rad < self.plan.slip_pulses * self.counted_rad[axis]
    }

    /// True if the angle of a rate over a stretch and band is masked by quantisation.
    pub fn hides_location(&self, location: &Location, rate_hz: f64) -> bool {
        let seconds = location.rows.len() as f64 / rate_hz;
        let (low_hz, high_hz) = location.band_hz;
        // Angle over rate: 1/ω of a tone, the root mean square of a ramp of a constant rate.
        let turn_s = match low_hz > 0.0 {
            true => (std::f64::consts::PI * (low_hz + high_hz)).recip(),
            false => seconds / f64::sqrt(12.0),
        };
        location.size_rad_s * turn_s <= self.plan.hidden_pulses * self.hiding_rad(location.axis)
    }

    /// Enters the pulses into the noise findings, in place of the spectral estimates for these gyros.
    ///
    /// # Inputs
    /// `gain`: gain in ln L by white angle noise of a gyro beyond the level known without the pulses; `None` if its pulses
    /// make none.
    pub fn take_over(&self, found: &mut Vec<Excess>, gain: &dyn Fn(usize) -> Option<f64>) {
        // Quantisation tones overlap the band of a random walk.
        for entry in found.iter_mut() {
            let coarse = (0..3).filter(|&axis| self.pulse_rad[axis] > 0.0);
            for axis in coarse.filter(|&axis| gain(axis).is_some()) {
                (entry.values[axis], entry.stds[axis]) = (0.0, 0.0);
            }
        }
        found.retain(|entry| entry.values != [0.0; 3]);
        let new = |axis: &usize| {
            let least_rad2 = self.plan.unknown_share * self.pulse_rad[*axis].powi(2);
            self.unknown_rad2(*axis) > least_rad2 && gain(*axis).is_some()
        };
        let unknown: Vec<usize> = (0..3).filter(new).collect();
        if unknown.is_empty() {
            return;
        }
        let place = found
            .iter()
            .position(|entry| entry.kind == excess::PULSES.kind);
        let place = place.unwrap_or_else(|| {
            found.push(excess::PULSES);
            found.len() - 1
        });
        let entry = &mut found[place];
        for axis in unknown {
            entry.values[axis] = self.unknown_rad2(axis).sqrt();
            entry.stds[axis] = self.plan.off_share * entry.values[axis];
            entry.log_likelihood_gain += gain(axis).unwrap_or_default();
            // Thousands of values on multiples of one number are not due to chance.
            entry.p_value = 0.0;
        }
    }
}

/// Root mean square of the cumulative sum of increments, about its mean \[rad\].
fn angle_rms_rad(increments_rad: &[f64]) -> f64 {
    let (mut angle_rad, mut sum, mut square) = (0.0, 0.0, 0.0);
    for increment in increments_rad {
        angle_rad += increment;
        sum += angle_rad;
        square += angle_rad * angle_rad;
    }
    let count = increments_rad.len().max(1) as f64;
    (square / count - (sum / count).powi(2)).max(0.0).sqrt()
}

/// True if runs of many equal values make up more than the plan's share of the rows.
fn stays(values: &[f64], plan: &LatticePlan) -> bool {
    let same = values.chunk_by(|a, b| a == b).map(<[f64]>::len);
    plan.rare_one_in * same.filter(|rows| *rows >= plan.rare_rows).sum::<usize>() > values.len()
}

/// Estimates the pulse: the smallest distance from the most frequent value if all differences of values are multiples of it;
/// else 0.
fn pulse_rad(values: &[f64], (plan, pulses): (&LatticePlan, &ChannelPulsePlan)) -> f64 {
    let pulse = rlg_signal::fault::pulse(values, pulses);
    let first = values.first().copied().unwrap_or_default();
    let off = |value: &f64| {
        let pulses = (value - first) / pulse;
        (pulses - pulses.round()).abs() > plan.off_share
    };
    let between = || values.iter().filter(|value| off(value)).count() as f64;
    if pulse > 0.0 && between() < plan.bridged_share * values.len() as f64 {
        pulse
    } else {
        0.0
    }
}

/// Estimates the pulse of values rounded to a written unit: the number of which all are multiples within the rounding; 0 if
/// none.
fn written_pulse_rad(values: &[f64], plan: &LatticePlan) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]);
    let of_any = |least: f64| {
        let larger = steps.clone().filter(move |step| *step > least);
        larger.fold(f64::INFINITY, f64::min)
    };
    let largest = sorted.last().map_or(0.0, |last| last.max(-sorted[0]));
    // Steps below a billionth of the largest value are floating-point rounding.
    let unit = of_any(1e-9 * largest);
    let mut pulse = of_any(plan.written_step_units * unit);
    if !pulse.is_finite() || pulse < plan.written_pulse_units * unit {
        return 0.0;
    }
    // Larger values determine the pulse better; doubling the range at a time, no count is wrong.
    let mut reach = 2.0 * pulse;
    loop {
        let near = sorted.iter().filter(|value| value.abs() <= reach);
        let (cross, square) = near.fold((0.0, 0.0), |(cross, square), value| {
            let count = (value / pulse).round();
            (cross + value * count, square + count * count)
        });
        if square > 0.0 {
            pulse = cross / square;
        }
        if reach > largest {
            break;
        }
        reach *= 2.0;
    }
    let most_off = plan.written_off_units * unit;
    let is_multiple = |value: &f64| (value - pulse * (value / pulse).round()).abs() <= most_off;
    if sorted.iter().all(is_multiple) {
        pulse
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pulse_rad(values: &[f64]) -> f64 {
        super::pulse_rad(
            values,
            (&LatticePlan::default(), &ChannelPulsePlan::default()),
        )
    }

    fn written_pulse_rad(values: &[f64]) -> f64 {
        super::written_pulse_rad(values, &LatticePlan::default())
    }

    fn stays(values: &[f64]) -> bool {
        super::stays(values, &LatticePlan::default())
    }

    #[test]
    fn counts_have_a_pulse_and_noise_has_none() {
        let angle = |row: usize| 3.0e-6 * (row as f64 * 0.01).sin() * row as f64;
        let counted = |pulse: f64| -> Vec<f64> {
            let count = |row: usize| (angle(row) / pulse).floor();
            (1..4000)
                .map(|row| (count(row) - count(row - 1)) * pulse)
                .collect()
        };
        assert!((pulse_rad(&counted(4.5e-6)) / 4.5e-6 - 1.0).abs() < 1e-9);
        let smooth: Vec<f64> = (1..4000).map(|row| angle(row) - angle(row - 1)).collect();
        assert_eq!(pulse_rad(&smooth), 0.0);
    }

    #[test]
    fn pulses_written_in_a_finer_unit_are_seen() {
        let angle = |row: usize| 3.0e-6 * (row as f64 * 0.01).sin() * row as f64;
        let written =
            |row: usize| ((angle(row) / 2.415e-6).floor() * 2.415e-6 / 1e-9).floor() * 1e-9;
        let values: Vec<f64> = (1..4000)
            .map(|row| written(row) - written(row - 1))
            .collect();
        assert!((written_pulse_rad(&values) / 2.415e-6 - 1.0).abs() < 1e-4);
        let smooth = |row: usize| (angle(row) / 1e-9).floor() * 1e-9;
        let plain: Vec<f64> = (1..4000).map(|row| smooth(row) - smooth(row - 1)).collect();
        assert_eq!(written_pulse_rad(&plain), 0.0);
        assert_eq!(written_pulse_rad(&[]), 0.0);
        assert_eq!(written_pulse_rad(&[0.0; 8]), 0.0);
    }

    #[test]
    fn a_tone_of_half_a_pulse_is_hidden_and_a_drift_is_not() {
        let lattice = Lattice {
            pulse_rad: [4e-6, 0.0, 0.0],
            ..Lattice::default()
        };
        let tone: Vec<f64> = (0..4000).map(|row| (row as f64 * 0.1).cos()).collect();
        // Its angle has an amplitude of ten times its size: 0.18 pulses of root mean square.
        assert!(lattice.hides(0, &tone, 1e-7));
        assert!(!lattice.hides(0, &vec![1.0; 4000], 1e-8));
        assert!(!lattice.hides(1, &tone, 1e-7));
    }

    #[test]
    fn rare_pulses_hide_a_motion_of_half_a_pulse_though_the_model_knows_them() {
        let tone: Vec<f64> = (0..4000)
            .map(|row| 1e-7 * (row as f64 * 0.1).cos())
            .collect();
        let mut lattice = Lattice {
            counted_rad: [2e-6, 0.0, 0.0],
            ..Lattice::default()
        };
        assert!(!lattice.hides_motion(0, &tone) && !lattice.hides(0, &tone, 1.0));
        lattice.is_rare[0] = true;
        assert!(lattice.hides_motion(0, &tone) && lattice.hides(0, &tone, 1.0));
        let swing: Vec<f64> = tone.iter().map(|increment| 3.0 * increment).collect();
        assert!(!lattice.hides_motion(0, &swing));
    }

    #[test]
    fn a_counter_stays_where_it_shows_the_same_for_many_rows() {
        let counted = |every: usize| -> Vec<f64> {
            let row = |row: usize| f64::from(u8::from(row.is_multiple_of(every)));
            (0..4000).map(row).collect()
        };
        assert!(stays(&counted(50)));
        assert!(!stays(&counted(10)));
    }
}
