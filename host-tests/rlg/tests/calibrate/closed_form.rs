//! Makes recordings straight from equations, for tests that need hundreds: no simulator, no dither, 500 Hz.
//!
//! From segments of motion, K and a seed it makes a recording with gyro increments and a reference, and its model. Body
//! rates are by formula; increments and attitudes by fourth-order quadrature (Gauss, Magnus), so that they are more accurate
//! than the reader's integration. Noise: random walk of angle and white angle.

use std::f64::consts::TAU;

use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use rlg::model::{Gyro, Installation, Model, MotionSource, Reference};
use rlg::recording::{Channel, Clock, Quantity, Recording, Table};

pub const RATE_HZ: f64 = 500.0;

/// Table 3 of the paper \[s²\]: xy, xz, yx, yz, zx, zy.
pub const TABLE_3: [f64; 6] = [6.9e-8, 7.1e-8, 7.5e-8, 7.3e-8, 6.7e-8, 7.6e-8];

/// 0.0015 °/√h, of a system of 0.8 nmile/h.
pub const WALK_RAD_SQRT_S: f64 = 4.36e-7;

/// 0.8″.
pub const PULSE_RAD: f64 = 3.88e-6;

const REFERENCE_ANGLE_RAD: f64 = 2e-7;
const REFERENCE_WALK_RAD_SQRT_S: f64 = 8.7e-8;

/// Errors unknown to the model, to be fitted jointly with K.
const SCALE: [f64; 3] = [8e-6, -5e-6, 3e-6];
const TILT_RAD: [f64; 6] = [2e-5, -1e-5, 1.5e-5, 3e-5, -2e-5, 1e-5];

#[derive(Clone, Copy)]
pub enum Motion {
    Still,
    /// Rotation about an axis by an angle \[rad\], from one position to the next.
    Slew(usize, f64),
    /// Cone axis, turns a second \[Hz\], half-angle \[rad\].
    Coning(usize, f64, f64),
    /// Spin axis, its rate \[rad/s\], oscillating axis, its peak angle \[rad\], its phase \[rad\]; synchronous.
    Spin(usize, f64, usize, f64, f64),
}

pub enum Against {
    Rates,
    /// Attitude samples at this rate \[Hz\], with this white noise \[rad\].
    Attitude(f64, f64),
    Nothing,
}

/// Motions of `seconds` each, tapered over a tenth at either end.
pub struct Programme(pub Vec<(Motion, f64)>);

impl Programme {
    fn seconds(&self) -> f64 {
        self.0.iter().map(|(_, seconds)| seconds).sum()
    }

    fn rate_rad_s(&self, time_s: f64) -> Vector3<f64> {
        let mut begin_s = 0.0;
        for (motion, seconds) in &self.0 {
            if time_s < begin_s + seconds {
                return rate_of(*motion, time_s - begin_s, *seconds);
            }
            begin_s += seconds;
        }
        Vector3::zeros()
    }
}

fn rate_of(motion: Motion, time_s: f64, seconds: f64) -> Vector3<f64> {
    let ramp_s = 0.1 * seconds;
    let edge = (time_s.min(seconds - time_s) / ramp_s).clamp(0.0, 1.0);
    // Quintic step, so that the angular acceleration is continuous.
    let taper = edge.powi(3) * (10.0 + edge * (-15.0 + 6.0 * edge));
    let mut rate = Vector3::zeros();
    match motion {
        Motion::Still => {}
        Motion::Slew(axis, angle) => {
            let share = time_s / seconds;
            rate[axis] = angle * 30.0 * (share * (1.0 - share)).powi(2) / seconds;
        }
        Motion::Coning(axis, hz, angle) => {
            // Rates across the axis in quadrature; the mean along it is left to the attitude.
            let (sin, cos) = (TAU * hz * time_s).sin_cos();
            rate[(axis + 1) % 3] = taper * TAU * hz * angle * cos;
            rate[(axis + 2) % 3] = taper * TAU * hz * angle * sin;
        }
        Motion::Spin(axis, spin_rad_s, across, angle, phase) => {
            rate[axis] = taper * spin_rad_s;
            let omega = spin_rad_s.abs();
            rate[across] = taper * omega * angle * (omega * time_s + phase).cos();
        }
    }
    rate
}

/// Computes the sensed rate of each gyro at an instant (physics §1 and §2), its scale and installation errors included.
fn sensed_rad_s(rate: &Vector3<f64>, acceleration: &Vector3<f64>, k: &[f64; 6]) -> Vector3<f64> {
    let tilt = |index: usize, axis: usize| TILT_RAD[index] - k[index] * acceleration[axis];
    let (xy, xz) = (tilt(0, 1), tilt(1, 2));
    let (yx, yz) = (tilt(2, 0), tilt(3, 2));
    let (zx, zy) = (tilt(4, 0), tilt(5, 1));
    let scaled = Vector3::from_fn(|axis, _| (1.0 + SCALE[axis]) * rate[axis]);
    scaled
        + Vector3::new(
            xz * rate.y - xy * rate.z,
            yx * rate.z - yz * rate.x,
            zy * rate.x - zx * rate.y,
        )
}

pub struct Made {
    pub recording: Recording,
    pub model: Model,
}

/// Makes a recording.
pub fn make(programme: &Programme, k: &[f64; 6], against: &Against, seed: u64) -> Made {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut rng) };
    let rows = (programme.seconds() * RATE_HZ).round() as usize;
    let period_s = 1.0 / RATE_HZ;
    let nodes = [0.5 - 3f64.sqrt() / 6.0, 0.5 + 3f64.sqrt() / 6.0];
    let bias = [2.4e-8, -3.9e-8, 1.5e-8].map(|size| size * (1.0 + normal()));
    let mut gyro: [Vec<f64>; 3] = Default::default();
    let mut reference: [Vec<f64>; 3] = Default::default();
    let mut attitude = Vec::with_capacity(rows);
    let (mut angle, mut reference_angle) = ([0.0; 3], [0.0; 3]);
    let mut now = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.2, 0.5));
    for row in 0..rows {
        let at = nodes.map(|node| programme.rate_rad_s((row as f64 + node) * period_s));
        let mean = nodes.map(|node| {
            let time_s = (row as f64 + node) * period_s;
            let step_s = 1e-5;
            let slope = (programme.rate_rad_s(time_s + step_s)
                - programme.rate_rad_s((time_s - step_s).max(0.0)))
                / (2.0 * step_s);
            sensed_rad_s(&programme.rate_rad_s(time_s), &slope, k)
        });
        let case = (at[0] + at[1]) * (0.5 * period_s);
        let sensed = (mean[0] + mean[1]) * (0.5 * period_s);
        let coning = at[0].cross(&at[1]) * (3f64.sqrt() / 12.0 * period_s * period_s);
        now *= UnitQuaternion::from_scaled_axis(case + coning);
        attitude.push(now);
        for axis in 0..3 {
            let white = PULSE_RAD / 12f64.sqrt() * normal();
            let walk = WALK_RAD_SQRT_S * period_s.sqrt() * normal();
            gyro[axis].push(sensed[axis] + bias[axis] * period_s + walk + white - angle[axis]);
            angle[axis] = white;
            let white = REFERENCE_ANGLE_RAD * normal();
            let walk = REFERENCE_WALK_RAD_SQRT_S * period_s.sqrt() * normal();
            reference[axis].push(case[axis] + walk + white - reference_angle[axis]);
            reference_angle[axis] = white;
        }
    }
    let mut tables = vec![table(
        "gyro.csv",
        RATE_HZ,
        0.0,
        &Quantity::GyroIncrement,
        gyro,
    )];
    let mut angle_noise_rad = REFERENCE_ANGLE_RAD;
    match against {
        Against::Nothing => {}
        Against::Rates => tables.push(table(
            "reference.csv",
            RATE_HZ,
            0.0,
            &Quantity::ReferenceIncrement,
            reference,
        )),
        Against::Attitude(rate_hz, noise_rad) => {
            angle_noise_rad = *noise_rad;
            let every = (RATE_HZ / rate_hz).round() as usize;
            let read: Vec<[f64; 4]> = attitude
                .iter()
                .skip(every - 1)
                .step_by(every)
                .map(|q| {
                    let noise = Vector3::from_fn(|_, _| noise_rad * normal());
                    let read = UnitQuaternion::from_scaled_axis(noise) * q;
                    [read.w, read.i, read.j, read.k]
                })
                .collect();
            tables.push(attitude_table(*rate_hz, &read));
        }
    }
    Made {
        recording: Recording {
            name: format!("closed-form-{seed}"),
            folder: format!("closed-form-{seed}").into(),
            site: None,
            tables,
            segments: Vec::new(),
        },
        model: model(angle_noise_rad),
    }
}

/// Makes the initial model of the calibration: the noise, and no errors.
pub fn model(angle_noise_rad: f64) -> Model {
    Model {
        motion: MotionSource::Reference,
        earth_rate_in_reference: true,
        gyro: Gyro {
            pulse_weight_rad: [PULSE_RAD; 3],
            bias_rad_s: [0.0; 3],
            scale_error: [0.0; 3],
            angle_random_walk_rad_sqrt_s: Some([WALK_RAD_SQRT_S; 3]),
            rate_random_walk_rad_s_sqrt_s: None,
            flicker_rad_s: None,
            installation_rad: Installation::default(),
        },
        dither: None,
        reference: Some(Reference {
            angle_noise_rad: Some(angle_noise_rad),
            angle_random_walk_rad_sqrt_s: Some(REFERENCE_WALK_RAD_SQRT_S),
        }),
        accelerometer: None,
        effects: Vec::new(),
    }
}

fn table(
    file: &str,
    rate_hz: f64,
    start_s: f64,
    quantity: &Quantity,
    values: [Vec<f64>; 3],
) -> Table {
    let rows = values[0].len();
    let channel = |(axis, values): (&str, Vec<f64>)| Channel {
        column: format!("{}_{axis}", quantity.name()),
        quantity: quantity.clone(),
        axis: Some(axis.to_owned()),
        scale: 1.0,
        offset: 0.0,
        values,
    };
    Table {
        file: file.to_owned(),
        clock: Clock::Uniform { rate_hz, start_s },
        rows,
        channels: ["x", "y", "z"]
            .into_iter()
            .zip(values)
            .map(channel)
            .collect(),
    }
}

/// Attitude samples at a rate, the first at the end of its first period.
pub fn attitude_table(rate_hz: f64, wxyz: &[[f64; 4]]) -> Table {
    let channels = ["w", "x", "y", "z"]
        .into_iter()
        .enumerate()
        .map(|(component, axis)| Channel {
            column: format!("q{axis}"),
            quantity: Quantity::ReferenceAttitude,
            axis: Some(axis.to_owned()),
            scale: 1.0,
            offset: 0.0,
            values: wxyz.iter().map(|q| q[component]).collect(),
        })
        .collect();
    Table {
        file: "attitude.csv".to_owned(),
        clock: Clock::Uniform {
            rate_hz,
            start_s: 0.0,
        },
        rows: wxyz.len(),
        channels,
    }
}

/// Coning about each axis at three positions, the paper's way; 5 Hz at 2.9° drifts 1.1 °/h. The rotations between the
/// positions identify the scale errors, of which an unknown 1e-5 would be 1e-8 s² of a sum at this frequency.
pub fn coning() -> Programme {
    let mut segments = vec![(Motion::Still, 4.0)];
    for axis in 0..3 {
        segments.push((Motion::Coning(axis, 5.0, 0.05), 10.0));
        segments.push((Motion::Slew(axis, 1.5), 2.0));
    }
    segments.push((Motion::Still, 4.0));
    Programme(segments)
}

/// Every pair of axes with both senses; 7 rad/s and 0.2 rad reach 9.8 rad/s².
pub fn spins() -> Programme {
    let mut segments = vec![(Motion::Still, 2.0)];
    for axis in 0..3 {
        for across in [(axis + 1) % 3, (axis + 2) % 3] {
            segments.push((Motion::Spin(axis, 7.0, across, 0.2, 0.0), 4.0));
            segments.push((Motion::Spin(axis, -7.0, across, 0.2, TAU / 4.0), 4.0));
        }
    }
    segments.push((Motion::Still, 2.0));
    Programme(segments)
}
