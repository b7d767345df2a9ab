//! Gyros and reference of one motion and of two.

use nalgebra::{UnitQuaternion, Vector3};
use rlg_plan::SameMotionPlan;
use rlg_signal::axes::Triad;
use rlg_signal::same_motion::{Clocks, apart};

use super::{RATE_HZ, ROWS, noise};

fn noise_values(count: usize, seed: u64) -> Vec<f64> {
    // Neighbouring seeds of a congruence are alike at first.
    let mut noise = noise(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    (0..count).map(|_| noise()).collect()
}

/// Increments of a motion below 2 Hz with a pause, 0.2 rad/s, and white noise of `noise_rad` a row.
fn motion(seed: u64, noise_rad: f64) -> Triad {
    [0, 1, 2].map(|axis| {
        let drive = noise_values(ROWS, 10 * seed + axis);
        let noise = noise_values(ROWS, 7_000_000 + 10 * seed + axis);
        let (mut slow, mut smooth) = (0.0, 0.0);
        let each = drive.iter().zip(noise).enumerate();
        each.map(|(row, (drive, noise))| {
            let drive = if row / 500 == 3 { 0.0 } else { *drive };
            slow += 0.1 * (drive - slow);
            smooth += 0.1 * (slow - smooth);
            0.02 * smooth + noise_rad * noise
        })
        .collect()
    })
}

fn is_apart(gyros: &Triad, reference: &Triad) -> bool {
    let plan = SameMotionPlan::default();
    let clocks = Clocks {
        rate_hz: RATE_HZ,
        reference_hz: RATE_HZ,
    };
    apart((gyros, reference), &[true; ROWS], clocks, &plan).is_some()
}

#[test]
fn two_motions_are_apart_and_one_motion_of_noisy_sides_is_not() {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.9, 0.2));
    let mut two = 0;
    for seed in 0..24 {
        let gyros = motion(seed, 1e-4);
        two += u32::from(is_apart(&gyros, &motion(1000 + seed, 1e-4)));
        // The same motion 0.12 s later, in other axes, a fifth larger, with as much noise as motion in a row.
        let noise = [0, 1, 2].map(|axis| noise_values(ROWS, 5_000_000 + 10 * seed + axis));
        let mut reference: Triad = Default::default();
        for row in 0..ROWS {
            let sensed = |axis: usize| gyros[axis][(row + ROWS - 12) % ROWS];
            let turned = turn * Vector3::from_fn(|axis, _| 1.2 * sensed(axis));
            for axis in 0..3 {
                reference[axis].push(turned[axis] + 2e-3 * noise[axis][row]);
            }
        }
        assert!(!is_apart(&gyros, &reference), "{seed}");
    }
    // The best of 40 lags is one of the best delays once in as many pairs.
    assert!(two >= 22, "{two} of 24");
}

#[test]
fn gyros_at_rest_say_nothing() {
    let gyros: Triad =
        [0, 1, 2].map(|axis| noise_values(ROWS, axis).iter().map(|x| 1e-4 * x).collect());
    assert!(!is_apart(&gyros, &motion(3, 1e-4)));
}
