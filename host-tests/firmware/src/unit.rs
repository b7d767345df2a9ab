//! Models a dithered unit without faults: its counters and pickoffs, period by period.
//!
//! From a seed and each block's share of its amplitude in each period it makes [`Sample`]s: pulses over the period,
//! pickoff codes at its end; block frame, axes x, y, z. The case turns steadily and swings at 5 Hz, at most 0.25 rad/s;
//! the blocks dither at 390, 410 and 430 Hz with 150″, which wanders by a tenth.
//!
//! Not a simulator of the physics: no flexure, lock-in or noise. It shows faults, not drift.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueaxis::{CrossAxis, Parameters, Sample};

/// Pulse weight \[rad\]: 0.8″.
pub const PULSE_RAD: f64 = 3.9e-6;

/// Pickoff code \[rad\]: a twentieth of a pulse.
pub const PICKOFF_RAD: f64 = 2e-7;

/// Dither amplitude \[rad\]: 150″.
pub const DITHER_RAD: f64 = 7.3e-4;

/// Dither frequencies \[Hz\]: three different ones, as always.
pub const DITHER_HZ: [f64; 3] = [390.0, 410.0, 430.0];

/// Rows a second \[Hz\].
pub const RATE_HZ: f64 = 4000.0;

/// Sampling periods in an output period: 400 frames a second.
pub const SAMPLES_PER_OUTPUT: u16 = 10;

/// Steady rates of the case \[rad/s\].
const STEADY_RAD_S: [f64; 3] = [0.02, -0.05, 0.1];

/// Swing of the case \[rad/s\], and its frequency \[Hz\].
const SWING_RAD_S: f64 = 0.15;
const SWING_HZ: f64 = 5.0;

/// Fastest that the case turns about an axis \[rad/s\]: steady and swing together.
pub const FASTEST_RAD_S: f64 = 0.25;

/// Largest part by which the amplitude wanders from its nominal value \[1\].
const WANDER: f64 = 0.1;

/// The firmware's parameters for this unit.
pub fn parameters() -> Parameters {
    Parameters::default().with(|p| {
        p.pulse_weight_rad = [PULSE_RAD; 3];
        p.pickoff_weight_rad = PICKOFF_RAD;
        p.flexure_s2 = CrossAxis::from_array([6.9e-8, 7.1e-8, 7.5e-8, 7.3e-8, 6.7e-8, 7.6e-8]);
        p.dither_frequency_hz = DITHER_HZ;
        p.dither_amplitude_rad = [DITHER_RAD; 3];
        p.adaptation_time_s = 0.5;
        p.sample_rate_hz = RATE_HZ;
        p.samples_per_output = SAMPLES_PER_OUTPUT;
    })
}

/// The unit at the end of a period.
#[derive(Debug, Clone)]
pub struct Unit {
    random: ChaCha8Rng,
    period: u32,
    case_rad: [f64; 3],
    /// Wandering part of the amplitude \[1\].
    wander: [f64; 3],
    pulses: [i64; 3],
}

impl Unit {
    /// Makes the unit before its first period.
    pub fn new(seed: u64) -> Self {
        Self {
            random: ChaCha8Rng::seed_from_u64(seed),
            period: 0,
            case_rad: [0.0; 3],
            wander: [0.0; 3],
            pulses: [0; 3],
        }
    }

    /// Advances one period, with this share of each block's amplitude at its end.
    pub fn step(&mut self, amplitude_share: [f64; 3]) -> Sample {
        self.period += 1;
        let time_s = f64::from(self.period) / RATE_HZ;
        let mut sample = Sample::default();
        for axis in 0..3 {
            let phase = std::f64::consts::TAU * SWING_HZ * time_s + axis as f64;
            self.case_rad[axis] += (STEADY_RAD_S[axis] + SWING_RAD_S * phase.sin()) / RATE_HZ;
            // A walk of 1 % a period: the amplitude changes over tens of milliseconds, as real ones do.
            let step = self.random.random_range(-0.01..0.01);
            self.wander[axis] = (self.wander[axis] + step).clamp(-WANDER, WANDER);
            let amplitude_rad = DITHER_RAD * (1.0 + self.wander[axis]) * amplitude_share[axis];
            let dither = (std::f64::consts::TAU * DITHER_HZ[axis] * time_s).sin();
            let block_rad = amplitude_rad * dither;
            let pulses = ((self.case_rad[axis] + block_rad) / PULSE_RAD).floor() as i64;
            sample.pulse_counts[axis] = (pulses - self.pulses[axis]) as i32;
            self.pulses[axis] = pulses;
            sample.pickoff_codes[axis] = (block_rad / PICKOFF_RAD).round() as i32;
        }
        sample
    }
}
