//! Gyros that count coarser pulses than the model knows, without a dither to blur them.
//!
//! Enters: the gyros' increments, the model. Leaves: each such gyro's pulse \[rad\], read off its values ([`Lattice`]).
//! A counter that is not dithered is wrong in tones and windows that go with the motion and look like physics, but never
//! by more than a pulse: what turns by less is no finding there, and what remains of it is the pulses' noise. Where the gyro
//! turns so slowly that its pulses are rare, that holds of pulses that the model knows, too: they are no white noise.

use super::locate::Location;
use super::noise_spectrum::Declared;
use rlg_findings::excess::{self, Excess, excess_square};
use rlg_inference::events::{Event, EventKind};
use rlg_model::Model;
use rlg_signal::streams::Streams;

/// A pulse this many times the declared one is another instrument's.
const COARSER: f64 = 1.5;

/// What the values are off their lattice by, as a share of a pulse.
const ON_LATTICE: f64 = 1e-3;

/// Root mean square of an angle that pulses hide, in pulses: what is wrong by up to one has half of one at most.
const HIDDEN: f64 = 0.6;

/// See the page above.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lattice {
    /// What each gyro counts in \[rad\]; 0 where it counts too finely to be seen.
    pub counted_rad: [f64; 3],
    /// The same where it is coarser than the model knows; else 0.
    pub pulse_rad: [f64; 3],
    /// Of it, what stands in the model as an effect already \[rad\].
    known_rad: [f64; 3],
    /// Whether pulses come so rarely that what counting is wrong by stays for many rows: its angle is not white.
    pub is_rare: [bool; 3],
}

impl Lattice {
    /// Reads the pulses off a recording's gyros.
    ///
    /// # Inputs
    /// `is_seen`: whether a row may be looked at.
    pub fn of(streams: &Streams, model: &Model, is_seen: &dyn Fn(usize) -> bool) -> Self {
        // What rounds rates leaves an angle that is not bounded: at rest the spectrum shows which of the two it is.
        let may_count = !streams.reports_rates || streams.at_rest.is_some();
        if streams.pickoff_rad.is_some() || !may_count {
            return Self::default();
        }
        let is_coarser =
            |axis: usize, seen: f64| seen > COARSER * model.gyro.pulse_weight_rad[axis];
        let counted = |axis: usize| {
            let rows = streams.sensed_rad[axis].iter().enumerate();
            let seen = rows.filter(|(row, _)| is_seen(*row));
            let values: Vec<f64> = seen.map(|(_, value)| *value).collect();
            let exact = pulse_rad(&values);
            if is_coarser(axis, exact) {
                exact
            } else {
                written_pulse_rad(&values).max(exact)
            }
        };
        let counted_rad = [0, 1, 2].map(counted);
        let is_rare = |axis: usize| {
            let values = &streams.sensed_rad[axis];
            let seen: Vec<f64> = (0..values.len())
                .filter(|row| is_seen(*row))
                .map(|row| values[row])
                .collect();
            counted_rad[axis] > 0.0 && stays(&seen)
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
            known_rad: [0, 1, 2].map(|axis| excess_square(model, excess::PULSES.kind, axis).sqrt()),
        }
    }

    /// The declared noise with the pulses' own.
    pub fn beside(&self, mut declared: [Declared; 3]) -> [Declared; 3] {
        for (axis, declared) in declared.iter_mut().enumerate() {
            let unknown = self.unknown_rad2(axis) / 12.0;
            declared.white_angle = declared.white_angle.map(|level| level + unknown);
        }
        declared
    }

    /// What of the square of a pulse the model does not know \[rad²\].
    pub fn unknown_rad2(&self, axis: usize) -> f64 {
        (self.pulse_rad[axis].powi(2) - self.known_rad[axis].powi(2)).max(0.0)
    }

    /// Whether increments of a gyro \[rad per row\] add up to no more than its pulses hide.
    pub fn hides(&self, axis: usize, increments_rad: &[f64], size: f64) -> bool {
        size.abs() * angle_rms_rad(increments_rad) <= HIDDEN * self.hiding_rad(axis)
    }

    /// Whether a motion \[rad per row\] is no more than what a gyro whose pulses come rarely is wrong by: its own pulses, seen
    /// through its residual.
    pub fn hides_motion(&self, axis: usize, increments_rad: &[f64]) -> bool {
        self.is_rare[axis] && self.hides_angle(axis, angle_rms_rad(increments_rad))
    }

    /// A pulse whose counting is no white noise of angle that the model knows \[rad\]; 0 of others.
    fn hiding_rad(&self, axis: usize) -> f64 {
        match self.is_rare[axis] {
            true => self.counted_rad[axis],
            false => self.pulse_rad[axis],
        }
    }

    /// Whether there is any such gyro.
    pub fn is_any(&self) -> bool {
        self.pulse_rad != [0.0; 3]
    }

    /// Whether an angle of this root mean square is within what counting makes \[rad\].
    pub fn hides_angle(&self, axis: usize, rms_rad: f64) -> bool {
        rms_rad <= HIDDEN * self.counted_rad[axis]
    }

    /// Whether an event is a jump that is no slip of a gyro that counts: its angle is off by up to a pulse, and slips by whole ones.
    pub fn hides_event(&self, axis: usize, event: &Event) -> bool {
        /// Nearer to one pulse than to two.
        const HIDDEN: f64 = 1.5;
        let jump_rad = (event.size * event.std).abs() * event.rows as f64;
        event.kind != EventKind::Step && jump_rad < HIDDEN * self.counted_rad[axis]
    }

    /// Whether a rate over a stretch and band turns by no more than the pulses hide.
    pub fn hides_location(&self, location: &Location, rate_hz: f64) -> bool {
        let seconds = location.rows.len() as f64 / rate_hz;
        let (low_hz, high_hz) = location.band_hz;
        // Of a tone's rate its angle, of a constant rate's the root mean square of a ramp.
        let turn_s = match low_hz > 0.0 {
            true => (std::f64::consts::PI * (low_hz + high_hz)).recip(),
            false => seconds / f64::sqrt(12.0),
        };
        location.size_rad_s * turn_s <= HIDDEN * self.hiding_rad(location.axis)
    }

    /// The pulses as a finding beside the noise that was compared, in the place of what the spectrum says of these gyros.
    ///
    /// # Inputs
    /// `gain`: growth of ln L by white angle noise on a gyro beyond what is known without the pulses; `None` where they make none.
    pub fn take_over(&self, found: &mut Vec<Excess>, gain: &dyn Fn(usize) -> Option<f64>) {
        // Their tones lie where a walk would show, too.
        for entry in found.iter_mut() {
            let coarse = (0..3).filter(|&axis| self.pulse_rad[axis] > 0.0);
            for axis in coarse.filter(|&axis| gain(axis).is_some()) {
                (entry.values[axis], entry.stds[axis]) = (0.0, 0.0);
            }
        }
        found.retain(|entry| entry.values != [0.0; 3]);
        let new = |axis: &usize| {
            self.unknown_rad2(*axis) > 0.2 * self.pulse_rad[*axis].powi(2) && gain(*axis).is_some()
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
            entry.stds[axis] = ON_LATTICE * entry.values[axis];
            entry.log_likelihood_gain += gain(axis).unwrap_or_default();
            // Thousands of values on multiples of one number are no chance.
            entry.p_value = 0.0;
        }
    }
}

/// Root mean square of the angle that increments add up to, about its mean.
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

/// Whether a counter shows the same for many rows in a tenth of them.
fn stays(values: &[f64]) -> bool {
    /// Rows.
    const MANY: usize = 20;
    let same = values.chunk_by(|a, b| a == b).map(<[f64]>::len);
    10 * same.filter(|rows| *rows >= MANY).sum::<usize>() > values.len()
}

/// The number of which all values are multiples away from the most frequent one; 0 where there is none.
fn pulse_rad(values: &[f64]) -> f64 {
    let pulse = rlg_signal::fault::pulse(values);
    let first = values.first().copied().unwrap_or_default();
    let off = |value: &f64| {
        let pulses = (value - first) / pulse;
        (pulses - pulses.round()).abs() > ON_LATTICE
    };
    // Bridged gaps lie between.
    const MOST_BETWEEN: f64 = 0.01;
    let between = || values.iter().filter(|value| off(value)).count() as f64;
    if pulse > 0.0 && between() < MOST_BETWEEN * values.len() as f64 {
        pulse
    } else {
        0.0
    }
}

/// The number of which all values are multiples but for the unit that they are written in; 0 where there is none.
fn written_pulse_rad(values: &[f64]) -> f64 {
    /// Units that the difference of two written values is off by at most, and some rounding.
    const OFF: f64 = 1.5;
    /// Pulses of fewer units look like noise written in them.
    const FEWEST_UNITS: f64 = 20.0;
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]);
    let of_any = |least: f64| {
        let larger = steps.clone().filter(move |step| *step > least);
        larger.fold(f64::INFINITY, f64::min)
    };
    let largest = sorted.last().map_or(0.0, |last| last.max(-sorted[0]));
    // Below a billionth of the largest value lies the rounding of its number.
    let unit = of_any(1e-9 * largest);
    let mut pulse = of_any(2.5 * unit);
    if !pulse.is_finite() || pulse < FEWEST_UNITS * unit {
        return 0.0;
    }
    // The further the values, the better they know the pulse; a step further at a time, none is counted wrongly.
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
    let is_multiple = |value: &f64| (value - pulse * (value / pulse).round()).abs() <= OFF * unit;
    if sorted.iter().all(is_multiple) {
        pulse
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        // Its angle swings by ten times its size on either side, 0.18 pulses of root mean square.
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
