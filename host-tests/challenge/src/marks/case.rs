//! Input of the instruments: increments of the case, warming, specific force.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::{Gyro, Installation};

use super::motion::Motion;
use super::setting::{Setting, log_uniform};

/// Standard gravity \[m/s²\].
pub const GRAVITY_M_S2: f64 = 9.806_65;

/// Temperatures at the start \[K\].
pub const START_K: f64 = 293.0;

/// Warming of a block: amplitude · (1 − e^{−t/τ}) + slope · t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Warming {
    amplitude_k: f64,
    time_constant_s: f64,
    slope_k_s: f64,
}

impl Warming {
    /// Draws the warming of a block over a recording of some length \[s\].
    pub fn draw(length_s: f64, rng: &mut ChaCha8Rng) -> Self {
        Self {
            amplitude_k: log_uniform(rng, 1.0, 8.0),
            time_constant_s: length_s * log_uniform(rng, 0.15, 1.0),
            slope_k_s: log_uniform(rng, 0.1, 2.0) / length_s,
        }
    }

    /// Returns the warming since the start \[K\].
    pub fn at_k(&self, time_s: f64) -> f64 {
        self.amplitude_k * (1.0 - (-time_s / self.time_constant_s).exp()) + self.slope_k_s * time_s
    }
}

/// Case and its surroundings, without any instrument.
#[derive(Debug, Clone)]
pub struct Case {
    /// Motion in closed form.
    pub motion: Motion,
    /// Number of rows.
    pub rows: usize,
    /// Period of a row \[s\].
    pub period_s: f64,
    /// Increments \[rad\], x y z.
    pub increments_rad: [Vec<f64>; 3],
    /// Warming of the blocks since the start at the rows' ends \[K\].
    pub warming_k: Option<[Vec<f64>; 3]>,
    /// Mean specific force of the rows \[m/s²\].
    pub force_m_s2: Option<[Vec<f64>; 3]>,
}

impl Case {
    /// Computes the input of a setting's instruments.
    pub fn new(setting: &Setting, motion: &Motion, warming: Option<[Warming; 3]>) -> Self {
        let (rows, period_s) = (setting.rows, setting.period_s());
        let increments_rad =
            std::array::from_fn(|axis| motion.increments_rad(axis, 0.0, period_s, rows));
        let warming_k = warming.map(|blocks| {
            blocks.map(|block| {
                (1..=rows)
                    .map(|row| block.at_k(row as f64 * period_s))
                    .collect()
            })
        });
        let force_m_s2 = setting.has_force.then(|| force(&increments_rad));
        Self {
            motion: motion.clone(),
            rows,
            period_s,
            increments_rad,
            warming_k,
            force_m_s2,
        }
    }
}

/// Returns the mean specific force of a case that rotates without translation, level at the start, z down.
fn force(increments_rad: &[Vec<f64>; 3]) -> [Vec<f64>; 3] {
    let rows = increments_rad[0].len();
    let up = Vector3::new(0.0, 0.0, -GRAVITY_M_S2);
    let mut attitude = UnitQuaternion::identity();
    let mut before = Vector3::zeros();
    let mut felt = up;
    let mut force: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::with_capacity(rows));
    let [x, y, z] = increments_rad;
    for ((x, y), z) in x.iter().zip(y).zip(z) {
        let turned = Vector3::new(*x, *y, *z);
        // Savage's two-sample coning term
        let rotation = turned + before.cross(&turned) / 12.0;
        attitude *= UnitQuaternion::from_scaled_axis(rotation);
        before = turned;
        let now = attitude.inverse_transform_vector(&up);
        let mean = 0.5 * (felt + now);
        felt = now;
        for (axis, values) in force.iter_mut().enumerate() {
            values.push(mean[axis]);
        }
    }
    force
}

/// Constants of a unit, known to the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Bias \[rad/s\].
    pub bias_rad_s: [f64; 3],
    /// Scale error.
    pub scale_error: [f64; 3],
    /// ε_xy, ε_xz, ε_yx, ε_yz, ε_zx, ε_zy \[rad\]: ε_xy multiplies the z rate in gyro x.
    pub installation_rad: [f64; 6],
}

impl Unit {
    /// Draws the constants of a calibrated unit.
    pub fn draw(rng: &mut ChaCha8Rng) -> Self {
        let mut spread = |size: f64| size * (2.0 * rng.random::<f64>() - 1.0);
        Self {
            bias_rad_s: std::array::from_fn(|_| spread(5e-8)),
            scale_error: std::array::from_fn(|_| spread(1e-5)),
            installation_rad: std::array::from_fn(|_| spread(3e-4)),
        }
    }

    /// Returns these constants as a model states them, without any declared noise.
    pub fn gyro(&self, pulse_rad: f64) -> Gyro {
        Gyro {
            pulse_weight_rad: [pulse_rad; 3],
            bias_rad_s: self.bias_rad_s,
            scale_error: self.scale_error,
            installation_rad: Installation::from_array(self.installation_rad),
            ..Gyro::default()
        }
    }

    /// Returns M⁻¹ of Eq. (7): sensing axes from body.
    pub fn sensing_from_body(&self) -> Matrix3<f64> {
        let [xy, xz, yx, yz, zx, zy] = self.installation_rad;
        let body_from_sensing = Matrix3::new(1.0, xz, xy, yz, 1.0, yx, zy, zx, 1.0);
        // Angles of 3e-4 rad leave it far from singular.
        body_from_sensing
            .try_inverse()
            .unwrap_or_else(Matrix3::identity)
    }
}
