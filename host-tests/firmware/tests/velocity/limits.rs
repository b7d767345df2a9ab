//! Readings and outputs beyond their ranges.

use trueaxis::design_parameters::VELOCITY_LIMIT_M_S;
use trueaxis::{
    Chain, ChainState, F32, Fixed, NumberSystem, OUTPUT_M_S_PER_CODE, Parameters, Sample, Status,
};

use crate::frames;
use crate::motion::parameters;

const NO_ARMS: [[f64; 3]; 3] = [[0.0; 3]; 3];

/// Pulses of 2⁻²⁰ m/s, 128 output codes: everything here is exact.
const WEIGHT_M_S: f64 = 128.0 * OUTPUT_M_S_PER_CODE;

fn coarse() -> Parameters {
    let mut parameters = parameters(NO_ARMS);
    let known = parameters.accelerometers.as_mut().expect("accelerometers");
    known.weight_m_s = [WEIGHT_M_S; 3];
    parameters
}

fn reading(codes: [i32; 3]) -> Sample {
    Sample {
        accelerometer_codes: codes,
        ..Sample::default()
    }
}

fn held<N: NumberSystem>(beyond: i32) {
    let limit = (VELOCITY_LIMIT_M_S / WEIGHT_M_S) as i32;
    let mut samples = vec![Sample::default(); 40];
    samples[12] = reading([limit, 0, -limit]);
    samples[25] = reading([0, beyond, 7]);
    let (frames, state) = frames::<N>(&coarse(), &samples);
    let saturated = |frame: usize| frames[frame].status.contains(Status::VELOCITY_SATURATED);
    assert!(!saturated(1), "the limit itself is in range");
    assert!(saturated(2) && !saturated(3));
    assert_eq!(frames[1].dvel_codes, [128 * limit, 0, -128 * limit]);
    assert_eq!(
        frames[2].dvel_codes,
        [0, 128 * limit * beyond.signum(), 128 * 7],
        "{} holds {beyond} at the limit and leaves the others",
        N::NAME
    );
    let faults = state.faults();
    assert_eq!((faults.velocity, faults.counts), (1, 0));
    assert_eq!(faults.first.stages, Status::VELOCITY_SATURATED);
    assert_eq!(faults.first.sample, 25);
}

#[test]
fn codes_beyond_the_limit_are_held_flagged_and_counted() {
    let limit = (VELOCITY_LIMIT_M_S / WEIGHT_M_S) as i32;
    for beyond in [limit + 1, -limit - 1, i32::MAX, i32::MIN, i32::MIN + 1] {
        held::<F32>(beyond);
        held::<Fixed>(beyond);
    }
}

fn after_a_gap<N: NumberSystem>() {
    let limit = (VELOCITY_LIMIT_M_S / WEIGHT_M_S) as i32;
    let chain = Chain::<N>::new(&coarse()).expect("parameters");
    let mut state = ChainState::new();
    let mut frames = Vec::new();
    for k in 0..60 {
        match k {
            21..24 | 41..44 => frames.extend(chain.process_lost(&mut state, 1)),
            24 => frames.extend(chain.process(&mut state, &reading([4 * limit, 0, 0]))),
            44 => frames.extend(chain.process(&mut state, &reading([4 * limit + 1, 0, 0]))),
            _ => frames.extend(chain.process(&mut state, &Sample::default())),
        }
    }
    let codes = 128 * 4 * limit;
    assert_eq!(frames[2].dvel_codes, [codes, 0, 0]);
    assert!(!frames[2].status.contains(Status::VELOCITY_SATURATED));
    assert_eq!(frames[4].dvel_codes, [codes, 0, 0]);
    assert!(frames[4].status.contains(Status::VELOCITY_SATURATED));
}

#[test]
fn a_reading_after_three_lost_ones_may_be_four_times_the_limit() {
    after_a_gap::<F32>();
    after_a_gap::<Fixed>();
}

fn carried<N: NumberSystem>() {
    // 24 m/s within one frame, which shows 16.
    let chain = Chain::<N>::new(&coarse()).expect("parameters");
    let mut state = ChainState::new();
    let mut frames = Vec::new();
    let codes = (24.0 / WEIGHT_M_S) as i32;
    for _ in 0..10 {
        frames.extend(chain.process(&mut state, &Sample::default()));
    }
    frames.extend(chain.process_lost(&mut state, 199));
    frames.extend(chain.process(&mut state, &reading([codes, 0, 0])));
    for _ in 0..20 {
        frames.extend(chain.process(&mut state, &Sample::default()));
    }
    let shown: i64 = frames
        .iter()
        .map(|frame| i64::from(frame.dvel_codes[0]))
        .sum();
    assert_eq!(shown, 128 * i64::from(codes), "{} loses velocity", N::NAME);
    let full = frames
        .iter()
        .position(|frame| frame.dvel_codes[0] == i32::MAX);
    let full = full.expect("a frame filled to its end");
    assert!(frames[full].status.contains(Status::OUTPUT_SATURATED));
    assert!(!frames[full + 1].status.contains(Status::OUTPUT_SATURATED));
    assert_eq!(state.faults().velocity, 0);
}

#[test]
fn what_a_frame_cannot_show_comes_with_the_next() {
    carried::<F32>();
    carried::<Fixed>();
}
