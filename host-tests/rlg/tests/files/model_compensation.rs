//! The chain's parameters are the inverse of the model's sensing of the gyros.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use rlg::model::{Dither, EffectValue, Gyro, Installation, Model, ModelEffect, MotionSource};
use rlg::parameters::{Unit, parameters_from_model};
use trueaxis::TermKind;

/// Rounding of some thirty f64 operations on rates of order 1 rad/s: 30 · 2⁻⁵³ · 1 rad/s.
const ROUNDING_RAD_S: f64 = 4e-15;

const XYZ: [&str; 3] = ["x", "y", "z"];
const SIX: [&str; 6] = ["xy", "xz", "yx", "yz", "zx", "zy"];

fn effect(kind: &str, names: &[&str], values: &[f64]) -> ModelEffect {
    let parameters = names.iter().zip(values);
    ModelEffect {
        kind: kind.to_owned(),
        parameters: parameters
            .map(|(name, value)| ((*name).to_owned(), EffectValue::Number(*value)))
            .collect::<BTreeMap<_, _>>(),
    }
}

fn model(scale: [f64; 3], bias: [f64; 3], angles: [f64; 6], gain: [f64; 3]) -> Model {
    Model {
        motion: MotionSource::Reference,
        earth_rate_in_reference: true,
        gyro: Gyro {
            pulse_weight_rad: [2e-6; 3],
            bias_rad_s: bias,
            scale_error: scale,
            angle_random_walk_rad_sqrt_s: None,
            rate_random_walk_rad_s_sqrt_s: None,
            flicker_rad_s: None,
            installation_rad: Installation::from_array(angles),
        },
        dither: Some(Dither {
            pickoff_gain: gain,
            pickoff_noise_rad: [0.0; 3],
        }),
        reference: None,
        accelerometer: None,
        effects: Vec::new(),
    }
}

fn three(limit: f64) -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-limit..limit)
}

fn six(limit: f64) -> impl Strategy<Value = [f64; 6]> {
    prop::array::uniform6(-limit..limit)
}

/// M of Eq. (7) as printed: rows x, y, z.
fn eq7([xy, xz, yx, yz, zx, zy]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(1.0, xz, xy, yz, 1.0, yx, zy, zx, 1.0)
}

proptest! {
    #[test]
    fn constant_effects_vanish_from_the_compensated_rate(
        case in three(1.0),
        pickoff_rate in three(1.0),
        (scale, bias, angles) in (three(1e-3), three(1e-4), six(1e-3)),
        (more_bias, more_scale, tilts, dither_gain) in (three(1e-4), three(1e-3), six(1e-3), three(1e-2)),
        gain in prop::array::uniform3(0.9..1.1),
    ) {
        let mut model = model(scale, bias, angles, gain);
        model.effects = vec![
            effect("gyro_bias", &XYZ, &more_bias),
            effect("gyro_scale", &XYZ, &more_scale),
            effect("installation", &SIX, &tilts),
            effect("dither_gain", &XYZ, &dither_gain),
        ];
        // The gyros' rates, from the contract's words and small tilts of the sensing axes.
        let w = Vector3::from(case);
        let static_part = eq7(angles).try_inverse().expect("small angles") * w;
        let [xy, xz, yx, yz, zx, zy] = tilts;
        let tilted = [xz * w.y - xy * w.z, yx * w.z - yz * w.x, zy * w.x - zx * w.y];
        let reading = |i: usize| {
            let block = gain[i] * (1.0 + dither_gain[i]) * pickoff_rate[i];
            let sensed = static_part[i] + bias[i] / (1.0 - scale[i])
                + more_bias[i] + more_scale[i] * (w[i] + block) + tilted[i];
            sensed / (1.0 - scale[i]) + block
        };
        // Eq. (7) with the chain's parameters.
        let (p, left) = parameters_from_model(&model, &Unit::at(4000.0)).expect("in range");
        prop_assert!(left.is_empty());
        let corrected = |i: usize| {
            (1.0 - p.scale_error[i]) * (reading(i) - p.pickoff_gain[i] * pickoff_rate[i]) - p.bias_rad_s[i]
        };
        let back = eq7(p.installation_rad.to_array())
            * Vector3::new(corrected(0), corrected(1), corrected(2));
        prop_assert!((back - w).amax() < ROUNDING_RAD_S, "{:e}", (back - w).amax());
    }
}

#[test]
fn a_model_without_effects_is_handed_on_as_it_is() {
    let angles = [1e-4, -2e-4, 3e-4, -4e-4, 5e-4, -6e-4];
    let model = model([0.0; 3], [1e-6, 2e-6, 3e-6], angles, [1.0, 1.01, 0.99]);
    let (p, left) = parameters_from_model(&model, &Unit::at(4000.0)).expect("in range");
    assert!(left.is_empty());
    assert_eq!(p.pickoff_gain, [1.0, 1.01, 0.99]);
    for (ours, given) in p.installation_rad.to_array().iter().zip(angles) {
        assert!((ours - given).abs() < ROUNDING_RAD_S);
    }
}

#[test]
fn the_flexure_is_handed_on_by_name_and_twice_listed_adds_up() {
    let k = [1e-8, 2e-8, 3e-8, 4e-8, 5e-8, 6e-8];
    let mut model = model([0.0; 3], [0.0; 3], [0.0; 6], [1.0; 3]);
    model.effects = vec![
        effect("axis_flexure", &SIX, &k),
        effect("axis_flexure", &["zy"], &[1e-8]),
    ];
    let (p, left) = parameters_from_model(&model, &Unit::at(4000.0)).expect("in range");
    assert!(left.is_empty());
    let (xy, zy) = (p.flexure_s2.xy, p.flexure_s2.zy);
    assert_eq!((xy, zy), (1e-8, 6e-8 + 1e-8));
}

#[test]
fn what_the_chain_has_no_term_for_is_named_once_and_facts_of_the_recording_are_not() {
    let mut model = model([0.0; 3], [0.0; 3], [0.0; 6], [1.0; 3]);
    model.effects = vec![
        effect("gyro_g_bias", &["xx"], &[1e-8]),
        effect("lock_in", &["x"], &[1e-4]),
        effect("gyro_g_bias", &["yy"], &[1e-8]),
        effect("reference_delay", &["all"], &[1e-3]),
        effect("elastic_rate_by_jerk", &["xx"], &[0.0]),
    ];
    let (_, left) = parameters_from_model(&model, &Unit::at(4000.0)).expect("in range");
    // The bias by force needs accelerometers.
    assert_eq!(left, ["gyro_g_bias", "lock_in"]);
}

#[test]
fn a_gyro_s_smoothing_becomes_a_record_and_its_low_pass_is_left() {
    let mut model = model([0.0; 3], [0.0; 3], [0.0; 6], [1.0; 3]);
    model.effects = vec![effect("gyro_bandwidth", &["y"], &[2e-8])];
    let made = |model: &Model| parameters_from_model(model, &Unit::at(4000.0)).expect("in range");
    let (p, left) = made(&model);
    assert!(left.is_empty(), "{left:?}");
    let expected = [0.0, 2e-8, 0.0];
    assert_eq!(p.terms.values::<3>(TermKind::GyroBandwidth), expected);
    let low_pass = effect("gyro_bandwidth", &["x_pole_s"], &[1e-3]);
    model.effects.push(low_pass);
    let (p, left) = made(&model);
    assert_eq!(left, ["gyro_bandwidth"]);
    assert_eq!(p.terms.values::<3>(TermKind::GyroBandwidth), expected);
}

#[test]
fn a_suspension_s_mode_becomes_a_record_and_a_second_one_is_left() {
    let mode = |k: f64, frequency_hz: f64| {
        effect(
            "axis_flexure_mode",
            &["zy", "frequency_hz", "damping"],
            &[k, frequency_hz, 0.02],
        )
    };
    let mut model = model([0.0; 3], [0.0; 3], [0.0; 6], [1.0; 3]);
    model.effects = vec![mode(6e-8, 300.0), mode(1e-8, 300.0)];
    let made = |model: &Model| parameters_from_model(model, &Unit::at(4000.0)).expect("in range");
    let (p, left) = made(&model);
    assert!(left.is_empty(), "{left:?}");
    assert_eq!(
        p.terms.values::<8>(TermKind::AxisFlexureMode),
        [0.0, 0.0, 0.0, 0.0, 0.0, 6e-8 + 1e-8, 300.0, 0.02]
    );
    model.effects.push(mode(1e-8, 500.0));
    let (p, left) = made(&model);
    assert_eq!(left, ["axis_flexure_mode"]);
    assert_eq!(
        p.terms.values::<8>(TermKind::AxisFlexureMode)[5],
        6e-8 + 1e-8
    );
}

#[test]
fn effects_of_optional_terms_become_records_and_twice_listed_add_up() {
    let mut model = model([0.0; 3], [0.0; 3], [0.0; 6], [1.0; 3]);
    model.effects = vec![
        effect("gyro_delay", &XYZ, &[1e-5, 2e-5, 3e-5]),
        effect("gyro_delay", &["y"], &[1e-5]),
        effect("gyro_bias_temperature", &XYZ, &[1e-7, 2e-7, 3e-7]),
        effect("installation_temperature", &["zx"], &[1e-6]),
        effect("gyro_g_bias", &["xy", "zz"], &[1e-8, 2e-8]),
    ];
    let unit = Unit {
        accelerometer_weight_m_s: Some([1e-6; 3]),
        ..Unit::at(4000.0)
    };
    let (p, left) = parameters_from_model(&model, &unit).expect("in range");
    assert!(left.is_empty(), "{left:?}");
    let close = |found: &[f64], expected: &[f64]| {
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                (found - expected).abs() <= 1e-6 * expected.abs(),
                "{found} {expected}"
            );
        }
    };
    close(
        &p.terms.values::<3>(TermKind::GyroDelay),
        &[1e-5, 3e-5, 3e-5],
    );
    close(
        &p.terms.values::<9>(TermKind::GyroBiasTemperature),
        &[0.0, 0.0, 0.0, 1e-7, 2e-7, 3e-7, 0.0, 0.0, 0.0],
    );
    assert_eq!(
        p.terms.values::<15>(TermKind::InstallationTemperature)[3 + 4],
        1e-6
    );
    let force = p.terms.values::<9>(TermKind::GyroGBias);
    close(&[force[1], force[8]], &[1e-8, 2e-8]);
    assert_eq!(p.check(), Ok(()));
}

#[test]
fn gyros_without_dither_have_nothing_to_strip() {
    let mut model = model([0.0; 3], [0.0; 3], [0.0; 6], [1.0; 3]);
    model.dither = None;
    let (p, _) = parameters_from_model(&model, &Unit::at(4000.0)).expect("in range");
    assert_eq!(p.pickoff_gain, [0.0; 3]);
}
