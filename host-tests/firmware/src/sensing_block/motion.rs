//! Motions in closed form: a steady rate and sums of sines about the body axes, after a smooth start from rest.

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{NODES, SUBSTEPS, Substep, Vector};

/// Duration of the start \[s\]: long against every period from 10 Hz up and against the ringing of a block.
pub const RAMP_S: f64 = 0.5;

/// One frequency of a body rate \[rad/s\]: sine · sin(2πft) + cosine · cos(2πft).
#[derive(Debug, Clone, Copy)]
pub struct Tone {
    /// Frequency f \[Hz\].
    pub frequency_hz: f64,
    /// Amplitudes of the sine about x, y, z \[rad/s\].
    pub sine: Vector,
    /// Amplitudes of the cosine about x, y, z \[rad/s\].
    pub cosine: Vector,
}

impl Tone {
    /// Amplitudes \[rad/s\] and phases \[rad\] about x, y, z: amplitude · sin(2πft + phase).
    pub fn new(frequency_hz: f64, amplitude_rad_s: Vector, phase_rad: Vector) -> Self {
        Self {
            frequency_hz,
            sine: [0, 1, 2].map(|i| amplitude_rad_s[i] * phase_rad[i].cos()),
            cosine: [0, 1, 2].map(|i| amplitude_rad_s[i] * phase_rad[i].sin()),
        }
    }
}

/// Phases of a random vibration's three axes at one frequency.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phases {
    /// The same about all axes, either sign about each: a table skew to the axes. No pair of axes encloses an area.
    Common,
    /// The phase rises by 60° from x to y to z: each pair encloses an area of the same sense at every frequency.
    Turning,
    /// Independent about each axis.
    Independent,
}

/// A body rate, known at every time.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Steady rate about body axes \[rad/s\].
    pub steady_rad_s: Vector,
    /// The oscillations.
    pub tones: Vec<Tone>,
    /// Time over which all of it rises from zero, as (1 − cos πt/ramp)/2 \[s\]; 0: at once.
    pub ramp_s: f64,
}

impl Motion {
    /// These tones, from rest.
    pub fn of(tones: Vec<Tone>) -> Self {
        Self {
            steady_rad_s: [0.0; 3],
            tones,
            ramp_s: RAMP_S,
        }
    }

    /// A rate vector of constant size \[rad/s\] that turns about body axis `axis`, in the positive sense.
    pub fn coning(axis: usize, frequency_hz: f64, rate_rad_s: f64) -> Self {
        let (mut sine, mut cosine) = ([0.0; 3], [0.0; 3]);
        cosine[(axis + 1) % 3] = rate_rad_s;
        sine[(axis + 2) % 3] = rate_rad_s;
        Self::of(vec![Tone {
            frequency_hz,
            sine,
            cosine,
        }])
    }

    /// Coning about x whose attitude is a rotation vector φ (0, cos Ωt, sin Ωt) exactly; without a start.
    pub fn exact_coning(frequency_hz: f64, angle_rad: f64) -> Self {
        let omega = TAU * frequency_hz;
        let side = omega * angle_rad.sin();
        Self {
            steady_rad_s: [-omega * (1.0 - angle_rad.cos()), 0.0, 0.0],
            tones: vec![Tone {
                frequency_hz,
                sine: [0.0, -side, 0.0],
                cosine: [0.0, 0.0, side],
            }],
            ramp_s: 0.0,
        }
    }

    /// Vibration with the same phase about all axes, amplitudes \[rad/s\].
    pub fn in_phase(frequency_hz: f64, amplitude_rad_s: Vector) -> Self {
        Self::elliptical(frequency_hz, amplitude_rad_s, [0.0; 3])
    }

    /// Vibration at one frequency with amplitudes \[rad/s\] and phases \[rad\].
    pub fn elliptical(frequency_hz: f64, amplitude_rad_s: Vector, phase_rad: Vector) -> Self {
        Self::of(vec![Tone::new(frequency_hz, amplitude_rad_s, phase_rad)])
    }

    /// Random vibration about three axes: `count` sines of equal power within `band_hz`, spaced at golden-ratio
    /// irregularity, so that no two frequencies are commensurate; `rms_rad_s` about each axis.
    pub fn random(
        band_hz: (f64, f64),
        rms_rad_s: f64,
        count: usize,
        phases: Phases,
        seed: u64,
    ) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let golden = (5f64.sqrt() - 1.0) / 2.0;
        let amplitude = rms_rad_s * (2.0 / count as f64).sqrt();
        let tones = (0..count).map(|k| {
            // Within the middle half of its own share of the band: two tones are at least half a share apart.
            let place = k as f64 + 0.25 + 0.5 * ((k + 1) as f64 * golden).fract();
            let frequency_hz = band_hz.0 + (band_hz.1 - band_hz.0) * place / count as f64;
            let mut phase = || TAU * random.random::<f64>();
            let base = phase();
            let phase_rad = match phases {
                Phases::Common => [0.0; 3].map(|_| base + if phase() < PI { 0.0 } else { PI }),
                Phases::Turning => [base, base + PI / 3.0, base + 2.0 * PI / 3.0],
                Phases::Independent => [base, phase(), phase()],
            };
            Tone::new(frequency_hz, [amplitude; 3], phase_rad)
        });
        Self::of(tones.collect())
    }

    /// A steady spin about `spin_axis` at `frequency_hz` turns a second (either sign), and an oscillation at the same
    /// frequency about `axis`: rate_rad_s · sin(2π|f|t + phase_rad).
    pub fn spin_synchronous(
        spin_axis: usize,
        axis: usize,
        frequency_hz: f64,
        rate_rad_s: f64,
        phase_rad: f64,
    ) -> Self {
        let mut amplitude_rad_s = [0.0; 3];
        amplitude_rad_s[axis] = rate_rad_s;
        let mut motion = Self::elliptical(frequency_hz.abs(), amplitude_rad_s, [phase_rad; 3]);
        motion.steady_rad_s[spin_axis] = TAU * frequency_hz;
        motion
    }

    /// The same with a steady rate added \[rad/s\].
    #[must_use]
    pub fn with_slew(mut self, rate_rad_s: Vector) -> Self {
        for (steady, rate) in self.steady_rad_s.iter_mut().zip(rate_rad_s) {
            *steady += rate;
        }
        self
    }

    /// Period of the slowest oscillation \[s\]; 1 without any.
    pub fn period_s(&self) -> f64 {
        let lowest =
            (self.tones.iter()).fold(f64::INFINITY, |low, tone| low.min(tone.frequency_hz));
        if lowest.is_finite() {
            1.0 / lowest
        } else {
            1.0
        }
    }

    /// Share of the motion at time t \[1\] and its derivative \[1/s\].
    fn share(&self, t: f64) -> (f64, f64) {
        if t >= self.ramp_s {
            return (1.0, 0.0);
        }
        let (sin, cos) = (PI * t / self.ramp_s).sin_cos();
        (0.5 * (1.0 - cos), 0.5 * PI / self.ramp_s * sin)
    }
}

/// The motion on the nodes of successive sampling periods.
pub(super) struct Grid<'a> {
    motion: &'a Motion,
    period_s: f64,
    /// Number of the next period.
    period: usize,
    /// Offsets of the nodes from a period's start \[s\].
    offsets_s: Vec<f64>,
    /// Sine and cosine by which each tone's phase advances to each node; tone by tone.
    advances: Vec<(f64, f64)>,
    substeps: Vec<Substep>,
}

impl<'a> Grid<'a> {
    pub(super) fn new(motion: &'a Motion, period_s: f64) -> Self {
        let step_s = period_s / SUBSTEPS as f64;
        let offsets_s: Vec<_> = (0..SUBSTEPS)
            .flat_map(|step| NODES.map(|node| (step as f64 + node) * step_s))
            .collect();
        let advances = (motion.tones.iter())
            .flat_map(|tone| {
                offsets_s
                    .iter()
                    .map(|t| (TAU * tone.frequency_hz * t).sin_cos())
            })
            .collect();
        Self {
            motion,
            period_s,
            period: 0,
            offsets_s,
            advances,
            substeps: vec![Substep::default(); SUBSTEPS],
        }
    }

    /// Rates and accelerations at the nodes of the next period.
    pub(super) fn next_period(&mut self) -> &[Substep] {
        let start_s = self.period as f64 * self.period_s;
        self.period += 1;
        for substep in &mut self.substeps {
            substep.rate = [self.motion.steady_rad_s; 3];
            substep.acceleration = [[0.0; 3]; 3];
        }
        let nodes = self.offsets_s.len();
        for (tone, advances) in (self.motion.tones.iter()).zip(self.advances.chunks(nodes)) {
            let omega = TAU * tone.frequency_hz;
            let (sin_start, cos_start) = (TAU * (tone.frequency_hz * start_s).fract()).sin_cos();
            for (node, (sin, cos)) in advances.iter().enumerate() {
                let (sin, cos) = (
                    sin_start * cos + cos_start * sin,
                    cos_start * cos - sin_start * sin,
                );
                let substep = &mut self.substeps[node / NODES.len()];
                let rate = &mut substep.rate[node % NODES.len()];
                let acceleration = &mut substep.acceleration[node % NODES.len()];
                for i in 0..3 {
                    rate[i] += tone.sine[i] * sin + tone.cosine[i] * cos;
                    acceleration[i] += omega * (tone.sine[i] * cos - tone.cosine[i] * sin);
                }
            }
        }
        if start_s < self.motion.ramp_s {
            for (node, offset_s) in self.offsets_s.iter().enumerate() {
                let (share, slope) = self.motion.share(start_s + offset_s);
                let substep = &mut self.substeps[node / NODES.len()];
                let rate = &mut substep.rate[node % NODES.len()];
                let acceleration = &mut substep.acceleration[node % NODES.len()];
                for i in 0..3 {
                    acceleration[i] = share * acceleration[i] + slope * rate[i];
                    rate[i] *= share;
                }
            }
        }
        &self.substeps
    }
}
