//! Slow channels of the unit's health: laser intensity, path-length control, dither drive, time since a pulse per second.
//!
//! From the time since the start in s and the warming of each block in K, one row of [`SlowChannels`], in the order of the
//! table's columns. Resolutions are those of the counter bank's slow channels.
//!
//! Equations: intensity I_i = I_0i e^{−(t − t_d)/τ} after a laser begins to die. Drive of the path-length control
//! d_i = d_0i + k_i ΔT_i + hops: the mirror follows the block's length. Where |d_i| would exceed its end the control resets: it
//! moves towards the middle by whole modes until it is inside, and its count grows. A stamp is ⌊(t − t_pulse)(1 + c)/r⌋ r with c the
//! deviation of the unit's clock and r its resolution.
//!
//! Out of scope: pulses of a laser too dim for its counter, and rates while a control moves to another mode.

use super::instrument::{Seeds, Stream, normal, stream};
use super::unit_faults::UnitFaults;
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

/// Resolution of an intensity and of a dither drive \[1\].
pub const NOMINAL_WEIGHT: f64 = 1.0 / 16384.0;

/// Resolution of a path-length control's drive \[1\].
pub const DRIVE_WEIGHT: f64 = 1.0 / 32768.0;

/// Resolution of a time since a pulse \[s\].
pub const STAMP_WEIGHT_S: f64 = 1.0 / 16e6;

/// Longest time since a pulse that a stamp holds \[s\].
const LONGEST_STAMP_S: f64 = (0xFF_FFFE as f64) * STAMP_WEIGHT_S;

/// Largest code of a channel, at either end.
const LARGEST_CODE: f64 = 32767.0;

/// `[slow_channels]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlowChannelsEntry {
    /// Sample rate \[Hz\].
    pub rate_hz: f64,
    /// I_0i: intensity over nominal \[1\].
    pub intensity: [f64; 3],
    /// White noise of an intensity \[1\].
    pub intensity_noise: f64,
    /// d_0i: drive of the path-length control over its range \[1\].
    pub path_length_drive: [f64; 3],
    /// k_i: change of that drive with the block's temperature \[1/K\].
    pub path_length_drive_k: [f64; 3],
    /// White noise of that drive \[1\].
    pub path_length_noise: f64,
    /// Change of that drive from one mode of the laser to the next \[1\].
    pub path_length_mode: f64,
    /// Drive beyond which the control resets \[1\].
    pub path_length_end: f64,
    /// Dither drive over nominal \[1\].
    pub dither_drive: [f64; 3],
    /// White noise of a dither drive \[1\].
    pub dither_drive_noise: f64,
    /// The pulse per second; `None`: none is connected.
    pub pulse: Option<PulseEntry>,
}

/// Pulse per second, and the clock that measures it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulseEntry {
    /// First pulse after the start \[s\].
    pub first_s: f64,
    /// c: deviation of the unit's clock \[1\].
    pub clock_error: f64,
}

/// Slow channels and their states.
pub struct SlowChannels<'a> {
    entry: &'a SlowChannelsEntry,
    faults: &'a UnitFaults,
    start_s: f64,
    intensity_rngs: Vec<ChaCha8Rng>,
    drive_rngs: Vec<ChaCha8Rng>,
    dither_rngs: Vec<ChaCha8Rng>,
    /// Whole modes that a control has moved back by.
    modes: [f64; 3],
    resets: [f64; 3],
    /// Resets that faults have demanded so far.
    demanded: [usize; 3],
}

impl<'a> SlowChannels<'a> {
    /// Channels before the first row, which begins at `start_s`.
    pub fn new(
        entry: &'a SlowChannelsEntry,
        faults: &'a UnitFaults,
        start_s: f64,
        seeds: Seeds,
    ) -> Self {
        let rngs = |of| (0..3).map(|axis| stream(seeds, of, axis)).collect();
        Self {
            entry,
            faults,
            start_s,
            intensity_rngs: rngs(Stream::Intensity),
            drive_rngs: rngs(Stream::PathLength),
            dither_rngs: rngs(Stream::DitherDrive),
            modes: [0.0; 3],
            resets: [0.0; 3],
            demanded: [0; 3],
        }
    }

    /// Appends the row that ends at `end_s`, in the order of the columns.
    pub fn read(&mut self, end_s: f64, warming_k: &Vector3<f64>, row: &mut Vec<f64>) {
        let entry = self.entry;
        for (axis, rng) in self.intensity_rngs.iter_mut().enumerate() {
            let left = self.faults.intensity_left(axis, end_s);
            let shown = (entry.intensity[axis] + entry.intensity_noise * normal(rng)) * left;
            row.push(coded(shown, NOMINAL_WEIGHT));
        }
        for (axis, warming_k) in warming_k.iter().enumerate() {
            let drive = self.drive(axis, end_s, *warming_k);
            row.push(coded(drive, DRIVE_WEIGHT));
        }
        row.extend(self.resets);
        for (axis, rng) in self.dither_rngs.iter_mut().enumerate() {
            let drive = self.faults.dither_drive(axis, end_s);
            let drive = drive.unwrap_or(entry.dither_drive[axis]);
            let shown = drive + entry.dither_drive_noise * normal(rng);
            row.push(coded(shown, NOMINAL_WEIGHT));
        }
        if let Some(pulse) = &entry.pulse {
            row.push(self.since_pulse_s(pulse, end_s));
        }
    }

    /// Drive of a path-length control, after the resets that it needs.
    fn drive(&mut self, axis: usize, end_s: f64, warming_k: f64) -> f64 {
        let entry = self.entry;
        let free = entry.path_length_drive[axis]
            + entry.path_length_drive_k[axis] * warming_k
            + self.faults.hopped(axis, end_s)
            + entry.path_length_noise * normal(&mut self.drive_rngs[axis]);
        let mode = entry.path_length_mode;
        let demanded = self.faults.resets(axis, end_s);
        for _ in self.demanded[axis]..demanded {
            let before = free - self.modes[axis] * mode;
            self.modes[axis] += if before < 0.0 { -1.0 } else { 1.0 };
            self.resets[axis] += 1.0;
        }
        self.demanded[axis] = demanded;
        let drive = free - self.modes[axis] * mode;
        let beyond = drive.abs() - entry.path_length_end;
        if beyond <= 0.0 {
            return drive;
        }
        let moved = (beyond / mode).ceil() * drive.signum();
        self.modes[axis] += moved;
        self.resets[axis] += 1.0;
        drive - moved * mode
    }

    /// Time since the last pulse by the unit's clock \[s\]; NaN before the first, and beyond the stamp's range.
    fn since_pulse_s(&self, pulse: &PulseEntry, end_s: f64) -> f64 {
        let since_first_s = end_s - self.start_s - pulse.first_s;
        if since_first_s < 0.0 {
            return f64::NAN;
        }
        let mut second = since_first_s.floor();
        while second >= 0.0
            && self
                .faults
                .is_pulse_lost(self.start_s + pulse.first_s + second)
        {
            second -= 1.0;
        }
        let shown_s = (since_first_s - second) * (1.0 + pulse.clock_error);
        let stamp_s = (shown_s / STAMP_WEIGHT_S).floor() * STAMP_WEIGHT_S;
        if second < 0.0 || stamp_s > LONGEST_STAMP_S {
            return f64::NAN;
        }
        stamp_s
    }
}

/// Value in whole codes, held at the code's ends.
fn coded(value: f64, weight: f64) -> f64 {
    (value / weight).round().clamp(-LARGEST_CODE, LARGEST_CODE) * weight
}
