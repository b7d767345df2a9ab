//! The f32 operations: each within its roundings of the formula in f64.

use trueaxis::{F32, NumberSystem};

use crate::{DRAWS, draws, word};

/// Half a unit in the last place, relative.
const ROUNDING: f64 = 1.0 / (1 << 24) as f64;

/// Asserts that `found` is the sum of `terms` to the roundings of as many products and sums.
#[track_caller]
fn is_sum(found: f32, terms: &[f64]) {
    let (sum, magnitude) = terms.iter().fold((0.0, 0.0), |(sum, all), term| {
        (sum + term, all + term.abs())
    });
    let error = (f64::from(found) - sum).abs();
    let allowed = (2 + terms.len()) as f64 * ROUNDING * magnitude;
    assert!(
        error <= allowed,
        "{found} for {sum}: off by {error:e}, roundings {allowed:e}"
    );
}

#[test]
fn conversions_are_to_nearest() {
    for value in [0.0, 1.0 / 3.0, -1.0 / 7.0, 0.1] {
        let nearest = value as f32;
        assert_eq!(F32::coefficient(value), nearest);
        assert_eq!(F32::filter_coefficient(value), nearest);
        assert_eq!(F32::flexure(value), nearest);
        assert_eq!(F32::slope(value), nearest);
        assert_eq!(F32::increment(value), nearest);
        assert_eq!(F32::tilt_limit(value), nearest);
        assert_eq!(F32::pulse_weight(value, 7), nearest);
    }
    assert_eq!(F32::tap(1 << 62, ()), 0.25);
    assert_eq!(F32::tap(-(1 << 40), ()), -(2f32.powi(-24)));
    assert_eq!(F32::step((), -12), -12.0);
    assert_eq!((F32::codes_per_factor(()), F32::RAD_PER_FACTOR), (1.0, 1.0));
}

#[test]
fn sums_and_products_are_their_formulas() {
    let mut rng = draws(21);
    for _ in 0..DRAWS {
        let any = [0; 5].map(|_| word(&mut rng, 30) as f32 * 2f32.powi(-31));
        let [a, b, c, d, e] = any;
        let [wa, wb, wc, wd, we] = any.map(f64::from);
        let counts = word(&mut rng, 24);
        is_sum(F32::pulses(a, counts), &[wa * f64::from(counts)]);
        is_sum(F32::strip(a, b, c), &[wa, -wb * wc]);
        is_sum(F32::add_product(a, b, c), &[wa, wb * wc]);
        is_sum(F32::add_scaled(a, b, c), &[wa, wb * wc]);
        is_sum(F32::add_product_of(a, b, c), &[wa, wb * wc]);
        is_sum(F32::add_correlation(a, b, c), &[wa, wb * wc]);
        is_sum(F32::difference(a, b), &[wa, -wb]);
        is_sum(F32::add(a, b), &[wa, wb]);
        is_sum(F32::add_tilt(a, b), &[wa, wb]);
        is_sum(F32::add_tilted(a, b), &[wa, wb]);
        is_sum(F32::turn(a, b), &[wa, wb]);
        is_sum(F32::sloped(a, b), &[wa * wb]);
        is_sum(F32::sloped_twice(a, b), &[wa * wb * wb]);
        is_sum(F32::tilt(a, b), &[wa * wb]);
        is_sum(F32::tilted(a, b, c, d), &[wa * wb, wc * wd]);
        is_sum(F32::add_cross(a, b, c, d, e), &[wa, wb * wc, -wd * we]);
        is_sum(F32::within_sample(a), &[wa / 12f64.sqrt()]);
        is_sum(
            F32::filter(&[a, b, c, d], [e, d, b, c]),
            &[wa * we, wb * wd, wc * wb, wd * wc],
        );
        is_sum(
            F32::section(&[a, b, c, d, e], [e, a, d], [b, c]),
            &[wa * we, wb * wa, wc * wd, wd * wb, we * wc],
        );
        for same in [
            F32::filtered,
            F32::acceleration,
            F32::step_factor,
            F32::increment_factor,
            F32::correlation,
        ] {
            assert_eq!(same(a), a);
        }
        let limit = b.abs();
        assert_eq!(
            F32::difference_within(a, c, limit),
            (a - c).clamp(-limit, limit)
        );
        assert_eq!(F32::hold_tilt(a, limit), a.clamp(-limit, limit));
    }
}

/// Beyond 2⁻¹⁰ of either sign, and held there.
#[test]
fn the_acceleration_is_held_at_its_limit() {
    let limit = 2f32.powi(-10);
    for sign in [1.0, -1.0] {
        assert!(!F32::beyond(sign * limit));
        assert!(F32::beyond(sign * limit.next_up()));
        assert!(!F32::beyond(sign * limit.next_down()));
        assert_eq!(F32::held(sign * 0.5), sign * limit);
        assert_eq!(F32::held(sign * 1e-4), sign * 1e-4);
    }
    assert!(!F32::beyond(0.0) && !F32::beyond(-0.0));
}

#[test]
fn a_cube_is_of_what_is_held_within_its_reach() {
    let end = 2f32.powi(-13);
    let mut rng = draws(22);
    for _ in 0..DRAWS {
        let a = word(&mut rng, 30) as f32 * 2f32.powi(-42);
        let less = word(&mut rng, 30).abs() as f32 * 2f32.powi(-30);
        let held = f64::from(a.clamp(-end, end));
        let reach = f64::from(end);
        is_sum(
            F32::cubed(a, less),
            &[held.powi(3) / reach / reach, -held * f64::from(less)],
        );
    }
    assert_eq!(F32::cubed(1.0, 0.0), end);
    assert_eq!(F32::cubed(-1.0, 0.0), -end);
}

/// Without the carried errors a thousand additions in one direction are off by hundreds of roundings.
#[test]
fn the_angle_carries_the_errors_of_its_additions() {
    let increment = 4.363_323e-4f32;
    let mut angle = <F32 as NumberSystem>::Angle::default();
    for count in 1..=1000 {
        angle = F32::advance(angle, increment);
        let exact = f64::from(count) * f64::from(increment);
        let error = (f64::from(F32::lever(angle, 0.0, 0.0)) - exact).abs();
        assert!(error <= 2.0 * ROUNDING * exact, "{count}: {error:e}");
    }
}

/// angle + 2 · 7/60 of the last increment − 2/60 of the one before.
#[test]
fn the_lever_adds_the_coning_within_a_sample() {
    let mut rng = draws(23);
    for _ in 0..DRAWS {
        let [a, b, c] = [0; 3].map(|_| word(&mut rng, 30) as f32 * 2f32.powi(-38));
        let angle = F32::advance(Default::default(), a);
        let [wa, wb, wc] = [a, b, c].map(f64::from);
        is_sum(F32::lever(angle, b, c), &[wa, wb * 7.0 / 30.0, -wc / 30.0]);
    }
}

/// (3 now − past)/2 and tilted + cross/2, in 2⁻⁶⁴.
#[test]
fn fine_units_are_the_float_itself() {
    let mut rng = draws(24);
    for _ in 0..DRAWS {
        let [a, b] = [0; 2].map(|_| word(&mut rng, 30) as f32 * 2f32.powi(-38));
        let fine = |value: f32| (f64::from(value) * 2f64.powi(64)) as i64;
        assert_eq!(F32::at_end(a, b), fine(a + 0.5 * (a - b)));
        assert_eq!(F32::fine(a, b), fine(a + 0.5 * b));
    }
}
