//! The chain's numbers as f32.
//!
//! f32 holds 24 bits: an increment of 100 °/s at 4 kHz (4.4e-4 rad) has an LSB of 2.9e-11 rad, which every
//! sample, always in the same direction, would be 0.02 °/h. So no increment is summed into an output: f32
//! carries only factors and products, and those are 1e-2 of an angle or less and round either way. One factor
//! is itself a sum: the lever of the coning, which on a steady turn would round the same way each time. It
//! carries the rounding errors of its additions (Kahan); without that a turn of 100 °/s shows 1.5e-4 °/h.
//!
//! Only + − × and conversions, in this order: Rust contracts nothing to fused operations, so the bits are
//! the same on host and target.

use super::exact::{FINE_PER_RAD_LOG2, fine_of_f32};
use super::{CUBE_REACH, LagFactors, NumberSystem, largest_lag_sum};
use crate::chain::design_parameters::{
    ACCELERATION_LIMIT_RAD, CENTRAL_PAIRS, CONING_COEFFICIENTS, FILTER_TERMS,
    FLEXURE_ANGLE_LIMIT_RAD, WITHIN_SAMPLE,
};

/// f32, for processors with a single-precision unit.
#[derive(Debug, Clone, Copy, Default)]
pub struct F32;

/// An angle, and the rounding errors of its additions, compensated by the next one (Kahan).
#[derive(Debug, Clone, Copy, Default)]
pub struct Summed {
    sum: f32,
    lost: f32,
}

/// Σ |factor| of an axis up to which a correction is less than ⅗ of the largest increment.
const LARGEST_IN_PRODUCTS: f64 = 40.0;

const CUBE_END: f32 = CUBE_REACH as f32;
const FLEXURE_ANGLE_LIMIT: f32 = FLEXURE_ANGLE_LIMIT_RAD as f32;
const ACCELERATION_LIMIT: f32 = ACCELERATION_LIMIT_RAD as f32;
const TWICE_CONING: [f32; 2] = [
    2.0 * CONING_COEFFICIENTS[0] as f32,
    2.0 * CONING_COEFFICIENTS[1] as f32,
];
const KAPPA: f32 = WITHIN_SAMPLE as f32;
const RAD_PER_FINE: f32 = 1.0 / (1u128 << FINE_PER_RAD_LOG2) as f32;

/// The value within ±`limit`. `clamp`, `max` and `min` are calls on a processor without their instructions, 35 cycles each.
#[inline(always)]
pub(crate) fn within(value: f32, limit: f32) -> f32 {
    if value.abs() > limit {
        limit.copysign(value)
    } else {
        value
    }
}

impl NumberSystem for F32 {
    const NAME: &'static str = "f32";

    type PulseWeight = f32;
    type StepScale = ();
    type Step = f32;
    type Tap = f32;
    type Increment = f32;
    type Coefficient = f32;
    type FilterCoefficient = f32;
    type FilterSum = f32;
    type Acceleration = f32;
    type Flexure = f32;
    type Tilt = f32;
    type Tilted = f32;
    type LagFactor = f32;
    type LagScale = f32;
    type Lagged = f32;
    type LagIncrement = f32;
    type Rectified = f32;
    type Angle = Summed;
    type Lever = f32;
    type Cross = f32;
    type Slope = f32;
    type Factor = f32;
    type Correlation = f32;

    const LOADS_FACTORS: bool = true;
    const RAD_PER_FACTOR: f64 = 1.0;

    fn pulse_weight(weight_rad: f64, _: i32) -> f32 {
        weight_rad as f32
    }
    fn step_scale(_: i32) {}
    fn tap(fine_per_code: i64, (): ()) -> f32 {
        fine_per_code as f32 * RAD_PER_FINE
    }
    fn coefficient(value: f64) -> f32 {
        value as f32
    }
    fn filter_coefficient(value: f64) -> f32 {
        value as f32
    }
    fn flexure(value: f64) -> f32 {
        value as f32
    }
    fn slope(value: f64) -> f32 {
        value as f32
    }
    fn increment(value: f64) -> f32 {
        value as f32
    }

    #[inline(always)]
    fn pulses(weight: f32, counts: i32) -> f32 {
        weight * counts as f32
    }
    #[inline(always)]
    fn step((): (), codes: i32) -> f32 {
        codes as f32
    }
    #[inline(always)]
    fn strip(increment: f32, tap: f32, step: f32) -> f32 {
        increment - tap * step
    }
    #[inline(always)]
    fn add_product(to: f32, coefficient: f32, increment: f32) -> f32 {
        to + coefficient * increment
    }
    #[inline(always)]
    fn difference(now: f32, past: f32) -> f32 {
        now - past
    }
    #[inline(always)]
    fn add(a: f32, b: f32) -> f32 {
        a + b
    }
    #[inline(always)]
    fn difference_within(now: f32, past: f32, limit: f32) -> f32 {
        within(now - past, limit)
    }
    #[inline(always)]
    fn add_scaled(to: f32, factor: f32, increment: f32) -> f32 {
        to + factor * increment
    }
    #[inline(always)]
    fn filtered(sum: f32) -> f32 {
        sum
    }
    #[inline(always)]
    fn sloped(slope: f32, increment: f32) -> f32 {
        slope * increment
    }
    #[inline(always)]
    fn sloped_twice(slope: f32, increment: f32) -> f32 {
        slope * increment * increment
    }
    #[inline(always)]
    fn add_tilt(a: f32, b: f32) -> f32 {
        a + b
    }

    #[inline(always)]
    fn filter(
        [c1, c2, c3, c4]: &[f32; FILTER_TERMS],
        [d1, d2, d3, d4]: [f32; FILTER_TERMS],
    ) -> f32 {
        c1 * d1 + c2 * d2 + c3 * d3 + c4 * d4
    }
    #[inline(always)]
    fn beyond(sum: f32) -> bool {
        // Floats of one sign order as their bits do, and integers compare at half the cost.
        sum.to_bits() << 1 > ACCELERATION_LIMIT.to_bits() << 1
    }
    #[inline(always)]
    fn held(sum: f32) -> f32 {
        within(sum, ACCELERATION_LIMIT)
    }
    #[inline(always)]
    fn acceleration(sum: f32) -> f32 {
        sum
    }
    #[inline(always)]
    fn tilt(flexure: f32, acceleration: f32) -> f32 {
        flexure * acceleration
    }
    fn tilt_limit(value: f64) -> f32 {
        value as f32
    }
    #[inline(always)]
    fn hold_tilt(tilt: f32, limit: f32) -> f32 {
        within(tilt, limit)
    }
    #[inline(always)]
    fn cubed(acceleration: f32, less: f32) -> f32 {
        let a = within(acceleration, CUBE_END);
        let ratio = a * (1.0 / CUBE_END);
        a * (ratio * ratio - less)
    }
    #[inline(always)]
    fn section(
        [b0, b1, b2, c1, c2]: &[f32; 5],
        [now, one, two]: [f32; 3],
        [last, before]: [f32; 2],
    ) -> f32 {
        b0 * now + b1 * one + b2 * two + c1 * last + c2 * before
    }
    #[inline(always)]
    fn tilted(t_a: f32, r_a: f32, t_b: f32, r_b: f32) -> f32 {
        t_a * r_a + t_b * r_b
    }
    #[inline(always)]
    fn add_tilted(a: f32, b: f32) -> f32 {
        a + b
    }
    #[inline(always)]
    fn turn(increment: f32, tilted: f32) -> f32 {
        increment + tilted
    }

    /// The scale is the share of a sample's correction used in coning's products: all, or none where it could be of the
    /// increments' own size (blocks that ring below some 490 Hz).
    fn lag_factors(values: &LagFactors<f64>) -> (LagFactors<f32>, f32) {
        let converted = values.map(|gyro| gyro.map(|axis| axis.map(|value| value as f32)));
        let in_products = if largest_lag_sum(values) > LARGEST_IN_PRODUCTS {
            0.0
        } else {
            1.0
        };
        (converted, in_products)
    }
    #[inline(always)]
    fn lagged([b1, b2, b3]: &[f32; CENTRAL_PAIRS], [d1, d2, d3]: [f32; CENTRAL_PAIRS]) -> f32 {
        b1 * d1 + b2 * d2 + b3 * d3
    }
    #[inline(always)]
    fn lag_increment(increment: f32) -> f32 {
        increment
    }
    #[inline(always)]
    fn rectify((p_a, d_a): (f32, f32), (p_b, d_b): (f32, f32)) -> f32 {
        p_a * d_a - p_b * d_b
    }
    #[inline(always)]
    fn add_rectified(a: f32, b: f32) -> f32 {
        a + b
    }
    #[inline(always)]
    fn bend(increment: f32, rectified: f32, in_products: f32) -> f32 {
        increment + in_products * rectified
    }
    #[inline(always)]
    fn rectified_beyond(sum: f32, _: f32) -> bool {
        sum.to_bits() << 1 > FLEXURE_ANGLE_LIMIT.to_bits() << 1
    }
    fn rectified_held(sum: f32, _: f32) -> f32 {
        within(sum, FLEXURE_ANGLE_LIMIT)
    }
    #[inline(always)]
    fn rectified(sum: f32, _: f32) -> i64 {
        fine_of_f32(sum)
    }
    #[inline(always)]
    fn ahead(now: f32, difference: f32) -> i64 {
        fine_of_f32(now + 0.5 * difference)
    }

    #[inline(always)]
    fn advance(angle: Summed, increment: f32) -> Summed {
        let wanted = increment - angle.lost;
        let sum = angle.sum + wanted;
        Summed {
            sum,
            lost: (sum - angle.sum) - wanted,
        }
    }
    #[inline(always)]
    fn lever(angle: Summed, previous: f32, before_previous: f32) -> f32 {
        angle.sum + TWICE_CONING[0] * previous + TWICE_CONING[1] * before_previous
    }
    #[inline(always)]
    fn add_cross(sum: f32, u_a: f32, d_b: f32, u_b: f32, d_a: f32) -> f32 {
        // The difference before the sum: on a steady turn it is small, and its products are large.
        sum + (u_a * d_b - u_b * d_a)
    }
    #[inline(always)]
    fn add_product_of(sum: f32, a: f32, b: f32) -> f32 {
        sum + a * b
    }
    #[inline(always)]
    fn within_sample(difference: f32) -> f32 {
        KAPPA * difference
    }
    #[inline(always)]
    fn at_end(now: f32, past: f32) -> i64 {
        fine_of_f32(now + 0.5 * (now - past))
    }
    #[inline(always)]
    fn fine(tilted: f32, cross: f32) -> i64 {
        fine_of_f32(tilted + 0.5 * cross)
    }
    #[inline(always)]
    fn step_factor(step: f32) -> f32 {
        step
    }
    fn codes_per_factor((): ()) -> f64 {
        1.0
    }
    #[inline(always)]
    fn increment_factor(increment: f32) -> f32 {
        increment
    }
    #[inline(always)]
    fn add_correlation(sum: f32, a: f32, b: f32) -> f32 {
        sum + a * b
    }
    #[inline(always)]
    fn correlation(sum: f32) -> f32 {
        sum
    }
}
