//! Quantisation and noise: from true angles to recorded values.
//!
//! From the true increments (rad, rad/s) of one row: pulse counts, quantised angles and quantised samples, each with its
//! noise.
//!
//! Equations: a counter stores ⌊Φ_k/w⌋ − ⌊Φ_{k−1}/w⌋ of the running angle Φ; an encoder stores round(Ψ_k/w) −
//! round(Ψ_{k−1}/w) of the running angle with its white noise. Both telescope: the sum of counts is the angle within one
//! pulse at any length.
//!
//! Assumes Gaussian white noise; each instrument draws from its own stream, so that switching one effect on leaves every
//! other draw unchanged.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Independent random streams of a simulation; the number is the ChaCha stream.
#[derive(Debug, Clone, Copy)]
pub enum Stream {
    /// Tones of vibrations.
    Motion = 0,
    /// Amplitudes and phases of the dithers; one stream a gyro.
    Dither = 10,
    /// Angle random walk and first pulse phase of the gyros.
    Gyro = 20,
    /// Pickoff noise.
    Pickoff = 30,
    /// Reference noise.
    Reference = 40,
    /// Accelerometer noise.
    Accelerometer = 50,
    /// Phase of the backscatter behind lock-in.
    LockIn = 60,
    /// Noise of a fibre-optic gyro.
    FibreOptic = 70,
    /// Noise of a table's encoders.
    Encoder = 80,
    /// Noise of thermometers.
    Thermometer = 90,
    /// Noise of magnetometers.
    Magnetometer = 100,
    /// Initial phase inside a coarser pulse.
    Converter = 110,
    /// Noise of laser intensities.
    Intensity = 120,
    /// Noise of the drives of path-length controls.
    PathLength = 130,
    /// Noise of dither drives.
    DitherDrive = 140,
}

/// Seeds of a simulation, one for the motion and one for the instrument noise; usually the same number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seeds {
    /// Seed of vibrations, dithers and the phase of the backscatter, which a noise-free recording contains too.
    pub motion: u64,
    /// Seed of every other stream.
    pub noise: u64,
}

impl From<u64> for Seeds {
    fn from(seed: u64) -> Self {
        Self {
            motion: seed,
            noise: seed,
        }
    }
}

/// Generator of one stream for one axis.
pub fn stream(seeds: impl Into<Seeds>, stream: Stream, axis: usize) -> ChaCha8Rng {
    let seeds = seeds.into();
    let seed = match stream {
        Stream::Motion | Stream::Dither | Stream::LockIn => seeds.motion,
        _ => seeds.noise,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream as u64 + axis as u64);
    rng
}

/// Draws a standard normal number.
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(StandardNormal)
}

/// Pulse counter of a running angle.
#[derive(Debug, Clone)]
pub struct PulseCounter {
    weight_rad: f64,
    /// Angle since the start of the current pulse: the running angle itself would lose digits.
    angle_rad: f64,
}

impl PulseCounter {
    /// Starts the counter at a random place inside a pulse.
    pub fn new(weight_rad: f64, rng: &mut ChaCha8Rng) -> Self {
        Self {
            weight_rad,
            angle_rad: rng.random::<f64>() * weight_rad,
        }
    }

    /// Number of pulses completed by `increment_rad`.
    pub fn count(&mut self, increment_rad: f64) -> f64 {
        self.angle_rad += increment_rad;
        let pulses = (self.angle_rad / self.weight_rad).floor();
        self.angle_rad -= pulses * self.weight_rad;
        pulses
    }
}

/// Encoder of a running angle, with white noise and a random walk, in steps of its weight.
#[derive(Debug, Clone)]
pub struct AngleEncoder {
    weight_rad: f64,
    noise_rad: f64,
    walk_rad: f64,
    /// Running angle less the stored steps \[rad\].
    remainder_rad: f64,
    rng: ChaCha8Rng,
}

impl AngleEncoder {
    /// `walk_rad`: standard deviation of the random walk per row.
    pub fn new(weight_rad: f64, noise_rad: f64, walk_rad: f64, mut rng: ChaCha8Rng) -> Self {
        // the row before the first has noise too
        let first = noise_rad * normal(&mut rng);
        Self {
            weight_rad,
            noise_rad,
            walk_rad,
            remainder_rad: -(first / weight_rad).round() * weight_rad,
            rng,
        }
    }

    /// Steps between this sample and the last.
    pub fn step(&mut self, increment_rad: f64) -> f64 {
        self.remainder_rad += increment_rad + self.walk_rad * normal(&mut self.rng);
        let seen = self.remainder_rad + self.noise_rad * normal(&mut self.rng);
        let steps = (seen / self.weight_rad).round();
        self.remainder_rad -= steps * self.weight_rad;
        steps
    }
}
