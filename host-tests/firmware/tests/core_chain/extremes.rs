//! Any bits may enter: nothing panics, everything beyond its range is held and counted.

use proptest::collection::vec;
use proptest::prelude::*;
use trueaxis::design_parameters::{OUTPUT_PERIOD_LIMIT_RAD, SENSED_LIMIT_RAD};
use trueaxis::{
    Chain, ChainState, CrossAxis, F32, Fixed, NumberSystem, Parameters, Sample, Status,
};

use crate::motion::{Both, Slew, Turning, fine, stream};
use crate::{CODE_RAD, run};

/// Largest difference of an f32 frame near the range's end from the fixed-point one \[codes\]: 40 roundings of the
/// increment's strip (1e-3 rad, half an LSB 1.2e-10 rad is 4 codes) at random, three sigma.
const F32_FRAME_CODES: i64 = 80;

/// Every parameter at the end of its range, where formats are fullest.
fn worst_parameters() -> Parameters {
    let end = |value: f64| CrossAxis::from_array([value, -value, value, -value, value, -value]);
    Parameters::default().with(|p| {
        p.pulse_weight_rad = [3.9e-6, 1e-4, 1.0 / (1u64 << 34) as f64];
        p.bias_rad_s = [0.01, -0.01, 0.01];
        p.scale_error = [1.0 / 128.0, -1.0 / 128.0, 1.0 / 128.0];
        p.installation_rad = end(1.0 / 128.0);
        p.flexure_s2 = end(5e-7);
        p.pickoff_gain = [2.0, 0.0, 1.0];
        p.pickoff_weight_rad = 1.0 / (1u64 << 35) as f64;
        p.samples_per_output = 40;
    })
}

/// A code that matters: the ends, around zero, or anything.
fn any_code() -> impl Strategy<Value = i32> {
    prop_oneof![Just(i32::MIN), Just(i32::MAX), -2000..2000i32, any::<i32>()]
}

fn any_sample() -> impl Strategy<Value = Sample> {
    vec(any_code(), 9).prop_map(|c| Sample {
        pulse_counts: [c[0], c[1], c[2]],
        pickoff_codes: [c[3], c[4], c[5]],
        accelerometer_codes: [c[6], c[7], c[8]],
    })
}

/// The outputs never sum to more than the largest case increments and the largest coning they can form.
fn assert_survives<N: NumberSystem>(parameters: &Parameters, samples: &[Sample]) {
    let (frames, state) = run::<N>(parameters, samples.iter().copied());
    let per_output = usize::from(parameters.samples_per_output);
    assert_eq!(frames.len(), samples.len() / per_output);
    assert_eq!(state.samples() as usize, samples.len());
    let angle = OUTPUT_PERIOD_LIMIT_RAD * per_output as f64
        / f64::from(parameters.most_samples_per_output());
    let bound = angle + angle * angle;
    let mut turned = [0.0; 3];
    for (sequence, frame) in frames.iter().enumerate() {
        assert_eq!(frame.sequence as usize, sequence);
        for (turned, code) in turned.iter_mut().zip(frame.dtheta_codes) {
            *turned += f64::from(code) * CODE_RAD;
            assert!(turned.abs() <= bound * (sequence + 1) as f64);
        }
    }
}

proptest! {
    #[test]
    fn any_stream_is_processed_without_panic(samples in vec(any_sample(), 0..200)) {
        for parameters in [Parameters::default(), worst_parameters()] {
            assert_survives::<F32>(&parameters, &samples);
            assert_survives::<Fixed>(&parameters, &samples);
        }
    }

    #[test]
    fn after_any_stream_the_chain_follows_again(samples in vec(any_sample(), 40..80)) {
        // An extreme leaves only bounded memory: four samples of history, one code of carry.
        let parameters = Parameters::default().with(|p| p.samples_per_output = 10);
        let calm = Sample { pulse_counts: [3, -2, 1], pickoff_codes: [0; 3], accelerometer_codes: [0; 3] };
        assert_recovers::<F32>(&parameters, &samples, calm);
        assert_recovers::<Fixed>(&parameters, &samples, calm);
    }
}

fn assert_recovers<N: NumberSystem>(parameters: &Parameters, wild: &[Sample], calm: Sample) {
    let chain = Chain::<N>::new(parameters).unwrap();
    let mut state = ChainState::new();
    for sample in wild {
        chain.process(&mut state, sample);
    }
    let frames: Vec<_> = (0..40)
        .filter_map(|_| chain.process(&mut state, &calm))
        .collect();
    let pulse_codes = parameters.pulse_weight_rad[0] / CODE_RAD;
    let last = frames.last().unwrap();
    for (code, pulses) in last.dtheta_codes.iter().zip([3.0, -2.0, 1.0]) {
        let expected = pulses * pulse_codes * 10.0;
        assert!(
            (f64::from(*code) - expected).abs() <= 1.0,
            "{code} {expected}"
        );
    }
    assert_eq!(last.status, Status::default());
}

#[test]
fn alternating_ends_of_the_range_do_not_panic() {
    let ends = |k: usize| {
        if k.is_multiple_of(2) {
            i32::MIN
        } else {
            i32::MAX
        }
    };
    let samples: Vec<_> = (0..4000)
        .map(|k| Sample {
            pulse_counts: [ends(k), ends(k / 2), ends(k / 3)],
            pickoff_codes: [ends(k + 1), ends(k / 5), ends(k / 7)],
            accelerometer_codes: [ends(k / 2), ends(k + 1), ends(k / 4)],
        })
        .collect();
    for parameters in [Parameters::default(), worst_parameters()] {
        assert_survives::<F32>(&parameters, &samples);
        assert_survives::<Fixed>(&parameters, &samples);
    }
}

fn assert_counted<N: NumberSystem>() {
    let parameters = Parameters::default().with(|p| p.samples_per_output = 5);
    let mut samples = vec![Sample::default(); 30];
    // 0.79″ pulses: 640 are the 2.44e-3 rad of the sensed limit. One beyond, in the third frame.
    let limit = (SENSED_LIMIT_RAD / parameters.pulse_weight_rad[0]) as i32;
    samples[12].pulse_counts[1] = limit + 1;
    // The pickoff jumps by a rad and back, in the fourth period.
    samples[16].pickoff_codes[2] = i32::MAX;
    let (frames, state) = run::<N>(&parameters, samples);
    let faults = state.faults();
    assert_eq!(faults.counts, 1);
    assert_eq!(faults.pickoff, 1);
    // Nothing bends, so no correction is held.
    assert_eq!(faults.acceleration, 0);
    assert_eq!(faults.output, 0);
    assert_eq!(faults.first.sample, 12);
    assert!(faults.first.stages.contains(Status::COUNTS_SATURATED));
    assert!(!faults.first.stages.contains(Status::PICKOFF_SATURATED));

    assert_eq!(frames[0].status, Status::PRIMED);
    assert_eq!(frames[1].status, Status::default());
    assert!(frames[2].status.contains(Status::COUNTS_SATURATED));
    assert!(frames[3].status.contains(Status::PICKOFF_SATURATED));
    assert!(!frames[3].status.contains(Status::COUNTS_SATURATED));
    assert_eq!(frames[5].status, Status::default());
}

#[test]
fn a_count_beyond_the_limit_is_counted_flagged_and_latched() {
    assert_counted::<F32>();
    assert_counted::<Fixed>();
}

fn assert_limits_are_exact<N: NumberSystem>() {
    let parameters = Parameters::default().with(|p| p.samples_per_output = 1);
    let limit = (SENSED_LIMIT_RAD / parameters.pulse_weight_rad[0]) as i32;
    for (count, held) in [(limit, 0), (-limit, 0), (limit + 1, 1), (-limit - 1, 1)] {
        let sample = Sample {
            pulse_counts: [count, 0, 0],
            ..Sample::default()
        };
        let (_, state) = run::<N>(&parameters, [sample]);
        assert_eq!(state.faults().counts, held, "{count}");
    }
}

#[test]
fn the_last_count_in_range_is_no_fault() {
    assert_limits_are_exact::<F32>();
    assert_limits_are_exact::<Fixed>();
}

fn assert_output_held<N: NumberSystem>() {
    let parameters = Parameters::default().with(|p| p.samples_per_output = 40);
    // 559 °/s for 10 ms is 0.098 rad; a frame shows 0.0625.
    let sample = Sample {
        pulse_counts: [640, -640, 0],
        ..Sample::default()
    };
    let (frames, state) = run::<N>(&parameters, vec![sample; 80]);
    assert_eq!(frames[1].dtheta_codes[..2], [i32::MAX, -i32::MAX]);
    assert!(frames[1].status.contains(Status::OUTPUT_SATURATED));
    assert_eq!(state.faults().output, 2);
    assert_eq!(state.faults().first.sample, 39);
}

#[test]
fn a_rotation_beyond_the_frame_is_held_and_flagged() {
    assert_output_held::<F32>();
    assert_output_held::<Fixed>();
}

/// 390 °/s about x while the axis of y and z turns: the coning correction brings part of an x angle
/// beyond the frame's range back.
fn assert_output_held_under_coning<N: NumberSystem>(turn: f64) {
    let parameters = fine().with(|p| p.samples_per_output = 40);
    let motion = Both(
        Slew([390f64.to_radians(), 0.0, 0.0]),
        Turning {
            frequency_hz: turn,
            rate_rad_s: 60f64.to_radians(),
        },
    );
    let samples = stream(&parameters, &motion, false, 120);
    let (frames, state) = run::<N>(&parameters, samples.iter().copied());
    // 390 °/s for 10 ms is 0.0681 rad, 5.6e-3 beyond the frame; a turn of 100 Hz corrects by π (1.7e-3)²,
    // 9e-6 rad: held still, by far.
    for frame in &frames {
        assert_eq!(frame.dtheta_codes[0], i32::MAX, "{}", N::NAME);
        assert!(frame.status.contains(Status::OUTPUT_SATURATED));
    }
    assert_eq!(state.faults().output as usize, frames.len());
}

#[test]
fn a_rotation_beyond_the_frame_is_held_whatever_the_coning_adds() {
    for turn in [100.0, -100.0] {
        assert_output_held_under_coning::<F32>(turn);
        assert_output_held_under_coning::<Fixed>(turn);
    }
}

/// Both systems within a code of the range's end, from either side: held exactly where it is beyond.
#[test]
fn an_angle_that_the_coning_brings_back_into_range_is_not_held() {
    let parameters = fine().with(|p| p.samples_per_output = 40);
    // 0.0625 rad over 10 ms is 358.1 °/s; the correction of 60 °/s at 100 Hz is 9e-4 rad/s.
    for rate_rad_s in [
        6.2485, 6.249, 6.2495, 6.25, 6.2505, 6.251, 6.252, 6.255, 6.26,
    ] {
        for turn in [100.0, -100.0] {
            let motion = Both(
                Slew([rate_rad_s, 0.0, 0.0]),
                Turning {
                    frequency_hz: turn,
                    rate_rad_s: 60f64.to_radians(),
                },
            );
            let samples = stream(&parameters, &motion, false, 120);
            let (f32_frames, _) = run::<F32>(&parameters, samples.iter().copied());
            let (fixed_frames, _) = run::<Fixed>(&parameters, samples.iter().copied());
            for (single, fixed) in f32_frames.iter().zip(&fixed_frames) {
                assert_eq!(single.status, fixed.status, "{rate_rad_s} {turn}");
                let apart = i64::from(single.dtheta_codes[0]) - i64::from(fixed.dtheta_codes[0]);
                assert!(
                    apart.abs() <= F32_FRAME_CODES,
                    "{rate_rad_s} {turn}: {apart}"
                );
            }
        }
    }
}

#[test]
fn the_first_sample_contributes_nothing() {
    let parameters = Parameters::default().with(|p| p.samples_per_output = 2);
    let still = Sample::default();
    let first = Sample {
        pulse_counts: [100, -100, 7],
        pickoff_codes: [1_000_000, -5_000_000, 3],
        ..still
    };
    let second = Sample {
        pulse_counts: [0; 3],
        ..first
    };
    let (f32_frames, _) = run::<F32>(&parameters, [first, second, second, second]);
    let (fixed_frames, _) = run::<Fixed>(&parameters, [first, second, second, second]);
    let (still_frames, _) = run::<Fixed>(&parameters, [still; 4]);
    assert_eq!(f32_frames, still_frames);
    assert_eq!(fixed_frames, still_frames);
    assert_eq!(still_frames[0].status, Status::PRIMED);
    assert_eq!(still_frames[1].status, Status::default());
}

#[test]
fn a_state_copied_in_mid_stream_goes_on_as_the_original() {
    let chain = Chain::<F32>::new(&worst_parameters()).unwrap();
    let sample = |k: i32| Sample {
        pulse_counts: [k % 17, k % 5 - 2, k],
        pickoff_codes: [k * 1000 % 7919, 0, -k],
        ..Sample::default()
    };
    let mut state = ChainState::new();
    for k in 0..1013 {
        chain.process(&mut state, &sample(k));
    }
    let mut copy = state;
    for k in 1013..3000 {
        let expected = chain.process(&mut state, &sample(k));
        assert_eq!(chain.process(&mut copy, &sample(k)), expected);
    }
}
