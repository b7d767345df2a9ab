//! The fixed-point operations: exact integers, rounded as in the table of formats.

use trueaxis::{Fixed, NumberSystem};

use crate::{DRAWS, draws, word};

/// Fractional bits, as the table of formats has them.
const INCREMENT: u32 = 37;
const COEFFICIENT: u32 = 32;
const FILTER: u32 = 30;
const FILTER_SUM: u32 = 67;
const ACCELERATION: u32 = 40;
const FLEXURE: u32 = 26;
const SLOPE: u32 = 25;
const TILT: u32 = 34;
const TILTED: u32 = 71;
const ANGLE: u32 = 31;
const CROSS: u32 = 68;
const FACTOR: u32 = 29;
const FINE: u32 = 64;

/// a × b with `from` fractional bits in all, in a format of `to`, rounded down.
fn down(product: i128, from: u32, to: u32) -> i128 {
    product >> (from - to)
}

fn times(a: i32, b: i32) -> i128 {
    i128::from(a) * i128::from(b)
}

#[test]
fn conversions_are_to_nearest_in_their_formats() {
    for value in [0.0, 1e-3, -1e-3, 0.007_3, -0.007_8, 3.3e-11, -3.3e-11] {
        let nearest = |bits: u32| (value * 2f64.powi(bits as i32)).round_ties_even() as i32;
        assert_eq!(Fixed::increment(value), nearest(INCREMENT));
        assert_eq!(Fixed::coefficient(value), nearest(COEFFICIENT));
        assert_eq!(Fixed::tilt_limit(value), nearest(TILT));
        assert_eq!(Fixed::filter_coefficient(200.0 * value), {
            (200.0 * value * 2f64.powi(FILTER as i32)).round_ties_even() as i32
        });
        assert_eq!(Fixed::flexure(4000.0 * value), {
            (4000.0 * value * 2f64.powi(FLEXURE as i32)).round_ties_even() as i32
        });
        assert_eq!(Fixed::slope(8000.0 * value), {
            (8000.0 * value * 2f64.powi(SLOPE as i32)).round_ties_even() as i32
        });
    }
    // A value beyond the format is held at its end.
    assert_eq!(Fixed::slope(1e3), i32::MAX);
    assert_eq!(Fixed::slope(-1e3), i32::MIN);
    assert_eq!(Fixed::RAD_PER_FACTOR, 2f64.powi(-(FACTOR as i32)));
}

/// A weight's mantissa is right to 2⁻²⁹ of it where its counts reach the limit of 2⁻⁸·5/8 rad, and the increment is
/// rounded down.
#[test]
fn pulses_and_steps_are_weight_times_counts() {
    let mut rng = draws(1);
    for (weight_rad, limit) in [(3.878e-6, 629), (5.9e-11, 41_000_000), (1e-4, 24)] {
        let weight = Fixed::pulse_weight(weight_rad, limit);
        for counts in (0..DRAWS)
            .map(|_| word(&mut rng, 30) % (limit + 1))
            .chain([limit, -limit, 1, -1, 0])
        {
            let exact = weight_rad * f64::from(counts) * 2f64.powi(INCREMENT as i32);
            let error = f64::from(Fixed::pulses(weight, counts)) - exact;
            let of_mantissa = exact.abs() * 2f64.powi(-29);
            assert!(
                (-1.0 - of_mantissa..=of_mantissa).contains(&error),
                "{weight_rad} rad, {counts} counts: {error} increments"
            );
        }
    }
}

/// The scale fills 31 bits; strip less tap × step, both scaled, down.
#[test]
fn the_strip_takes_tap_times_step_off() {
    let mut rng = draws(2);
    for (limit, scale) in [
        (1, 1 << 30),
        (2, 1 << 29),
        (3, 1 << 29),
        (1 << 22, 1 << 8),
        (i32::MAX, 1),
    ] {
        assert_eq!(Fixed::step_scale(limit), scale);
        assert_eq!(Fixed::step(scale, 1), scale);
        assert_eq!(Fixed::step(scale, -1), -scale);
        assert_eq!(Fixed::codes_per_factor(scale), 256.0 / f64::from(scale));
        for _ in 0..DRAWS / 10 {
            // A tap that strips at most 2⁻⁹ rad with the largest step.
            let tap_rad = f64::from(word(&mut rng, 30)) * 2f64.powi(-39) / f64::from(limit);
            let fine = (tap_rad * 2f64.powi(FINE as i32)) as i64;
            let codes = word(&mut rng, 31).wrapping_rem(limit);
            let increment = word(&mut rng, 29);
            let tap = Fixed::tap(fine, scale);
            let stripped = Fixed::strip(increment, tap, Fixed::step(scale, codes));
            let exact = f64::from(increment)
                - fine as f64 * 2f64.powi(INCREMENT as i32 - FINE as i32) * f64::from(codes);
            let error = f64::from(stripped) - exact;
            // Down by the increment's rounding, and by the tap's over the step.
            assert!(
                (-1.01..=1.01).contains(&error),
                "{tap_rad} {codes}: {error}"
            );
        }
    }
    // A tap beyond its word is held, and not wrapped to the other sign.
    assert_eq!(Fixed::tap(i64::MAX >> 9, 1), i32::MIN);
    assert_eq!(Fixed::tap(i64::MIN >> 9, 1), i32::MAX);
}

#[test]
fn sums_and_differences_of_increments_are_exact() {
    let mut rng = draws(3);
    for _ in 0..DRAWS {
        let (a, b) = (word(&mut rng, 30), word(&mut rng, 29));
        let limit = word(&mut rng, 28).abs();
        assert_eq!(Fixed::add(a, b), a + b);
        assert_eq!(Fixed::add_tilt(a, b), a + b);
        assert_eq!(Fixed::difference(a, b), a - b);
        assert_eq!(
            Fixed::difference_within(a, b, limit),
            (a - b).clamp(-limit, limit)
        );
        assert_eq!(Fixed::hold_tilt(a, limit), a.clamp(-limit, limit));
        let (wide_a, wide_b) = (i64::from(a) << 20, i64::from(b) << 20);
        assert_eq!(Fixed::add_tilted(wide_a, wide_b), wide_a + wide_b);
        assert_eq!(Fixed::correlation(wide_a), wide_a as f32);
    }
    assert_eq!(Fixed::difference(i32::MAX, -1), i32::MAX);
    assert_eq!(Fixed::difference(i32::MIN, 1), i32::MIN);
}

#[test]
fn products_are_rounded_down_to_their_formats() {
    let mut rng = draws(4);
    for _ in 0..DRAWS {
        let to = word(&mut rng, 29);
        let increment = word(&mut rng, 30);
        let coefficient = word(&mut rng, 26);
        let expected = down(
            times(coefficient, increment),
            COEFFICIENT + INCREMENT,
            INCREMENT,
        );
        assert_eq!(
            i128::from(Fixed::add_product(to, coefficient, increment)),
            i128::from(to) + expected
        );

        // A slope times an increment fits an increment.
        let factor = word(&mut rng, 24);
        let expected = down(times(factor, increment), SLOPE + INCREMENT, INCREMENT);
        assert_eq!(
            i128::from(Fixed::add_scaled(to, factor, increment)),
            i128::from(to) + expected
        );
        let small = word(&mut rng, 26);
        let slope = word(&mut rng, 31);
        let expected = down(times(slope, small), SLOPE + INCREMENT, TILT);
        assert_eq!(i128::from(Fixed::sloped(slope, small)), expected);
        // Twice: the first product keeps its upper word.
        let once = (times(slope, increment) >> 32) as i32;
        let expected = down(times(once, increment), SLOPE + 2 * INCREMENT - 32, TILT);
        assert_eq!(i128::from(Fixed::sloped_twice(slope, increment)), expected);

        let (flexure, acceleration) = (word(&mut rng, 31), word(&mut rng, 30));
        let expected = down(times(flexure, acceleration), FLEXURE + ACCELERATION, TILT);
        assert_eq!(i128::from(Fixed::tilt(flexure, acceleration)), expected);

        // κ = 1/√12 with 32 fractional bits, towards zero.
        let kappa = (2f64.powi(32) / 12f64.sqrt()) as i32;
        assert_eq!(
            i128::from(Fixed::within_sample(increment)),
            times(kappa, increment) >> 32
        );
        assert_eq!(Fixed::step_factor(increment), increment >> 8);
        assert_eq!(
            Fixed::increment_factor(increment),
            increment >> (INCREMENT - FACTOR)
        );
    }
}

#[test]
fn sums_of_products_are_exact() {
    let mut rng = draws(5);
    for _ in 0..DRAWS {
        let [a, b, c, d] = [30, 29, 30, 29].map(|bits| word(&mut rng, bits));
        let sum = i64::from(word(&mut rng, 31)) << 28;
        assert_eq!(
            i128::from(Fixed::tilted(a, b, c, d)),
            times(a, b) + times(c, d)
        );
        assert_eq!(
            i128::from(Fixed::add_cross(sum, a, b, c, d)),
            i128::from(sum) + times(a, b) - times(c, d)
        );
        assert_eq!(
            i128::from(Fixed::add_correlation(sum, a, b)),
            i128::from(sum) + times(a, b)
        );
        // One factor has an angle's bits.
        let of_square = i128::from(a >> (INCREMENT - ANGLE)) * i128::from(b);
        assert_eq!(
            i128::from(Fixed::add_product_of(sum, a, b)),
            i128::from(sum) + of_square
        );
        let tilted = i64::from(a) << 30;
        let turned = i128::from(b) + down(i128::from(tilted), TILTED, INCREMENT);
        assert_eq!(i128::from(Fixed::turn(b, tilted)), turned);
        let cross = i64::from(d) << 29;
        let fine =
            down(i128::from(tilted), TILTED, FINE) + down(i128::from(cross), CROSS + 1, FINE);
        assert_eq!(i128::from(Fixed::fine(tilted, cross)), fine);
        // (3 now − past)/2 in fine units.
        let at_end = (3 * i128::from(b) - i128::from(d)) << (FINE - INCREMENT - 1);
        assert_eq!(i128::from(Fixed::at_end(b, d)), at_end);
    }
}

/// The filter's sum is exact; it is held one LSB of an acceleration inside 2⁻¹⁰.
#[test]
fn the_acceleration_is_the_filters_sum_held_inside_its_limit() {
    let mut rng = draws(6);
    for _ in 0..DRAWS {
        let c = [0; 4].map(|_| word(&mut rng, 30));
        let d = [0; 4].map(|_| word(&mut rng, 29));
        let sum: i128 = (0..4).map(|at| times(c[at], d[at])).sum();
        let found = Fixed::filter(&c, d);
        assert_eq!(i128::from(found), sum);
        assert_eq!(
            i128::from(Fixed::filtered(found)),
            down(sum, FILTER_SUM, INCREMENT)
        );
        let small = found >> 8;
        assert_eq!(
            i128::from(Fixed::acceleration(small)),
            down(i128::from(small), FILTER_SUM, ACCELERATION)
        );
    }
    let limit = 1i64 << (FILTER_SUM - 10);
    let lsb = 1i64 << (FILTER_SUM - ACCELERATION);
    for (sum, beyond) in [
        (limit, true),
        (limit - 1, false),
        (-limit, false),
        (-limit - 1, true),
        (0, false),
    ] {
        assert_eq!(Fixed::beyond(sum), beyond, "{sum}");
    }
    for far in [limit, 3 * limit, 31 * limit] {
        assert_eq!(Fixed::held(far), limit - lsb);
        assert_eq!(Fixed::held(-far), lsb - limit);
    }
    assert_eq!(Fixed::held(12_345), 12_345);
    assert_eq!(Fixed::acceleration(Fixed::held(limit)), (1 << 30) - 1);
}

/// a ((a/r)² − less), r = 2⁻¹³ rad a sample².
#[test]
fn a_cube_is_of_what_is_held_within_its_reach() {
    let end = 1i32 << (ACCELERATION - 13);
    let mut rng = draws(7);
    for _ in 0..DRAWS {
        let (acceleration, less) = (word(&mut rng, 30), word(&mut rng, 30).abs());
        let a = acceleration.clamp(-end, end);
        let square = (times(a, a) >> (2 * (ACCELERATION - 13) - FILTER)) as i32;
        let expected = times(a, square - less) >> FILTER;
        assert_eq!(i128::from(Fixed::cubed(acceleration, less)), expected);
    }
    assert_eq!(Fixed::cubed(end, 0), end);
    assert_eq!(Fixed::cubed(i32::MAX, 0), end);
    assert_eq!(Fixed::cubed(i32::MIN, 0), -end);
}

#[test]
fn a_section_is_the_sum_of_its_products_to_nearest() {
    let mut rng = draws(8);
    for _ in 0..DRAWS {
        let factors = [0; 5].map(|_| word(&mut rng, 30));
        let inputs = [0; 3].map(|_| word(&mut rng, 27));
        let outputs = [0; 2].map(|_| word(&mut rng, 27));
        let values = [inputs[0], inputs[1], inputs[2], outputs[0], outputs[1]];
        let sum: i128 = (0..5).map(|at| times(factors[at], values[at])).sum();
        let expected = (sum + (1 << (FILTER - 1))) >> FILTER;
        assert_eq!(
            i128::from(Fixed::section(&factors, inputs, outputs)),
            expected
        );
    }
}

/// The angle sums increments to nearest, and the part below its bits is never lost; the lever adds 2 c₁ and 2 c₂ of the
/// last two increments, each to nearest.
#[test]
fn the_lever_is_the_angle_and_the_coning_within_a_sample() {
    let nearest = |value: f64| value.round() as i64;
    let twice = [2.0 * 7.0 / 60.0, -2.0 / 60.0].map(|c| nearest(c * 2f64.powi(26)));
    let mut rng = draws(9);
    for _ in 0..20 {
        let (mut angle, mut sum) = (<Fixed as NumberSystem>::Angle::default(), 0i64);
        for _ in 0..DRAWS / 10 {
            let increment = word(&mut rng, 29) / 64;
            angle = Fixed::advance(angle, increment);
            sum += i64::from(increment);
            let [previous, before] = [0; 2].map(|_| word(&mut rng, 29));
            let of_angle = (sum + (1 << (INCREMENT - ANGLE - 1))) >> (INCREMENT - ANGLE);
            assert_eq!(i64::from(Fixed::lever(angle, 0, 0)), of_angle);
            let part = |c: i64, d: i32| (c * i64::from(d) + (1 << 31)) >> 32;
            let expected = of_angle + part(twice[0], previous) + part(twice[1], before);
            assert_eq!(i64::from(Fixed::lever(angle, previous, before)), expected);
        }
    }
}
