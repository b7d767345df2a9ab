//! Spin at the frequency of an oscillation: the motion that separates the two K of a gyro.

use std::f64::consts::FRAC_PI_2;

use firmware_tests::sensing_block::{Flexure, Motion, Unit};

use crate::{Trial, UNEQUAL_S2};

/// Share of the drift that may stay \[1\]: the compensation of 1 Hz is exact to the arithmetic.
const MARK: f64 = 1e-3;

fn assert_spin(turns: &[(usize, usize, f64, f64)]) {
    let unit = Unit::fine().with(|u| u.flexure = Flexure::rigid(UNEQUAL_S2));
    let mut outcomes = Vec::new();
    for &(spin_axis, axis, frequency_hz, phase_rad) in turns {
        let motion = Motion::spin_synchronous(spin_axis, axis, frequency_hz, 0.6, phase_rad);
        let trial = Trial::new(&unit, &motion, 16.0);
        let name = format!("spin about {spin_axis} at {frequency_hz}, axis {axis}, {phase_rad:.1}");
        let both = trial.both(&unit.flexure, &name);
        outcomes.extend(both.map(|outcome| (name.clone(), outcome)));
    }
    for (name, outcome) in &outcomes {
        outcome.assert_left(name, MARK * outcome.uncompensated.largest_deg_h());
    }
}

#[test]
fn spin_synchronous_oscillation_is_followed() {
    assert_spin(&[(2, 1, 1.003, 0.0), (2, 1, -1.003, FRAC_PI_2)]);
}

#[test]
#[ignore = "all pairs of axes, both directions, two phases"]
fn spin_synchronous_oscillation_of_every_pair_in_full() {
    let mut turns = Vec::new();
    for spin_axis in 0..3 {
        for axis in (0..3).filter(|axis| *axis != spin_axis) {
            for frequency_hz in [1.003, -1.003] {
                for phase_rad in [0.0, FRAC_PI_2] {
                    turns.push((spin_axis, axis, frequency_hz, phase_rad));
                }
            }
        }
    }
    assert_spin(&turns);
}
