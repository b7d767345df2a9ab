//! The error of the product of α̂ and D by frequency, against the closed form of sampled sines.

use std::f64::consts::TAU;

use trueaxis::Fixed;

use crate::equations::CENTRAL;
use crate::motion::{Coning, TABLE_3_S2, fine, stream};
use crate::{mean_rate_rad_s, run};

/// The estimate's product over the true one, less one, from its definition: 2 Σ a_p sin(p x) 2 (1 − cos x)/x³ − 1 is
/// the relative error of the rectification of oscillations in quadrature.
fn product_error(x: f64) -> f64 {
    let terms = CENTRAL.iter().zip(1..);
    let sum: f64 = terms.map(|(a, p)| 2.0 * a * (f64::from(p) * x).sin()).sum();
    sum * 2.0 * (1.0 - x.cos()) / x.powi(3) - 1.0
}

/// Largest difference of the measured share from the formula \[1\]: the ends of 10 s are known to a pulse and a code,
/// 9e-11 rad or 2e-6 °/h, against drifts of 0.9 °/h and more; the tilts' second order is 4e-6 at 1e-3 rad.
const SHARE_TOLERANCE: f64 = 1e-5;

/// Coning angles by frequency \[°\]: as large as the drift's measurement needs and the range allows.
fn angle_deg(frequency_hz: f64) -> f64 {
    match frequency_hz {
        ..20.0 => 1.0,
        ..200.0 => 0.3,
        _ => 0.05,
    }
}

/// (share of the flexure's drift that stays) = −product error, through the chain.
fn share_left(frequency_hz: f64) -> f64 {
    let coning = Coning {
        frequency_hz,
        angle_rad: angle_deg(frequency_hz).to_radians(),
    };
    let rate = |truth, followed| {
        let with = |flexure_s2| fine().with(|p| p.flexure_s2 = flexure_s2);
        let samples = stream(&with(truth), &coning, false, 40_000);
        let (frames, state) = run::<Fixed>(&with(followed), samples);
        assert_eq!(state.faults().acceleration, 0);
        mean_rate_rad_s(&fine(), &frames, 1)[0]
    };
    let none = Default::default();
    let rigid = rate(none, none);
    (rate(TABLE_3_S2, TABLE_3_S2) - rigid) / (rate(TABLE_3_S2, none) - rigid)
}

#[test]
fn the_chain_leaves_the_share_that_the_formula_says() {
    println!("frequency  left        formula");
    for frequency_hz in [15.0, 100.0, 200.0, 400.0] {
        let left = share_left(frequency_hz);
        let formula = -product_error(TAU * frequency_hz / 4000.0);
        println!("{frequency_hz:5} Hz   {left:10.3e}  {formula:10.3e}");
        assert!((left - formula).abs() < SHARE_TOLERANCE);
    }
}

#[test]
fn the_product_errors_are_those_that_the_design_states() {
    // Stated with one or two digits: half of the last.
    for (frequency_hz, stated, half_digit) in [
        (100.0, 2e-7, 0.5e-7),
        (200.0, 1.3e-5, 0.05e-5),
        (400.0, 7.5e-4, 0.05e-4),
    ] {
        let error = product_error(TAU * frequency_hz / 4000.0).abs();
        println!("{frequency_hz} Hz: {error:.3e}");
        assert!(
            (error - stated).abs() <= half_digit,
            "{frequency_hz} Hz: {error}"
        );
    }
}
