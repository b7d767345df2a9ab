//! Converts a model into the parameters of the firmware's chain.
//!
//! It takes a [`Model`] and a [`Unit`]: the chain's settings, and the facts of the hardware that a model lacks. It
//! gives [`Parameters`] in SI units, and the kinds of effects that the chain has no term for.
//!
//! The contract's prediction, as rates, with ω the case's rate, p the pickoff angle, e the model's bias:
//!
//! ```text
//! u_i = [M⁻¹ ω]_i + b_i/(1 − s_i) + effects                reading_i = u_i/(1 − s_i) + gain_i dp_i/dt
//! ```
//!
//! and the chain's Eq. (7): ω = M' ((1 − s'_i)(reading_i − gain'_i dp_i/dt) − b'_i). The constant effects
//! that are linear in ω and in the block's rate d_i = gain_i (1 + dg_i) dp_i/dt add up to
//!
//! ```text
//! u = A ω + b/(1 − s) + e + G d      A = M⁻¹ + G + N     G = diag(gyro_scale), e = gyro_bias
//!         ⎡   0     δ_xz  −δ_xy ⎤
//!     N = ⎢ −δ_yz    0     δ_yx ⎥    the tilts of `installation`, rows x, y, z
//!         ⎣  δ_zy  −δ_zx    0   ⎦
//! ```
//!
//! Split A⁻¹ = M' D⁻¹ with D diagonal so that M' has ones on its diagonal, D_jj = 1/(A⁻¹)_jj. Then
//!
//! ```text
//! 1 − s' = (1 − s)/D      b' = (b/(1 − s) + e)/D      gain' = gain (1 + dg)(1 + g/(1 − s))
//! ```
//!
//! which is exact; to first order ε'_xy = ε_xy0 + δ_xy, ε'_xz = ε_xz0 − δ_xz, s' = s + g (in the signs of Eq. (7): a
//! gyro that reads high has s > 0). `axis_flexure` adds to K, and selects the compensation of the block's mode (a
//! second one with another choice is reported as uncompensated).
//!
//! `dither_delay` becomes the strip's second tap, which turns with the dither's frequency: where
//! the unit's dither is not known, the delay stays and is reported as uncompensated.
//!
//! Accelerometers the same way: f the specific force at the body origin, f_i + size effect the force sensed by
//! accelerometer i,
//!
//! ```text
//! u = A (f + size) + b/(1 − s) + e      A = 1 + N(accel_misalignment) + diag(accel_scale), e = accel_bias
//! reading_i = u_i/(1 − s_i)             size_i = (α × r_i + ω × (ω × r_i))_i, r_i row i of `size_effect`
//! ```
//!
//! (scale error and bias in the sense that they have for the gyros), and the chain's f = M' ((1 − s') reading
//! − b') − size. That A turns the other axes' size effect too is left out: 1e-3 of it.
//!
//! Effects that optional terms of the chain correct become records (`terms`).
//!
//! Out of scope: effects of the recording rather than of the unit (the reference, the Earth's
//! rotation); they leave nothing for the chain to correct and are not reported as uncompensated.

mod terms;

use nalgebra::{Matrix3, Vector3};
use trueaxis::design_parameters::{FLEXURE_DAMPING, MODE_DAMPING_RANGE};
use trueaxis::parameters::AccelerometerParameters;
use trueaxis::{CrossAxis, FlexureResponse, ParameterError, Parameters};

use rlg_model::catalogue::{self, NINE, SIX, XYZ};
use rlg_model::{EffectValue, Model, ModelEffect, MotionSource, Response};

use terms::TermSums;

/// Samples in one output period unless asked otherwise: 2.5 ms at 4 kHz, the step of a 400 Hz
/// navigation computer.
pub const SAMPLES_PER_OUTPUT: u16 = 10;

/// Facts of the recording, not errors of the unit.
const OF_THE_RECORDING: &[&str] = &[
    "reference_misalignment",
    "reference_delay",
    "reference_scale",
    "reference_harmonic",
    "reference_pull",
    "isolator_mode",
    "earth_rate",
];

/// The dither of the unit's blocks; amplitude 0 and 400 Hz where it is not dithered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DitherMotion {
    /// Frequency \[Hz\].
    pub frequency_hz: [f64; 3],
    /// Amplitude of the pickoff's angle \[rad\].
    pub amplitude_rad: [f64; 3],
}

impl Default for DitherMotion {
    fn default() -> Self {
        let neutral = Parameters::default();
        Self {
            frequency_hz: neutral.dither_frequency_hz,
            amplitude_rad: neutral.dither_amplitude_rad,
        }
    }
}

/// Facts of the unit that the chain needs beyond the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Samples per second \[Hz\].
    pub sample_rate_hz: f64,
    /// Samples in one output period.
    pub samples_per_output: u16,
    /// Time in which the strip follows the pickoff \[s\]; 0: frozen.
    pub adaptation_time_s: f64,
    /// The dither, where it is known.
    pub dither: Option<DitherMotion>,
    /// Velocity of one accelerometer code \[m/s\]; `None`: no accelerometers.
    pub accelerometer_weight_m_s: Option<[f64; 3]>,
}

impl Unit {
    /// The commands' defaults: no accelerometers, the dither not known.
    pub fn at(sample_rate_hz: f64) -> Self {
        Self {
            sample_rate_hz,
            samples_per_output: SAMPLES_PER_OUTPUT,
            adaptation_time_s: 0.0,
            dither: None,
            accelerometer_weight_m_s: None,
        }
    }
}

/// The chain's parameters for `model`, and the kinds of its effects that the chain cannot compensate, each
/// once, in the model's order. An error names the parameter that the chain's formats cannot hold.
pub fn parameters_from_model(
    model: &Model,
    unit: &Unit,
) -> Result<(Parameters, Vec<String>), ParameterError> {
    let (parameters, uncompensated) = unchecked_parameters(model, unit)?;
    parameters.check()?;
    Ok((parameters, uncompensated))
}

/// The parameters before the check, for a caller that replaces some of them.
pub fn unchecked_parameters(
    model: &Model,
    unit: &Unit,
) -> Result<(Parameters, Vec<String>), ParameterError> {
    let motion = unit.dither;
    let dithered = model.dither.is_some() || motion.is_some();
    let has_accelerometers = unit.accelerometer_weight_m_s.is_some();
    let mut bias = Vector3::zeros();
    let mut scale = Vector3::zeros();
    let mut dither_gain = Vector3::zeros();
    let mut tilt = [0.0; 6];
    let mut flexure = [0.0; 6];
    let mut response = None;
    let mut delay_s = Vector3::zeros();
    let mut force = ForceErrors::default();
    let mut terms = TermSums::default();
    let mut uncompensated: Vec<String> = Vec::new();
    for effect in model.effects.iter().filter(|effect| acts(effect)) {
        match effect.kind.as_str() {
            "gyro_bias" => bias += xyz(effect),
            "gyro_scale" => scale += xyz(effect),
            "dither_gain" => dither_gain += xyz(effect),
            "installation" => add(&mut tilt, effect),
            "axis_flexure" if response.is_none_or(|known| known == response_of(effect)) => {
                response = Some(response_of(effect));
                add(&mut flexure, effect);
            }
            // without dither there is nothing to be late
            "dither_delay" if motion.is_some() || !dithered => delay_s += xyz(effect),
            "accel_bias" if has_accelerometers => force.bias_m_s2 += xyz(effect),
            "accel_scale" if has_accelerometers => force.scale += xyz(effect),
            "accel_misalignment" if has_accelerometers => add(&mut force.tilt_rad, effect),
            "size_effect" if has_accelerometers => force.add_arms(effect),
            _ if terms.take(effect, has_accelerometers, dithered) => {}
            kind if OF_THE_RECORDING.contains(&kind) || uncompensated.iter().any(|k| k == kind) => {
            }
            kind => uncompensated.push(kind.to_owned()),
        }
    }

    let gyro = &model.gyro;
    let [xy, xz, yx, yz, zx, zy] = gyro.installation_rad.to_array();
    let case_from_sensed = Matrix3::new(1.0, xz, xy, yz, 1.0, yx, zy, zx, 1.0);
    let sensed_from_case = case_from_sensed
        .try_inverse()
        .ok_or(ParameterError::Installation)?;
    let sensitivity = sensed_from_case + tilts(tilt) + Matrix3::from_diagonal(&scale);
    let (installation_rad, stretch) = split(&sensitivity).ok_or(ParameterError::Installation)?;

    let keep = |axis: usize| 1.0 - gyro.scale_error[axis];
    let each = |value: &dyn Fn(usize) -> f64| [value(0), value(1), value(2)];
    let gain = match dithered {
        true => [0, 1, 2].map(|axis| model.pickoff_gain(axis)),
        false => [0.0; 3],
    };
    let accelerometers = match unit.accelerometer_weight_m_s {
        Some(weight_m_s) => Some(force.parameters(model, weight_m_s)?),
        None => None,
    };
    let records = terms.records(stretch.into())?;
    let parameters = Parameters::default().with(|p| {
        p.pulse_weight_rad = gyro.pulse_weight_rad;
        p.bias_rad_s = each(&|i| (gyro.bias_rad_s[i] / keep(i) + bias[i]) / stretch[i]);
        p.scale_error = each(&|i| 1.0 - keep(i) / stretch[i]);
        p.installation_rad = installation_rad;
        p.flexure_s2 = CrossAxis::from_array(flexure);
        p.pickoff_gain = each(&|i| gain[i] * (1.0 + dither_gain[i]) * (1.0 + scale[i] / keep(i)));
        p.sample_rate_hz = unit.sample_rate_hz;
        p.samples_per_output = unit.samples_per_output;
        p.flexure_response = response.unwrap_or_default();
        p.pickoff_delay_s = each(&|i| {
            let swings = motion.is_some_and(|motion| motion.amplitude_rad[i] > 0.0);
            if swings { delay_s[i] } else { 0.0 }
        });
        p.dither_frequency_hz = motion.unwrap_or_default().frequency_hz;
        p.dither_amplitude_rad = motion.unwrap_or_default().amplitude_rad;
        p.adaptation_time_s = if dithered {
            unit.adaptation_time_s
        } else {
            0.0
        };
        p.accelerometers = accelerometers;
        p.terms = records;
    });
    Ok((parameters, uncompensated))
}

// A model's range and usual value are the chain's.
const _: () = {
    let (least, greatest) = MODE_DAMPING_RANGE;
    let [model_least, model_greatest] = catalogue::FLEXURE_DAMPING;
    assert!(least == model_least && greatest == model_greatest);
    assert!(FLEXURE_DAMPING == catalogue::USUAL_FLEXURE_DAMPING);
};

/// Returns the response of a flexure to the acceleration.
fn response_of(effect: &ModelEffect) -> FlexureResponse {
    match (effect.response(), effect.damping()) {
        (Response::Static, _) => FlexureResponse::Static,
        (Response::Mode, Some(damping)) => FlexureResponse::Mode { damping },
        (Response::Mode, None) => FlexureResponse::default(),
    }
}

/// Errors of the accelerometers that the model's effects add up to.
#[derive(Default)]
struct ForceErrors {
    bias_m_s2: Vector3<f64>,
    scale: Vector3<f64>,
    tilt_rad: [f64; 6],
    lever_arm_m: [[f64; 3]; 3],
}

impl ForceErrors {
    fn add_arms(&mut self, effect: &ModelEffect) {
        for (sum, name) in self.lever_arm_m.as_flattened_mut().iter_mut().zip(NINE) {
            *sum += effect.number(name);
        }
    }

    fn parameters(
        &self,
        model: &Model,
        weight_m_s: [f64; 3],
    ) -> Result<AccelerometerParameters, ParameterError> {
        let neutral = ([0.0; 3], [0.0; 3]);
        let (bias, scale) = model
            .accelerometer
            .as_ref()
            .map_or(neutral, |known| (known.bias_m_s2, known.scale_error));
        let sensitivity =
            Matrix3::identity() + tilts(self.tilt_rad) + Matrix3::from_diagonal(&self.scale);
        let (misalignment_rad, stretch) =
            split(&sensitivity).ok_or(ParameterError::AccelerometerMisalignment)?;
        let keep = |axis: usize| 1.0 - scale[axis];
        let each = |value: &dyn Fn(usize) -> f64| [value(0), value(1), value(2)];
        Ok(AccelerometerParameters {
            weight_m_s,
            bias_m_s2: each(&|i| (bias[i] / keep(i) + self.bias_m_s2[i]) / stretch[i]),
            scale_error: each(&|i| 1.0 - keep(i) / stretch[i]),
            misalignment_rad,
            lever_arm_m: self.lever_arm_m,
        })
    }
}

/// N: change of a triad's readings by tilts δ_ij.
fn tilts([xy, xz, yx, yz, zx, zy]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(0.0, xz, -xy, -yz, 0.0, yx, zy, -zx, 0.0)
}

/// A⁻¹ = M' D⁻¹: the angles of M' and the diagonal of D; `None` for an A without inverse.
fn split(sensitivity: &Matrix3<f64>) -> Option<(CrossAxis<f64>, Vector3<f64>)> {
    let inverse = sensitivity.try_inverse()?;
    let stretch = inverse.diagonal().map(|diagonal| 1.0 / diagonal);
    let unit_diagonal = inverse * Matrix3::from_diagonal(&stretch);
    let angles = CrossAxis::from_array([
        unit_diagonal[(0, 2)],
        unit_diagonal[(0, 1)],
        unit_diagonal[(1, 2)],
        unit_diagonal[(1, 0)],
        unit_diagonal[(2, 1)],
        unit_diagonal[(2, 0)],
    ]);
    Some((angles, stretch))
}

/// Reason that the drift against the recording's reference would not be the gyros' drift under `model`, if there is one.
pub fn reference_is_no_truth(model: &Model) -> Option<String> {
    if model.motion == MotionSource::Static {
        return Some("the model's motion is static, not the reference's".to_owned());
    }
    if !model.earth_rate_in_reference {
        return Some(
            "the model says that the reference lacks the Earth's rotation, which the gyros sense"
                .to_owned(),
        );
    }
    let of_the_reference = |kind: &str| kind.starts_with("reference_") || kind == "earth_rate";
    let effect = model
        .effects
        .iter()
        .find(|effect| acts(effect) && of_the_reference(&effect.kind))?;
    Some(format!(
        "the model has {}, which is not taken out of the reference",
        effect.kind
    ))
}

/// True if any of its numbers is other than 0.
fn acts(effect: &ModelEffect) -> bool {
    let mut values = effect.parameters.values();
    let zero = |value: &EffectValue| matches!(value, EffectValue::Number(number) if *number == 0.0);
    // `unlisted` may have text alone: an expression.
    !values.all(zero)
}

fn xyz(effect: &ModelEffect) -> Vector3<f64> {
    Vector3::from_iterator(XYZ.iter().map(|axis| effect.number(axis)))
}

fn add(six: &mut [f64; 6], effect: &ModelEffect) {
    for (sum, name) in six.iter_mut().zip(SIX) {
        *sum += effect.number(name);
    }
}
