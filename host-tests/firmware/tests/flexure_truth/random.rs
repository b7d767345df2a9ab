//! Random vibration about three axes, 20 to 200 Hz, 0.3 rad/s rms about each.

use firmware_tests::sensing_block::{Flexure, Motion, Phases, Unit};

use crate::{EQUAL_S2, MODE_DAMPING, MODE_HZ, MODE_S2, Outcome, Trial, UNEQUAL_S2};

const BAND_HZ: (f64, f64) = (20.0, 200.0);
const RMS_RAD_S: f64 = 0.3;
const TONES: usize = 24;

/// Share of the drift in quadrature that may stay \[1\].
const QUADRATURE_MARK: f64 = 3e-3;

/// Drift that may be created in phase \[°/h\].
const IN_PHASE_MARK_DEG_H: f64 = 1e-5;

fn outcomes(flexure: Flexure, phases: Phases, seed: u64) -> [Outcome; 2] {
    let unit = Unit::fine().with(|u| u.flexure = flexure);
    let motion = Motion::random(BAND_HZ, RMS_RAD_S, TONES, phases, seed);
    let trial = Trial::new(&unit, &motion, 8.0);
    trial.both(&unit.flexure, &format!("random, {phases:?}"))
}

#[test]
fn random_vibration_leaves_little_in_quadrature_and_creates_nothing_in_phase() {
    let [turning, common, independent] = [Phases::Turning, Phases::Common, Phases::Independent]
        .map(|phases| outcomes(Flexure::rigid(UNEQUAL_S2), phases, 21));
    for system in 0..2 {
        let quadrature = turning[system].uncompensated.largest_deg_h();
        turning[system].assert_left("turning", QUADRATURE_MARK * quadrature);
        common[system].assert_left("common", IN_PHASE_MARK_DEG_H);
        independent[system].assert_left("independent", QUADRATURE_MARK * quadrature);
    }
}

#[test]
fn random_vibration_of_a_ringing_block_leaves_as_little() {
    let flexure = Flexure::rigid([MODE_S2; 6]).ringing([MODE_HZ; 6], MODE_DAMPING);
    for outcome in outcomes(flexure, Phases::Turning, 22) {
        outcome.assert_left(
            "turning",
            QUADRATURE_MARK * outcome.uncompensated.largest_deg_h(),
        );
    }
}

#[test]
#[ignore = "ten seeds, equal and unequal K"]
fn random_vibration_of_ten_seeds_in_full() {
    for seed in 30..40 {
        for s2 in [EQUAL_S2, UNEQUAL_S2] {
            let turning = outcomes(Flexure::rigid(s2), Phases::Turning, seed);
            let independent = outcomes(Flexure::rigid(s2), Phases::Independent, seed);
            let common = outcomes(Flexure::rigid(s2), Phases::Common, seed);
            for system in 0..2 {
                let quadrature = turning[system].uncompensated.largest_deg_h();
                turning[system].assert_left("turning", QUADRATURE_MARK * quadrature);
                independent[system].assert_left("independent", QUADRATURE_MARK * quadrature);
                common[system].assert_left("common", IN_PHASE_MARK_DEG_H);
            }
        }
    }
}
