//! The dither monitor, and the accuracy of its square root.

use micromath::F32Ext;
use trueaxis::DitherMonitor;
use trueaxis::dither_monitor::AMPLITUDE_ERROR_LIMIT;

const CODE_RAD: f64 = 1.0 / 4_294_967_296.0;
const ARCSEC_RAD: f64 = 4.848_136_811e-6;

/// micromath's root of zero is not zero, but 4e-20: a thousandth of a pickoff code is far above it.
const ZERO_ARCSEC: f32 = 1e-8;

fn measured_arcsec(amplitude_arcsec: f64, offset_codes: f64) -> f32 {
    let mut monitor = DitherMonitor::new();
    // 400.5 Hz for 2 s at 4 kHz: whole swings.
    for k in 0..8000 {
        let phase = std::f64::consts::TAU * 400.5 * f64::from(k) / 4000.0;
        let code = amplitude_arcsec * ARCSEC_RAD / CODE_RAD * phase.sin() + offset_codes;
        monitor.observe([code.round() as i32, 0, i32::MIN]);
    }
    let [x, y, _] = monitor.amplitude_arcsec(CODE_RAD as f32).unwrap();
    assert!(y < ZERO_ARCSEC);
    x
}

#[test]
fn amplitude_is_right_to_what_the_square_root_allows() {
    for arcsec in [1.0, 10.0, 50.0, 100.0, 150.0, 200.0, 300.0] {
        let error = f64::from(measured_arcsec(arcsec, 20_000.0)) / arcsec - 1.0;
        println!("{arcsec} arcsec: {:.2} %", 100.0 * error);
        assert!(error.abs() < f64::from(AMPLITUDE_ERROR_LIMIT), "{error}");
    }
}

/// micromath's square root halves the exponent and takes the mantissa linearly; libm's is correctly
/// rounded. Measured over every amplitude that matters, as the choice between them.
#[test]
fn micromath_stays_within_the_limit_and_libm_is_exact() {
    let (mut micromath_worst, mut libm_worst) = (0.0f64, 0.0f64);
    let mut value = 1.0f32;
    while value < 1e13 {
        let exact = f64::from(value).sqrt();
        micromath_worst = micromath_worst.max((f64::from(F32Ext::sqrt(value)) / exact - 1.0).abs());
        libm_worst = libm_worst.max((f64::from(libm::sqrtf(value)) / exact - 1.0).abs());
        value *= 1.01;
    }
    println!("micromath {micromath_worst:.3e}, libm {libm_worst:.3e}");
    assert!(micromath_worst < f64::from(AMPLITUDE_ERROR_LIMIT));
    // Half a unit in the last place of 24 bits.
    assert!(libm_worst <= 1.0 / (1 << 24) as f64);
}

/// Accuracy needed of a library by health items of the dither's frequency and of the pickoff's phase, against that of
/// micromath's functions: it suffices for the amplitude alone.
#[test]
fn micromath_has_no_frequency_and_no_phase_that_a_health_item_could_show() {
    // A suspension's resonance moves by parts of a per cent.
    const FREQUENCY_NEEDED: f64 = 1e-3;
    // A microsecond of pickoff delay at 400 Hz.
    let phase_needed_rad = std::f64::consts::TAU * 400.0 * 1e-6;

    // Ω from cos Ω, of dithers at 0.04 to 0.4 of the sample rate.
    let (mut of_micromath, mut of_libm) = (0.0f64, 0.0f64);
    for step in 0..=3600 {
        let phase_rad = std::f64::consts::TAU * (0.04 + f64::from(step) * 1e-4);
        let cosine = phase_rad.cos() as f32;
        let error = |found: f32| (f64::from(found) / phase_rad - 1.0).abs();
        of_micromath = of_micromath.max(error(F32Ext::acos(cosine)));
        of_libm = of_libm.max(error(libm::acosf(cosine)));
    }
    println!("frequency by acos: micromath {of_micromath:.1e}, libm {of_libm:.1e} of it");
    assert!(of_micromath > FREQUENCY_NEEDED && of_libm < FREQUENCY_NEEDED);

    // The tracked quadrature over the tracked gain, both within 0.2 of nominal; and no function at all.
    let (mut of_micromath, mut of_libm, mut of_quotient) = (0.0f64, 0.0f64, 0.0f64);
    for step in -200..=200 {
        for gain in [0.8f32, 1.0, 1.2] {
            let quadrature = step as f32 * 1e-3;
            let exact_rad = f64::from(quadrature).atan2(f64::from(gain));
            let error = |found: f32| (f64::from(found) - exact_rad).abs();
            of_micromath = of_micromath.max(error(F32Ext::atan2(quadrature, gain)));
            of_libm = of_libm.max(error(libm::atan2f(quadrature, gain)));
            of_quotient = of_quotient.max(error(quadrature / gain));
        }
    }
    println!(
        "phase by atan2: micromath {of_micromath:.1e}, libm {of_libm:.1e} rad; by the quotient {of_quotient:.1e} rad"
    );
    assert!(of_micromath > phase_needed_rad && of_libm < phase_needed_rad);
}

#[test]
fn an_empty_window_has_no_amplitude() {
    let mut monitor = DitherMonitor::new();
    assert_eq!(monitor.amplitude_arcsec(1e-9), None);
    monitor.observe([1, 2, 3]);
    assert!(monitor.amplitude_arcsec(1e-9).is_some());
    assert_eq!(monitor.amplitude_arcsec(1e-9), None);
}

#[test]
fn a_window_never_overflows() {
    let mut monitor = DitherMonitor::new();
    for _ in 0..70_000 {
        monitor.observe([i32::MIN, i32::MAX, 0]);
    }
    let [x, y, z] = monitor.amplitude_arcsec(1e-9).unwrap();
    assert!(x.max(y).max(z) < ZERO_ARCSEC);
}
