//! Sums without rounding: whole numbers of a unit far below an output code.
//!
//! A *fine unit* is 2⁻²⁹ of an output code: 2⁻⁶⁴ rad of an angle, 2⁻⁵⁶ m/s of a velocity. An `i64` of them
//! spans ±0.5 rad and ±128 m/s. Both number systems use it, once per output period and per axis, for all quantities
//! that must not drift: counts × weight, pickoff codes × taps, bias, the matrix at rest.
//!
//! | quantity | rounding |
//! |---|---|
//! | weight of a count | 2⁻³² of a fine unit: 6e-8 °/h at 100 °/s with the finest weight |
//! | tap of a pickoff code | half a fine unit; multiplies differences that telescope |
//! | coefficient (scale, matrix term) | 2⁻³⁸: 1.3e-6 °/h at 100 °/s |
//! | coefficient × angle | below 2 fine units a period |
//! | lever of an accelerometer | 2⁻¹⁸ m/s per rad: 1e-9 m of arm at 4 kHz |
//! | from f32 | exact below 2⁻⁵ of the value's unit |
//!
//! Everything wraps: a value beyond the range is wrong, but nothing panics. By the limits of readings and parameters no
//! value is beyond it (`fixed.rs`, Proof).

use crate::chain::design_parameters::{
    FINE_PER_CODE_LOG2, OUTPUT_M_S_PER_CODE, OUTPUT_RAD_PER_CODE,
};

/// Fine units in one rad: 2⁶⁴, as an exponent.
pub const FINE_PER_RAD_LOG2: i32 = 64;

/// Fine units in one m/s: 2⁵⁶, as an exponent.
pub const FINE_PER_M_S_LOG2: i32 = 56;

/// Unit of a number system's velocity \[m/s\]: 2⁶⁴ fine units, as the unit of an angle, so that velocities have the
/// angles' formats and ranges: 1 g over 250 µs is 9.6e-6, as 2.2 °/s.
pub const VELOCITY_UNIT_M_S: f64 = (1u64 << (FINE_PER_RAD_LOG2 - FINE_PER_M_S_LOG2)) as f64;

// The two definitions agree: a code is 2⁻³⁵ rad or 2⁻²⁷ m/s, and 2²⁹ fine units.
const _: () = assert!(
    OUTPUT_RAD_PER_CODE * (1u64 << (FINE_PER_RAD_LOG2 - FINE_PER_CODE_LOG2 as i32)) as f64 == 1.0
        && OUTPUT_M_S_PER_CODE * (1u64 << (FINE_PER_M_S_LOG2 - FINE_PER_CODE_LOG2 as i32)) as f64
            == 1.0
);

/// value \[rad or m/s\] in units of 2^−exponent, to nearest.
pub fn fine(value: f64, exponent: i32) -> i64 {
    libm::rint(libm::ldexp(value, exponent)) as i64
}

/// A weight in fine units per count, with 31 bits below one fine unit.
#[derive(Debug, Clone, Copy, Default)]
pub struct ExactWeight {
    whole: i64,
    fraction: i32,
}

impl ExactWeight {
    /// From a weight per count \[unit of 2^exponent fine units\].
    pub fn of(weight: f64, exponent: i32) -> Self {
        let scaled = libm::ldexp(weight, exponent);
        let whole = libm::floor(scaled);
        Self {
            whole: whole as i64,
            fraction: libm::ldexp(scaled - whole, 31) as i32,
        }
    }

    /// weight × counts \[fine units\].
    #[inline(always)]
    pub fn times(self, counts: i32) -> i64 {
        let part = (i64::from(self.fraction) * i64::from(counts)) >> 31;
        self.whole
            .wrapping_mul(i64::from(counts))
            .wrapping_add(part)
    }
}

impl ExactWeight {
    /// weight × counts \[fine units\], beyond the range of an `i64` too: for readings after lost samples.
    pub fn times_wide(self, counts: i32) -> i128 {
        let part = (i64::from(self.fraction) * i64::from(counts)) >> 31;
        i128::from(self.whole)
            .wrapping_mul(i128::from(counts))
            .wrapping_add(i128::from(part))
    }
}

/// A small number, Q37, within ±1/64: 27 significant bits at 1e-3.
#[derive(Debug, Clone, Copy, Default)]
pub struct ExactCoefficient(i32);

const COEFFICIENT_BITS: u32 = 37;

impl ExactCoefficient {
    /// Rounds to nearest.
    pub fn of(value: f64) -> Self {
        Self(fine(value, COEFFICIENT_BITS as i32) as i32)
    }

    /// From an f32 in service, towards zero: exact for values whose bits reach no further than the format's.
    pub fn of_f32(value: f32) -> Self {
        Self((value * (1u64 << COEFFICIENT_BITS) as f32) as i32)
    }

    /// coefficient × value \[fine units\], down.
    #[inline(always)]
    pub fn times(self, value: i64) -> i64 {
        let c = i64::from(self.0);
        let high = i64::from((value >> 32) as i32) * c;
        // 31 bits, so that the factor is a signed word; the 32nd is half a fine unit times 1/64.
        let low = i64::from(((value as u32) >> 1) as i32) * c;
        high.wrapping_add(low >> 31) >> (COEFFICIENT_BITS - 32)
    }
}

impl ExactCoefficient {
    /// coefficient × value \[fine units\], down, beyond the range of an `i64` too.
    pub fn times_wide(self, value: i128) -> i128 {
        i128::from(self.0).wrapping_mul(value) >> COEFFICIENT_BITS
    }
}

/// A velocity per angle or per square of an angle, within ±2¹⁴ m/s, in the velocity unit and Q25.
#[derive(Debug, Clone, Copy, Default)]
pub struct ExactLever(i32);

const LEVER_BITS: u32 = 25;

impl ExactLever {
    /// Rounds to nearest, from m/s per rad or per rad².
    pub fn of(value: f64) -> Self {
        Self::of_factor(value / VELOCITY_UNIT_M_S)
    }

    /// Rounds to nearest, from a plain factor within ±64.
    pub fn of_factor(value: f64) -> Self {
        Self(fine(value, LEVER_BITS as i32) as i32)
    }

    /// lever × value \[fine units\], down.
    #[inline(always)]
    pub fn times(self, value: i64) -> i64 {
        let c = i64::from(self.0);
        let high = i64::from((value >> 32) as i32) * c;
        let low = i64::from(((value as u32) >> 1) as i32) * c;
        (high << (32 - LEVER_BITS)).wrapping_add(low >> (LEVER_BITS - 1))
    }
}

/// value × 2⁶⁴ for |value| < 2⁻⁵: two conversions to i32, which a processor has, for one to i64, which it
/// has not.
#[inline(always)]
pub fn fine_of_f32(value: f32) -> i64 {
    const COARSE: f32 = (1u64 << 36) as f32;
    const REST: u32 = 28;
    let coarse = (value * COARSE) as i32;
    // Exact: the difference has no more bits than the value.
    let rest = value * COARSE - coarse as f32;
    let rest = (rest * (1u32 << REST) as f32) as i32;
    (i64::from(coarse) << REST).wrapping_add(i64::from(rest))
}
