//! Physics that a scenario switches on: entries of the contract's catalogue, as coefficients.
//!
//! Enters: `[[effect]]` entries. Leaves: [`Effects`], the sum of all of them, applied at the quadrature
//! nodes ([`Effects::sensed_rate`]) or at a row's end (dither, jumps, noise).
//!
//! Equations: the catalogue's, with tilts δ_ij as right-hand rotations of gyro i's axis about body axis j:
//! gyro i senses + δ_ik ω_j − δ_ij ω_k with (i, j, k) cyclic. `gyro_delay` is the Taylor series
//! ω(t − d) = ω − α d + ½ ω'' d²: 1e-3 of a 400 Hz rate at the longest delay that is let in.
//!
//! Deliberately not here: kinds this simulator does not have. It refuses them, and never ignores one.

use super::entry::Entry;
use super::motion::BodyMotion;
use crate::error::InputError;
use crate::model::{EffectValue, ModelEffect};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// Longest `gyro_delay` or `dither_delay` \[s\]: (Ωd)³/6 stays below 1e-3 at 400 Hz.
const LONGEST_DELAY_S: f64 = 7e-5;

/// A jump of the rate or of the angle of one gyro.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Gyro.
    pub axis: usize,
    /// When \[s\].
    pub time_s: f64,
    /// \[rad/s\] or \[rad\].
    pub size: f64,
}

/// All effects of a scenario, summed. Matrices are \[gyro i, axis j\].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Effects {
    bias_rad_s: Vector3<f64>,
    bias_steps: Vec<Jump>,
    slips: Vec<Jump>,
    g_bias: Matrix3<f64>,
    g2_bias: Vector3<f64>,
    scale: Vector3<f64>,
    scale_asymmetry: Vector3<f64>,
    scale_quadratic: Vector3<f64>,
    scale_cubic: Vector3<f64>,
    tilt_rad: Matrix3<f64>,
    flexure_s2: Matrix3<f64>,
    flexure_cubic: Matrix3<f64>,
    tilt_by_force: Matrix3<f64>,
    rate_by_force: Matrix3<f64>,
    rate_by_jerk: Matrix3<f64>,
    delay_s: Vector3<f64>,
    dither_gain: Vector3<f64>,
    dither_delay_s: Vector3<f64>,
    dither_cubic: Vector3<f64>,
    dither_crosstalk: Matrix3<f64>,
    angle_random_walk: Vector3<f64>,
    reference_scale: Vector3<f64>,
}

const LETTERS: [&str; 3] = ["x", "y", "z"];

impl Effects {
    /// Adds one entry and returns it in the form of a model.
    pub fn add(&mut self, mut entry: Entry) -> Result<ModelEffect, InputError> {
        let kind = entry.text("kind")?;
        let mut parameters = BTreeMap::new();
        match kind.as_str() {
            "gyro_bias" => self.bias_rad_s += xyz(&mut entry, &mut parameters)?,
            "gyro_bias_step" => self.bias_steps.push(jump(&mut entry, &mut parameters)?),
            "counter_slip" => self.slips.push(jump(&mut entry, &mut parameters)?),
            "gyro_g_bias" => self.g_bias += matrix(&mut entry, &mut parameters, true)?,
            "gyro_g2_bias" => self.g2_bias += xyz(&mut entry, &mut parameters)?,
            "gyro_scale" => self.scale += xyz(&mut entry, &mut parameters)?,
            "gyro_scale_asymmetry" => self.scale_asymmetry += xyz(&mut entry, &mut parameters)?,
            "gyro_scale_quadratic" => self.scale_quadratic += xyz(&mut entry, &mut parameters)?,
            "gyro_scale_cubic" => self.scale_cubic += xyz(&mut entry, &mut parameters)?,
            "installation" => self.tilt_rad += matrix(&mut entry, &mut parameters, false)?,
            "axis_flexure" => self.flexure_s2 += matrix(&mut entry, &mut parameters, false)?,
            "axis_flexure_cubic" => {
                self.flexure_cubic += matrix(&mut entry, &mut parameters, false)?;
            }
            "axis_tilt_by_force" => {
                self.tilt_by_force += matrix(&mut entry, &mut parameters, false)?;
            }
            "elastic_rate_by_force" => {
                self.rate_by_force += matrix(&mut entry, &mut parameters, true)?;
            }
            "elastic_rate_by_jerk" => {
                self.rate_by_jerk += matrix(&mut entry, &mut parameters, true)?;
            }
            "gyro_delay" => self.delay_s += xyz(&mut entry, &mut parameters)?,
            "dither_gain" => self.dither_gain += xyz(&mut entry, &mut parameters)?,
            "dither_delay" => self.dither_delay_s += xyz(&mut entry, &mut parameters)?,
            "dither_cubic" => self.dither_cubic += xyz(&mut entry, &mut parameters)?,
            "dither_crosstalk" => {
                self.dither_crosstalk += matrix(&mut entry, &mut parameters, false)?;
            }
            "angle_random_walk" => {
                let walk = xyz(&mut entry, &mut parameters)?;
                self.angle_random_walk = self.angle_random_walk.zip_map(&walk, f64::hypot);
            }
            "reference_scale" => self.reference_scale += xyz(&mut entry, &mut parameters)?,
            other => {
                return Err(entry
                    .error("kind", "is no effect of this simulator")
                    .value(other)
                    .expected(KINDS.join(", ")));
            }
        }
        for (name, delay_s) in [
            ("gyro_delay", self.delay_s),
            ("dither_delay", self.dither_delay_s),
        ] {
            if kind == name && delay_s.amax() > LONGEST_DELAY_S {
                return Err(entry
                    .error("kind", "has a delay too long for this simulator")
                    .value(delay_s.amax())
                    .expected(format!("at most {LONGEST_DELAY_S} s")));
            }
        }
        entry.finish()?;
        Ok(ModelEffect { kind, parameters })
    }

    /// What the effects add to the rates the gyros sense (case part, before 1/(1 − s)) \[rad/s\], from the
    /// inertial motion, the specific force \[m/s²\] and its derivative \[m/s³\], all in the body frame.
    pub fn sensed_rate(
        &self,
        motion: &BodyMotion,
        force_m_s2: &Vector3<f64>,
        force_rate_m_s3: &Vector3<f64>,
    ) -> Vector3<f64> {
        let rate = &motion.rate_rad_s;
        let alpha = &motion.acceleration_rad_s2;
        let mut sensed = self.bias_rad_s
            + self.g_bias * force_m_s2
            + self.rate_by_force * force_rate_m_s3
            + self.rate_by_jerk * motion.jerk_rad_s3;
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let tilt = |about: usize, third: usize| {
                self.tilt_rad[(i, about)]
                    - self.flexure_s2[(i, about)] * alpha[about]
                    - self.flexure_cubic[(i, about)] * alpha[about].powi(3)
                    + self.tilt_by_force[(i, about)] * force_m_s2[third]
            };
            sensed[i] += tilt(k, j) * rate[j] - tilt(j, k) * rate[k];
            sensed[i] += self.g2_bias[i] * force_m_s2[i].powi(2)
                + self.scale[i] * rate[i]
                + self.scale_asymmetry[i] * rate[i].abs()
                + self.scale_quadratic[i] * rate[i].powi(2)
                + self.scale_cubic[i] * rate[i].powi(3);
            sensed[i] +=
                self.delay_s[i] * (0.5 * self.delay_s[i] * motion.jerk_rad_s3[i] - alpha[i]);
        }
        sensed
    }

    /// What steps of the bias add to gyro `axis` over \[begin, end) \[rad\], before 1/(1 − s).
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

    /// Block angles from pickoff angles, both relative to the case \[rad\].
    pub fn block_angle_rad(&self, pickoff_gain: [f64; 3], pickoff_rad: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| {
            let p = pickoff_rad[i];
            pickoff_gain[i] * (1.0 + self.dither_gain[i]) * p + self.dither_cubic[i] * p.powi(3)
        })
    }

    /// What gyro i reads of the blocks' angles \[rad\]: its own, the concealed scale on it (which stands
    /// before 1/(1 − s)), and crosstalk from the others (likewise).
    pub fn sensed_block_angle_rad(&self, block_rad: [f64; 3], scale_error: [f64; 3]) -> [f64; 3] {
        let block = Vector3::from(block_rad);
        let added = self.scale.component_mul(&block) + self.dither_crosstalk * block;
        std::array::from_fn(|i| block[i] + added[i] / (1.0 - scale_error[i]))
    }

    /// How late the pickoff shows the block \[s\].
    pub fn dither_delay_s(&self, axis: usize) -> f64 {
        self.dither_delay_s[axis]
    }

    /// Angle random walk with the model's share `modelled` \[rad/√s\].
    pub fn angle_random_walk(&self, axis: usize, modelled: f64) -> f64 {
        modelled.hypot(self.angle_random_walk[axis])
    }

    /// What the reference reads of the case's increment \[rad\].
    pub fn reference_reads(&self, case_rad: &Vector3<f64>) -> Vector3<f64> {
        case_rad + self.reference_scale.component_mul(case_rad)
    }
}

/// The kinds this simulator has.
pub const KINDS: [&str; 22] = [
    "gyro_bias",
    "gyro_bias_step",
    "counter_slip",
    "gyro_g_bias",
    "gyro_g2_bias",
    "gyro_scale",
    "gyro_scale_asymmetry",
    "gyro_scale_quadratic",
    "gyro_scale_cubic",
    "installation",
    "axis_flexure",
    "axis_flexure_cubic",
    "axis_tilt_by_force",
    "elastic_rate_by_force",
    "elastic_rate_by_jerk",
    "gyro_delay",
    "dither_gain",
    "dither_delay",
    "dither_cubic",
    "dither_crosstalk",
    "angle_random_walk",
    "reference_scale",
];

type Parameters = BTreeMap<String, EffectValue>;

fn take(entry: &mut Entry, parameters: &mut Parameters, name: &str) -> Result<f64, InputError> {
    let present = entry.has(name);
    let value = entry.number_or_zero(name)?;
    if present {
        parameters.insert(name.to_owned(), EffectValue::Number(value));
    }
    Ok(value)
}

fn xyz(entry: &mut Entry, parameters: &mut Parameters) -> Result<Vector3<f64>, InputError> {
    let mut vector = Vector3::zeros();
    for (i, name) in LETTERS.iter().enumerate() {
        vector[i] = take(entry, parameters, name)?;
    }
    Ok(vector)
}

/// The nine, or, with the diagonal left out, the six.
fn matrix(
    entry: &mut Entry,
    parameters: &mut Parameters,
    diagonal: bool,
) -> Result<Matrix3<f64>, InputError> {
    let mut matrix = Matrix3::zeros();
    for (i, gyro) in LETTERS.iter().enumerate() {
        for (j, axis) in LETTERS.iter().enumerate() {
            if diagonal || i != j {
                matrix[(i, j)] = take(entry, parameters, &format!("{gyro}{axis}"))?;
            }
        }
    }
    Ok(matrix)
}

fn jump(entry: &mut Entry, parameters: &mut Parameters) -> Result<Jump, InputError> {
    let (axis, letter) = entry.axis("axis")?;
    let (time_s, size) = (entry.number("time_s")?, entry.number("size")?);
    parameters.insert("axis".to_owned(), EffectValue::Text(letter));
    parameters.insert("time_s".to_owned(), EffectValue::Number(time_s));
    parameters.insert("size".to_owned(), EffectValue::Number(size));
    Ok(Jump { axis, time_s, size })
}
