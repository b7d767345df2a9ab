//! Settings: instruments, noise and length of a recording, drawn.

use std::f64::consts::PI;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_recording::error::InputError;
use serde::{Deserialize, Serialize};

use super::noise::{Drift, Levels};

/// Range of the drawn strengths: matched-filter SNR.
const STRENGTHS: [f64; 2] = [10.0, 30.0];

/// Rates of ordinary recorders \[Hz\].
pub const RATES_HZ: [f64; 6] = [50.0, 100.0, 200.0, 400.0, 1000.0, 4000.0];

/// Limits of the drawn recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Shortest and longest \[s\].
    pub length_s: [f64; 2],
    /// Largest number of rows: a shorter length is drawn for a high rate.
    pub most_rows: f64,
    /// Largest factor by which the declared noise of the reference is wrong, either way.
    pub declared_within: f64,
}

/// Motion of the case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionKind {
    /// A rate table's sine about one axis.
    SineOneAxis,
    /// Sines about two axes, each with its own frequency.
    SineTwoAxes,
    /// Sines about three axes.
    SineThreeAxes,
    /// A table with alternating dwells and rotations.
    Steps,
    /// Linear frequency sweeps.
    Sweep,
    /// Roll, pitch and yaw in a seaway.
    Ship,
    /// Turns, and vibration of the road.
    Vehicle,
    /// Slow turns in turbulence.
    Aircraft,
    /// A slow cone.
    SlowConing,
    /// Wide-band, and barely above the reference's noise.
    Weak,
}

/// All motions.
pub const MOTIONS: [MotionKind; 10] = [
    MotionKind::SineOneAxis,
    MotionKind::SineTwoAxes,
    MotionKind::SineThreeAxes,
    MotionKind::Steps,
    MotionKind::Sweep,
    MotionKind::Ship,
    MotionKind::Vehicle,
    MotionKind::Aircraft,
    MotionKind::SlowConing,
    MotionKind::Weak,
];

/// Reference of the case's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReferenceKind {
    /// An encoder of 1e-7 rad.
    FineEncoder,
    /// An encoder of 1e-5 rad.
    CoarseEncoder,
    /// A fibre-optic gyro, with angle random walk.
    FibreOptic,
    /// A gyro like those under test.
    LikeGyro,
}

const REFERENCES: [ReferenceKind; 4] = [
    ReferenceKind::FineEncoder,
    ReferenceKind::CoarseEncoder,
    ReferenceKind::FibreOptic,
    ReferenceKind::LikeGyro,
];

/// Drawn setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// Motion of the case.
    pub motion: MotionKind,
    /// Reference of the motion.
    pub reference: ReferenceKind,
    /// Row rate \[Hz\].
    pub rate_hz: f64,
    /// Number of rows.
    pub rows: usize,
    /// Drift of the gyros.
    pub drift: Drift,
    /// Angle random walk of the gyros \[rad/√s\].
    pub gyro_walk_rad_sqrt_s: [f64; 3],
    /// Pulse weight of the gyros \[rad\].
    pub pulse_rad: f64,
    /// Angle random walk of the reference \[rad/√s\].
    pub reference_walk_rad_sqrt_s: f64,
    /// White angle noise of the reference \[rad\].
    pub reference_angle_rad: f64,
    /// Ratio of the model's declared reference noise to the true one.
    pub declared_over_true: f64,
    /// The model declares the gyros' angle random walk.
    pub declares_gyro_walk: bool,
    /// Thermometers are recorded.
    pub has_temperature: bool,
    /// Accelerometers are recorded.
    pub has_force: bool,
}

/// Draws from a log-uniform distribution.
pub fn log_uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(rng.random::<f64>())
}

/// Draws a strength (log-uniform).
pub fn draw_strength(rng: &mut ChaCha8Rng) -> f64 {
    log_uniform(rng, STRENGTHS[0], STRENGTHS[1])
}

/// Draws one element of a list.
pub fn one_of<T: Copy>(rng: &mut ChaCha8Rng, list: &[T]) -> T {
    list[rng.random_range(0..list.len())]
}

/// Returns the first of some hundreds of draws in which the injected effect is observable.
///
/// # Errors No draw shows the effect `name`.
pub fn shown<T>(name: &str, draw: impl FnMut() -> Option<T>) -> Result<T, InputError> {
    const DRAWS: usize = 200;
    let mut draws = std::iter::repeat_with(draw).take(DRAWS);
    let nothing = || InputError::new("challenge", "no setting shows what is planted").value(name);
    draws.find_map(|drawn| drawn).ok_or_else(nothing)
}

/// Returns −1 or 1.
pub fn sign(rng: &mut ChaCha8Rng) -> f64 {
    if rng.random_bool(0.5) { 1.0 } else { -1.0 }
}

impl Setting {
    /// Draws a setting with one of `motions`.
    pub fn draw(
        rng: &mut ChaCha8Rng,
        limits: &Limits,
        drift: Drift,
        motions: &[MotionKind],
    ) -> Self {
        let motion = one_of(rng, motions);
        let reference = one_of(rng, &REFERENCES);
        let [shortest_s, longest_s] = limits.length_s;
        let rates: Vec<f64> = RATES_HZ
            .into_iter()
            .filter(|rate_hz| rate_hz * shortest_s <= limits.most_rows)
            .collect();
        let rate_hz = one_of(rng, &rates);
        let longest_s = longest_s.min(limits.most_rows / rate_hz);
        let length_s = log_uniform(rng, shortest_s, longest_s.max(shortest_s));
        // 0.001 to 0.03 °/√h
        let walk = log_uniform(rng, 3e-7, 1e-5);
        let gyro_walk_rad_sqrt_s = std::array::from_fn(|_| walk * log_uniform(rng, 0.8, 1.25));
        // Up to twice the noise of a row, so that the noise dithers the counter.
        let pulse_rad = walk / rate_hz.sqrt() * log_uniform(rng, 0.1, 2.0);
        let (reference_walk_rad_sqrt_s, reference_angle_rad) = match reference {
            ReferenceKind::FineEncoder => (0.0, 1e-7),
            ReferenceKind::CoarseEncoder => (0.0, 1e-5),
            ReferenceKind::FibreOptic => (log_uniform(rng, 3e-7, 6e-6), 1e-8),
            ReferenceKind::LikeGyro => (walk, pulse_rad / 12_f64.sqrt()),
        };
        Self {
            motion,
            reference,
            rate_hz,
            rows: (length_s * rate_hz).round() as usize,
            drift,
            gyro_walk_rad_sqrt_s,
            pulse_rad,
            reference_walk_rad_sqrt_s,
            reference_angle_rad,
            declared_over_true: log_uniform(
                rng,
                1.0 / limits.declared_within,
                limits.declared_within,
            ),
            declares_gyro_walk: rng.random_bool(0.5),
            has_temperature: rng.random_bool(0.4),
            has_force: rng.random_bool(0.4),
        }
    }

    /// Returns the period of a row \[s\].
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    /// Returns the length \[s\].
    pub fn length_s(&self) -> f64 {
        self.rows as f64 / self.rate_hz
    }

    /// Returns a gyro's noise without pulse quantisation.
    pub fn gyro_levels(&self, axis: usize) -> Levels {
        Levels::white(self.gyro_walk_rad_sqrt_s[axis], 0.0).drifting(self.drift)
    }

    /// Returns the reference's noise.
    pub fn reference_levels(&self) -> Levels {
        Levels::white(self.reference_walk_rad_sqrt_s, self.reference_angle_rad)
    }

    /// Returns the noise of gyro less reference, pulse quantisation included.
    pub fn residual_levels(&self, axis: usize) -> Levels {
        let pulses = Levels::white(0.0, self.pulse_rad / 12_f64.sqrt());
        self.gyro_levels(axis)
            .beside(pulses)
            .beside(self.reference_levels())
    }

    /// Returns the two-sided power spectral density of the reference's rate noise at a frequency \[rad²/s\].
    pub fn reference_rate_density(&self, frequency_hz: f64) -> f64 {
        let angle = 2.0 * (PI * frequency_hz * self.period_s()).sin() * self.reference_angle_rad;
        self.reference_walk_rad_sqrt_s.powi(2) + angle.powi(2) / self.period_s()
    }
}

/// Returns a kind's name in files.
pub fn name_of(kind: &impl Serialize) -> String {
    serde_json::to_value(kind)
        .ok()
        .and_then(|value| value.as_str().map(str::to_owned))
        .unwrap_or_default()
}

impl Setting {
    /// Returns the setting in one line.
    pub fn words(&self) -> String {
        format!(
            "{}, {}, {} Hz, {:.0} s, declared × {:.2}, drift {}",
            name_of(&self.motion),
            name_of(&self.reference),
            self.rate_hz,
            self.length_s(),
            self.declared_over_true,
            self.drift.name()
        )
    }

    /// Returns the groups of the setting in the tables.
    pub fn groups(&self) -> Vec<String> {
        let length = match self.length_s() {
            seconds if seconds < 60.0 => "below 60 s",
            seconds if seconds < 200.0 => "60 to 200 s",
            _ => "200 s and more",
        };
        let declared = match self.declared_over_true {
            factor if factor < 0.85 => "too low",
            factor if factor > 1.0 / 0.85 => "too high",
            _ => "about right",
        };
        vec![
            format!("motion {}", name_of(&self.motion)),
            format!("reference {}", name_of(&self.reference)),
            format!("rate {} Hz", self.rate_hz),
            format!("length {length}"),
            format!("declared noise {declared}"),
            format!("drift {}", self.drift.name()),
        ]
    }
}
