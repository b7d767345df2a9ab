//! What a configuration may ask for.

use trueaxis::{Chain, F32, Fixed, ParameterError, Parameters};

use crate::motion::as_built;

/// A way to spoil one field.
type Spoil = fn(&mut Parameters, f64);

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
        let parameters = Parameters {
            samples_per_output,
            ..as_built()
        };
        assert_eq!(parameters.check(), Err(ParameterError::SamplesPerOutput));
    }
    for acceleration_order in [0, 5, u8::MAX] {
        let parameters = Parameters {
            acceleration_order,
            ..as_built()
        };
        assert_eq!(parameters.check(), Err(ParameterError::AccelerationOrder));
    }
}

#[test]
fn the_flexure_limit_follows_the_sample_rate() {
    let mut parameters = Parameters {
        sample_rate_hz: 2000.0,
        ..as_built()
    };
    parameters.flexure_s2.xy = 1.9e-6;
    assert_eq!(parameters.check(), Ok(()));
    parameters.flexure_s2.xy = 2.1e-6;
    assert_eq!(parameters.check(), Err(ParameterError::Flexure));
}
