//! The chain's numbers as integers.
//!
//! A number is an `i32` or `i64` whose LSB is 2⁻ᶠ of the unit; F stands in the table and in the constants.
//! On a Cortex-M4 a product of which the upper word is kept is one `SMMUL`, with its sum one `SMMLA`, and a
//! product with a 64-bit sum one `SMLAL`: the formats are chosen so that the upper word is the result.
//!
//! | quantity | F | LSB | range | largest | rounding |
//! |---|---|---|---|---|---|
//! | counts, pickoff steps | — | 1 | shifted up at boot's choice to fill 31 bits | their limits | exact |
//! | weight, tap | mantissa | 2⁻²⁹ of it or better | that of the counts and steps | 0.6 of it | to nearest |
//! | increment | 37 | 7.3e-12 rad | ±2⁻⁶ = 0.0156 rad; 2⁻⁸ is the design's largest | 0.0070; difference of two 0.0139 | products down |
//! | matrix term | 32 | 2.3e-10 | ±1/2 | 1/128 | at boot |
//! | filter coefficient | 30 | 9.3e-10 | ±2 | 1.44 | at boot |
//! | filter sum | 67 | 6.8e-21 rad | ±2⁻⁴ = 0.0625 rad per sample² | 0.0289 | exact |
//! | acceleration × T² | 40 | 9.1e-13 rad | ±2⁻⁹, held at 2⁻¹⁰ | 2⁻¹⁰ | down |
//! | K/T² | 26 | 1.5e-8 | ±32, held | 32 | at boot |
//! | scale error per increment | 25 | 3.0e-8 | ±64, checked | 64 | at boot |
//! | tilt | 34 | 5.8e-11 rad | ±1/8 rad | 1/32 | down |
//! | tilt × increment, summed | 71 | 4.2e-22 rad | ±2⁻⁸ = 0.0039 rad | 0.0027 | exact |
//! | angle, lever | 31 | 4.7e-10 rad | ±1 rad | 0.177 | to nearest; the angle keeps the rest |
//! | factor of a correlation | 29 | 1.9e-9 rad | ±2⁻⁶ rad | 0.0139; steps fill 24 bits | down |
//! | product of two, summed | 58 | 3.5e-18 rad² | ±32 rad² | 0.016 | exact |
//! | lever × increment, summed | 68 | 3.4e-21 rad | ±2⁻⁵ = 0.03125 rad | 0.0309 | exact |
//! | square of an increment, summed | 68 | 3.4e-21 rad² | ±2⁻⁵ rad²; one factor at F = 31 | 0.0016 | down |
//! | velocity | as an angle's increment and sum, in units of 2⁸ m/s | | | 0.0010; sum 0.040 | |
//!
//! Rounding *down* moves a factor by half an LSB in the mean: as much as a rate error of 3e-3 °/h (increment)
//! or a tilt error of 3e-11 rad, which reach an output only through products, as 1e-5 °/h at 100 °/s.
//!
//! # Proof
//! Nothing wraps, whatever samples enter: `host-tests/firmware/tests/interval_proof/` runs the chain itself in interval
//! arithmetic (`interval.rs`), over every count and pickoff step within its limit, every tap that adaptation can reach
//! and output periods of all lengths. *Largest* is the largest magnitude of each quantity over the corners of the
//! parameters that [`Parameters::check`](crate::Parameters::check) accepts. Tightest is lever × increment: by
//! [`OUTPUT_PERIOD_LIMIT_RAD`](crate::chain::design_parameters::OUTPUT_PERIOD_LIMIT_RAD) it stays below 0.1767² = 0.0312, also
//! between the corners. The same test bounds the exact sums by the same limits, with readings after lost samples:
//! a rotation reaches 0.30 of ±0.5 rad, a velocity 117 of ±128 m/s, counts 2.10e9 and pickoff codes 1.79e9 of 2.15e9.
//!
//! Assumptions:
//! - Each interval grows with the magnitude of each parameter. Parameters within the corners are drawn at random as
//!   a check.
//! - At most 2³¹ codes lie between a pickoff and its first reading. Readings count modulo 2³²; with more, a moved tap
//!   would act on a wrong angle.
//! - The part that frames defer to later ones stays below 2⁶³ codes, where it is held.
//!
//! The additions are wrapping ones, so that a wrong limit could give a wrong number but never a panic.

use super::exact::FINE_PER_RAD_LOG2;
use super::{CUBE_REACH, LagFactors, NumberSystem, largest_lag_sum};
use crate::chain::design_parameters::{
    ACCELERATION_LIMIT_RAD, BENT_LIMIT_RAD, CENTRAL_PAIRS, CONING_COEFFICIENTS, FILTER_TERMS,
    FLEXURE_ANGLE_LIMIT_RAD, WITHIN_SAMPLE,
};

/// Fixed point, for processors without a floating-point unit and for proofs of exactness.
#[derive(Debug, Clone, Copy, Default)]
pub struct Fixed;

/// Counts × weight: counts × 2^shift fill 31 bits, and the mantissa's product has its result in the upper word. The
/// shift is kept as a factor: a multiplication costs as much as a shift.
#[derive(Debug, Clone, Copy, Default)]
pub struct Scaled {
    factor: i32,
    mantissa: i32,
}

/// An angle, and the part of its increments below its LSB: without that part every increment of a steady turn would
/// round the same way.
#[derive(Debug, Clone, Copy)]
pub struct Summed {
    sum: i32,
    rest: i32,
}

impl Default for Summed {
    /// No angle. The rest begins at half an LSB, so that the sum is rounded to nearest.
    fn default() -> Self {
        Self {
            sum: 0,
            rest: 1 << (INCREMENT - ANGLE - 1),
        }
    }
}

pub(super) const INCREMENT: u32 = 37;
pub(super) const COEFFICIENT: u32 = 32;
pub(super) const FILTER: u32 = 30;
pub(super) const ACCELERATION: u32 = 40;
pub(super) const FLEXURE: u32 = 26;
pub(super) const SLOPE: u32 = 25;
pub(super) const TILT: u32 = FLEXURE + ACCELERATION - 32;
pub(super) const TILTED: u32 = TILT + INCREMENT;
pub(super) const ANGLE: u32 = 31;
pub(super) const CROSS: u32 = ANGLE + INCREMENT;
/// Bits that correlations drop of both factors, so that a window's sum fits: 2 · 23 bits and 2⁷ terms.
pub(super) const REDUCED: u32 = 8;
pub(super) const FINE: u32 = FINE_PER_RAD_LOG2 as u32;
/// Bits of lag factors, and of the formats derived from them, at a scale of 0.
pub(super) const LAG_FACTOR: u32 = 28;
pub(super) const LAGGED: u32 = LAG_FACTOR + INCREMENT - 32;
pub(super) const RECTIFIED: u32 = LAGGED + ANGLE;
const _: () = assert!(RECTIFIED == FINE);
/// Largest addition of flexure to an increment in products.
const BENT_LIMIT: i32 = (BENT_LIMIT_RAD * (1u64 << INCREMENT) as f64) as i32;
/// The limit of such a sum in its upper word, at a scale of 0.
const RECTIFIED_LIMIT: i32 = (FLEXURE_ANGLE_LIMIT_RAD * (1u64 << 32) as f64) as i32;

/// Σ |factor| of one axis that a scale of 0 holds: with the largest difference, 0.0139 rad, a quarter.
const LARGEST_LAG_SUM: f64 = 17.5;

/// Largest |factor| that a scale of 0 holds.
const LARGEST_LAG_FACTOR: f64 = 7.999;

/// The scale of lag factors: an exponent of two for all.
#[derive(Debug, Clone, Copy, Default)]
pub struct LagScale {
    pub(super) exponent: i32,
    /// Share of a sample's correction used in coning's products: all, or none at the scales of blocks that ring below
    /// some 460 Hz, where it could leave an increment no room.
    in_products: i32,
    up: u32,
    /// The limit of a period's sum in its upper word.
    limit: i32,
}

impl LagScale {
    /// Returns the scale that these factors need.
    pub(super) fn of(values: &LagFactors<f64>) -> Self {
        Self::at(lag_exponent(values))
    }

    /// Returns the scale of an exponent.
    pub fn at(exponent: i32) -> Self {
        Self {
            exponent,
            in_products: if exponent > 2 { 0 } else { -1 },
            up: (INCREMENT as i32 - 32 + exponent) as u32,
            limit: (RECTIFIED_LIMIT << exponent.min(0).unsigned_abs()) >> exponent.max(0),
        }
    }
}

fn lag_exponent(values: &LagFactors<f64>) -> i32 {
    let factors = values.as_flattened().as_flattened().iter();
    let largest = factors.fold(0.0f64, |most, factor| most.max(factor.abs()));
    let needed = (largest_lag_sum(values) / LARGEST_LAG_SUM).max(largest / LARGEST_LAG_FACTOR);
    let mut scale = LEAST_LAG_SCALE;
    while libm::ldexp(1.0, scale) < needed && scale < LARGEST_LAG_SCALE {
        scale += 1;
    }
    scale
}

/// Finer scales add nothing: an increment's own LSB is larger.
const LEAST_LAG_SCALE: i32 = -3;

/// The largest factors that parameters in range can give need 12.
const LARGEST_LAG_SCALE: i32 = 16;

/// 2c, so that its upper word with an increment is an angle.
pub(super) const TWICE_CONING: [i32; 2] = [
    twice_coning(CONING_COEFFICIENTS[0]),
    twice_coning(CONING_COEFFICIENTS[1]),
];

const fn twice_coning(c: f64) -> i32 {
    let scaled = 2.0 * c * (1u64 << (ANGLE + 32 - INCREMENT)) as f64;
    (scaled + if scaled < 0.0 { -0.5 } else { 0.5 }) as i32
}

/// Below 1/2, so that the upper word with an increment is an increment.
pub(super) const KAPPA: i32 = (WITHIN_SAMPLE * (1u64 << 32) as f64) as i32;

/// Half the limit's span in the filter sum's upper word.
pub(super) const ACCELERATION_LIMIT: i32 =
    (ACCELERATION_LIMIT_RAD * (1u64 << (INCREMENT + FILTER - 32)) as f64) as i32;

/// [`CUBE_REACH`] in an acceleration's word, as an exponent.
pub(super) const CUBE_BITS: u32 = 27;
const CUBE_END: i32 = 1 << CUBE_BITS;
const _: () = assert!(CUBE_REACH * (1u64 << ACCELERATION) as f64 == CUBE_END as f64);

/// a × b, exact.
#[inline(always)]
fn wide(a: i32, b: i32) -> i64 {
    i64::from(a) * i64::from(b)
}

/// The upper word of a × b.
#[inline(always)]
fn upper(a: i32, b: i32) -> i32 {
    (wide(a, b) >> 32) as i32
}

/// sum + the upper word of a × b, to nearest: one `SMMLAR`.
#[inline(always)]
fn add_nearest(sum: i32, a: i32, b: i32) -> i32 {
    let half = 1 << 31;
    let sum = (i64::from(sum) << 32) | half;
    (sum.wrapping_add(wide(a, b)) >> 32) as i32
}

/// The largest power of two by which `limit` still fits an `i32`.
pub(super) fn filling(limit: i32) -> u32 {
    limit.max(1).leading_zeros() - 1
}

/// To the nearest `i32`.
fn nearest(value: f64, exponent: u32) -> i32 {
    // A float's conversion holds at the ends.
    libm::rint(libm::ldexp(value, exponent as i32)) as i32
}

impl NumberSystem for Fixed {
    const NAME: &'static str = "fixed";

    type PulseWeight = Scaled;
    type StepScale = i32;
    type Step = i32;
    type Tap = i32;
    type Increment = i32;
    type Coefficient = i32;
    type FilterCoefficient = i32;
    type FilterSum = i64;
    type Acceleration = i32;
    type Flexure = i32;
    type Tilt = i32;
    type Tilted = i64;
    type LagFactor = i32;
    type LagScale = LagScale;
    type Lagged = i32;
    type LagIncrement = i32;
    type Rectified = i64;
    type Angle = Summed;
    type Lever = i32;
    type Cross = i64;
    type Slope = i32;
    type Factor = i32;
    type Correlation = i64;

    const LOADS_FACTORS: bool = false;
    const RAD_PER_FACTOR: f64 = (1u64 << REDUCED) as f64 / (1u64 << INCREMENT) as f64;

    fn pulse_weight(weight_rad: f64, limit_counts: i32) -> Scaled {
        let shift = filling(limit_counts);
        Scaled {
            factor: 1 << shift,
            mantissa: nearest(weight_rad, INCREMENT + 32 - shift),
        }
    }
    fn step_scale(limit_codes: i32) -> i32 {
        1 << filling(limit_codes)
    }
    fn tap(fine_per_code: i64, scale: i32) -> i32 {
        // Negative, so that stripping is an addition.
        let shift = scale.trailing_zeros();
        let up = INCREMENT + 32 - FINE;
        let mantissa = (fine_per_code.wrapping_neg() << up) >> shift;
        mantissa.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    }
    fn coefficient(value: f64) -> i32 {
        nearest(value, COEFFICIENT)
    }
    fn filter_coefficient(value: f64) -> i32 {
        nearest(value, FILTER)
    }
    fn flexure(value: f64) -> i32 {
        nearest(value, FLEXURE)
    }
    fn slope(value: f64) -> i32 {
        nearest(value, SLOPE)
    }
    fn increment(value: f64) -> i32 {
        nearest(value, INCREMENT)
    }

    #[inline(always)]
    fn pulses(weight: Scaled, counts: i32) -> i32 {
        upper(weight.factor.wrapping_mul(counts), weight.mantissa)
    }
    #[inline(always)]
    fn step(scale: i32, codes: i32) -> i32 {
        scale.wrapping_mul(codes)
    }
    #[inline(always)]
    fn strip(increment: i32, tap: i32, step: i32) -> i32 {
        increment.wrapping_add(upper(tap, step))
    }
    #[inline(always)]
    fn add_product(to: i32, coefficient: i32, increment: i32) -> i32 {
        to.wrapping_add(upper(coefficient, increment))
    }
    #[inline(always)]
    fn difference(now: i32, past: i32) -> i32 {
        now.saturating_sub(past)
    }
    #[inline(always)]
    fn add(a: i32, b: i32) -> i32 {
        a.wrapping_add(b)
    }
    #[inline(always)]
    fn difference_within(now: i32, past: i32, limit: i32) -> i32 {
        let difference = now.saturating_sub(past);
        difference.max(limit.wrapping_neg()).min(limit)
    }
    #[inline(always)]
    fn add_scaled(to: i32, factor: i32, increment: i32) -> i32 {
        to.wrapping_add((wide(factor, increment) >> SLOPE) as i32)
    }
    #[inline(always)]
    fn filtered(sum: i64) -> i32 {
        (sum >> FILTER) as i32
    }
    #[inline(always)]
    fn sloped(slope: i32, increment: i32) -> i32 {
        (wide(slope, increment) >> (SLOPE + INCREMENT - TILT)) as i32
    }
    #[inline(always)]
    fn sloped_twice(slope: i32, increment: i32) -> i32 {
        let once = upper(slope, increment);
        (wide(once, increment) >> (SLOPE + 2 * INCREMENT - 32 - TILT)) as i32
    }
    #[inline(always)]
    fn add_tilt(a: i32, b: i32) -> i32 {
        a.wrapping_add(b)
    }

    #[inline(always)]
    fn filter(
        [c1, c2, c3, c4]: &[i32; FILTER_TERMS],
        [d1, d2, d3, d4]: [i32; FILTER_TERMS],
    ) -> i64 {
        wide(*c1, d1)
            .wrapping_add(wide(*c2, d2))
            .wrapping_add(wide(*c3, d3))
            .wrapping_add(wide(*c4, d4))
    }
    #[inline(always)]
    fn beyond(sum: i64) -> bool {
        let upper = (sum >> 32) as i32;
        upper.wrapping_add(ACCELERATION_LIMIT) as u32 >= 2 * ACCELERATION_LIMIT as u32
    }
    #[inline(always)]
    fn held(sum: i64) -> i64 {
        // One LSB of the acceleration below the limit, so that the held value itself does not overflow.
        let limit =
            (i64::from(ACCELERATION_LIMIT) << 32) - (1 << (INCREMENT + FILTER - ACCELERATION));
        sum.clamp(-limit, limit)
    }
    #[inline(always)]
    fn acceleration(sum: i64) -> i32 {
        (sum >> (INCREMENT + FILTER - ACCELERATION)) as i32
    }
    #[inline(always)]
    fn tilt(flexure: i32, acceleration: i32) -> i32 {
        upper(flexure, acceleration)
    }
    fn tilt_limit(value: f64) -> i32 {
        nearest(value, TILT)
    }
    #[inline(always)]
    fn hold_tilt(tilt: i32, limit: i32) -> i32 {
        tilt.max(limit.wrapping_neg()).min(limit)
    }
    #[inline(always)]
    fn cubed(acceleration: i32, less: i32) -> i32 {
        let a = acceleration.max(CUBE_END.wrapping_neg()).min(CUBE_END);
        // Of the end's square, as a filter coefficient.
        let square = (wide(a, a) >> (2 * CUBE_BITS - FILTER)) as i32;
        (wide(a, square.wrapping_sub(less)) >> FILTER) as i32
    }
    #[inline(always)]
    fn section(
        [b0, b1, b2, c1, c2]: &[i32; 5],
        [now, one, two]: [i32; 3],
        [last, before]: [i32; 2],
    ) -> i32 {
        // The sum of all fits, so that parts of it may wrap.
        let sum = (1i64 << (FILTER - 1))
            .wrapping_add(wide(*b0, now))
            .wrapping_add(wide(*b1, one))
            .wrapping_add(wide(*b2, two))
            .wrapping_add(wide(*c1, last))
            .wrapping_add(wide(*c2, before));
        (sum >> FILTER) as i32
    }
    #[inline(always)]
    fn tilted(t_a: i32, r_a: i32, t_b: i32, r_b: i32) -> i64 {
        wide(t_a, r_a).wrapping_add(wide(t_b, r_b))
    }
    #[inline(always)]
    fn add_tilted(a: i64, b: i64) -> i64 {
        a.wrapping_add(b)
    }
    #[inline(always)]
    fn turn(increment: i32, tilted: i64) -> i32 {
        increment.wrapping_add((tilted >> (TILTED - INCREMENT)) as i32)
    }

    fn lag_factors(values: &LagFactors<f64>) -> (LagFactors<i32>, LagScale) {
        let scale = LagScale::of(values);
        let exponent = (LAG_FACTOR as i32 - scale.exponent) as u32;
        let converted =
            values.map(|gyro| gyro.map(|axis| axis.map(|value| nearest(value, exponent))));
        (converted, scale)
    }
    #[inline(always)]
    fn lagged([b1, b2, b3]: &[i32; CENTRAL_PAIRS], [d1, d2, d3]: [i32; CENTRAL_PAIRS]) -> i32 {
        add_nearest(add_nearest(add_nearest(0, *b1, d1), *b2, d2), *b3, d3)
    }
    #[inline(always)]
    fn lag_increment(increment: i32) -> i32 {
        increment.wrapping_add(1 << (INCREMENT - ANGLE - 1)) >> (INCREMENT - ANGLE)
    }
    #[inline(always)]
    fn rectify((p_a, d_a): (i32, i32), (p_b, d_b): (i32, i32)) -> i64 {
        wide(p_a, d_a).wrapping_add(wide(p_b.wrapping_neg(), d_b))
    }
    #[inline(always)]
    fn add_rectified(a: i64, b: i64) -> i64 {
        a.wrapping_add(b)
    }
    #[inline(always)]
    fn bend(increment: i32, rectified: i64, scale: LagScale) -> i32 {
        // The upper word counts in 2⁻³² at a scale of 0. Held first so that it can be shifted.
        let upper = ((rectified >> 32) as i32).clamp(-(1 << 23), (1 << 23) - 1);
        let bent = (upper & scale.in_products) << scale.up;
        increment.wrapping_add(bent.clamp(-BENT_LIMIT, BENT_LIMIT - 1))
    }
    #[inline(always)]
    fn rectified_beyond(sum: i64, scale: LagScale) -> bool {
        let limit = scale.limit;
        ((sum >> 32) as i32).wrapping_add(limit) as u32 >= 2 * limit as u32
    }
    fn rectified_held(sum: i64, scale: LagScale) -> i64 {
        let limit = i64::from(scale.limit) << 32;
        // Without `clamp`, which panics where its limits are the wrong way round.
        sum.max(limit.wrapping_neg()).min(limit.wrapping_sub(1))
    }
    #[inline(always)]
    fn rectified(sum: i64, scale: LagScale) -> i64 {
        // A sum counts in fine units at a scale of 0; one shift by a variable costs less than two.
        const DOWN: u32 = LEAST_LAG_SCALE.unsigned_abs();
        (sum << scale.exponent.wrapping_sub(LEAST_LAG_SCALE) as u32) >> DOWN
    }
    #[inline(always)]
    fn ahead(now: i32, difference: i32) -> i64 {
        let twice = 2 * i64::from(now) + i64::from(difference);
        twice << (FINE - INCREMENT - 1)
    }

    #[inline(always)]
    fn advance(angle: Summed, increment: i32) -> Summed {
        const DROP: u32 = INCREMENT - ANGLE;
        let wanted = increment.wrapping_add(angle.rest);
        Summed {
            sum: angle.sum.wrapping_add(wanted >> DROP),
            rest: wanted & ((1 << DROP) - 1),
        }
    }
    #[inline(always)]
    fn lever(angle: Summed, previous: i32, before_previous: i32) -> i32 {
        let with_previous = add_nearest(angle.sum, TWICE_CONING[0], previous);
        add_nearest(with_previous, TWICE_CONING[1], before_previous)
    }
    #[inline(always)]
    fn add_cross(sum: i64, u_a: i32, d_b: i32, u_b: i32, d_a: i32) -> i64 {
        sum.wrapping_add(wide(u_a, d_b))
            .wrapping_add(wide(u_b.wrapping_neg(), d_a))
    }
    #[inline(always)]
    fn add_product_of(sum: i64, a: i32, b: i32) -> i64 {
        sum.wrapping_add(wide(a >> (INCREMENT - ANGLE), b))
    }
    #[inline(always)]
    fn within_sample(difference: i32) -> i32 {
        upper(KAPPA, difference)
    }
    #[inline(always)]
    fn at_end(now: i32, past: i32) -> i64 {
        let twice = 3 * i64::from(now) - i64::from(past);
        twice << (FINE - INCREMENT - 1)
    }
    #[inline(always)]
    fn fine(tilted: i64, cross: i64) -> i64 {
        (tilted >> (TILTED - FINE)).wrapping_add(cross >> (CROSS + 1 - FINE))
    }
    #[inline(always)]
    fn step_factor(step: i32) -> i32 {
        step >> REDUCED
    }
    fn codes_per_factor(scale: i32) -> f64 {
        (1u32 << REDUCED) as f64 / scale as f64
    }
    #[inline(always)]
    fn increment_factor(increment: i32) -> i32 {
        increment >> REDUCED
    }
    #[inline(always)]
    fn add_correlation(sum: i64, a: i32, b: i32) -> i64 {
        sum.wrapping_add(wide(a, b))
    }
    #[inline(always)]
    fn correlation(sum: i64) -> f32 {
        // Runs once a window and enters no angle; without a floating-point unit it costs some hundred instructions.
        sum as f32
    }
}
