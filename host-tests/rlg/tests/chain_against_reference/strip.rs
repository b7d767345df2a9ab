//! The dither strip: a late pickoff, its adaptation to a wrong one, and the error due to adaptation.

use crate::motion::{Both, Coning, Motion, Slew};
use crate::unit::{
    DITHER_HZ, DITHER_RAD, Firmware, Reference, Runner, TABLE_3_S2, Triad, as_built, reading,
};
use crate::{DEG_H, PERIOD_S, TEN_MINUTES};
use nalgebra::{Matrix2, UnitQuaternion, Vector2, Vector3};
use rlg::reference::ReferenceChain;
use rlg::replay::calibration;
use std::f64::consts::TAU;
use trueaxis::{F32, Fixed, Parameters};

/// Drift allowed for the adaptation to the pickoff \[°/h\].
const ADDED_DRIFT_DEG_H: f64 = 1e-4;

/// The chain's documented choice \[s\].
pub const ADAPTATION_TIME_S: f64 = 20.0;

/// Largest residual share of the dither at its frequency.
const RESIDUE: f64 = 1e-3;

fn motion() -> Both<Slew, Coning> {
    let coning = Coning {
        frequency_hz: 15.0,
        angle_rad: 0.367_f64.to_radians(),
        flexure_s2: TABLE_3_S2.to_array(),
    };
    Both(Slew([4.1e-5, -2.2e-5, 5.6e-5]), coning)
}

/// Initial values with a gain wrong by 5 %, with an unknown delay of 20 µs, and with both.
fn wrong() -> Parameters {
    let truth = as_built();
    let [x, y, z] = truth.pickoff_gain;
    let [dx, dy, dz] = truth.pickoff_delay_s;
    truth.with(|p| {
        p.pickoff_gain = [1.05 * x, y, 0.95 * z];
        p.pickoff_delay_s = [dx, dy - 20e-6, dz - 20e-6];
        p.adaptation_time_s = ADAPTATION_TIME_S;
    })
}

#[test]
fn the_reference_takes_a_late_pickoff_off_to_rounding_where_the_tone_is_pure() {
    // The flexure's correction of the first increment comes three periods later.
    let known = as_built().with(|p| p.flexure_s2 = Default::default());
    let mut chain = ReferenceChain::new(&calibration(&known));
    let turn = |axis: usize, t: f64| DITHER_RAD[axis] * (TAU * DITHER_HZ[axis] * t).sin();
    let mut sum = Vector3::zeros();
    let mut first = Vector3::zeros();
    for k in 0..400 {
        let end_s = (k + 1) as f64 * PERIOD_S;
        let axes = [0, 1, 2];
        let mut sample = reading(&known, &trueaxis::Sample::default());
        sample.pickoff_rad = axes.map(|i| turn(i, end_s - known.pickoff_delay_s[i]));
        sample.sensed_rad =
            axes.map(|i| known.pickoff_gain[i] * (turn(i, end_s) - turn(i, end_s - PERIOD_S)));
        let case = chain.process(&sample).case_rad;
        sum += case;
        // the first increment has one sample before it, the strip needs two
        if k == 1 {
            first = case;
        }
    }
    let bias: Vector3<f64> = Vector3::from(known.bias_rad_s) * (398.0 * PERIOD_S);
    // the bias goes through the installation matrix, 1e-3 of 5e-9 rad; the rest is rounding of 1e-3 rad
    let left = sum - first + bias;
    assert!(left.amax() < 1e-11, "{left}");
    // and the first one is the quarter-period tap, 2πFd/sin Ω, on one step of the pickoff
    assert!(first.amax() < 0.1 * DITHER_RAD[2], "{first}");
}

/// Computes the rms over quarter seconds of each block's residual angle, relative to the block's amplitude.
fn residue(runner: &mut dyn Runner) -> Vector3<f64> {
    const BLOCK: usize = 1000;
    let (from, to) = (40_000, 80_000);
    let known = as_built();
    let mut triad = Triad::new(&known, 8, to as f64 * PERIOD_S);
    let mut motion = motion();
    let mut normal = [Matrix2::<f64>::zeros(); 3];
    let mut right = [Vector2::<f64>::zeros(); 3];
    let mut squares = Vector3::zeros();
    let mut blocks = 0.0;
    let mut blocks_before = [Vector3::<f64>::zeros(); 3];
    for k in 0..to {
        let sample = triad.read(k, motion.sensed(k));
        let case = motion.1.case(k);
        let rotation = runner.take(&sample).expect("one sample a frame");
        let [now, before, _] = blocks_before;
        let next = triad.block_rad(k);
        blocks_before = [next, now, before];
        if k < from {
            continue;
        }
        for i in 0..3 {
            let (sin, cos) = (TAU * DITHER_HZ[i] * PERIOD_S).sin_cos();
            let step = [next[i] - now[i], now[i] - before[i]];
            let tone = Vector2::new(step[0], (cos * step[0] - step[1]) / sin);
            normal[i] += tone * tone.transpose();
            right[i] += tone * (rotation[i] - case[i]);
        }
        if (k + 1) % BLOCK == 0 {
            for i in 0..3 {
                let left = normal[i].try_inverse().unwrap() * right[i];
                squares[i] += left.norm_squared();
            }
            normal = Default::default();
            right = Default::default();
            blocks += 1.0;
        }
    }
    squares.map(|square: f64| (square / blocks).sqrt())
}

#[test]
fn a_wrong_gain_and_an_unknown_delay_leave_a_thousandth_of_the_dither_after_ten_seconds() {
    let wrong = wrong().with(|p| p.samples_per_output = 1);
    let frozen = wrong.with(|p| p.adaptation_time_s = 0.0);
    let before = residue(&mut Reference::new(&frozen));
    println!("frozen: {:.2e} {:.2e} {:.2e}", before.x, before.y, before.z);
    // initial errors: 5 %, 2π 404 Hz 20 µs, and 5 % with 2π 439 Hz 20 µs
    assert!(before.iter().all(|share| (0.045..0.08).contains(share)));
    let runners: [&mut dyn Runner; 3] = [
        &mut Reference::new(&wrong),
        &mut Firmware::<F32>::new(&wrong),
        &mut Firmware::<Fixed>::new(&wrong),
    ];
    for runner in runners {
        let left = residue(runner);
        let name = runner.name();
        println!("{name}: {:.2e} {:.2e} {:.2e}", left.x, left.y, left.z);
        assert!(left.amax() < RESIDUE, "{name}: {left}");
    }
}

#[test]
fn following_the_pickoff_adds_no_drift_in_ten_minutes() {
    let frozen_at_truth = as_built();
    let mut truth = Reference::new(&frozen_at_truth);
    let mut runners: [&mut dyn Runner; 3] = [
        &mut Reference::new(&wrong()),
        &mut Firmware::<F32>::new(&wrong()),
        &mut Firmware::<Fixed>::new(&wrong()),
    ];
    // during adaptation the angle varies by 5e-4 of the dither: a mean over 10 s at both ends isolates the drift
    const MEAN: usize = 40_000;
    let (early, late) = (MEAN..2 * MEAN, TEN_MINUTES - MEAN..TEN_MINUTES);
    let mut triad = Triad::new(&frozen_at_truth, 5, TEN_MINUTES as f64 * PERIOD_S);
    let mut motion = motion();
    // attitudes, not sums of rotation vectors: coning of the residual dither encloses an area within output periods that the
    // next rotation cancels, and a sum would keep it as a random walk
    let mut true_attitude = UnitQuaternion::identity();
    let mut attitude = [UnitQuaternion::identity(); 3];
    let mut means = [[Vector3::<f64>::zeros(); 2]; 3];
    let frames = (MEAN / usize::from(frozen_at_truth.samples_per_output)) as f64;
    for k in 0..TEN_MINUTES {
        let sample = triad.read(k, motion.sensed(k));
        let Some(expected) = truth.take(&sample) else {
            for runner in &mut runners {
                assert!(runner.take(&sample).is_none());
            }
            continue;
        };
        true_attitude *= UnitQuaternion::from_scaled_axis(expected);
        for (i, runner) in runners.iter_mut().enumerate() {
            let rotation = runner.take(&sample).expect("frames at the same samples");
            attitude[i] *= UnitQuaternion::from_scaled_axis(rotation);
            // in the axes of the common initial attitude
            let apart = (attitude[i] * true_attitude.inverse()).scaled_axis();
            for (mean, range) in means[i].iter_mut().zip([&early, &late]) {
                if range.contains(&k) {
                    *mean += apart / frames;
                }
            }
        }
    }
    for (runner, [early, late]) in runners.iter().zip(means) {
        let seconds = (TEN_MINUTES - 2 * MEAN) as f64 * PERIOD_S;
        let drift = (late - early).amax() / seconds / DEG_H;
        println!("{}: {drift:.1e} deg/h added", runner.name());
        assert!(drift < ADDED_DRIFT_DEG_H, "{}: {drift}", runner.name());
    }
}
