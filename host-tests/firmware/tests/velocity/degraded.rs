//! The size effect while a pickoff does not show its block.

use std::f64::consts::TAU;

use trueaxis::{F32, Fixed, NumberSystem, OUTPUT_M_S_PER_CODE, Sample, Status};

use crate::frames;
use crate::motion::parameters;

/// Centimetres, all different.
const ARMS_M: [[f64; 3]; 3] = [
    [0.04, 0.03, -0.02],
    [-0.05, 0.02, 0.01],
    [0.02, -0.03, 0.06],
];

/// 150″ at 400 Hz about x, in pulses of 0.8″ and pickoff codes of 2⁻³² rad.
const DITHER_RAD: f64 = 7.3e-4;
const DITHER_HZ: f64 = 400.0;
const PULSE_RAD: f64 = 3.9e-6;
const CODES_PER_RAD: f64 = (1u64 << 32) as f64;

/// The case at rest, block x dithering; its pickoff stands still from this time on.
const FAILS_S: f64 = 0.2;

fn a_failed_pickoff_moves_nothing<N: NumberSystem>() {
    let known = parameters(ARMS_M).with(|p| {
        p.pulse_weight_rad = [PULSE_RAD; 3];
        p.dither_amplitude_rad = [DITHER_RAD, 0.0, 0.0];
        p.dither_frequency_hz = [DITHER_HZ; 3];
    });
    let block = |t: f64| DITHER_RAD * (TAU * DITHER_HZ * t).sin();
    let pulses = |t: f64| (block(t) / PULSE_RAD).floor() as i32;
    let samples: Vec<Sample> = (1..=5600)
        .map(|k| {
            let t = f64::from(k) / 4000.0;
            let mut sample = Sample::default();
            sample.pulse_counts[0] = pulses(t) - pulses(t - 1.0 / 4000.0);
            sample.pickoff_codes[0] = (block(t.min(FAILS_S)) * CODES_PER_RAD) as i32;
            sample
        })
        .collect();
    let (frames, _) = frames::<N>(&known, &samples);
    // From 0.4 s on; a fault is seen two windows of 30 ms after it began.
    let after = &frames[160..];
    assert!(
        after
            .iter()
            .all(|f| f.status.contains(Status::PICKOFF_FAILED))
    );
    let gained = [0, 1, 2].map(|axis| {
        let codes = after.iter().map(|frame| i64::from(frame.dvel_codes[axis]));
        codes.sum::<i64>() as f64 * OUTPUT_M_S_PER_CODE
    });
    // The held rate is one of pulses: 1½ of one increment less ½ of the one before, each a pulse off at most. A frame
    // turns by the dither's two amplitudes at most, there and back. Taken for the case's, the dither would gain
    // ω²/2 times the difference of two arms: 8e-2 m/s in this second.
    let held_m_s = 2.0 * PULSE_RAD * 4000.0 * 0.06;
    let bound = held_m_s * 2.0 * DITHER_RAD + OUTPUT_M_S_PER_CODE;
    for gained in gained {
        assert!(gained.abs() < bound, "{}: {gained:e} m/s", N::NAME);
    }
}

#[test]
fn dither_that_is_not_stripped_is_no_motion_of_the_accelerometers() {
    a_failed_pickoff_moves_nothing::<F32>();
    a_failed_pickoff_moves_nothing::<Fixed>();
}
