//! Both number systems against the equations in f64, sample for sample the same stream.

use trueaxis::{F32, Fixed, FlexureResponse, NumberSystem, Parameters, Sample};

use crate::equations::Equations;
use crate::motion::{Both, Coning, Motion, Slew, as_built, fine, stream};
use crate::{CODE_RAD, DEG_H, run};

/// Drift that arithmetic may add \[°/h\]: a hundredth of the best ring lasers' bias stability, 0.01 °/h.
const ARITHMETIC_DRIFT_DEG_H: f64 = 1e-4;

/// Largest distance from the equations at any time \[rad\]: one output code (the part a frame cannot show)
/// and, for f32, the random walk of its roundings: half an LSB at 100 °/s (1.5e-11 rad) over the square
/// root of 240 000 samples, three sigma and three roundings: 4e-8 rad, 0.008″.
const ARITHMETIC_ANGLE_RAD: f64 = 4e-8;

/// 60 s: 240 000 samples.
const SAMPLES: usize = 240_000;

/// Largest angle between the chain and the equations, and their mean drift \[rad, °/h\].
fn distance<N: NumberSystem>(parameters: &Parameters, samples: &[Sample]) -> (f64, f64) {
    let (frames, _) = run::<N>(parameters, samples.iter().copied());
    let mut equations = Equations::new(parameters);
    let expected: Vec<_> = samples
        .iter()
        .filter_map(|sample| equations.process(sample))
        .collect();
    assert_eq!(frames.len(), expected.len());
    let mut angle_rad = [0.0f64; 3];
    let mut largest_rad = 0.0f64;
    for (frame, expected) in frames.iter().zip(&expected) {
        for i in 0..3 {
            angle_rad[i] += f64::from(frame.dtheta_codes[i]) * CODE_RAD - expected[i];
            largest_rad = largest_rad.max(angle_rad[i].abs());
        }
    }
    let duration_s = samples.len() as f64 / parameters.sample_rate_hz;
    let drift_deg_h = angle_rad
        .iter()
        .fold(0.0f64, |largest, a| largest.max(a.abs()))
        / duration_s
        / DEG_H;
    (largest_rad, drift_deg_h)
}

fn assert_follows(name: &str, parameters: &Parameters, motion: &impl Motion, dithered: bool) {
    let samples = stream(parameters, motion, dithered, SAMPLES);
    for (system, (angle_rad, drift_deg_h)) in [
        (F32::NAME, distance::<F32>(parameters, &samples)),
        (Fixed::NAME, distance::<Fixed>(parameters, &samples)),
    ] {
        println!("{name}, {system}: {angle_rad:.2e} rad at most, {drift_deg_h:.2e} deg/h");
        assert!(
            angle_rad < ARITHMETIC_ANGLE_RAD,
            "{name}, {system}: {angle_rad} rad"
        );
        assert!(
            drift_deg_h < ARITHMETIC_DRIFT_DEG_H,
            "{name}, {system}: {drift_deg_h} deg/h"
        );
    }
}

fn bench_coning() -> Coning {
    Coning {
        frequency_hz: 15.0,
        angle_rad: 0.367f64.to_radians(),
    }
}

const EARTH: Slew = Slew([4.1e-5, -2.2e-5, 5.6e-5]);

/// 100 °/s about no axis of the body.
fn slew() -> Slew {
    Slew([1.1, -0.9, 1.0])
}

#[test]
fn dithered_coning_follows_the_equations() {
    let motion = Both(EARTH, bench_coning());
    assert_follows("dithered coning", &as_built(), &motion, true);
}

#[test]
fn a_dithered_slew_follows_the_equations() {
    assert_follows("dithered slew", &as_built(), &slew(), true);
}

#[test]
fn a_slew_without_dither_follows_the_equations() {
    assert_follows("slew without dither", &as_built(), &slew(), false);
}

#[test]
fn rest_without_dither_follows_the_equations() {
    assert_follows("rest without dither", &as_built(), &EARTH, false);
}

#[test]
fn coning_on_a_slew_follows_the_equations() {
    assert_follows(
        "coning on a slew",
        &as_built(),
        &Both(slew(), bench_coning()),
        true,
    );
}

#[test]
fn fine_pulses_follow_the_equations() {
    let parameters = as_built().with(|p| p.pulse_weight_rad = fine().pulse_weight_rad);
    assert_follows(
        "fine pulses",
        &parameters,
        &Both(EARTH, bench_coning()),
        false,
    );
}

#[test]
fn every_output_period_follows_the_equations() {
    for samples_per_output in [1, 2, 7, 10, 33, 40] {
        let parameters = as_built().with(|p| p.samples_per_output = samples_per_output);
        let name = format!("{samples_per_output} samples per output");
        assert_follows(&name, &parameters, &Both(EARTH, bench_coning()), true);
    }
}

#[test]
fn without_flexure_its_response_changes_nothing() {
    let still = as_built().with(|p| p.flexure_s2 = Default::default());
    let samples = stream(&as_built(), &bench_coning(), true, 20_000);
    let frames = |parameters: &Parameters| {
        let (f32_frames, _) = run::<F32>(parameters, samples.iter().copied());
        let (fixed_frames, _) = run::<Fixed>(parameters, samples.iter().copied());
        (f32_frames, fixed_frames)
    };
    let mode = still.with(|p| p.flexure_response = FlexureResponse::Mode { damping: 0.01 });
    assert!(frames(&still) == frames(&mode), "a bit changes");
    let bent = as_built().with(|p| p.flexure_response = FlexureResponse::Mode { damping: 0.005 });
    assert!(
        frames(&as_built()) != frames(&still),
        "flexure changes nothing"
    );
    assert!(
        frames(&as_built()) != frames(&bent),
        "its mode changes nothing"
    );
}
