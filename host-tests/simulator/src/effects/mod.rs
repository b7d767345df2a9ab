//! Physics switched on in a scenario: entries of the contract's catalogue, as coefficients.
//!
//! [`Effects`] is the sum of all `[[effect]]` entries. They act on the rates sensed by the gyros and the forces on the
//! accelerometers ([`Exposure`] at the quadrature nodes), on the blocks' angles (`block`), on the reference's increments
//! (`reference`), on the data (`faults`).
//!
//! Equations: the catalogue's, with tilts δ_ij as right-hand rotations of gyro i's axis about body axis j:
//! gyro i senses + δ_ik ω_j − δ_ij ω_k with (i, j, k) cyclic; accelerometers alike.
//!
//! Out of scope: the compensation by a model; that is `model::compensation`, which shares no code.

mod block;
mod expression;
pub mod faults;
mod parse;
mod reference;

use super::motion::BodyMotion;
use expression::Expression;
use faults::FaultEntry;
use nalgebra::{Matrix3, Vector3};

pub use parse::EffectContext;
pub use reference::Harmonic;

/// Input of the instruments at one instant, body frame.
#[derive(Debug, Clone)]
pub struct Exposure {
    /// Time since the recording's start \[s\].
    pub since_start_s: f64,
    /// Motion of the case relative to space.
    pub motion: BodyMotion,
    /// Specific force at the body's origin \[m/s²\].
    pub force_m_s2: Vector3<f64>,
    /// Derivative of the specific force \[m/s³\].
    pub force_rate_m_s3: Vector3<f64>,
    /// Warming of each block since the start \[K\].
    pub warming_k: Vector3<f64>,
    /// Rate of that warming \[K/s\].
    pub warming_rate_k_s: Vector3<f64>,
    /// Magnetic flux density \[T\].
    pub field_t: Vector3<f64>,
    /// Angle \[rad\] and rate \[rad/s\] of each block relative to the case; zeros if no effect needs them.
    pub block_rad: [[f64; 2]; 3],
    /// Tilts by the suspensions' modes, \[gyro i, axis j\] \[rad\].
    pub bent_rad: Matrix3<f64>,
}

/// Jump of the rate or of the angle of one gyro.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Index of the gyro.
    pub axis: usize,
    /// Instant of the jump \[s\].
    pub time_s: f64,
    /// Size of the jump \[rad/s\] or \[rad\].
    pub size: f64,
}

/// `axis_flexure_mode`.
#[derive(Debug, Clone, PartialEq)]
struct FlexureMode {
    flexure_s2: Matrix3<f64>,
    frequency_hz: f64,
    damping: f64,
}

/// Sum of all effects of a scenario. Matrices are \[gyro i, axis j\].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Effects {
    bias_rad_s: Vector3<f64>,
    bias_steps: Vec<Jump>,
    slips: Vec<Jump>,
    bias_temperature: Vector3<f64>,
    bias_temperature_rate: Vector3<f64>,
    bias_magnetic: Matrix3<f64>,
    g_bias: Matrix3<f64>,
    g2_bias: Vector3<f64>,
    scale: Vector3<f64>,
    scale_temperature: Vector3<f64>,
    scale_asymmetry: Vector3<f64>,
    scale_quadratic: Vector3<f64>,
    scale_cubic: Vector3<f64>,
    tilt_rad: Matrix3<f64>,
    tilt_temperature: Matrix3<f64>,
    flexure_s2: Matrix3<f64>,
    flexure_cubic: Matrix3<f64>,
    flexure_modes: Vec<FlexureMode>,
    tilt_by_force: Matrix3<f64>,
    rate_by_force: Matrix3<f64>,
    rate_by_jerk: Matrix3<f64>,
    delay_s: Vector3<f64>,
    dither_gain: Vector3<f64>,
    dither_delay_s: Vector3<f64>,
    dither_cubic: Vector3<f64>,
    dither_crosstalk: Matrix3<f64>,
    lock_in_rad_s: Vector3<f64>,
    high_pass_s: Vector3<f64>,
    angle_random_walk: Vector3<f64>,
    converter_rad: Vector3<f64>,
    reference_misalignment_rad: Vector3<f64>,
    reference_delay_s: f64,
    reference_scale: Vector3<f64>,
    harmonics: Vec<Harmonic>,
    isolator: [super::isolator::AxisMode; 3],
    earth_rate_rad_s: Vector3<f64>,
    accel_bias: Vector3<f64>,
    accel_scale: Vector3<f64>,
    accel_tilt_rad: Matrix3<f64>,
    accel_quadratic: Vector3<f64>,
    accel_delay_s: Vector3<f64>,
    lever_arm_m: Matrix3<f64>,
    faults: Vec<FaultEntry>,
    expressions: Vec<Expression>,
}

/// Contribution of tilts \[sensor i, axis j\] to a triad's measurement of `v`.
fn tilted(tilt: impl Fn(usize, usize) -> f64, v: &Vector3<f64>) -> Vector3<f64> {
    let mut added = Vector3::zeros();
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        added[i] = tilt(i, k) * v[j] - tilt(i, j) * v[k];
    }
    added
}

impl Effects {
    /// Contribution of the effects to the rates sensed by the gyros (case part, before 1/(1 − s)) \[rad/s\].
    pub fn sensed_rate(&self, exposure: &Exposure) -> Vector3<f64> {
        let rate = &exposure.motion.rate_rad_s;
        let alpha = &exposure.motion.acceleration_rad_s2;
        let force = &exposure.force_m_s2;
        let warming = &exposure.warming_k;
        let mut sensed = self.bias_rad_s
            + self.g_bias * force
            + self.rate_by_force * exposure.force_rate_m_s3
            + self.rate_by_jerk * exposure.motion.jerk_rad_s3
            + self.bias_magnetic * exposure.field_t;
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let tilt = |about: usize, third: usize| {
                self.tilt_rad[(i, about)]
                    - self.flexure_s2[(i, about)] * alpha[about]
                    - self.flexure_cubic[(i, about)] * alpha[about].powi(3)
                    + self.tilt_by_force[(i, about)] * force[third]
                    + self.tilt_temperature[(i, about)] * warming[i]
                    + exposure.bent_rad[(i, about)]
            };
            sensed[i] += tilt(k, j) * rate[j] - tilt(j, k) * rate[k];
            sensed[i] += self.g2_bias[i] * force[i].powi(2)
                + self.bias_temperature[i] * warming[i]
                + self.bias_temperature_rate[i] * exposure.warming_rate_k_s[i]
                + (self.scale[i] + self.scale_temperature[i] * warming[i]) * rate[i]
                + self.scale_asymmetry[i] * rate[i].abs()
                + self.scale_quadratic[i] * rate[i].powi(2)
                + self.scale_cubic[i] * rate[i].powi(3);
        }
        for expression in &self.expressions {
            sensed[expression.axis] += expression.rate_rad_s(exposure);
        }
        sensed
    }

    /// Specific force on each accelerometer \[m/s²\], at the end of its lever arm.
    pub fn felt_force(&self, exposure: &Exposure) -> Vector3<f64> {
        if self.lever_arm_m == Matrix3::zeros() {
            return exposure.force_m_s2;
        }
        let motion = &exposure.motion;
        let mut felt = exposure.force_m_s2;
        for i in 0..3 {
            let arm: Vector3<f64> = self.lever_arm_m.row(i).transpose();
            let carried = motion.acceleration_rad_s2.cross(&arm)
                + motion.rate_rad_s.cross(&motion.rate_rad_s.cross(&arm));
            felt[i] += carried[i];
        }
        felt
    }

    /// Contribution of the accelerometers' own errors to the mean force, before 1/(1 − s) \[m/s²\].
    pub fn accelerometer_error(&self, force_m_s2: &Vector3<f64>) -> Vector3<f64> {
        let square = force_m_s2.component_mul(force_m_s2);
        tilted(|i, j| self.accel_tilt_rad[(i, j)], force_m_s2)
            + self.accel_bias
            + self.accel_scale.component_mul(force_m_s2)
            + self.accel_quadratic.component_mul(&square)
    }

    /// Delay of each accelerometer \[s\].
    pub fn accelerometer_delay_s(&self, axis: usize) -> f64 {
        self.accel_delay_s[axis]
    }

    /// Delay of each gyro \[s\].
    pub fn gyro_delay_s(&self, axis: usize) -> f64 {
        self.delay_s[axis]
    }

    /// Frequency \[Hz\] and damping of each mode of the suspensions.
    pub fn flexure_modes(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.flexure_modes
            .iter()
            .map(|mode| (mode.frequency_hz, mode.damping))
    }

    /// Adds the tilts of mode `index` bent by `bend_rad_s2` about `axis` (statically: the angular acceleration).
    pub fn add_mode_tilt(
        &self,
        index: usize,
        axis: usize,
        bend_rad_s2: f64,
        tilt_rad: &mut Matrix3<f64>,
    ) {
        for i in 0..3 {
            tilt_rad[(i, axis)] -= self.flexure_modes[index].flexure_s2[(i, axis)] * bend_rad_s2;
        }
    }

    /// Contribution of steps of the bias to gyro `axis` over \[begin, end) \[rad\], before 1/(1 − s).
    pub fn stepped_angle_rad(&self, axis: usize, begin_s: f64, end_s: f64) -> f64 {
        self.bias_steps
            .iter()
            .filter(|step| step.axis == axis)
            .map(|step| step.size * (end_s - step.time_s.max(begin_s)).max(0.0))
            .sum()
    }

    /// Jumps of the angle of gyro `axis` inside \[begin, end) \[rad\].
    pub fn slipped_angle_rad(&self, axis: usize, begin_s: f64, end_s: f64) -> f64 {
        self.slips
            .iter()
            .filter(|slip| slip.axis == axis && (begin_s..end_s).contains(&slip.time_s))
            .map(|slip| slip.size)
            .sum()
    }

    /// Angle random walk, the model's share `modelled` included \[rad/√s\].
    pub fn angle_random_walk(&self, axis: usize, modelled: f64) -> f64 {
        modelled.hypot(self.angle_random_walk[axis])
    }

    /// Time constant of a gyro's automatic zeroing \[s\]; 0 for none.
    pub fn high_pass_s(&self, axis: usize) -> f64 {
        self.high_pass_s[axis]
    }

    /// Lock-in threshold \[rad/s\]; 0 for none.
    pub fn lock_in_rad_s(&self, axis: usize) -> f64 {
        self.lock_in_rad_s[axis]
    }

    /// Weight of a coarser converter before the gyro's own counter \[rad\]; 0 for none.
    pub fn converter_rad(&self, axis: usize) -> f64 {
        self.converter_rad[axis]
    }

    /// Earth's rotation in the body frame at the start that the reference does not contain \[rad/s\].
    pub fn earth_rate_rad_s(&self) -> Vector3<f64> {
        self.earth_rate_rad_s
    }

    /// `isolator_mode`, if any axis has one.
    pub fn isolator(&self) -> Option<[super::isolator::AxisMode; 3]> {
        self.isolator
            .iter()
            .any(Option::is_some)
            .then_some(self.isolator)
    }

    /// Faults of the data.
    pub fn faults(&self) -> &[FaultEntry] {
        &self.faults
    }

    /// True if any effect needs the blocks' motion at the nodes.
    pub fn has_expressions(&self) -> bool {
        !self.expressions.is_empty()
    }

    /// Sets the temperature coefficients of the gyros' scale \[1/K\].
    pub fn set_scale_temperature(&mut self, scale_error_k: [f64; 3]) {
        self.scale_temperature = Vector3::from(scale_error_k);
    }
}
