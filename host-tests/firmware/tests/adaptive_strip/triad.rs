//! A dithered triad in closed form: its counts and pickoff codes, sample by sample.
//!
//! From the real motion of blocks and pickoffs it makes samples. Units are rad and s, axes those of the body; nothing
//! is copied from the chain.

use std::f64::consts::TAU;

use trueaxis::{Parameters, Sample};

/// 1″ \[rad\].
pub const ARCSEC: f64 = 4.848_136_811e-6;

/// 1 °/h \[rad/s\].
pub const DEG_H: f64 = ARCSEC;

/// Pickoff codes of 2⁻³² rad.
const CODES_PER_RAD: f64 = (1u64 << 32) as f64;

/// The true triad.
#[derive(Debug, Clone, Copy)]
pub struct Triad {
    /// Block angle over pickoff angle.
    pub gain: [f64; 3],
    /// The pickoff shows the block this late \[s\].
    pub delay_s: [f64; 3],
    /// Pickoff angles at rest \[rad\].
    pub offset_rad: [f64; 3],
    pub frequency_hz: [f64; 3],
    pub amplitude_rad: [f64; 3],
    pub pulse_rad: f64,
    /// Coning about x: frequency \[Hz\] and half angle \[rad\].
    pub coning: (f64, f64),
    pub seed: u64,
}

impl Default for Triad {
    fn default() -> Self {
        Self {
            gain: [1.0; 3],
            delay_s: [0.0; 3],
            offset_rad: [3e-4, -2e-4, 1e-4],
            frequency_hz: [371.3, 403.9, 438.7],
            amplitude_rad: [150.0 * ARCSEC; 3],
            pulse_rad: 0.8 * ARCSEC,
            coning: (15.0, 0.367f64.to_radians()),
            seed: 1,
        }
    }
}

impl Triad {
    /// Nominal parameters that know the frequencies, amplitudes and pulses, and nothing of gain and delay.
    pub fn parameters(&self) -> Parameters {
        Parameters::default().with(|p| {
            p.pulse_weight_rad = [self.pulse_rad; 3];
            p.pickoff_weight_rad = 1.0 / CODES_PER_RAD;
            p.dither_frequency_hz = self.frequency_hz;
            p.dither_amplitude_rad = self.amplitude_rad;
            p.samples_per_output = 10;
        })
    }

    /// The same with the true gain and delay.
    pub fn known(&self) -> Parameters {
        self.parameters().with(|p| {
            p.pickoff_gain = self.gain;
            p.pickoff_delay_s = self.delay_s;
        })
    }

    /// The case's angles at t \[rad\]: coning about x and the cone's own turn.
    fn case_rad(&self, t: f64) -> [f64; 3] {
        let (cone_hz, cone_rad) = self.coning;
        let turned = TAU * cone_hz * t;
        [
            -TAU * cone_hz * (1.0 - cone_rad.cos()) * t,
            cone_rad.sin() * turned.cos(),
            cone_rad.sin() * turned.sin(),
        ]
    }

    /// Its samples, without end.
    pub fn stream(self) -> Stream {
        Stream {
            triad: self,
            period: 0,
            random: self.seed,
            wander: [[0.0; 2]; 3],
            pulses: self
                .case_rad(0.0)
                .map(|angle| (angle / self.pulse_rad).floor() as i64),
        }
    }
}

/// Samples one after the other.
pub struct Stream {
    triad: Triad,
    period: u64,
    random: u64,
    /// Amplitude modulation: a slow random walk and its value a period before.
    wander: [[f64; 2]; 3],
    pulses: [i64; 3],
}

impl Stream {
    /// Uniform in ±1 (splitmix64).
    fn noise(&mut self) -> f64 {
        self.random = self.random.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.random;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) as i64 as f64 / i64::MAX as f64
    }
}

impl Iterator for Stream {
    type Item = Sample;

    fn next(&mut self) -> Option<Sample> {
        const PERIOD_S: f64 = 1.0 / 4000.0;
        self.period += 1;
        let t = self.period as f64 * PERIOD_S;
        // Noise kicks an amplitude that forgets in 20 ms: some 10 % of the amplitude, as drives randomise.
        for axis in 0..3 {
            let kick = 0.02 * self.noise();
            let [now, _] = self.wander[axis];
            self.wander[axis] = [now * (1.0 - PERIOD_S / 0.02) + kick, now];
        }
        let triad = &self.triad;
        let case_rad = triad.case_rad(t);
        let mut sample = Sample::default();
        for (axis, case_rad) in case_rad.iter().enumerate() {
            let [now, before] = self.wander[axis];
            let omega = TAU * triad.frequency_hz[axis];
            let block = |late_s: f64| {
                let modulation = now + (before - now) * late_s / PERIOD_S;
                triad.amplitude_rad[axis] * (1.0 + modulation) * (omega * (t - late_s)).sin()
            };
            let angle = case_rad + block(0.0);
            let total = (angle / triad.pulse_rad).floor() as i64;
            sample.pulse_counts[axis] = (total - self.pulses[axis]) as i32;
            self.pulses[axis] = total;
            let shown = block(triad.delay_s[axis]) / triad.gain[axis] + triad.offset_rad[axis];
            sample.pickoff_codes[axis] = (shown * CODES_PER_RAD).round() as i32;
        }
        Some(sample)
    }
}
