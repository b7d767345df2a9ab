//! Ranges of a configuration.

use trueaxis::{
    AccelerometerParameters, Chain, CrossAxis, F32, Fixed, FlexureResponse, ParameterError,
    Parameters,
};

use crate::motion::as_built;

/// A way to spoil one field.
type Spoil = fn(&mut Parameters, f64);

fn accelerometers(parameters: &mut Parameters) -> &mut AccelerometerParameters {
    parameters
        .accelerometers
        .get_or_insert(AccelerometerParameters {
            weight_m_s: [1e-6; 3],
            bias_m_s2: [0.0; 3],
            scale_error: [0.0; 3],
            misalignment_rad: CrossAxis::default(),
            lever_arm_m: [[0.0; 3]; 3],
        })
}

const SPOILED: &[(Spoil, ParameterError, &[f64])] = &[
    (
        |p, v| p.pulse_weight_rad[1] = v,
        ParameterError::PulseWeight,
        &[0.0, -3.9e-6, 1e-3, 1.1e-11],
    ),
    (
        |p, v| p.bias_rad_s[2] = v,
        ParameterError::Bias,
        &[0.011, -0.011],
    ),
    (
        |p, v| p.scale_error[0] = v,
        ParameterError::ScaleError,
        &[0.01, -0.01],
    ),
    (
        |p, v| p.installation_rad.zx = v,
        ParameterError::Installation,
        &[0.008, -0.008],
    ),
    (
        |p, v| p.flexure_s2.yz = v,
        ParameterError::Flexure,
        &[5.01e-7, -5.01e-7],
    ),
    (
        |p, v| p.pickoff_gain[1] = v,
        ParameterError::PickoffGain,
        &[-0.1, 2.1],
    ),
    (
        |p, v| p.pickoff_weight_rad = v,
        ParameterError::PickoffWeight,
        &[0.0, -1e-9, 1e-3],
    ),
    (
        |p, v| p.sample_rate_hz = v,
        ParameterError::SampleRate,
        &[0.0, -4000.0, 499.0, 8001.0],
    ),
    (
        |p, v| p.pickoff_delay_s[2] = v,
        ParameterError::PickoffDelay,
        &[1.1e-4, -1.1e-4],
    ),
    (
        |p, v| p.dither_frequency_hz[0] = v,
        ParameterError::DitherFrequency,
        &[0.0, -400.0, 4001.0],
    ),
    (
        |p, v| p.dither_amplitude_rad[1] = v,
        ParameterError::DitherAmplitude,
        &[-1e-6, 0.011],
    ),
    (
        |p, v| p.adaptation_time_s = v,
        ParameterError::AdaptationTime,
        &[-1.0, 0.09, 1001.0],
    ),
    (
        |p, v| accelerometers(p).weight_m_s[0] = v,
        ParameterError::AccelerometerWeight,
        &[0.0, -1e-6, 0.011],
    ),
    (
        |p, v| accelerometers(p).bias_m_s2[1] = v,
        ParameterError::AccelerometerBias,
        &[1.1, -1.1],
    ),
    (
        |p, v| accelerometers(p).scale_error[2] = v,
        ParameterError::AccelerometerScale,
        &[0.01, -0.01],
    ),
    (
        |p, v| accelerometers(p).misalignment_rad.xz = v,
        ParameterError::AccelerometerMisalignment,
        &[0.008, -0.008],
    ),
    (
        |p, v| accelerometers(p).lever_arm_m[1][2] = v,
        ParameterError::LeverArm,
        &[0.51, -0.51],
    ),
];

#[test]
fn each_field_is_refused_by_its_own_name() {
    assert_eq!(as_built().check(), Ok(()));
    assert_eq!(Parameters::default().check(), Ok(()));
    for (spoil, error, values) in SPOILED {
        let not_finite = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        for value in values.iter().copied().chain(not_finite) {
            let mut parameters = as_built();
            spoil(&mut parameters, value);
            assert_eq!(parameters.check(), Err(*error), "{value}");
            assert_eq!(Chain::<F32>::new(&parameters).err(), Some(*error));
            assert_eq!(Chain::<Fixed>::new(&parameters).err(), Some(*error));
        }
    }
}

#[test]
fn counts_of_samples_and_terms_have_ranges() {
    for samples_per_output in [0, 41, u16::MAX] {
        let parameters = as_built().with(|p| p.samples_per_output = samples_per_output);
        assert_eq!(parameters.check(), Err(ParameterError::SamplesPerOutput));
    }
    for damping in [0.0019, 1.0, -0.005, f64::NAN, f64::INFINITY] {
        let parameters =
            as_built().with(|p| p.flexure_response = FlexureResponse::Mode { damping });
        assert_eq!(parameters.check(), Err(ParameterError::FlexureDamping));
    }
}

#[test]
fn the_flexure_limit_follows_the_sample_rate() {
    let mut parameters = as_built().with(|p| p.sample_rate_hz = 2000.0);
    parameters.flexure_s2.xy = 1.9e-6;
    assert_eq!(parameters.check(), Ok(()));
    parameters.flexure_s2.xy = 2.1e-6;
    assert_eq!(parameters.check(), Err(ParameterError::Flexure));
}

#[test]
fn a_dither_frequency_that_is_used_must_be_sampled_well() {
    let slow = Parameters::default().with(|p| {
        p.sample_rate_hz = 500.0;
        p.samples_per_output = 5;
    });
    assert_eq!(slow.check(), Ok(()));
    for used in [
        slow.with(|p| p.adaptation_time_s = 1.0),
        slow.with(|p| p.dither_amplitude_rad = [0.0, 0.0, 7e-4]),
        slow.with(|p| p.pickoff_delay_s = [0.0, 1e-5, 0.0]),
    ] {
        assert_eq!(used.check(), Err(ParameterError::DitherFrequency));
    }
}
