//! The range of every number in a record ends at its term's limit, at 4 kHz with fine codes.

use trueaxis::terms::AllTerms;
use trueaxis::{Chain, CrossAxis, F32, Fixed, ParameterError, Parameters, TermKind as K};

use crate::unit::parameters;

fn checked(known: &Parameters) -> Result<(), ParameterError> {
    let of_f32 = Chain::<F32, AllTerms<F32>>::with_terms(known).map(|_| ());
    let of_fixed = Chain::<Fixed, AllTerms<Fixed>>::with_terms(known).map(|_| ());
    assert_eq!(of_f32, of_fixed);
    of_f32
}

/// The kind's record of zeros but for one value, of both signs.
fn ends_at(kind: K, at: usize, limit: f64) {
    for sign in [1.0, -1.0] {
        let of = |value: f64| {
            let mut values = vec![0.0; kind.values()];
            values[at] = sign * value;
            checked(&parameters(&[(kind, values)]))
        };
        // Factors of a limit are rounded; the test is of the limit.
        let (inside, outside) = (limit * (1.0 - 1e-12), limit * (1.0 + 1e-12));
        assert_eq!(of(inside), Ok(()), "{kind} {at}: {inside:e}");
        assert_eq!(
            of(outside),
            Err(ParameterError::Term(kind)),
            "{kind} {at}: {outside:e}"
        );
    }
}

/// T \[s\], and the rate's square, as limits per sample have them.
const PERIOD_S: f64 = 1.0 / 4000.0;
const RATE_SQUARED: f64 = 16e6;
/// A velocity increment of 1: 256 m/s over a period.
const FORCE_M_S2: f64 = 256.0 * 4000.0;
/// Largest velocity increment of a term: a quarter m/s with 4 % of errors, and the addition of a delay.
const LARGEST_VELOCITY: f64 = 1.04 * 0.25 / 256.0 + 1.0 / 2048.0;

#[test]
fn each_value_of_a_record_ends_at_its_terms_limit() {
    // 100 K make the limit of a constant; 1e4 K² of the squares.
    for gyro in 3..6 {
        ends_at(K::GyroBiasTemperature, gyro, 1e-4);
        ends_at(K::GyroBiasTemperature, gyro + 3, 1e-6);
        ends_at(K::GyroScaleTemperature, gyro, 1.0 / 12_800.0);
        ends_at(K::GyroScaleTemperature, gyro + 3, 1.0 / 1_280_000.0);
    }
    for pair in 3..9 {
        ends_at(K::InstallationTemperature, pair, 1.0 / 12_800.0);
        ends_at(K::InstallationTemperature, pair + 6, 1.0 / 1_280_000.0);
    }
    for axis in 0..3 {
        // 0.1 K/s make a bias of 0.01 rad/s.
        ends_at(K::GyroBiasTemperatureRate, axis, 0.1);
        ends_at(K::GyroDelay, axis, 0.4 * PERIOD_S);
        ends_at(K::AccelDelay, axis, 0.4 * PERIOD_S);
        // E, at most 20/3 ½ v of the largest increment and of the dither's residual, is within 0.0155.
        let largest = 0.003_417_968_75 + 1.0 / 8192.0;
        ends_at(
            K::GyroBandwidth,
            axis,
            PERIOD_S * PERIOD_S * 0.0155 / (20.0 / 3.0 * largest),
        );
        // Half of 1/128, at twice the limit of counts.
        ends_at(K::GyroScaleAsymmetry, axis, 1.0 / 256.0);
        ends_at(
            K::GyroScaleQuadratic,
            axis,
            PERIOD_S / 256.0 / (2.0 * 0.002_441_406_25),
        );
        // The slope's 63 binds first.
        ends_at(K::GyroScaleCubic, axis, 63.0 / RATE_SQUARED);
        ends_at(
            K::GyroG2Bias,
            axis,
            1.0 / 16_384.0 / (LARGEST_VELOCITY * LARGEST_VELOCITY) / (256.0 * FORCE_M_S2),
        );
        ends_at(K::AccelQuadratic, axis, 1.0 / 128.0 / (0.25 * 4000.0));
        ends_at(K::DitherCubic, axis, 4e6);
    }
    for pair in 0..6 {
        ends_at(
            K::AxisTiltByForce,
            pair,
            1.0 / 1024.0 / LARGEST_VELOCITY / FORCE_M_S2,
        );
        ends_at(K::DitherCrosstalk, pair, 1.0 / 64.0);
        // Q α³ of the largest cube, 2⁻¹³ a sample², is within 32 of that acceleration.
        ends_at(
            K::AxisFlexureCubic,
            pair,
            32.0 * 2f64.powi(26) / RATE_SQUARED.powi(3),
        );
    }
    for element in 0..9 {
        ends_at(K::GyroGBias, element, 5e-5);
        // Half of 0.0155 by the largest force that the filter forms, 16/3 of the largest velocity.
        ends_at(
            K::ElasticRateByForce,
            element,
            0.5 * 0.0155 / (16.0 / 3.0 * LARGEST_VELOCITY) / FORCE_M_S2,
        );
        // An eighth of the slope's 63.
        ends_at(K::ElasticRateByJerk, element, 63.0 / 8.0 / RATE_SQUARED);
        // 0.01 rad/s at 0.1 T, in f32.
        ends_at(K::GyroBiasMagnetic, element, 0.01 / f64::from(0.1f32));
    }
}

/// A reference of 0 stands for the first temperature; others are temperatures of 150 to 450 K.
#[test]
fn reference_temperatures_are_zero_or_temperatures() {
    for kind in [
        K::GyroBiasTemperature,
        K::GyroScaleTemperature,
        K::InstallationTemperature,
    ] {
        for at in 0..3 {
            let of = |reference_k: f64| {
                let mut values = vec![0.0; kind.values()];
                values[at] = reference_k;
                checked(&parameters(&[(kind, values)]))
            };
            for good in [0.0, 150.0, 450.0] {
                assert_eq!(of(good), Ok(()), "{kind}: {good} K");
            }
            for bad in [1.0, -150.0, 150f64.next_down(), 450f64.next_up()] {
                assert_eq!(of(bad), Err(ParameterError::Term(kind)), "{kind}: {bad} K");
            }
        }
    }
}

/// Rows add up: three elements of a third of the limit each are as much as one of the whole.
#[test]
fn the_elements_of_a_gyros_row_share_its_limit() {
    let limits = [
        (
            K::ElasticRateByForce,
            0.5 * 0.0155 / (16.0 / 3.0 * LARGEST_VELOCITY) / FORCE_M_S2,
        ),
        (K::ElasticRateByJerk, 63.0 / 8.0 / RATE_SQUARED),
    ];
    for (kind, limit) in limits {
        for row in 0..3 {
            let of = |share: f64| {
                let mut values = vec![0.0; 9];
                values[3 * row..3 * row + 3]
                    .copy_from_slice(&[share, -share, share].map(|share| share * limit));
                checked(&parameters(&[(kind, values)]))
            };
            assert_eq!(of(0.333_333), Ok(()), "{kind} {row}");
            assert_eq!(
                of(0.333_334),
                Err(ParameterError::Term(kind)),
                "{kind} {row}"
            );
        }
        // Rows are apart.
        assert_eq!(
            checked(&parameters(&[(kind, vec![0.333_333 * limit; 9])])),
            Ok(())
        );
    }
}

/// Frequencies of 40 Hz to half the sample rate at 4 kHz, dampings of 0.002 to 0.99; the refusal names the number and its range.
#[test]
fn a_mode_has_a_frequency_and_a_damping_within_their_ranges() {
    let of = |frequency_hz: f64, damping: f64| {
        let values = vec![1e-9, 0.0, 0.0, 0.0, 0.0, 0.0, frequency_hz, damping];
        checked(&parameters(&[(K::AxisFlexureMode, values)]))
    };
    for (frequency_hz, damping) in [
        (40.0, 0.1),
        (1200.0, 0.1),
        (2000.0, 0.1),
        (150.0, 0.002),
        (2000.0, 0.002),
        (150.0, 0.99),
        (2000.0, 0.99),
    ] {
        assert_eq!(
            of(frequency_hz, damping),
            Ok(()),
            "{frequency_hz} Hz, {damping}"
        );
    }
    let frequency = (
        ParameterError::ModeFrequency,
        "frequency_hz",
        "40 to 2000 Hz",
    );
    let ratio = (ParameterError::ModeDamping, "damping", "0.002 to 0.99");
    for ((frequency_hz, damping), (error, name, range)) in [
        ((39.999, 0.1), frequency),
        ((2000.001, 0.1), frequency),
        ((f64::NAN, 0.1), frequency),
        ((150.0, 0.001_999), ratio),
        ((150.0, 0.990_001), ratio),
    ] {
        assert_eq!(
            of(frequency_hz, damping),
            Err(error),
            "{frequency_hz} Hz, {damping}"
        );
        let said = error.to_string();
        assert!(said.contains(name) && said.contains(range), "{said}");
    }
}

/// Those that multiply a force, as soon as one of their numbers is not zero.
#[test]
fn terms_that_need_accelerometers_say_so() {
    for (kind, needs) in [
        (K::GyroGBias, true),
        (K::AxisTiltByForce, true),
        (K::GyroG2Bias, true),
        (K::ElasticRateByForce, true),
        (K::ElasticRateByJerk, false),
    ] {
        for at in 0..kind.values() {
            let mut values = vec![0.0; kind.values()];
            let without = |values: &[f64]| {
                checked(&parameters(&[(kind, values.to_vec())]).with(|p| p.accelerometers = None))
            };
            assert_eq!(without(&values), Ok(()), "{kind}");
            values[at] = 1e-12;
            let expected = if needs {
                Err(ParameterError::TermNeedsAccelerometers(kind))
            } else {
                Ok(())
            };
            assert_eq!(without(&values), expected, "{kind} {at}");
        }
    }
}

/// The largest increment of a unit whose strip reaches far grows with the scale error; the last value that is taken fills
/// the limit to the last bit.
fn fills(
    samples_per_output: u16,
    [sample_rate_hz, frequency_hz, delay_s]: [f64; 3],
    has_cubic: bool,
    expected: (f64, ParameterError),
) {
    let of = |scale_error: f64| {
        let records = [
            (K::ElasticRateByJerk, vec![1e-12; 9]),
            (K::DitherCubic, vec![if has_cubic { 1e-3 } else { 0.0 }; 3]),
        ];
        parameters(&records).with(|p| {
            p.sample_rate_hz = sample_rate_hz;
            p.samples_per_output = samples_per_output;
            p.dither_frequency_hz = [frequency_hz; 3];
            p.dither_amplitude_rad = [1e-4; 3];
            p.adaptation_time_s = 20.0;
            p.pickoff_delay_s = [delay_s; 3];
            p.installation_rad = CrossAxis::from_array([1.0 / 128.0; 6]);
            p.scale_error = [scale_error; 3];
        })
    };
    let (limit, error) = expected;
    let (mut taken, mut refused) = (1.0 / 128.0, -1.0 / 128.0);
    assert_eq!(checked(&of(taken)), Ok(()));
    assert_eq!(checked(&of(refused)), Err(error));
    loop {
        let between = 0.5 * (taken + refused);
        if between == taken || between == refused {
            break;
        }
        match checked(&of(between)) {
            Ok(()) => taken = between,
            Err(found) => {
                assert_eq!(found, error);
                refused = between;
            }
        }
    }
    // Delay and elastic rates may add 2⁻¹¹ each, the pickoff's cubic error 2⁻¹³.
    let cubic = if has_cubic { 1.0 / 8192.0 } else { 0.0 };
    let added = of(taken).largest_increment_rad() + 1.0 / 1024.0 + cubic;
    let filled = if error == ParameterError::OutputPeriod {
        added * f64::from(samples_per_output)
    } else {
        added
    };
    assert_eq!(filled, limit);
}

#[test]
fn what_terms_add_may_fill_an_increment_and_an_output_period_and_no_more() {
    let too_large = (0.0078, ParameterError::TermsTooLarge);
    fills(1, [8000.0, 320.0, 9.4e-5], true, too_large);
    let period = (0.1767, ParameterError::OutputPeriod);
    fills(32, [4000.0, 743.0, 1e-4], false, period);
}
