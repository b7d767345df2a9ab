//! The same with randomised dither, pulses of 0.8″, bias, scale, installation and pickoff gain.

use firmware_tests::sensing_block::{Flexure, Motion, Unit};
use trueaxis::CrossAxis;

use crate::{EQUAL_S2, Trial, UNEQUAL_S2, near};

fn as_built(s2: [f64; 6], seed: u64) -> Unit {
    Unit::dithered(seed).with(|u| {
        u.flexure = Flexure::rigid(s2);
        u.bias_rad_s = [2.1e-8, -3.3e-8, 4.7e-8];
        u.scale_error = [7e-6, -4e-6, 11e-6];
        u.installation_rad =
            CrossAxis::from_array([4.1e-4, -2.3e-4, 1.7e-4, -5.9e-4, 3.2e-4, 8.8e-4]);
        u.pickoff_gain = [1.013, 0.991, 1.004];
    })
}

/// Drift that may be created in phase \[°/h\]: the pulses' own standard error is 1e-4 after 40 s.
const IN_PHASE_MARK_DEG_H: f64 = 1e-3;

fn assert_in_phase(frequencies_hz: &[f64], seconds: f64) {
    let unit = as_built(UNEQUAL_S2, 11);
    let mut outcomes = Vec::new();
    for &frequency_hz in frequencies_hz {
        let motion = Motion::in_phase(near(frequency_hz), [0.6, 0.6, -0.6]);
        let trial = Trial::new(&unit, &motion, seconds).with_samples_per_output(1);
        let name = format!("dithered, in phase, {frequency_hz} Hz");
        let both = trial.both(&unit.flexure, &name);
        outcomes.extend(both.map(|outcome| (name.clone(), outcome)));
    }
    for (name, outcome) in &outcomes {
        outcome.assert_true(name, IN_PHASE_MARK_DEG_H);
    }
}

#[test]
fn nothing_is_created_in_phase_with_dither_and_pulses() {
    assert_in_phase(&[100.0, 200.0], 30.0);
}

#[test]
#[ignore = "half a minute: five frequencies, a minute of motion each"]
fn nothing_is_created_in_phase_with_dither_and_pulses_in_full() {
    assert_in_phase(&[20.0, 50.0, 100.0, 200.0, 400.0], 60.0);
}

/// Tests coning: 1e-3 °/h, or 2e-4 of the drift where that is more, to three standard errors of the pulses.
#[test]
fn coning_with_dither_and_pulses_leaves_what_the_pulses_do_not_resolve() {
    let unit = as_built(EQUAL_S2, 12);
    let mut outcomes = Vec::new();
    for frequency_hz in [15.0, 100.0, 200.0] {
        let motion = Motion::coning(0, near(frequency_hz), 0.6);
        let trial = Trial::new(&unit, &motion, 20.0).with_samples_per_output(1);
        let name = format!("dithered, coning, {frequency_hz} Hz");
        let both = trial.both(&unit.flexure, &name);
        outcomes.extend(both.map(|outcome| (name.clone(), outcome)));
    }
    for (name, outcome) in &outcomes {
        let share = 2e-4 * outcome.uncompensated.largest_deg_h();
        let resolved = outcome.left.resolution_deg_h();
        outcome.assert_left(name, share.max(1e-3) + resolved);
    }
}
