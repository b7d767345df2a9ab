//! The acceleration filter's product error, by order and frequency: physics.md's table through the chain.

use std::f64::consts::TAU;

use trueaxis::Fixed;

use crate::motion::{Coning, TABLE_3_S2, fine, stream};
use crate::{mean_rate_rad_s, run};

/// The filter's product over the true one, less one, from its definition:
/// Σ c_p sin(p x) 2 (1 − cos x)/x³ − 1 is what oscillations in quadrature rectify too little or much.
fn product_error(order: u8, x: f64) -> f64 {
    let rows: [&[f64]; 4] = [
        &[1.0],
        &[3.0 / 2.0, -1.0 / 4.0],
        &[43.0 / 24.0, -29.0 / 60.0, 7.0 / 120.0],
        &[107.0 / 54.0, -727.0 / 1080.0, 44.0 / 315.0, -41.0 / 3024.0],
    ];
    let row = rows[usize::from(order) - 1];
    let sum: f64 = row
        .iter()
        .zip(1..)
        .map(|(c, p)| c * (f64::from(p) * x).sin())
        .sum();
    sum * 2.0 * (1.0 - x.cos()) / x.powi(3) - 1.0
}

/// How far the measured share may be from the formula \[1\]: the ends of 10 s are known to a pulse and a code,
/// 9e-11 rad or 2e-6 °/h, against drifts of 0.9 °/h and more; the tilts' second order is 4e-6 at 1e-3 rad.
const SHARE_TOLERANCE: f64 = 1e-5;

/// Coning angles by frequency \[°\]: as large as the drift's measurement needs and the acceleration limit
/// allows.
fn angle_deg(frequency_hz: f64) -> f64 {
    match frequency_hz {
        ..20.0 => 1.0,
        ..200.0 => 0.3,
        _ => 0.05,
    }
}

/// (share of the flexure's drift that stays) = −product error, through the chain.
fn share_left(order: u8, frequency_hz: f64) -> f64 {
    let coning = Coning {
        frequency_hz,
        angle_rad: angle_deg(frequency_hz).to_radians(),
    };
    let rate = |truth, followed| {
        let with = |flexure_s2| {
            fine().with(|p| {
                p.flexure_s2 = flexure_s2;
                p.acceleration_order = order;
            })
        };
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
fn each_order_leaves_the_share_that_its_formula_says() {
    println!("order  frequency  left        formula");
    for frequency_hz in [15.0, 100.0, 400.0] {
        for order in 1..=4 {
            let left = share_left(order, frequency_hz);
            let formula = -product_error(order, TAU * frequency_hz / 4000.0);
            println!("{order}      {frequency_hz:5} Hz   {left:10.3e}  {formula:10.3e}");
            assert!((left - formula).abs() < SHARE_TOLERANCE, "order {order}");
        }
    }
}

#[test]
fn the_product_errors_are_those_that_the_design_states() {
    // Stated with two digits: half of the second.
    for (order, frequency_hz, stated) in [
        (1, 100.0, 6.2e-3),
        (1, 400.0, 9.5e-2),
        (2, 400.0, 8.5e-3),
        (3, 400.0, 7.5e-4),
        (4, 400.0, 6.7e-5),
    ] {
        let error = product_error(order, TAU * frequency_hz / 4000.0).abs();
        let half_digit = 0.05 * 10f64.powf(f64::log10(stated).floor());
        println!("order {order}, {frequency_hz} Hz: {error:.3e}");
        assert!(
            (error - stated).abs() <= half_digit,
            "order {order}: {error}"
        );
    }
}
