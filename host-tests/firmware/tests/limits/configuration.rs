//! Ranges of a configuration to the last step of a float, and the figures that follow from it in closed form.

use trueaxis::design_parameters::{DITHER_LIMIT_RAD, SENSED_LIMIT_RAD};
use trueaxis::{AccelerometerParameters, CrossAxis, ParameterError, Parameters};

/// Sets one field.
type Set = fn(&mut Parameters, f64);

fn accelerometers(p: &mut Parameters) -> &mut AccelerometerParameters {
    p.accelerometers.get_or_insert(AccelerometerParameters {
        weight_m_s: [1e-6; 3],
        bias_m_s2: [0.0; 3],
        scale_error: [0.0; 3],
        misalignment_rad: CrossAxis::default(),
        lever_arm_m: [[0.0; 3]; 3],
    })
}

/// A field, its lowest and its highest value at 4 kHz with one sample an output, and the error's name.
const RANGES: [(Set, f64, f64, ParameterError); 17] = {
    use ParameterError as E;
    [
        (
            |p, v| p.pulse_weight_rad[0] = v,
            1.0 / 17_179_869_184.0,
            1e-4,
            E::PulseWeight,
        ),
        (|p, v| p.bias_rad_s[1] = v, -0.01, 0.01, E::Bias),
        (
            |p, v| p.scale_error[2] = v,
            -0.0078125,
            0.0078125,
            E::ScaleError,
        ),
        (
            |p, v| p.installation_rad.xy = v,
            -0.0078125,
            0.0078125,
            E::Installation,
        ),
        (|p, v| p.flexure_s2.zy = v, -5e-7, 5e-7, E::Flexure),
        (|p, v| p.pickoff_gain[2] = v, 0.0, 2.0, E::PickoffGain),
        (
            |p, v| p.pickoff_weight_rad = v,
            1.0 / 34_359_738_368.0,
            1e-4,
            E::PickoffWeight,
        ),
        (|p, v| p.sample_rate_hz = v, 500.0, 8000.0, E::SampleRate),
        (
            |p, v| p.pickoff_delay_s[0] = v,
            -1e-4,
            1e-4,
            E::PickoffDelay,
        ),
        (
            |p, v| p.dither_frequency_hz[2] = v,
            1.0,
            4000.0,
            E::DitherFrequency,
        ),
        (
            |p, v| p.dither_amplitude_rad[1] = v,
            0.0,
            0.01,
            E::DitherAmplitude,
        ),
        (
            |p, v| p.adaptation_time_s = v,
            0.1,
            1000.0,
            E::AdaptationTime,
        ),
        (
            |p, v| accelerometers(p).weight_m_s[2] = v,
            1e-9,
            1e-2,
            E::AccelerometerWeight,
        ),
        (
            |p, v| accelerometers(p).bias_m_s2[0] = v,
            -1.0,
            1.0,
            E::AccelerometerBias,
        ),
        (
            |p, v| accelerometers(p).scale_error[1] = v,
            -0.0078125,
            0.0078125,
            E::AccelerometerScale,
        ),
        (
            |p, v| accelerometers(p).misalignment_rad.yx = v,
            -0.0078125,
            0.0078125,
            E::AccelerometerMisalignment,
        ),
        (
            |p, v| accelerometers(p).lever_arm_m[1][1] = v,
            -0.5,
            0.5,
            E::LeverArm,
        ),
    ]
};

#[test]
fn every_range_ends_where_it_is_documented_to() {
    for (set, low, high, error) in RANGES {
        let checked = |value: f64| {
            let mut parameters = Parameters::default();
            parameters.samples_per_output = 1;
            set(&mut parameters, value);
            parameters.check()
        };
        assert_eq!(checked(low), Ok(()), "{error:?} at {low:e}");
        assert_eq!(checked(high), Ok(()), "{error:?} at {high:e}");
        assert_eq!(checked(low.next_down()), Err(error), "below {low:e}");
        assert_eq!(checked(high.next_up()), Err(error), "above {high:e}");
    }
}

/// The scaled limit of flexure, 32 increment units, binds from 8 units on: below 1 kHz |K| f² is within 4.
#[test]
fn the_flexure_limit_in_units_of_the_period_is_the_documented_one_at_every_rate() {
    for (rate_hz, limit) in [
        (8000.0, 8.0),
        (4000.0, 8.0),
        (2000.0, 8.0),
        (1000.0, 8.0),
        (999.0, 4.0),
        (500.0, 4.0),
    ] {
        let checked = |k: f64| {
            let mut parameters = Parameters::default();
            parameters.sample_rate_hz = rate_hz;
            parameters.samples_per_output = 1;
            parameters.flexure_s2.yx = k;
            parameters.check()
        };
        let largest = limit / (rate_hz * rate_hz);
        assert_eq!(checked(largest), Ok(()), "{rate_hz} Hz");
        assert_eq!(checked(-largest), Ok(()), "{rate_hz} Hz");
        assert_eq!(
            checked(largest.next_up()),
            Err(ParameterError::Flexure),
            "{rate_hz} Hz"
        );
    }
}

/// 0.04 to 0.4 cycles a sample, where delay, amplitude or adaptation uses the frequency: 160 to 1600 Hz at 4 kHz.
#[test]
fn a_dither_frequency_that_is_used_ends_at_its_share_of_the_sample_rate() {
    let uses: [Set; 3] = [
        |p, _| p.pickoff_delay_s[1] = 1e-6,
        |p, _| p.dither_amplitude_rad[1] = 1e-4,
        |p, _| p.adaptation_time_s = 1.0,
    ];
    for uses in uses {
        let checked = |frequency_hz: f64| {
            let mut parameters = Parameters::default();
            parameters.samples_per_output = 1;
            parameters.dither_frequency_hz[1] = frequency_hz;
            uses(&mut parameters, 0.0);
            parameters.check()
        };
        for good in [160.0, 1600.0] {
            assert_eq!(checked(good), Ok(()), "{good} Hz");
        }
        for bad in [160f64.next_down(), 1600f64.next_up()] {
            assert_eq!(
                checked(bad),
                Err(ParameterError::DitherFrequency),
                "{bad} Hz"
            );
        }
    }
}

/// S + D without matrix: 2⁻⁸·5/8 + 2⁻¹⁰ rad at 4 kHz, in the unit of the rate; and its part by the gains.
#[test]
fn the_largest_increment_is_counts_and_pickoff_at_their_limits() {
    let of =
        |change: fn(&mut Parameters)| Parameters::default().with(change).largest_increment_rad();
    assert_eq!(of(|_| ()), 0.003_417_968_75);
    assert_eq!(of(|p| p.sample_rate_hz = 2000.0), 2.0 * 0.003_417_968_75);
    assert_eq!(of(|p| p.sample_rate_hz = 500.0), 8.0 * 0.003_417_968_75);
    assert_eq!(of(|p| p.pickoff_gain = [0.0; 3]), SENSED_LIMIT_RAD);
    assert_eq!(
        of(|p| p.pickoff_gain = [0.0, 1.0, 0.0]),
        SENSED_LIMIT_RAD + DITHER_LIMIT_RAD
    );
    assert_eq!(
        of(|p| p.scale_error = [-0.0078125, 0.0078125, 0.0]),
        SENSED_LIMIT_RAD * 1.0078125 + DITHER_LIMIT_RAD
    );
}

/// Each element of the matrix at rest turns the angle of its axis into its gyro: gyro i with e_ij takes that of the
/// axis that is neither i nor j. Flexure adds its largest part in products.
#[test]
fn each_element_of_the_matrix_adds_its_axis_to_the_largest_increment() {
    // Counts of the axes x, y, z as scale errors leave them; all different.
    let scale_error = [0.0, 1.0 / 256.0, -1.0 / 256.0];
    let axis = scale_error.map(|s| SENSED_LIMIT_RAD * (1.0 - s) + DITHER_LIMIT_RAD);
    let places = [(0, 2), (0, 1), (1, 2), (1, 0), (2, 1), (2, 0)];
    let names = ["xy", "xz", "yx", "yz", "zx", "zy"];
    for (element, (gyro, from)) in places.into_iter().enumerate() {
        // ½ is no installation; the test is of the formula, and this gyro must be the largest.
        for sign in [1.0, -1.0] {
            let expected = axis[gyro] + 0.5 * axis[from];
            let mut six = [0.0; 6];
            six[element] = sign * 0.5;
            let e = CrossAxis::from_array(six);
            let at_rest = Parameters::default().with(|p| {
                p.scale_error = scale_error;
                p.installation_rad = e;
            });
            assert_eq!(
                at_rest.largest_increment_rad(),
                expected,
                "installation {}",
                names[element]
            );
            let flexed = at_rest.with(|p| p.flexure_s2 = e.map(|e| 16.0 * e / (4000.0 * 4000.0)));
            assert_eq!(
                flexed.largest_increment_rad(),
                expected + 1.0 / 65536.0,
                "flexure {}",
                names[element]
            );
        }
    }
}

/// h₀ = cos ωd + sin ωd cot Ω, h₁ = −sin ωd / sin Ω; adaptation may move both by a fifth of gain and quadrature.
#[test]
fn the_largest_increment_holds_the_taps_wherever_they_may_go() {
    let omega = std::f64::consts::TAU * 400.0 / 4000.0;
    let strip = |parameters: &Parameters| {
        (parameters.largest_increment_rad() - SENSED_LIMIT_RAD) / DITHER_LIMIT_RAD
    };
    for delay_s in [5e-5, -5e-5] {
        let delayed = Parameters::default().with(|p| p.pickoff_delay_s = [delay_s; 3]);
        let lag = omega * delay_s * 4000.0;
        let taps = (lag.cos() + lag.sin() / omega.tan()).abs() + (lag.sin() / omega.sin()).abs();
        assert!(
            (strip(&delayed) - taps).abs() < 1e-12,
            "{} {taps}",
            strip(&delayed)
        );
        let follows = delayed.with(|p| {
            p.adaptation_time_s = 20.0;
            p.dither_amplitude_rad = [7e-4; 3];
        });
        let moved = 0.2f64 * (1.0 + 1.0 / omega.tan() + 1.0 / omega.sin());
        assert!(
            (strip(&follows) - taps - moved).abs() < 1e-7,
            "{} {taps} {moved}",
            strip(&follows)
        );
        // Without an amplitude there is nothing to follow.
        let still = delayed.with(|p| p.adaptation_time_s = 20.0);
        assert!((strip(&still) - taps).abs() < 1e-12);
    }
    // Above a quarter of the sample rate the cotangent is negative: its size counts.
    let fast = Parameters::default().with(|p| {
        p.dither_frequency_hz = [1500.0; 3];
        p.adaptation_time_s = 20.0;
        p.dither_amplitude_rad = [1e-4; 3];
    });
    let omega = std::f64::consts::TAU * 1500.0 / 4000.0;
    let moved = 0.2f64 * (1.0 + (1.0 / omega.tan()).abs() + 1.0 / omega.sin());
    assert!(
        (strip(&fast) - 1.0 - moved).abs() < 1e-7,
        "{} {moved}",
        strip(&fast)
    );
}

/// 40 at most; 0.1767 rad over the largest increment; and pulses whose sum an `i32` holds.
#[test]
fn the_most_samples_of_an_output_are_what_its_sums_hold() {
    let most = |rate_hz: f64, gain: f64, pulse_rad: f64| {
        Parameters::default()
            .with(|p| {
                p.sample_rate_hz = rate_hz;
                p.pickoff_gain = [gain; 3];
                p.pulse_weight_rad = [1e-5, pulse_rad, 1e-5];
            })
            .most_samples_per_output()
    };
    // 0.1767 over (2⁻⁸·5/8 + 2⁻¹⁰) rad, and over 2⁻⁸·5/8 rad without a dither, in the unit of the rate.
    assert_eq!(most(4000.0, 1.0, 1e-6), 40);
    assert_eq!(most(2000.0, 1.0, 1e-6), 25);
    assert_eq!(most(2000.0, 0.0, 1e-6), 36);
    assert_eq!(most(1000.0, 1.0, 1e-6), 12);
    assert_eq!(most(500.0, 1.0, 1e-6), 6);
    // (2³¹ − 1) pulses of 2⁻³⁴ rad over the limit of counts in the unit of the rate.
    let finest = 1.0 / 17_179_869_184.0;
    assert_eq!(most(4000.0, 0.0, finest), 40);
    assert_eq!(most(2000.0, 0.0, finest), 25);
    assert_eq!(most(500.0, 0.0, finest), 6);
}

#[test]
fn an_output_of_the_most_samples_is_taken_and_one_more_is_not() {
    for rate_hz in [500.0, 1000.0, 2000.0] {
        let slow = Parameters::default().with(|p| p.sample_rate_hz = rate_hz);
        let most = slow.most_samples_per_output();
        let checked = |samples: u16| slow.with(|p| p.samples_per_output = samples).check();
        assert_eq!(checked(most), Ok(()), "{most} at {rate_hz} Hz");
        assert_eq!(
            checked(most + 1),
            Err(ParameterError::OutputPeriod),
            "{rate_hz} Hz"
        );
    }
    let checked = |samples: u16| {
        Parameters::default()
            .with(|p| p.samples_per_output = samples)
            .check()
    };
    assert_eq!([checked(1), checked(40)], [Ok(()); 2]);
    assert_eq!(
        [checked(0), checked(41)],
        [Err(ParameterError::SamplesPerOutput); 2]
    );
}

/// 5/8 of 2⁻⁸ rad a sample, twice that a sample from 2 kHz down; and (2³¹ − 1) codes of 2⁻³⁵ rad a frame.
#[test]
fn ranges_in_rates_follow_rate_unit_and_output_period() {
    let at = |rate_hz: f64, samples: u16| {
        Parameters::default().with(|p| {
            p.sample_rate_hz = rate_hz;
            p.samples_per_output = samples;
        })
    };
    assert_eq!(at(4000.0, 20).sensed_range_rad_s(), 9.765625);
    assert_eq!(at(8000.0, 20).sensed_range_rad_s(), 19.53125);
    assert_eq!(at(2000.0, 20).sensed_range_rad_s(), 9.765625);
    let frame_rad = 2_147_483_647.0 / 34_359_738_368.0;
    assert_eq!(at(4000.0, 20).frame_range_rad_s(), frame_rad * 200.0);
    assert_eq!(at(2000.0, 1).frame_range_rad_s(), frame_rad * 2000.0);
}

/// Twice the largest increment a second times |arm across|, of each accelerometer with its own two coordinates across.
#[test]
fn arms_swing_by_no_more_than_the_exact_sums_hold() {
    // 2 (S + D) 4000 / s = 27.34 rad/s; the arms across reach 20 m/s at 0.7314 m in all.
    let reach_m = 20.0 / (2.0 * 0.003_417_968_75 * 4000.0);
    for axis in 0..3 {
        let checked = |along: f64, one: f64, other: f64| {
            let mut parameters = Parameters::default();
            accelerometers(&mut parameters).lever_arm_m[axis][axis] = along;
            accelerometers(&mut parameters).lever_arm_m[axis][(axis + 1) % 3] = one;
            accelerometers(&mut parameters).lever_arm_m[axis][(axis + 2) % 3] = other;
            parameters.check()
        };
        let rest = reach_m - 0.5;
        for (one, other) in [(0.5f64, rest), (-0.5, rest), (rest, -0.5)] {
            let (less, more) = (1.0 - 1e-12, 1.0 + 1e-12);
            let inside = checked(0.5, one.clamp(-0.5, 0.5) * less, other * less);
            assert_eq!(inside, Ok(()), "accelerometer {axis}: {one} {other}");
            let (one, other) = if one.abs() < other.abs() {
                (one * more + 1e-12, other)
            } else {
                (one, other * more + 1e-12)
            };
            assert_eq!(
                checked(0.0, one, other),
                Err(ParameterError::LeverArm),
                "{axis}: {one} {other}"
            );
        }
    }
}
