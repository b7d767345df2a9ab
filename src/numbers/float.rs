//! The chain's numbers as f32.
//!
//! f32 holds 24 bits; an increment of 100 °/s at 4 kHz (4.4e-4 rad) has an LSB of 2.9e-11 rad, which every
//! sample, always in the same direction, would be 0.02 °/h. So:
//! - counts × short weight is exact (11 + 13 bits);
//! - what the strip rounds off is recovered exactly (Knuth's two-sum, valid whichever operand is larger)
//!   and joins the small terms, which are added to the increment once;
//! - the summed angle is a pair: its low part takes what that addition and the sum's own round off, and
//!   the coning correction is summed apart from both.
//!
//! What stays is the rounding of products that are themselves 1e-3 of an increment or less.
//!
//! Only + − × and conversions, in this order: Rust contracts nothing to fused operations, so the bits are
//! the same on host and target.

use super::{NumberSystem, Unrounded};
use crate::design_parameters::{ACCELERATION_LIMIT_RAD, CONING_COEFFICIENTS, OUTPUT_RAD_PER_CODE};

/// f32, for processors with a single-precision unit.
#[derive(Debug, Clone, Copy, Default)]
pub struct F32;

/// A summed angle \[rad\]: `sum + low` is exact to about 2⁻⁴⁸ of it.
#[derive(Debug, Clone, Copy, Default)]
pub struct AnglePair {
    sum: f32,
    low: f32,
}

const CODES_PER_RAD: f32 = (1.0 / OUTPUT_RAD_PER_CODE) as f32;
const ACCELERATION_LIMIT: f32 = ACCELERATION_LIMIT_RAD as f32;
const SIGN_BIT: u32 = 1 << 31;
const CONING: [f32; 2] = [CONING_COEFFICIENTS[0] as f32, CONING_COEFFICIENTS[1] as f32];

/// a + b as the rounded sum and the exact error of that rounding.
#[inline(always)]
fn two_sum(a: f32, b: f32) -> (f32, f32) {
    let sum = a + b;
    let b_seen = sum - a;
    let a_seen = sum - b_seen;
    (sum, (a - a_seen) + (b - b_seen))
}

impl NumberSystem for F32 {
    const NAME: &'static str = "f32";

    type PulseWeight = f32;
    type PickoffGain = f32;
    type Increment = f32;
    type Coefficient = f32;
    type Correction = f32;
    type Flexure = f32;
    type FilterCoefficient = f32;
    type FilterSum = f32;
    type Acceleration = f32;
    type Angle = AnglePair;
    type Lever = f32;
    type Coning = f32;
    type OutputCarry = f32;

    fn pulse_weight(short_rad: f64) -> f32 {
        short_rad as f32
    }
    fn pickoff_gain(rad_per_code: f64) -> f32 {
        rad_per_code as f32
    }
    fn coefficient(value: f64) -> f32 {
        value as f32
    }
    fn correction(value_rad: f64) -> f32 {
        value_rad as f32
    }
    fn flexure(value: f64) -> f32 {
        value as f32
    }
    fn filter_coefficient(value: f64) -> f32 {
        value as f32
    }

    #[inline(always)]
    fn pulses(weight: f32, counts: i32) -> f32 {
        weight * counts as f32
    }

    #[inline(always)]
    fn strip(sensed: f32, gain: f32, codes: i32) -> Unrounded<Self> {
        // The product's own rounding is odd in the dither's sign, so a swinging block averages it out.
        let (increment, small) = two_sum(sensed, -(gain * codes as f32));
        Unrounded { increment, small }
    }

    #[inline(always)]
    fn product(coefficient: f32, increment: f32) -> f32 {
        coefficient * increment
    }

    #[inline(always)]
    fn rounded(value: Unrounded<Self>) -> f32 {
        value.increment + value.small
    }

    #[inline(always)]
    fn difference(coefficient: f32, now: f32, past: f32) -> f32 {
        coefficient * (now - past)
    }

    #[inline(always)]
    fn acceleration(sum: f32) -> (f32, bool) {
        // Floats of one sign order as their bits do; a comparison of integers costs half of one of floats.
        let sign = sum.to_bits() & SIGN_BIT;
        let magnitude = sum.to_bits() & !SIGN_BIT;
        let held = magnitude.min(ACCELERATION_LIMIT.to_bits());
        (f32::from_bits(held | sign), held != magnitude)
    }

    #[inline(always)]
    fn tilt(flexure: f32, acceleration: f32) -> f32 {
        flexure * acceleration
    }

    #[inline(always)]
    fn accumulate(angle: AnglePair, value: Unrounded<Self>) -> (AnglePair, f32) {
        // Dekker's short form: exact while the small terms are smaller than the increment. Where they are
        // not, near rest, both are below 1e-6 rad, and what it misses is below 2⁻⁴⁵ rad.
        let increment = value.increment + value.small;
        let left = value.small - (increment - value.increment);
        let (sum, error) = two_sum(angle.sum, increment);
        let low = angle.low + (error + left);
        (AnglePair { sum, low }, increment)
    }

    #[inline(always)]
    fn lever(angle: AnglePair, previous: f32, before_previous: f32) -> f32 {
        0.5 * angle.sum + (CONING[0] * previous + CONING[1] * before_previous)
    }

    #[inline(always)]
    fn cross(u_a: f32, d_b: f32, u_b: f32, d_a: f32) -> f32 {
        u_a * d_b - u_b * d_a
    }

    #[inline(always)]
    fn output_code(angle: AnglePair, coning: f32, carry: &mut f32) -> (i32, bool) {
        // The large part first: scaling by a power of two is exact, and so is its part of a code.
        let scaled = angle.sum * CODES_PER_RAD;
        let whole = libm::rintf(scaled);
        let rest = (scaled - whole) + ((angle.low + coning) * CODES_PER_RAD + *carry);
        let rest_whole = libm::rintf(rest);
        *carry = rest - rest_whole;
        // Summed wide and held last: the rest may bring back what the angle alone has beyond the range.
        let code = (whole as i64).wrapping_add(i64::from(rest_whole as i32));
        let limit = i64::from(i32::MAX);
        let held = code.clamp(-limit, limit);
        (held as i32, held != code)
    }
}
