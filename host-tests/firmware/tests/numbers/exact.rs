//! The exact sums' conversions and products, against integers of twice the width.

use rand::RngExt;
use trueaxis::chain::numbers::exact::{
    ExactCoefficient, ExactLever, ExactWeight, VELOCITY_UNIT_M_S, fine, fine_of_f32,
};

use crate::{DRAWS, draws, word};

#[test]
fn a_value_is_converted_to_nearest() {
    assert_eq!(VELOCITY_UNIT_M_S, 256.0);
    assert_eq!(fine(0.25, 64), 1 << 62);
    assert_eq!(fine(-2f64.powi(-64), 64), -1);
    assert_eq!(
        [fine(1.4, 0), fine(1.6, 0), fine(-1.4, 0), fine(-1.6, 0)],
        [1, 2, -1, -2]
    );
    assert_eq!([fine(2.5, 0), fine(3.5, 0)], [2, 4]);
}

/// Right to 2⁻³¹ of a fine unit a count, down.
#[test]
fn a_weight_keeps_its_fraction_below_the_unit() {
    let mut rng = draws(41);
    for _ in 0..DRAWS {
        // Of 53 bits, all of which the weight holds: 22 and more above the unit, 31 below it.
        let weight = (rng.random_range(-(1i64 << 52)..1i64 << 52)) as f64 * 2f64.powi(-31);
        let scaled = (weight * 2f64.powi(31)) as i128;
        let counts = word(&mut rng, 31);
        let expected = (scaled * i128::from(counts)) >> 31;
        let of = ExactWeight::of(weight * 2f64.powi(-40), 40);
        assert_eq!(of.times_wide(counts), expected, "{weight} × {counts}");
        assert_eq!(of.times(counts), expected as i64, "{weight} × {counts}");
    }
}

/// Q37, within ±1/64; the product down, of an angle without its last bit.
#[test]
fn a_coefficient_times_an_angle_is_within_two_fine_units() {
    let mut rng = draws(42);
    for _ in 0..DRAWS {
        let whole = word(&mut rng, 31);
        let of = ExactCoefficient::of(f64::from(whole) * 2f64.powi(-37));
        let value: i64 = rng.random_range(-(1i64 << 62)..1 << 62) >> rng.random_range(0..40);
        let exact = (i128::from(whole) * i128::from(value)) >> 37;
        assert_eq!(of.times_wide(i128::from(value)), exact);
        let lost = exact - i128::from(of.times(value));
        assert!((-1..=2).contains(&lost), "{whole} × {value}: {lost}");
        let even = value & !1;
        let exact = (i128::from(whole) * i128::from(even)) >> 37;
        let lost = exact - i128::from(of.times(even));
        assert!((0..=1).contains(&lost), "{whole} × {even}: {lost}");
        let beyond = i128::from(value) << 20;
        assert_eq!(of.times_wide(beyond), (i128::from(whole) * beyond) >> 37);
    }
    // To nearest from f64, towards zero from f32.
    let one = |value: f64| ExactCoefficient::of(value).times_wide(1 << 37);
    assert_eq!(
        [one(1.6 * 2f64.powi(-37)), one(-1.6 * 2f64.powi(-37))],
        [2, -2]
    );
    let one = |value: f32| ExactCoefficient::of_f32(value).times_wide(1 << 37);
    assert_eq!(
        [
            one(1.6 * 2f32.powi(-37)),
            one(-1.6 * 2f32.powi(-37)),
            one(2f32.powi(-10))
        ],
        [1, -1, 1 << 27]
    );
}

/// Velocity units per rad in Q25, the product down, of an angle without its last bit.
#[test]
fn a_lever_times_an_angle_is_a_velocity() {
    let mut rng = draws(43);
    for _ in 0..DRAWS {
        let whole = word(&mut rng, 30);
        let of = ExactLever::of(f64::from(whole) * 2f64.powi(-25) * 256.0);
        let value: i64 = rng.random_range(-(1i64 << 57)..1 << 57) >> rng.random_range(0..30);
        let even = value & !1;
        let exact = (i128::from(whole) * i128::from(even)) >> 25;
        assert_eq!(i128::from(of.times(even)), exact, "{whole} × {even}");
    }
    assert_eq!(ExactLever::of(1.6 * 2f64.powi(-17)).times(1 << 25), 2);
}

/// Exact below 2⁻⁵: no bit of the float is lost above the unit, 2⁻⁶⁴.
#[test]
fn a_float_in_fine_units_is_exact() {
    let mut rng = draws(44);
    for _ in 0..DRAWS {
        let value = word(&mut rng, 24) as f32 * 2f32.powi(-29 - rng.random_range(0..30));
        assert_eq!(
            fine_of_f32(value),
            (f64::from(value) * 2f64.powi(64)) as i64,
            "{value:e}"
        );
    }
}
