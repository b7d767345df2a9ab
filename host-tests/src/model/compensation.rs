//! A model → what the firmware's chain corrects.
//!
//! Enters: [`Model`], the sample rate \[Hz\], samples per output, the order of the acceleration filter.
//! Leaves: [`Parameters`] in SI units, and the kinds of effects that the chain has no term for.
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
//! which is exact; to first order ε'_xy = ε_xy0 + δ_xy, ε'_xz = ε_xz0 − δ_xz, s' = s + g (in the signs
//! of Eq. (7): a gyro that reads high has s > 0). `axis_flexure` adds to K; its products with the other
//! small angles (1e-3 of the effect itself) are left out.
//!
//! Deliberately not here: effects of the recording rather than of the unit (the reference, the Earth's
//! rotation); they leave nothing for the chain to correct and are not reported as uncompensated.

use nalgebra::{Matrix3, Vector3};
use trueaxis::{CrossAxis, ParameterError, Parameters};

use super::catalogue::{SIX, XYZ};
use super::{EffectValue, Model, ModelEffect, MotionSource};

/// Samples in one output period unless asked otherwise: 2.5 ms at 4 kHz, the step of a 400 Hz
/// navigation computer.
pub const SAMPLES_PER_OUTPUT: u16 = 10;

/// Terms of the acceleration filter unless asked otherwise: the most exact of the chain's four.
pub const ACCELERATION_ORDER: u8 = 4;

/// Facts of the recording, not errors of the unit.
const OF_THE_RECORDING: &[&str] = &[
    "reference_misalignment",
    "reference_delay",
    "reference_scale",
    "reference_harmonic",
    "isolator_mode",
    "earth_rate",
];

/// The chain's parameters for `model`, and the kinds of its effects that the chain cannot compensate, each
/// once, in the model's order. An error names the parameter that the chain's formats cannot hold.
pub fn parameters_from_model(
    model: &Model,
    sample_rate_hz: f64,
    samples_per_output: u16,
    acceleration_order: u8,
) -> Result<(Parameters, Vec<String>), ParameterError> {
    let (parameters, uncompensated) = unchecked_parameters(
        model,
        sample_rate_hz,
        samples_per_output,
        acceleration_order,
    )?;
    parameters.check()?;
    Ok((parameters, uncompensated))
}

/// The same before the check, for a caller that replaces some of them.
pub(crate) fn unchecked_parameters(
    model: &Model,
    sample_rate_hz: f64,
    samples_per_output: u16,
    acceleration_order: u8,
) -> Result<(Parameters, Vec<String>), ParameterError> {
    let mut bias = Vector3::zeros();
    let mut scale = Vector3::zeros();
    let mut dither_gain = Vector3::zeros();
    let mut tilt = [0.0; 6];
    let mut flexure = [0.0; 6];
    let mut uncompensated: Vec<String> = Vec::new();
    for effect in model.effects.iter().filter(|effect| acts(effect)) {
        match effect.kind.as_str() {
            "gyro_bias" => bias += xyz(effect),
            "gyro_scale" => scale += xyz(effect),
            "dither_gain" => dither_gain += xyz(effect),
            "installation" => add(&mut tilt, effect),
            "axis_flexure" => add(&mut flexure, effect),
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
    let [xy, xz, yx, yz, zx, zy] = tilt;
    let tilts = Matrix3::new(0.0, xz, -xy, -yz, 0.0, yx, zy, -zx, 0.0);
    let with_effects = sensed_from_case + tilts + Matrix3::from_diagonal(&scale);
    let inverse = with_effects
        .try_inverse()
        .ok_or(ParameterError::Installation)?;
    let stretch = inverse.diagonal().map(|diagonal| 1.0 / diagonal);
    let unit_diagonal = inverse * Matrix3::from_diagonal(&stretch);

    let keep = |axis: usize| 1.0 - gyro.scale_error[axis];
    let each = |value: &dyn Fn(usize) -> f64| [value(0), value(1), value(2)];
    let gain = model
        .dither
        .as_ref()
        .map_or([0.0; 3], |dither| dither.pickoff_gain);
    let parameters = Parameters {
        pulse_weight_rad: gyro.pulse_weight_rad,
        bias_rad_s: each(&|i| (gyro.bias_rad_s[i] / keep(i) + bias[i]) / stretch[i]),
        scale_error: each(&|i| 1.0 - keep(i) / stretch[i]),
        installation_rad: CrossAxis::from_array([
            unit_diagonal[(0, 2)],
            unit_diagonal[(0, 1)],
            unit_diagonal[(1, 2)],
            unit_diagonal[(1, 0)],
            unit_diagonal[(2, 1)],
            unit_diagonal[(2, 0)],
        ]),
        flexure_s2: CrossAxis::from_array(flexure),
        pickoff_gain: each(&|i| gain[i] * (1.0 + dither_gain[i]) * (1.0 + scale[i] / keep(i))),
        sample_rate_hz,
        samples_per_output,
        acceleration_order,
        ..Parameters::default()
    };
    Ok((parameters, uncompensated))
}

/// Why the drift against the recording's reference would not be the gyros' drift under `model`, if so.
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

/// Whether any of its numbers is other than 0.
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
