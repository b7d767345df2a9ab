//! The output frame's rotation vector against the attitude's own.

use trueaxis::{Chain, ChainState, CrossAxis, F32, Fixed, NumberSystem, Parameters, Sample};

use crate::motion::{Coning, TABLE_3_S2, as_built, fine, stream};
use crate::{CODE_RAD, DEG_H, run};

/// Coning drift that may stay \[°/h\]: a hundredth of the best ring lasers' 0.01 °/h. The formula's own
/// residual at 100 Hz, 0.1° is 2.1e-5 °/h.
const CONING_RESIDUAL_DEG_H: f64 = 1e-4;

/// Rotation vector of conj(a) b.
fn rotation_between(a: [f64; 4], b: [f64; 4]) -> [f64; 3] {
    let w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    let v = [
        a[0] * b[1] - a[1] * b[0] - (a[2] * b[3] - a[3] * b[2]),
        a[0] * b[2] - a[2] * b[0] - (a[3] * b[1] - a[1] * b[3]),
        a[0] * b[3] - a[3] * b[0] - (a[1] * b[2] - a[2] * b[1]),
    ];
    let sin = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let angle = 2.0 * sin.atan2(w);
    v.map(|v| v * angle / sin)
}

fn residual_deg_h<N: NumberSystem>(coning: &Coning, samples_per_output: u16) -> f64 {
    let parameters = fine().with(|p| p.samples_per_output = samples_per_output);
    residual_of::<N>(&parameters, coning)
}

fn residual_of<N: NumberSystem>(parameters: &Parameters, coning: &Coning) -> f64 {
    let samples_per_output = parameters.samples_per_output;
    let (frames, _) = run::<N>(parameters, stream(parameters, coning, false, 80_000));
    let period_s = f64::from(samples_per_output) / parameters.sample_rate_hz;
    let mut error_rad = 0.0;
    // The first frame holds the priming sample; the second's first sample has no D_{k−2} of motion.
    for (k, frame) in frames.iter().enumerate().skip(2) {
        let start = coning.attitude(k as f64 * period_s);
        let end = coning.attitude((k + 1) as f64 * period_s);
        let truth = rotation_between(start, end);
        error_rad += f64::from(frame.dtheta_codes[0]) * CODE_RAD - truth[0];
    }
    error_rad / ((frames.len() - 2) as f64 * period_s) / DEG_H
}

/// The rotation vector equation's third-order terms, which the stage leaves out: at most Ωφ⁴/3.
fn third_order_deg_h(coning: &Coning) -> f64 {
    coning.omega() * coning.angle_rad.powi(4) / 3.0 / DEG_H
}

fn assert_residual(frequency_hz: f64, angle_deg: f64, samples_per_output: u16, bound: f64) {
    let coning = Coning {
        frequency_hz,
        angle_rad: angle_deg.to_radians(),
    };
    let third_order = third_order_deg_h(&coning);
    let f32_left = residual_deg_h::<F32>(&coning, samples_per_output);
    let fixed_left = residual_deg_h::<Fixed>(&coning, samples_per_output);
    println!(
        "{frequency_hz} Hz, {angle_deg} deg, {samples_per_output} samples: f32 {f32_left:.1e}, \
         fixed {fixed_left:.1e} deg/h (third order at most {third_order:.1e})"
    );
    let bound = CONING_RESIDUAL_DEG_H + bound * third_order;
    assert!(f32_left.abs() < bound, "f32 {f32_left}");
    assert!(fixed_left.abs() < bound, "fixed {fixed_left}");
}

#[test]
fn with_short_periods_vibration_leaves_less_than_a_hundredth_of_the_best_bias() {
    for samples_per_output in [1, 5, 10] {
        assert_residual(15.0, 0.367, samples_per_output, 0.0);
        assert_residual(100.0, 0.1, samples_per_output, 0.0);
    }
}

#[test]
fn with_long_periods_only_the_third_order_is_left_out() {
    for samples_per_output in [20, 40] {
        assert_residual(15.0, 0.367, samples_per_output, 1.0);
        assert_residual(100.0, 0.1, samples_per_output, 1.0);
    }
}

/// Largest coning drift in navigation at 200 to 1000 Hz, at 0.1°: at 50 Hz and at 200 Hz \[°/h\].
const MARKS: [(f64, f64); 2] = [(50.0, 1e-4), (200.0, 1e-2)];

#[test]
fn coning_at_50_and_200_hz_leaves_less_than_its_marks_at_output_rates_of_200_to_1000_hz() {
    for (frequency_hz, mark_deg_h) in MARKS {
        let coning = Coning {
            frequency_hz,
            angle_rad: f64::to_radians(0.1),
        };
        for samples_per_output in [4, 5, 8, 10, 16, 20] {
            let rate_hz = 4000.0 / f64::from(samples_per_output);
            let f32_left = residual_deg_h::<F32>(&coning, samples_per_output);
            let fixed_left = residual_deg_h::<Fixed>(&coning, samples_per_output);
            println!(
                "{frequency_hz} Hz, 0.1 deg, out at {rate_hz} Hz: f32 {f32_left:.1e}, \
                 fixed {fixed_left:.1e} deg/h"
            );
            assert!(f32_left.abs() <= mark_deg_h, "f32 {f32_left}");
            assert!(fixed_left.abs() <= mark_deg_h, "fixed {fixed_left}");
        }
    }
}

/// Increments are counted in 1, 2, 4 and 8 rad from 4 kHz down; products of one increment with a tilt and of two scale
/// each in their own way. The motion is slower by as much as the samples, so that the rotation in a sample is the same.
#[test]
fn coning_and_flexure_are_right_at_every_sample_rate() {
    for (rate_hz, samples_per_output) in [
        (8000.0, 10),
        (4000.0, 10),
        (2000.0, 10),
        (1000.0, 5),
        (999.0, 5),
        (500.0, 5),
    ] {
        let coning = Coning {
            frequency_hz: 15.0 * rate_hz / 4000.0,
            angle_rad: f64::to_radians(0.367),
        };
        let instrument = as_built().with(|p| {
            p.pulse_weight_rad = fine().pulse_weight_rad;
            p.sample_rate_hz = rate_hz;
            p.samples_per_output = samples_per_output;
        });
        let rigid = fine().with(|p| {
            p.sample_rate_hz = rate_hz;
            p.samples_per_output = samples_per_output;
        });
        for parameters in [rigid, instrument] {
            let f32_left = residual_of::<F32>(&parameters, &coning);
            let fixed_left = residual_of::<Fixed>(&parameters, &coning);
            println!("{rate_hz} Hz: f32 {f32_left:.1e}, fixed {fixed_left:.1e} deg/h");
            assert!(
                f32_left.abs() < CONING_RESIDUAL_DEG_H,
                "{rate_hz} Hz: f32 {f32_left}"
            );
            assert!(
                fixed_left.abs() < CONING_RESIDUAL_DEG_H,
                "{rate_hz} Hz: fixed {fixed_left}"
            );
        }
    }
}

/// Nothing accelerates where every sample counts the same: the filter starts from the first increment, at the stream's
/// start and after lost samples.
#[test]
fn a_steady_turn_bends_nothing_from_its_first_sample_on() {
    fn turned<N: NumberSystem>(flexure_s2: CrossAxis<f64>) -> Vec<[i32; 3]> {
        let chain = Chain::<N>::new(&fine().with(|p| p.flexure_s2 = flexure_s2)).expect("in range");
        let mut state = ChainState::new();
        let mut frames = Vec::new();
        for k in 0..200 {
            let lost = if k == 90 { 2 } else { 0 };
            frames.extend(chain.process_lost(&mut state, lost));
            let pulse_counts = [7_000_000, -5_000_000, 6_000_000].map(|n| n * (1 + lost as i32));
            let sample = Sample {
                pulse_counts,
                ..Sample::default()
            };
            frames.extend(chain.process(&mut state, &sample));
        }
        frames.into_iter().map(|frame| frame.dtheta_codes).collect()
    }
    assert_eq!(
        turned::<F32>(TABLE_3_S2),
        turned::<F32>(CrossAxis::default())
    );
    assert_eq!(
        turned::<Fixed>(TABLE_3_S2),
        turned::<Fixed>(CrossAxis::default())
    );
}
