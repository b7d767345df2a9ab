//! Vibration that rectifies: coning about each axis, ellipses, stiff and ringing, K known and 10 % wrong.

use crate::predicted::drift_deg_h;
use crate::{EQUAL_S2, MODE_DAMPING, MODE_HZ, MODE_S2, Trial, UNEQUAL_S2, near};
use firmware_tests::sensing_block::{Flexure, Motion, Unit};

fn stiff(s2: [f64; 6]) -> Unit {
    Unit::fine().with(|u| u.flexure = Flexure::rigid(s2))
}

/// Coning with 0.6 rad/s and 70e-9 s² at these frequencies \[Hz\] have this residual at most \[°/h\]. At 15 Hz 1e-8 was
/// asked, 2e-8 of
/// the drift: K as a number of single precision is known to 3e-8 of itself, and words of fixed point round more.
const MARKS: [(f64, f64); 4] = [(15.0, 1e-7), (50.0, 1e-7), (100.0, 2e-6), (200.0, 2e-4)];

fn assert_coning(axes: &[usize]) {
    let unit = stiff(EQUAL_S2);
    let mut outcomes = Vec::new();
    for &axis in axes {
        for (frequency_hz, mark_deg_h) in MARKS {
            let motion = Motion::coning(axis, near(frequency_hz), 0.6);
            // One standard error of 40 s at 4 kHz is 2e-9 °/h, of 8 s 2e-8 °/h.
            let seconds = if frequency_hz < 20.0 { 40.0 } else { 8.0 };
            let trial = Trial::new(&unit, &motion, seconds).with_samples_per_output(1);
            let name = format!("coning about axis {axis}, {frequency_hz} Hz");
            for outcome in trial.both(&unit.flexure, &name) {
                outcomes.push((name.clone(), outcome, mark_deg_h));
            }
        }
    }
    for (name, outcome, mark_deg_h) in &outcomes {
        outcome.assert_left(name, *mark_deg_h);
    }
}

#[test]
fn coning_about_x_leaves_less_than_its_marks() {
    assert_coning(&[0]);
}

#[test]
#[ignore = "twice as long again"]
fn coning_about_every_axis_leaves_less_than_its_marks_in_full() {
    assert_coning(&[1, 2]);
}

/// With unequal K, at each frequency up to 400 Hz; at 400 Hz the estimate of the acceleration is good to 1e-3.
#[test]
fn coning_with_unequal_k_leaves_a_thousandth_at_most() {
    let unit = stiff(UNEQUAL_S2);
    let mut outcomes = Vec::new();
    for (axis, frequency_hz, mark) in [
        (0, 1.0, 1e-3),
        (1, 20.0, 1e-6),
        (2, 100.0, 1e-6),
        (0, 200.0, 3e-5),
        (1, 400.0, 1.2e-3),
    ] {
        let motion = Motion::coning(axis, near(frequency_hz), 0.6);
        let trial = Trial::new(&unit, &motion, if frequency_hz < 10.0 { 20.0 } else { 8.0 });
        let name = format!("coning, unequal K, {frequency_hz} Hz");
        for outcome in trial.both(&unit.flexure, &name) {
            outcomes.push((name.clone(), outcome, mark));
        }
    }
    for (name, outcome, mark) in &outcomes {
        outcome.assert_left(name, mark * outcome.uncompensated.largest_deg_h());
    }
}

/// An ellipse is part coning, part in phase: the residual is the share of the coning part.
#[test]
fn ellipses_leave_a_share_of_their_coning_part() {
    let unit = stiff(UNEQUAL_S2);
    let mut outcomes = Vec::new();
    for (frequency_hz, mark) in [(20.0, 1e-6), (50.0, 1e-6), (100.0, 1e-6), (200.0, 3e-5)] {
        let motion = Motion::elliptical(near(frequency_hz), [0.5, 0.6, 0.3], [0.0, 0.3, 1.4]);
        let trial = Trial::new(&unit, &motion, 8.0);
        let name = format!("ellipse, {frequency_hz} Hz");
        for outcome in trial.both(&unit.flexure, &name) {
            outcomes.push((name.clone(), outcome, mark));
        }
    }
    for (name, outcome, mark) in &outcomes {
        outcome.assert_left(name, mark * outcome.uncompensated.largest_deg_h());
    }
}

#[test]
fn a_ringing_block_leaves_a_thousandth_to_200_hz() {
    let unit = Unit::fine().with(|u| {
        u.flexure = Flexure::rigid([MODE_S2; 6]).ringing([MODE_HZ; 6], MODE_DAMPING);
    });
    let mut outcomes = Vec::new();
    for frequency_hz in [20.0, 50.0, 100.0, 150.0, 200.0] {
        let motion = Motion::coning(0, near(frequency_hz), 0.6);
        let trial = Trial::new(&unit, &motion, 4.0);
        let name = format!("ringing, coning, {frequency_hz} Hz");
        for outcome in trial.both(&unit.flexure, &name) {
            outcomes.push((name.clone(), outcome));
        }
    }
    for (name, outcome) in &outcomes {
        outcome.assert_left(name, 1e-3 * outcome.uncompensated.largest_deg_h());
    }
}

/// A chain that takes a ringing block for a stiff one leaves (f/f0)² of the drift.
#[test]
fn a_static_k_leaves_the_square_of_the_frequency_over_the_modes() {
    let unit = Unit::fine().with(|u| {
        u.flexure = Flexure::rigid([MODE_S2; 6]).ringing([MODE_HZ; 6], MODE_DAMPING);
    });
    for frequency_hz in [20.0, 50.0, 100.0, 200.0] {
        let motion = Motion::coning(0, near(frequency_hz), 0.6);
        let trial = Trial::new(&unit, &motion, 4.0);
        let formula = (near(frequency_hz) / MODE_HZ).powi(2);
        let name = format!("ringing, K static, {frequency_hz} Hz");
        for outcome in trial.both(&Flexure::rigid([MODE_S2; 6]), &name) {
            let share = outcome.left.mean_deg_h[0] / outcome.uncompensated.mean_deg_h[0];
            println!("{name}: {share:.5}, formula {formula:.5}");
            assert!((share - formula).abs() < 1e-4, "{name}: {share}");
        }
    }
}

#[test]
fn a_k_that_is_10_percent_wrong_leaves_10_percent() {
    let unit = stiff(UNEQUAL_S2);
    for frequency_hz in [15.0, 50.0, 100.0, 200.0] {
        for (motion, kind) in [
            (Motion::coning(0, near(frequency_hz), 0.6), "coning"),
            (
                Motion::elliptical(near(frequency_hz), [0.5, 0.6, 0.3], [0.0, 0.3, 1.4]),
                "ellipse",
            ),
        ] {
            let trial = Trial::new(&unit, &motion, 4.0);
            let name = format!("K 10 % too large, {kind}, {frequency_hz} Hz");
            let predicted = drift_deg_h(&unit.flexure, &motion);
            let largest = predicted.iter().fold(0.0f64, |l, v| l.max(v.abs()));
            for outcome in trial.both(&unit.flexure.times(1.1), &name) {
                for (left, predicted) in outcome.left.mean_deg_h.iter().zip(predicted) {
                    let expected = -0.1 * predicted;
                    assert!((left - expected).abs() < 1e-4 * largest, "{name}: {left}");
                }
            }
        }
    }
}
