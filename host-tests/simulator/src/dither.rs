//! Mechanical dither of one block, and its pickoff.
//!
//! Frequency, amplitude, spread and time in s give the pickoff angle p(t) in rad, block relative to case.
//!
//! Equation: p(t) = a_n sin ψ, ψ = 2πft + ψ0, with one amplitude a_n for each half-cycle n = ⌊ψ/π⌋. The amplitude changes
//! at sin ψ = 0, so that the angle is continuous: the drive kicks the block at its rest position. Amplitudes are a
//! first-order Gauss–Markov sequence, the response of a resonator of finite Q to a random drive; without it lock-in would
//! leave dead bands.
//!
//! Out of scope: lock-in (`lock_in.rs`), the reaction on the case (`case.rs`), drift of the frequency.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};

/// Correlation length of the amplitude \[half-cycles\]: Q/π for the Q of about 60 of dither springs.
const AMPLITUDE_MEMORY_HALF_CYCLES: f64 = 20.0;

/// Limit of the amplitude's deviation in spreads: no block stops or hits its stop.
pub const AMPLITUDE_LIMIT_SPREADS: f64 = 3.0;

/// Time for which past amplitudes are kept \[s\]: pickoffs and gyros may be a tenth of a second late, and early instruments
/// run a tenth of a second before them.
const KEPT_S: f64 = 0.5;

/// Angle of one dithered block, up to the instant of the last [`BlockDither::reach`].
#[derive(Debug, Clone)]
pub struct BlockDither {
    frequency_hz: f64,
    phase_rad: f64,
    begin_s: f64,
    mean_rad: f64,
    spread: f64,
    rng: ChaCha8Rng,
    deviation: f64,
    /// Half-cycles still to be drawn.
    left: usize,
    /// Number of the first half-cycle in `amplitudes_rad`.
    first: usize,
    amplitudes_rad: VecDeque<f64>,
    /// Stretches with another amplitude: begin, end \[s\], factor.
    factors: Vec<[f64; 3]>,
}

impl BlockDither {
    /// Dither from `begin_s` for `duration_s`; `spread` is the amplitude's rms deviation over its mean.
    pub fn new(
        frequency_hz: f64,
        amplitude_rad: f64,
        spread: f64,
        begin_s: f64,
        duration_s: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let half_cycles = (2.0 * frequency_hz * duration_s).ceil() as usize + 3;
        let amplitudes = rng.clone();
        // the phase is drawn after all amplitudes: they are drawn twice rather than kept
        for _ in 0..=half_cycles {
            let _: f64 = rng.sample(StandardNormal);
        }
        let phase_rad = rng.random::<f64>() * TAU;
        let mut dither = Self {
            frequency_hz,
            phase_rad,
            begin_s,
            mean_rad: amplitude_rad,
            spread,
            rng: amplitudes,
            deviation: 0.0,
            left: half_cycles,
            first: 0,
            amplitudes_rad: VecDeque::new(),
            factors: Vec::new(),
        };
        dither.deviation = dither.rng.sample(StandardNormal);
        dither.reach(begin_s);
        dither
    }

    /// Multiplies the amplitude of the half-cycles that begin in each of some stretches, \[start, end) and factor.
    #[must_use]
    pub fn with_factors(mut self, factors: Vec<[f64; 3]>) -> Self {
        self.factors = factors;
        self
    }

    /// Draws the amplitudes until `time_s`; drops those more than `KEPT_S` before it.
    pub fn reach(&mut self, time_s: f64) {
        let keep = (-1.0 / AMPLITUDE_MEMORY_HALF_CYCLES).exp();
        let drive = (1.0 - keep * keep).sqrt();
        // one more than required: rounding may put the instant beyond the next crossing
        let wanted = self.half_cycle(time_s) + 2;
        while self.first + self.amplitudes_rad.len() < wanted && self.left > 0 {
            let draw: f64 = self.rng.sample(StandardNormal);
            self.deviation = keep * self.deviation + drive * draw;
            let limited = self
                .deviation
                .clamp(-AMPLITUDE_LIMIT_SPREADS, AMPLITUDE_LIMIT_SPREADS);
            self.amplitudes_rad
                .push_back(self.mean_rad * (1.0 + self.spread * limited));
            self.left -= 1;
        }
        let oldest = self.half_cycle(time_s - KEPT_S);
        while self.first < oldest && self.amplitudes_rad.len() > 1 {
            self.amplitudes_rad.pop_front();
            self.first += 1;
        }
    }

    /// p(t) \[rad\], up to the last reach; before the start and after the end the outermost amplitude holds.
    pub fn angle_rad(&self, time_s: f64) -> f64 {
        let (amplitude_rad, phase) = self.swing(time_s);
        amplitude_rad * phase.sin()
    }

    /// p(t) and its first three derivatives. The rate steps with the amplitude; the higher derivatives omit that step, the
    /// kick of the drive.
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

    fn phase(&self, time_s: f64) -> f64 {
        TAU * self.frequency_hz * (time_s - self.begin_s) + self.phase_rad
    }

    /// Number of the half-cycle at an instant.
    fn half_cycle(&self, time_s: f64) -> usize {
        let first = (self.phase_rad / PI).floor();
        ((self.phase(time_s) / PI).floor() - first).max(0.0) as usize
    }

    /// Amplitude and phase at an instant \[rad\].
    fn swing(&self, time_s: f64) -> (f64, f64) {
        let place = self.half_cycle(time_s).saturating_sub(self.first);
        let last = self.amplitudes_rad.len() - 1;
        debug_assert!(place <= last || self.left == 0, "not reached yet");
        let amplitude_rad = self.amplitudes_rad[place.min(last)] * self.factor(time_s);
        (amplitude_rad, self.phase(time_s))
    }

    /// Factor of the amplitude in the half-cycle of an instant.
    fn factor(&self, time_s: f64) -> f64 {
        if self.factors.is_empty() {
            return 1.0;
        }
        // The half-cycle's begin, at which the angle is 0.
        let since_begin = self.phase(time_s).rem_euclid(PI) / (TAU * self.frequency_hz);
        let begin_s = time_s - since_begin;
        let stands = |[start_s, end_s, _]: &&[f64; 3]| (*start_s..*end_s).contains(&begin_s);
        let factors = self.factors.iter().filter(stands);
        factors.map(|[.., factor]| factor).product()
    }
}
