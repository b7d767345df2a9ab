//! Vibration with one phase about several axes: nothing rectifies, and the compensation must create nothing.

use firmware_tests::sensing_block::{Flexure, Motion, Unit};

use crate::{Trial, UNEQUAL_S2, near};

/// Drift that the chain may create without pulses \[°/h\].
const MARK_DEG_H: f64 = 1e-5;

#[test]
fn nothing_is_created_in_phase() {
    let unit = Unit::fine().with(|u| u.flexure = Flexure::rigid(UNEQUAL_S2));
    let mut outcomes = Vec::new();
    for frequency_hz in [20.0, 50.0, 100.0, 200.0, 400.0] {
        for (axes, amplitude) in [("yz", [0.0, 0.6, 0.6]), ("xyz", [0.6, 0.6, -0.6])] {
            let motion = Motion::in_phase(near(frequency_hz), amplitude);
            let trial = Trial::new(&unit, &motion, 4.0);
            let name = format!("in phase about {axes}, {frequency_hz} Hz");
            let both = trial.both(&unit.flexure, &name);
            outcomes.extend(both.map(|outcome| (name.clone(), outcome)));
        }
    }
    for (name, outcome) in &outcomes {
        outcome.assert_true(name, MARK_DEG_H);
    }
}

#[test]
fn nothing_is_created_in_phase_on_a_slew_or_with_installation_errors() {
    let unit = Unit::fine().with(|u| {
        u.flexure = Flexure::rigid(UNEQUAL_S2);
        u.bias_rad_s = [2.1e-8, -3.3e-8, 4.7e-8];
        // Multiples of 2⁻¹¹, which the chain holds exactly: its rounding of them would turn a slew.
        u.installation_rad = trueaxis::CrossAxis::from_array([1.0, -2.0, 1.0, -1.0, 2.0, 1.0])
            .map(|units: f64| units / 2048.0);
    });
    let mut outcomes = Vec::new();
    for slew in [[0.0; 3], [0.02, -0.03, 0.05]] {
        let motion = Motion::in_phase(near(100.0), [0.6, 0.6, -0.6]).with_slew(slew);
        let trial = Trial::new(&unit, &motion, 4.0);
        let name = format!("in phase, 100 Hz, slew {slew:?}");
        let both = trial.both(&unit.flexure, &name);
        outcomes.extend(both.map(|outcome| (name.clone(), outcome)));
    }
    // On the slew the tilts' oscillation multiplies the slew's rate. In coning's products that correction is some
    // samples late: a tenth of its rectified part may stay.
    for (name, outcome) in &outcomes {
        let share = 0.1 * outcome.uncompensated.largest_deg_h();
        outcome.assert_left(name, MARK_DEG_H.max(share));
    }
}

/// Damping of a mode makes the tilt lag, and a lag rectifies in phase too: a compensation that knows the mode removes
/// it, to a part of the drift.
#[test]
fn a_ringing_block_rectifies_little_in_phase() {
    let rigid = Flexure::rigid(UNEQUAL_S2);
    let modes = UNEQUAL_S2.map(|k: f64| 1.0 / (std::f64::consts::TAU * k.sqrt()));
    let unit = Unit::fine().with(|u| u.flexure = rigid.ringing(modes, 0.005));
    let mut outcomes = Vec::new();
    for frequency_hz in [50.0, 100.0, 200.0] {
        let motion = Motion::in_phase(near(frequency_hz), [0.6, 0.6, -0.6]);
        let trial = Trial::new(&unit, &motion, 4.0);
        let name = format!("ringing in phase, {frequency_hz} Hz");
        let both = trial.both(&unit.flexure, &name);
        outcomes.extend(both.map(|outcome| (name.clone(), outcome)));
    }
    for (name, outcome) in &outcomes {
        let share = 0.01 * outcome.uncompensated.largest_deg_h();
        outcome.assert_left(name, MARK_DEG_H.max(share));
    }
}
