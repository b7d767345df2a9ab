//! Shows that each operation on intervals contains the fixed-point operation on the values inside them.

use proptest::prelude::*;
use trueaxis::numbers::Interval;
use trueaxis::numbers::exact::{ExactCoefficient, ExactLever, ExactWeight, VELOCITY_UNIT_M_S};
use trueaxis::numbers::fixed::LagScale;
use trueaxis::numbers::interval::{Operation, Span, Summed, take_bounds};
use trueaxis::{Fixed, NumberSystem};

fn span(limit: i32) -> impl Strategy<Value = (Span, i32)> {
    (-limit..=limit, -limit..=limit, 0.0..=1.0f64).prop_map(|(one, other, share)| {
        let (low, high) = (one.min(other), one.max(other));
        let inside = f64::from(low) + share * (f64::from(high) - f64::from(low));
        let span = Span {
            low: low.into(),
            high: high.into(),
        };
        (span, (inside as i32).clamp(low, high))
    })
}

fn long_span(limit: i64) -> impl Strategy<Value = (Span, i64)> {
    (-limit..=limit, -limit..=limit, any::<bool>()).prop_map(|(one, other, at_high)| {
        let (low, high) = (one.min(other), one.max(other));
        let span = Span {
            low: low.into(),
            high: high.into(),
        };
        (span, if at_high { high } else { low })
    })
}

/// An increment, within the chain's largest.
fn increment() -> impl Strategy<Value = (Span, i32)> {
    span(1 << 30)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Each operation of `Fixed` on values inside intervals gives a value inside the interval's result, and on
    /// points the result itself.
    #[test]
    fn an_interval_holds_what_fixed_point_makes_of_its_values(
        (a, x) in increment(),
        (b, y) in increment(),
        (c, z) in increment(),
        (d, w) in increment(),
        (t, k) in span(1 << 29),
        (long, sum) in long_span(1 << 60),
        (tilts, tilted) in long_span(1 << 62),
    ) {
        type I = Interval;
        type F = Fixed;
        let point = |value: i32| Span::point(value);
        let (pa, pb, pc, pd, pt) = (point(x), point(y), point(z), point(w), point(k));
        let p_long = Span::point(sum);
        let p_tilts = Span::point(tilted);
        // With the largest slope, an increment whose scale error fits.
        let (small, of_small) = (Span { low: a.low >> 4, high: a.high >> 4 }, x >> 4);
        let p_small = point(of_small);
        let (less, of_less) = (Span { low: b.low >> 6, high: b.high >> 6 }, y >> 6);
        let p_less = point(of_less);
        // Of intervals, of points, of fixed point.
        let mut cases: Vec<(Span, Span, i64)> = Vec::new();
        let mut case = |interval: Span, point: Span, fixed: i64| cases.push((interval, point, fixed));

        case(I::strip(a, t, b), I::strip(pa, pt, pb), F::strip(x, k, y).into());
        case(I::add_product(a, t, b), I::add_product(pa, pt, pb), F::add_product(x, k, y).into());
        case(I::difference(a, b), I::difference(pa, pb), F::difference(x, y).into());
        let filter = I::filter(&[t, t, t, t], [a, b, c, d]);
        let of_points = I::filter(&[pt, pt, pt, pt], [pa, pb, pc, pd]);
        case(filter, of_points, F::filter(&[k; 4], [x, y, z, w]));
        case(I::filtered(long), I::filtered(p_long), F::filtered(sum).into());
        case(I::add(a, b), I::add(pa, pb), F::add(x, y).into());
        let limit = 1 << 26;
        case(I::difference_within(a, b, point(limit)), I::difference_within(pa, pb, point(limit)),
            F::difference_within(x, y, limit).into());
        case(I::add_scaled(small, t, less), I::add_scaled(p_small, pt, p_less),
            F::add_scaled(of_small, k, of_less).into());
        case(I::sloped(t, small), I::sloped(pt, p_small), F::sloped(k, of_small).into());
        case(I::sloped_twice(t, a), I::sloped_twice(pt, pa), F::sloped_twice(k, x).into());
        case(I::add_tilt(a, b), I::add_tilt(pa, pb), F::add_tilt(x, y).into());
        let held = |sum: i64| if F::beyond(sum) { F::held(sum) } else { sum };
        let (i_held, p_held) = (I::held(long), I::held(p_long));
        prop_assert!(i_held.contains(held(sum)) && p_held.contains(held(sum)));
        case(I::acceleration(i_held), I::acceleration(Span::point(held(sum))),
            F::acceleration(held(sum)).into());
        prop_assert!(!F::beyond(sum) || I::beyond(long));
        case(I::tilt(t, a), I::tilt(pt, pa), F::tilt(k, x).into());
        case(I::hold_tilt(a, point(limit)), I::hold_tilt(pa, point(limit)),
            F::hold_tilt(x, limit).into());
        let less = 1 << 20;
        for of in [a, pa] {
            prop_assert!(I::cubed(of, point(less)).contains(F::cubed(x, less)));
        }
        case(I::tilted(t, a, b, c), I::tilted(pt, pa, pb, pc), F::tilted(k, x, y, z));
        case(I::add_tilted(long, long), I::add_tilted(p_long, p_long), F::add_tilted(sum, sum));
        case(I::turn(a, tilts), I::turn(pa, p_tilts), F::turn(x, tilted).into());
        case(I::add_cross(long, a, b, c, d), I::add_cross(p_long, pa, pb, pc, pd),
            F::add_cross(sum, x, y, z, w));
        case(I::add_product_of(long, a, b), I::add_product_of(p_long, pa, pb),
            F::add_product_of(sum, x, y));
        let lagged = I::lagged(&[t, t, t], [a, b, c]);
        case(lagged, I::lagged(&[pt, pt, pt], [pa, pb, pc]), F::lagged(&[k; 3], [x, y, z]).into());
        case(I::lag_increment(a), I::lag_increment(pa), F::lag_increment(x).into());
        let rectified = I::rectify((a, b), (c, d));
        case(rectified, I::rectify((pa, pb), (pc, pd)), F::rectify((x, y), (z, w)));
        case(I::add_rectified(long, long), I::add_rectified(p_long, p_long), F::add_rectified(sum, sum));
        for scale in [-3, 0, 2, 5].map(LagScale::at) {
            case(I::bend(a, rectified, scale),
                I::bend(pa, I::rectify((pa, pb), (pc, pd)), scale),
                F::bend(x, F::rectify((x, y), (z, w)), scale).into());
        }
        case(I::within_sample(a), I::within_sample(pa), F::within_sample(x).into());
        case(I::increment_factor(a), I::increment_factor(pa), F::increment_factor(x).into());
        case(I::step_factor(a), I::step_factor(pa), F::step_factor(x).into());
        case(I::add_correlation(long, a, b), I::add_correlation(p_long, pa, pb),
            F::add_correlation(sum, x, y));
        // An angle at the period's start, and one sample on.
        let zero = Summed::default();
        let lever = I::lever(I::advance(zero, a), b, c);
        let fixed = F::lever(F::advance(Default::default(), x), y, z);
        case(lever, lever, fixed.into());

        for (index, (interval, point, fixed)) in cases.into_iter().enumerate() {
            prop_assert!(interval.contains(fixed), "case {index}: {interval:?} {fixed}");
            prop_assert!(
                point == Span::point(fixed) || point == interval,
                "case {index}: {point:?} {fixed}"
            );
        }

        // Values that leave the words return nothing and are recorded.
        take_bounds();
        I::fine(tilts, long);
        I::at_end(a, b);
        for bound in take_bounds() {
            let fixed = match bound.operation {
                Operation::Fine => F::fine(tilted, sum),
                Operation::FineTilted => F::fine(tilted, 0),
                Operation::FineCross => F::fine(0, sum),
                _ => F::at_end(x, y),
            };
            prop_assert!(bound.span.contains(fixed));
        }
    }

    /// The same for conversions at boot: weights with their counts, taps with their steps.
    #[test]
    fn an_interval_holds_what_boot_makes_of_a_weight(
        limit in 1..i32::MAX,
        share in 0.0..=1.0f64,
        angle_rad in 1e-9..0.0024f64,
        up in 1..=4i64,
    ) {
        let value = (f64::from(limit) * share) as i32;
        let weight = angle_rad / f64::from(limit);
        let interval = Interval::pulse_weight(weight, limit);
        let fixed = Fixed::pulse_weight(weight, limit);
        for counts in [value, -value, limit, -limit] {
            prop_assert!(Interval::pulses(interval, 0).contains(Fixed::pulses(fixed, counts)));
        }
        // A tap of up to four thirds of a gain.
        let tap = (weight * 2f64.powi(64)) as i64 / 3 * up;
        let (scale, scale_fixed) = (Interval::step_scale(limit), Fixed::step_scale(limit));
        prop_assert_eq!(Interval::codes_per_factor(scale), Fixed::codes_per_factor(scale_fixed));
        prop_assert_eq!(
            Interval::tap(tap, scale),
            Span::point(Fixed::tap(tap, scale_fixed))
        );
        prop_assert!(Interval::step(scale, 0).contains(Fixed::step(scale_fixed, value)));
        for small in [share / 64.0, -share / 64.0] {
            prop_assert_eq!(Interval::coefficient(small), Span::point(Fixed::coefficient(small)));
            prop_assert_eq!(
                Interval::filter_coefficient(64.0 * small),
                Span::point(Fixed::filter_coefficient(64.0 * small))
            );
            prop_assert_eq!(
                Interval::flexure(512.0 * small),
                Span::point(Fixed::flexure(512.0 * small))
            );
        }
    }
}

proptest! {
    /// Tests that the products of the exact sums are those assumed by the bounds, at the ends of their words too.
    #[test]
    fn exact_products_are_those_of_whole_numbers(
        exponent in -34.0..-13.3f64,
        counts in any::<i32>(),
        share in -1.0..=1.0f64,
        value in -(1i64 << 62)..1i64 << 62,
        small in -(1i64 << 57)..1i64 << 57,
    ) {
        let weight = exponent.exp2();
        // Half a radian of them.
        let most = (0.5 / weight) as i128;
        let counts = i128::from(counts).clamp(-most, most) as i32;
        let product = ExactWeight::of(weight, 64).times(counts);
        let per_count = weight * 2f64.powi(64);
        let exact = ((per_count * 2048.0) as i128 * i128::from(counts)) >> 11;
        prop_assert!((i128::from(product) - exact).abs() <= 1 + i128::from(counts).abs());

        let coefficient = share / 64.0 * 0.999;
        let whole = (coefficient * 2f64.powi(37)).round_ties_even() as i128;
        let product = ExactCoefficient::of(coefficient).times(value);
        let exact = (whole * i128::from(value)) >> 37;
        prop_assert!((i128::from(product) - exact).abs() <= 2);

        let lever = share * 62.5;
        let whole = (lever * 2f64.powi(25)).round_ties_even() as i128;
        let product = ExactLever::of(lever * VELOCITY_UNIT_M_S).times(small);
        let exact = (whole * i128::from(small)) >> 25;
        // The lowest bit of the value is left out.
        prop_assert!((i128::from(product) - exact).abs() <= 66, "{product} {exact}");
    }
}
