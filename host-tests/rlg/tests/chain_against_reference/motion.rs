//! Motions of the case as exact increments: the counts of an error-free gyro triad.

use crate::PERIOD_S;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Increments of the case over period k \[rad\], body frame; with `flexure_s2` those sensed by flexed axes.
pub trait Motion {
    fn sensed(&mut self, k: usize) -> Vector3<f64>;
}

/// Rotation vector φ (0, cos Ωt, sin Ωt): coning about x. ω = Ω (−(1 − cos φ), −sin φ sin Ωt, sin φ cos Ωt).
#[derive(Debug, Clone, Copy)]
pub struct Coning {
    pub frequency_hz: f64,
    pub angle_rad: f64,
    /// xy, xz, yx, yz, zx, zy \[s²\]: tilts δ_ij = −K_ij α_j of the sensing axes.
    pub flexure_s2: [f64; 6],
}

impl Coning {
    pub fn omega(&self) -> f64 {
        TAU * self.frequency_hz
    }

    /// The case's rotation without flexure.
    pub fn case(&self, k: usize) -> Vector3<f64> {
        let rigid = Self {
            flexure_s2: [0.0; 6],
            ..*self
        };
        rigid.increment(k)
    }

    /// Closed form: integrals of products of one sine and one cosine.
    fn increment(&self, k: usize) -> Vector3<f64> {
        let omega = self.omega();
        let (begin, end) = (k as f64 * PERIOD_S, (k + 1) as f64 * PERIOD_S);
        let ((s0, c0), (s1, c1)) = ((omega * begin).sin_cos(), (omega * end).sin_cos());
        let side = self.angle_rad.sin();
        let along_rate = -omega * (1.0 - self.angle_rad.cos());
        let along = along_rate * PERIOD_S;
        // ω_y, ω_z
        let (y, z) = (side * (c1 - c0), side * (s1 - s0));
        let [xy, xz, _, yz, _, zy] = self.flexure_s2;
        // ∫ sin² and ∫ cos²
        let wave = (s1 * c1 - s0 * c0) / (2.0 * omega);
        let (sin2, cos2) = (0.5 * PERIOD_S - wave, 0.5 * PERIOD_S + wave);
        let squared = omega * (omega * side).powi(2);
        // gyro x senses an additional δ_xz ω_y − δ_xy ω_z, and cyclically; α_y = −Ω² sin φ cos Ωt, α_z likewise sin
        Vector3::new(
            along - squared * (xz * sin2 + xy * cos2),
            y + yz * omega * along_rate * y,
            z + zy * omega * along_rate * z,
        )
    }
}

impl Motion for Coning {
    fn sensed(&mut self, k: usize) -> Vector3<f64> {
        self.increment(k)
    }
}

/// Random angular vibration: tones of 5 to 500 Hz, about 5 °/s rms an axis. Each is on all axes, at random phases, so that
/// it rectifies as coning does.
#[derive(Debug, Clone)]
pub struct Vibration {
    /// Current angle phasor and its rotation per period: cos, sin.
    tones: Vec<Tone>,
}

#[derive(Debug, Clone, Copy)]
struct Tone {
    axis: usize,
    amplitude_rad: f64,
    now: [f64; 2],
    turn: [f64; 2],
}

const TONES: usize = 24;

impl Vibration {
    pub fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let rms_rad_s = 5.0_f64.to_radians();
        let mut tones = Vec::new();
        let rate_rad_s = rms_rad_s * (2.0 / TONES as f64).sqrt();
        for _ in 0..TONES {
            let omega = TAU * 5.0 * 100.0_f64.powf(rng.random::<f64>());
            let (turn_sin, turn_cos) = (omega * PERIOD_S).sin_cos();
            for axis in 0..3 {
                let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
                tones.push(Tone {
                    axis,
                    amplitude_rad: rate_rad_s / omega,
                    now: [cos, sin],
                    turn: [turn_cos, turn_sin],
                });
            }
        }
        Self { tones }
    }
}

impl Motion for Vibration {
    fn sensed(&mut self, _: usize) -> Vector3<f64> {
        let mut increment = Vector3::zeros();
        for tone in &mut self.tones {
            let [cos, sin] = tone.now;
            let [turn_cos, turn_sin] = tone.turn;
            let next = [
                cos * turn_cos - sin * turn_sin,
                sin * turn_cos + cos * turn_sin,
            ];
            increment[tone.axis] += tone.amplitude_rad * (next[1] - sin);
            tone.now = next;
        }
        increment
    }
}

/// Sum of two motions: their rates add.
pub struct Both<A, B>(pub A, pub B);

impl<A: Motion, B: Motion> Motion for Both<A, B> {
    fn sensed(&mut self, k: usize) -> Vector3<f64> {
        self.0.sensed(k) + self.1.sensed(k)
    }
}

/// A constant rate \[rad/s\].
#[derive(Debug, Clone, Copy)]
pub struct Slew(pub [f64; 3]);

impl Motion for Slew {
    fn sensed(&mut self, _: usize) -> Vector3<f64> {
        Vector3::from(self.0) * PERIOD_S
    }
}
