//! Design parameters against their documented figures and the equations that they solve.

use trueaxis::design_parameters as design;

/// A limit and its documented value, as a decimal or as the power of two that is exact.
#[test]
fn limits_are_the_documented_ones() {
    for (name, value, documented) in [
        ("samples per second", design::DESIGN_SAMPLE_RATE_HZ, 4000.0),
        ("output period", design::OUTPUT_PERIOD_LIMIT_RAD, 0.1767),
        (
            "output code of rotation",
            design::OUTPUT_RAD_PER_CODE,
            2f64.powi(-35),
        ),
        (
            "output code of velocity",
            design::OUTPUT_M_S_PER_CODE,
            2f64.powi(-27),
        ),
        ("sensed increment", design::SENSED_LIMIT_RAD, 0.00244140625),
        ("dither increment", design::DITHER_LIMIT_RAD, 0.0009765625),
        ("gap in a frame", design::GAP_IN_FRAME_RAD, 0.0625),
        ("acceleration", design::ACCELERATION_LIMIT_RAD, 0.0009765625),
        ("flexure", design::FLEXURE_LIMIT, 8.0),
        ("scaled flexure", design::SCALED_FLEXURE_LIMIT, 32.0),
        ("installation", design::INSTALLATION_LIMIT_RAD, 0.0078125),
        ("scale error", design::SCALE_ERROR_LIMIT, 0.0078125),
        ("bias", design::BIAS_LIMIT_RAD_S, 0.01),
        (
            "finest pulse",
            design::PULSE_WEIGHT_RANGE_RAD.0,
            2f64.powi(-34),
        ),
        (
            "finest pickoff code",
            design::PICKOFF_WEIGHT_RANGE_RAD.0,
            2f64.powi(-35),
        ),
        ("reach of a pickoff", design::PICKOFF_REACH_RAD, 0.03125),
        ("swing", design::SWING_LIMIT_M_S, 20.0),
        ("velocity of a sample", design::VELOCITY_LIMIT_M_S, 0.25),
        (
            "codes of velocity",
            f64::from(design::ACCELEROMETER_SUM_CODES),
            1_073_741_824.0,
        ),
        ("response terms", design::RESPONSE_LIMIT_RAD, 0.00048828125),
        ("increment with terms", design::INCREMENT_LIMIT_RAD, 0.0078),
        (
            "force squared",
            design::FORCE_SQUARED_LIMIT_RAD,
            0.00006103515625,
        ),
        (
            "tilt by force",
            design::TILT_BY_FORCE_LIMIT_RAD,
            0.0009765625,
        ),
        (
            "dither errors",
            design::DITHER_ERROR_LIMIT_RAD,
            0.0001220703125,
        ),
        (
            "flexure terms",
            design::FLEXURE_TERM_LIMIT_RAD,
            0.0009765625,
        ),
    ] {
        assert_eq!(value, documented, "{name}");
    }
}

/// 559 °/s and 223 °/s at 4 kHz, 15 600 rad/s², 716 °/s over 5 ms: limits as the engineer reads them.
#[test]
fn limits_in_rates_are_the_documented_ones() {
    let rate = design::DESIGN_SAMPLE_RATE_HZ;
    for (name, value, documented, digit) in [
        (
            "sensed °/s",
            (design::SENSED_LIMIT_RAD * rate).to_degrees(),
            559.0,
            1.0,
        ),
        (
            "dither °/s",
            (design::DITHER_LIMIT_RAD * rate).to_degrees(),
            223.0,
            1.0,
        ),
        (
            "rad/s²",
            design::ACCELERATION_LIMIT_RAD * rate * rate,
            15_600.0,
            100.0,
        ),
        (
            "frame °/s",
            (f64::from(i32::MAX) * design::OUTPUT_RAD_PER_CODE / 5e-3).to_degrees(),
            716.0,
            1.0,
        ),
        (
            "frame m/s",
            f64::from(i32::MAX) * design::OUTPUT_M_S_PER_CODE,
            16.0,
            1e-6,
        ),
        (
            "velocity in g",
            design::VELOCITY_LIMIT_M_S * rate / 9.806_65,
            102.0,
            1.0,
        ),
        (
            "flexure s²",
            design::FLEXURE_LIMIT / (rate * rate),
            5e-7,
            1e-9,
        ),
    ] {
        assert!(
            (value - documented).abs() < digit,
            "{name}: {value}, documented {documented}"
        );
    }
}

/// The unit doubles with every halving of the rate, from the rates themselves on.
#[test]
fn the_increment_unit_doubles_with_every_halving_of_the_rate() {
    for (rate_hz, unit_log2) in [
        (8000.0, 0),
        (4000.0, 0),
        (4000f64.next_down(), 1),
        (2000.0, 1),
        (2000f64.next_down(), 2),
        (1000.0, 2),
        (1000f64.next_down(), 3),
        (500.0, 3),
    ] {
        assert_eq!(
            design::increment_unit_log2(rate_hz),
            unit_log2,
            "{rate_hz} Hz"
        );
    }
}

/// The mean of α̂ × D is right to the sixth power of ΩT: the residual at 400 Hz is documented.
#[test]
fn the_central_coefficients_leave_what_is_documented() {
    let x = std::f64::consts::TAU * 400.0 / 4000.0;
    let product = |x: f64| -> f64 {
        let pairs = (1..).zip(&design::CENTRAL_COEFFICIENTS);
        let sum: f64 = pairs.map(|(p, a)| 2.0 * a * (f64::from(p) * x).sin()).sum();
        sum * 2.0 * (1.0 - x.cos()) / (x * x) / x
    };
    let left = (product(x) - 1.0).abs();
    assert!((left - 7.5e-4).abs() <= 0.5e-5, "{left:e}");
    // Halving x divides the residual by 2⁶.
    let order = ((product(0.4) - 1.0) / (product(0.2) - 1.0)).log2();
    assert!((order - 6.0).abs() < 0.05, "{order}");
}

/// Σ c_j 2(1 − cos x) sin jx = ½(x − sin x) to x⁵: the residual falls with x⁷, and its factor is 1/20 − … by series.
#[test]
fn the_coning_coefficients_match_the_sample_to_the_fifth_power() {
    let [one, two] = design::CONING_COEFFICIENTS;
    let left = |x: f64| {
        let sum = one * x.sin() + two * (2.0 * x).sin();
        2.0 * (1.0 - x.cos()) * sum - 0.5 * (x - x.sin())
    };
    // At an angle where rounding is far below, halving x must divide the residual by 2⁷.
    let order = (left(0.4) / left(0.2)).log2();
    assert!((order - 7.0).abs() < 0.05, "{order}");
}

/// κ² = 1/12: the mean of (ΔD)² is x² of that of D², and D² lacks x²/12 of T² ω²; the residual is x⁴/90, 0.17 % at 400 Hz.
#[test]
fn products_within_a_sample_lack_a_sixth_of_a_per_cent() {
    let x = std::f64::consts::TAU * 400.0 / 4000.0;
    let attenuation = 2.0 * (1.0 - x.cos()) / (x * x);
    let kappa = design::WITHIN_SAMPLE;
    let seen = attenuation * (1.0 + kappa * kappa * 2.0 * (1.0 - x.cos()));
    assert!((1.0 - seen - 0.0017).abs() < 0.5e-4, "{}", 1.0 - seen);
}
