//! Eq. (6) read literally against its settled signs.
//!
//! As printed, ε_ij = ε_ij0 − K_ij α_j for all six. That is the settled form with K_xz, K_yx, K_zy negated,
//! so the same chain can be made to follow either.

use trueaxis::{CrossAxis, F32, Fixed, NumberSystem};

use crate::motion::{Coning, TABLE_3_S2, fine, stream};
use crate::{DEG_H, mean_rate_rad_s, run};

/// The figures are stated to 0.001 °/h, the digits after it cut.
const PRINTED_DIGIT_DEG_H: f64 = 1e-3;

/// Largest residual of a compensated drift: the tilts' second order, K α = 2e-5 at 15 Hz, and the part of a frame,
/// 3e-11 rad over 12 s \[°/h\].
const LEFT_DEG_H: f64 = 1e-4;

const SAMPLES: usize = 48_000;

fn literal(k: CrossAxis<f64>) -> CrossAxis<f64> {
    CrossAxis {
        xz: -k.xz,
        yx: -k.yx,
        zy: -k.zy,
        ..k
    }
}

/// Drift about x, against the same stream of a rigid triad through a chain without flexure \[°/h\].
fn drift_deg_h<N: NumberSystem>(
    coning: &Coning,
    truth_s2: CrossAxis<f64>,
    followed_s2: CrossAxis<f64>,
) -> f64 {
    let with = |flexure_s2| fine().with(|p| p.flexure_s2 = flexure_s2);
    let rate = |truth_s2, followed_s2| {
        let samples = stream(&with(truth_s2), coning, false, SAMPLES);
        let (frames, _) = run::<N>(&with(followed_s2), samples);
        // The first frame holds the priming sample.
        mean_rate_rad_s(&fine(), &frames, 1)[0]
    };
    let rigid = rate(CrossAxis::default(), CrossAxis::default());
    (rate(truth_s2, followed_s2) - rigid) / DEG_H
}

fn bench() -> Coning {
    Coning {
        frequency_hz: 15.0,
        angle_rad: 0.367f64.to_radians(),
    }
}

fn assert_near(what: &str, value: f64, expected: f64, tolerance: f64) {
    println!("{what}: {value:.6} deg/h");
    assert!(
        (value - expected).abs() <= tolerance,
        "{what}: {value} against {expected} +- {tolerance} deg/h"
    );
}

#[test]
fn uncompensated_flexure_drifts_by_half_the_sum_of_k_times_omega_cubed_phi_squared() {
    let none = CrossAxis::default();
    let coning = bench();
    let sum = TABLE_3_S2.xy + TABLE_3_S2.xz;
    let formula = sum * coning.omega().powi(3) * coning.angle_rad.sin().powi(2) / 2.0 / DEG_H;
    let drift = drift_deg_h::<Fixed>(&coning, TABLE_3_S2, none);
    assert_near("15 Hz, 0.367 deg", drift.abs(), 0.495, PRINTED_DIGIT_DEG_H);
    assert_near("against the formula", drift.abs(), formula, LEFT_DEG_H);

    let slow = Coning {
        frequency_hz: 1.0,
        angle_rad: 5f64.to_radians(),
    };
    let drift = drift_deg_h::<Fixed>(&slow, TABLE_3_S2, none);
    assert_near("1 Hz, 5 deg", drift.abs(), 0.027, PRINTED_DIGIT_DEG_H);
}

#[test]
fn the_settled_signs_take_the_drift_away() {
    let f32_left = drift_deg_h::<F32>(&bench(), TABLE_3_S2, TABLE_3_S2);
    let fixed_left = drift_deg_h::<Fixed>(&bench(), TABLE_3_S2, TABLE_3_S2);
    assert_near("left, f32", f32_left, 0.0, LEFT_DEG_H);
    assert_near("left, fixed", fixed_left, 0.0, LEFT_DEG_H);
}

#[test]
fn read_literally_eq_6_explains_0_007_of_0_495_deg_h() {
    let none = CrossAxis::default();
    let settled = drift_deg_h::<Fixed>(&bench(), none, TABLE_3_S2);
    let read_literally = drift_deg_h::<Fixed>(&bench(), none, literal(TABLE_3_S2));
    assert_near("settled", settled.abs(), 0.495, PRINTED_DIGIT_DEG_H);
    assert_near("literal", read_literally.abs(), 0.007, PRINTED_DIGIT_DEG_H);
}
