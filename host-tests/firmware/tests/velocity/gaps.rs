//! Samples that did not come.

use nalgebra::Rotation3;
use trueaxis::{
    Chain, ChainState, F32, Fixed, NumberSystem, OUTPUT_M_S_PER_CODE, OutputFrame, Sample, Status,
};

use crate::motion::{CODE_M_S, G, Motion, Vector, navigate, parameters};

const NO_ARMS: [[f64; 3]; 3] = [[0.0; 3]; 3];

/// Centimetres, all different.
const ARMS_M: [[f64; 3]; 3] = [
    [0.04, 0.03, -0.02],
    [-0.05, 0.02, 0.01],
    [0.02, -0.03, 0.06],
];

/// The stream without the samples `lost`: the one after them has counted on.
fn with_gap<N: NumberSystem>(
    chain: &Chain<N>,
    samples: &[Sample],
    lost: std::ops::Range<usize>,
) -> (Vec<OutputFrame>, ChainState<N>) {
    let mut state = ChainState::new();
    let mut frames = Vec::new();
    let mut missed = Sample::default();
    for (k, sample) in samples.iter().enumerate() {
        let mut sample = *sample;
        for axis in 0..3 {
            sample.pulse_counts[axis] += missed.pulse_counts[axis];
            sample.accelerometer_codes[axis] += missed.accelerometer_codes[axis];
        }
        if lost.contains(&k) {
            missed = sample;
            frames.extend(chain.process_lost(&mut state, 1));
        } else {
            missed = Sample::default();
            frames.extend(chain.process(&mut state, &sample));
        }
    }
    (frames, state)
}

fn no_velocity_is_lost<N: NumberSystem>(lost: std::ops::Range<usize>) {
    let mut parameters = parameters(NO_ARMS);
    let known = parameters.accelerometers.as_mut().expect("accelerometers");
    known.bias_m_s2 = [0.4, 0.0, -0.3];
    let samples: Vec<Sample> = (0..400)
        .map(|k| Sample {
            accelerometer_codes: [2_000_000 + k, -1_000_000 - k, 400_000],
            ..Sample::default()
        })
        .collect();
    let chain = Chain::<N>::new(&parameters).expect("parameters");
    let (frames, state) = with_gap(&chain, &samples, lost.clone());
    assert_eq!(state.faults().velocity, 0, "{lost:?} is within the limit");
    assert!(state.faults().gap > 0);
    for (axis, bias) in [0.4, 0.0, -0.3].into_iter().enumerate() {
        let shown: i64 = frames.iter().map(|f| i64::from(f.dvel_codes[axis])).sum();
        let counted: i64 = samples[1..]
            .iter()
            .map(|sample| i64::from(sample.accelerometer_codes[axis]))
            .sum();
        let exact = counted as f64 * CODE_M_S - bias * 399.0 / 4000.0;
        // Half a code is carried; the bias is held to half a fine unit.
        let error = shown as f64 - exact / OUTPUT_M_S_PER_CODE;
        assert!(error.abs() < 0.5001, "{} {lost:?}: {error} codes", N::NAME);
    }
}

#[test]
fn lost_samples_lose_no_velocity_and_no_bias() {
    // Within a period, over a period's end, over several periods, up to a period's end.
    for lost in [33..36, 38..43, 55..97, 70..80] {
        no_velocity_is_lost::<F32>(lost.clone());
        no_velocity_is_lost::<Fixed>(lost);
    }
}

fn a_steady_turn_goes_on<N: NumberSystem>() {
    let rate = Vector::new(0.3, -0.2, 0.5);
    let gravity = Vector::new(0.0, 0.0, G);
    let motion = Motion {
        attitude: Box::new(move |t| Rotation3::new(rate * t)),
        rate: Box::new(move |_| rate),
        acceleration: Box::new(|_| Vector::zeros()),
        force: Box::new(move |t| Rotation3::new(rate * t).inverse() * gravity),
    };
    let samples = motion.samples(ARMS_M, 4009);
    let chain = Chain::<N>::new(&parameters(ARMS_M)).expect("parameters");
    // Within one period, so that nothing is shown late.
    let (frames, _) = with_gap(&chain, &samples, 2002..2006);
    let gap = frames.iter().position(|f| f.status.contains(Status::GAP));
    assert_eq!(gap, Some(200));
    let path = navigate(&motion.attitude, &frames);
    let last = path.len() - 1;
    let gained = path[last] - path[0];
    let error = (gained - gravity * (0.0025 * last as f64)).norm();
    println!(
        "{}: gap of 4 samples under 35 °/s costs {error:.2e} m/s",
        N::NAME
    );
    // Parts that a gap leaves out: Q of five samples, ω² times 0.1 m; and sculling within it, of which a steady turn
    // has none.
    let bound = 5.0 / 4000.0 * rate.norm_squared() * 0.1 + 1e-6;
    assert!(error < bound, "{}: {error:e} over {bound:e} m/s", N::NAME);
}

#[test]
fn a_gap_under_a_steady_turn_costs_the_squares_of_its_samples_and_no_more() {
    a_steady_turn_goes_on::<F32>();
    a_steady_turn_goes_on::<Fixed>();
}

/// Turn about x \[codes of 2⁻³⁴ rad\]: 1e-3 rad; push along y \[codes\]: 0.05 m/s.
const TURN: i32 = 17_179_869;
const PUSH: i32 = 50_000_000;

/// The frame of six samples `before`, two lost ones, the reading that covers them and its own period, and one of
/// zeros \[m/s\].
fn frame_across<N: NumberSystem>(before: Sample, reading: Sample) -> [f64; 3] {
    let chain = Chain::<N>::new(&parameters(NO_ARMS)).expect("parameters");
    let mut state = ChainState::new();
    for _ in 0..10 {
        chain.process(&mut state, &Sample::default());
    }
    for _ in 0..6 {
        chain.process(&mut state, &before);
    }
    assert_eq!(chain.process_lost(&mut state, 2), None);
    chain.process(&mut state, &reading);
    let frame = chain.process(&mut state, &Sample::default());
    let codes = frame.expect("the tenth period ends the frame").dvel_codes;
    codes.map(|code| f64::from(code) * OUTPUT_M_S_PER_CODE)
}

fn order_counts_across_a_gap<N: NumberSystem>() {
    let turn = |by: i32| Sample {
        pulse_counts: [by, 0, 0],
        ..Sample::default()
    };
    let push = |by: i32| Sample {
        accelerometer_codes: [0, by, 0],
        ..Sample::default()
    };
    let angle_rad = 6e-3f64;
    let velocity_m_s = 0.05;
    // The steady turn's term of second order bounds any order of the two: θ²/3 of the velocity at most.
    let bound = velocity_m_s * angle_rad.powi(2) / 3.0 + 2.0 * OUTPUT_M_S_PER_CODE;
    let [_, y, z] = frame_across::<N>(turn(TURN), push(PUSH));
    assert!(
        (y - velocity_m_s * angle_rad.cos()).abs() < bound,
        "{}: {y}",
        N::NAME
    );
    assert!(
        (z - velocity_m_s * angle_rad.sin()).abs() < bound,
        "{}: {z}",
        N::NAME
    );
    let [_, y, z] = frame_across::<N>(push(PUSH / 6), turn(6 * TURN));
    assert!((y - velocity_m_s).abs() < bound, "{}: {y}", N::NAME);
    assert!(z.abs() < bound, "{}: {z}", N::NAME);
}

#[test]
fn a_push_within_a_gap_is_turned_by_what_was_before_and_a_turn_within_it_turns_nothing_before() {
    order_counts_across_a_gap::<F32>();
    order_counts_across_a_gap::<Fixed>();
}
