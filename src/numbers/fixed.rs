//! The chain's numbers as integers.
//!
//! `Q32<F>` and `Q64<F>` are an `i32` and an `i64` whose LSB is 2⁻ᶠ of the unit.
//!
//! | quantity | format | LSB | range | rounding |
//! |---|---|---|---|---|
//! | short pulse weight, increment | Q32<39> | 1.8e-12 rad | ±2⁻⁸ rad, 895 °/s at 4 kHz | counts × weight exact |
//! | pickoff gain | Q64<71> | 4e-22 rad | ±2⁻⁸ rad per code | at boot, to nearest |
//! | scale error, matrix term | Q32<36> | 1.5e-11 | ±1/32 | at boot, to nearest; tilts down (2⁻³⁷ rad of bias on a tilt) |
//! | correction | Q64<75> | 2.6e-23 rad | ±2⁻¹² rad | products exact; to nearest for an increment |
//! | K/T² | Q32<27> | 7.5e-9 | ±16 | at boot |
//! | filter coefficient | Q32<30> | 9.3e-10 | ±2 | at boot |
//! | filter sum | Q64<69> | 1.7e-21 rad | ±2⁻⁶ rad per sample² | products exact |
//! | acceleration × T² | Q32<37> | 7.3e-12 rad | held at ±2⁻¹⁰ | to nearest |
//! | summed angle | Q64<39> + Q64<75> | 2.6e-23 rad | ±0.16 rad occurs | exact: the second takes what rounding left |
//! | lever | Q32<33> | 1.2e-10 rad | ±0.25 rad | to nearest |
//! | coning | Q64<67> | 6.8e-21 rad | ±0.06 rad | products down by 2⁻⁶⁸ rad in the mean |
//! | output carry | Q64<67> | 6.8e-21 rad | one code | to nearest, 2⁻⁶⁸ rad a frame |
//!
//! Every sum fits by the limits in `design_parameters`; the additions are still wrapping ones, so that a
//! wrong limit could give a wrong number but never a panic. On a Cortex-M4 a product with its sum is one
//! `SMLAL`, and dropping 36 bits is one shift of the high word.

use core::ops::{Add, Sub};

use super::{NumberSystem, Unrounded};
use crate::design_parameters::{ACCELERATION_LIMIT_RAD, CONING_COEFFICIENTS};

/// Fixed point, for processors without a floating-point unit and for proofs of exactness.
#[derive(Debug, Clone, Copy, Default)]
pub struct Fixed;

/// `i32` with LSB 2⁻ᶠ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Q32<const F: u32>(i32);

/// A summed angle \[rad\]: what rounding left of its increments is in `low`.
#[derive(Debug, Clone, Copy, Default)]
pub struct AnglePair {
    sum: Q64<INCREMENT>,
    low: Q64<CORRECTION>,
}

/// `i64` with LSB 2⁻ᶠ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Q64<const F: u32>(i64);

impl<const F: u32> Q32<F> {
    /// To nearest; held at the ends of the range.
    const fn of(value: f64) -> Self {
        let rounded = round_to_i64(value, F);
        // `Ord::clamp` is no const function.
        Self(if rounded > i32::MAX as i64 {
            i32::MAX
        } else if rounded < i32::MIN as i64 {
            i32::MIN
        } else {
            rounded as i32
        })
    }
}

impl<const F: u32> Q64<F> {
    fn of(value: f64) -> Self {
        Self(round_to_i64(value, F))
    }
}

/// value × 2^fraction, halves away from zero: usable for constants, where `libm` is not.
const fn round_to_i64(value: f64, fraction: u32) -> i64 {
    // Two factors, because 2^75 does not fit an integer.
    let scaled =
        value * (1u64 << (fraction / 2)) as f64 * (1u64 << (fraction - fraction / 2)) as f64;
    let half = if scaled < 0.0 { -0.5 } else { 0.5 };
    (scaled + half) as i64
}

impl<const F: u32> Add for Q32<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
    }
}

impl<const F: u32> Sub for Q32<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0.wrapping_sub(other.0))
    }
}

impl<const F: u32> Add for Q64<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
    }
}

const INCREMENT: u32 = 39;
const COEFFICIENT: u32 = 36;
const CORRECTION: u32 = INCREMENT + COEFFICIENT;
const PICKOFF: u32 = INCREMENT + 32;
const FLEXURE: u32 = 27;
const FILTER: u32 = 30;
const ACCELERATION: u32 = 37;
const LEVER: u32 = 33;
const CONING: u32 = 67;
const OUTPUT: u32 = 35;

const ACCELERATION_LIMIT: i32 = Q32::<ACCELERATION>::of(ACCELERATION_LIMIT_RAD).0;
/// Twice the coning coefficients, Q31: they multiply into twice the lever.
const TWICE_CONING: [i32; 2] = [
    Q32::<31>::of(2.0 * CONING_COEFFICIENTS[0]).0,
    Q32::<31>::of(2.0 * CONING_COEFFICIENTS[1]).0,
];

/// a × b, exact.
#[inline(always)]
fn wide(a: i32, b: i32) -> i64 {
    i64::from(a) * i64::from(b)
}

impl NumberSystem for Fixed {
    const NAME: &'static str = "fixed";

    type PulseWeight = Q32<INCREMENT>;
    type PickoffGain = Q64<PICKOFF>;
    type Increment = Q32<INCREMENT>;
    type Coefficient = Q32<COEFFICIENT>;
    type Correction = Q64<CORRECTION>;
    type Flexure = Q32<FLEXURE>;
    type FilterCoefficient = Q32<FILTER>;
    type FilterSum = Q64<{ INCREMENT + FILTER }>;
    type Acceleration = Q32<ACCELERATION>;
    type Angle = AnglePair;
    type Lever = Q32<LEVER>;
    type Coning = Q64<CONING>;
    type OutputCarry = Q64<CONING>;

    fn pulse_weight(short_rad: f64) -> Self::PulseWeight {
        Q32::of(short_rad)
    }
    fn pickoff_gain(rad_per_code: f64) -> Self::PickoffGain {
        Q64::of(rad_per_code)
    }
    fn coefficient(value: f64) -> Self::Coefficient {
        Q32::of(value)
    }
    fn correction(value_rad: f64) -> Self::Correction {
        Q64::of(value_rad)
    }
    fn flexure(value: f64) -> Self::Flexure {
        Q32::of(value)
    }
    fn filter_coefficient(value: f64) -> Self::FilterCoefficient {
        Q32::of(value)
    }

    #[inline(always)]
    fn pulses(weight: Self::PulseWeight, counts: i32) -> Self::Increment {
        Q32(weight.0.wrapping_mul(counts))
    }

    #[inline(always)]
    fn strip(sensed: Self::Increment, gain: Self::PickoffGain, codes: i32) -> Unrounded<Self> {
        let strip = gain.0.wrapping_mul(i64::from(codes)).wrapping_neg();
        let down = Q32((strip >> (PICKOFF - INCREMENT)) as i32);
        let left = (strip & 0xFFFF_FFFF) << (CORRECTION - PICKOFF);
        Unrounded {
            increment: sensed + down,
            small: Q64(left),
        }
    }

    #[inline(always)]
    fn product(coefficient: Self::Coefficient, increment: Self::Increment) -> Self::Correction {
        Q64(wide(coefficient.0, increment.0))
    }

    #[inline(always)]
    fn rounded(value: Unrounded<Self>) -> Self::Increment {
        let half = Q64(1 << (COEFFICIENT - 1));
        value.increment + Q32(((value.small + half).0 >> COEFFICIENT) as i32)
    }

    #[inline(always)]
    fn difference(
        coefficient: Self::FilterCoefficient,
        now: Self::Increment,
        past: Self::Increment,
    ) -> Self::FilterSum {
        // Two increments of opposite sign near the limit differ by more than the format: such a step is
        // far beyond the acceleration limit whatever it saturates to.
        Q64(wide(coefficient.0, now.0.saturating_sub(past.0)))
    }

    #[inline(always)]
    fn acceleration(sum: Self::FilterSum) -> (Self::Acceleration, bool) {
        // |c| sum to less than 3, and a difference is within 2⁻⁸ rad: within the i32 of 2⁻³⁷ rad.
        const DROP: u32 = INCREMENT + FILTER - ACCELERATION;
        let rounded = (sum.0.wrapping_add(1 << (DROP - 1)) >> DROP) as i32;
        let held = rounded.clamp(-ACCELERATION_LIMIT, ACCELERATION_LIMIT);
        (Q32(held), held != rounded)
    }

    #[inline(always)]
    fn tilt(flexure: Self::Flexure, acceleration: Self::Acceleration) -> Self::Coefficient {
        const DROP: u32 = FLEXURE + ACCELERATION - COEFFICIENT;
        Q32((wide(flexure.0, acceleration.0) >> DROP) as i32)
    }

    #[inline(always)]
    fn accumulate(angle: AnglePair, value: Unrounded<Self>) -> (AnglePair, Self::Increment) {
        // Down and not to nearest: the half LSB of mean error reaches only the coning products, as 2⁻⁴⁰
        // rad times the lever, 2e-6 °/h at 100 °/s.
        let small = value.small.0;
        let increment = value.increment + Q32((small >> COEFFICIENT) as i32);
        let left = small & ((1 << COEFFICIENT) - 1);
        let pair = AnglePair {
            sum: angle.sum + Q64(i64::from(increment.0)),
            low: angle.low + Q64(left),
        };
        (pair, increment)
    }

    #[inline(always)]
    fn lever(
        angle: AnglePair,
        previous: Self::Increment,
        before_previous: Self::Increment,
    ) -> Self::Lever {
        const DROP: u32 = INCREMENT + 1 - LEVER;
        let within = wide(TWICE_CONING[0], previous.0)
            .wrapping_add(wide(TWICE_CONING[1], before_previous.0));
        // The angle's LSB read as half an increment's is half the angle.
        let lever = angle.sum.0.wrapping_add(within >> 31);
        Q32((lever.wrapping_add(1 << (DROP - 1)) >> DROP) as i32)
    }

    #[inline(always)]
    fn cross(
        u_a: Self::Lever,
        d_b: Self::Increment,
        u_b: Self::Lever,
        d_a: Self::Increment,
    ) -> Self::Coning {
        let cross = wide(u_a.0, d_b.0).wrapping_sub(wide(u_b.0, d_a.0));
        Q64(cross >> (LEVER + INCREMENT - CONING))
    }

    #[inline(always)]
    fn output_code(
        angle: AnglePair,
        coning: Self::Coning,
        carry: &mut Self::OutputCarry,
    ) -> (i32, bool) {
        const BELOW_CODE: u32 = INCREMENT - OUTPUT;
        const CARRY_BITS: u32 = CONING - OUTPUT;
        const BELOW_FINE: u32 = CORRECTION - CONING;
        let part = (angle.sum.0 & ((1 << BELOW_CODE) - 1)) << (CONING - INCREMENT);
        let low = angle.low.0.wrapping_add(1 << (BELOW_FINE - 1)) >> BELOW_FINE;
        let fine = coning
            .0
            .wrapping_add(carry.0)
            .wrapping_add(part)
            .wrapping_add(low);
        carry.0 = fine & ((1 << CARRY_BITS) - 1);
        let code = (angle.sum.0 >> BELOW_CODE).wrapping_add(fine >> CARRY_BITS);
        let limit = i64::from(i32::MAX);
        let held = code.clamp(-limit, limit);
        (held as i32, held != code)
    }
}
