//! The mechanical dither of one block, and its pickoff.
//!
//! Enters: frequency, amplitude, spread; time in s. Leaves: the pickoff angle p(t) in rad, block relative
//! to case, and its reading at a row's end.
//!
//! Equation: p(t) = a_n sin ψ, ψ = 2πft + ψ0, with one amplitude a_n for each half-cycle n = ⌊ψ/π⌋. The
//! amplitude changes where sin ψ = 0, so that the angle is continuous: the drive kicks the block as it
//! passes through rest position. Amplitudes wander as a first-order Gauss–Markov sequence, which is what a
//! resonator of finite Q makes of a random drive; without it lock-in would leave dead bands.
//!
//! Deliberately not here: lock-in itself (`lock_in.rs`), the reaction on the case (`case.rs`), wander of the
//! frequency.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::{PI, TAU};

/// Half-cycles over which the amplitude forgets itself: Q/π for the Q of about 60 that dither springs show.
const AMPLITUDE_MEMORY_HALF_CYCLES: f64 = 20.0;

/// Amplitudes further than this many spreads from the mean are drawn to it: no block stops or hits its stop.
pub const AMPLITUDE_LIMIT_SPREADS: f64 = 3.0;

/// The angle of one dithered block over a whole recording.
#[derive(Debug, Clone)]
pub struct BlockDither {
    frequency_hz: f64,
    phase_rad: f64,
    begin_s: f64,
    amplitudes_rad: Vec<f64>,
}

impl BlockDither {
    /// From `begin_s` for `duration_s`; `spread` is the amplitude's rms deviation over its mean.
    pub fn new(
        frequency_hz: f64,
        amplitude_rad: f64,
        spread: f64,
        begin_s: f64,
        duration_s: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let half_cycles = (2.0 * frequency_hz * duration_s).ceil() as usize + 3;
        let keep = (-1.0 / AMPLITUDE_MEMORY_HALF_CYCLES).exp();
        let drive = (1.0 - keep * keep).sqrt();
        let mut deviation: f64 = rng.sample(StandardNormal);
        let amplitudes_rad = (0..half_cycles)
            .map(|_| {
                let draw: f64 = rng.sample(StandardNormal);
                deviation = keep * deviation + drive * draw;
                let limited = deviation.clamp(-AMPLITUDE_LIMIT_SPREADS, AMPLITUDE_LIMIT_SPREADS);
                amplitude_rad * (1.0 + spread * limited)
            })
            .collect();
        Self {
            frequency_hz,
            phase_rad: rng.random::<f64>() * TAU,
            begin_s,
            amplitudes_rad,
        }
    }

    /// p(t) \[rad\]; before the begin and after the end the outermost amplitude holds.
    pub fn angle_rad(&self, time_s: f64) -> f64 {
        let (amplitude_rad, phase) = self.swing(time_s);
        amplitude_rad * phase.sin()
    }

    /// p(t) and its first three derivatives. The rate steps where the amplitude changes, by that change: what
    /// the derivatives beyond it miss there is the drive's kick.
    pub fn jet_rad(&self, time_s: f64) -> [f64; 4] {
        let (amplitude_rad, phase) = self.swing(time_s);
        let omega = TAU * self.frequency_hz;
        let (sin, cos) = phase.sin_cos();
        [
            amplitude_rad * sin,
            amplitude_rad * omega * cos,
            -amplitude_rad * omega.powi(2) * sin,
            -amplitude_rad * omega.powi(3) * cos,
        ]
    }

    /// Amplitude and phase at an instant \[rad\].
    fn swing(&self, time_s: f64) -> (f64, f64) {
        let phase = TAU * self.frequency_hz * (time_s - self.begin_s) + self.phase_rad;
        let first = (self.phase_rad / PI).floor();
        let half_cycle = ((phase / PI).floor() - first).max(0.0) as usize;
        let last = self.amplitudes_rad.len() - 1;
        (self.amplitudes_rad[half_cycle.min(last)], phase)
    }
}
