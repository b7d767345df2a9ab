//! The chain's fixed-point numbers as intervals: all values of a word of [`Fixed`](super::Fixed) for any input.
//!
//! Interval arithmetic (Moore 1966): an operation on intervals gives the interval of every result of the
//! operation on values inside them. Each operation here is the one of `fixed.rs` with the same format and
//! the same rounding, on lowest and highest values that do not wrap (`i128`). Each result is compared with
//! the word in which `Fixed` keeps it, and recorded ([`take_bounds`]): a bound inside its word is a proof that
//! the operation does not wrap.
//!
//! # Inputs
//! A count stands for every count within its limit, a pickoff step for every step within its limit, whatever the
//! sample. Parameters are single values. So one run of [`Chain::process`](crate::Chain::process) covers every stream of
//! samples for these parameters.
//!
//! # Returns
//! A value that leaves the fixed-point words for the exact sums is recorded and returned as zero: the exact sums are
//! not behind [`NumberSystem`].
//!
//! # Assumptions
//! Intervals ignore that two operands may depend on each other; a bound may thus be larger than any stream
//! attains, never smaller.
//!
//! Built with the feature `proof` alone, which needs `std` and therefore reaches no image.

use core::cell::RefCell;
use core::panic::Location;
use std::thread_local;
use std::vec::Vec;

use super::fixed::{
    ACCELERATION, ACCELERATION_LIMIT, ANGLE, COEFFICIENT, CROSS, CUBE_BITS, FILTER, FINE, FLEXURE,
    Fixed, INCREMENT, KAPPA, LAG_FACTOR, LAGGED, LagScale, RECTIFIED, REDUCED, SLOPE, TILT, TILTED,
    TWICE_CONING, filling,
};
pub use super::span::Span;
use super::span::norms;
use super::{LagFactors, NumberSystem};
use crate::chain::design_parameters::{CENTRAL_PAIRS, FILTER_TERMS};

/// Fixed point in intervals, for proofs that nothing wraps.
#[derive(Debug, Clone, Copy, Default)]
pub struct Interval;

/// An operation whose result is compared with its word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Operation {
    /// Conversion of a pulse weight at boot.
    PulseWeight,
    /// Conversion of a tap.
    Tap,
    /// Conversion of a matrix term at boot.
    Coefficient,
    /// Conversion of a filter coefficient at boot.
    FilterCoefficient,
    /// Conversion of K/T² at boot.
    Flexure,
    /// Conversion of a scale error per increment at boot.
    Slope,
    /// Conversion of an increment at boot.
    Increment,
    /// Counts shifted up to fill their word.
    ScaledCounts,
    /// Weight × counts.
    Pulses,
    /// Codes shifted up to fill their word.
    Step,
    /// Increment − tap × step.
    Strip,
    /// Increment + coefficient × increment.
    AddProduct,
    /// Difference of two increments.
    Difference,
    /// Sum of two increments.
    Add,
    /// Increment + factor × increment.
    AddScaled,
    /// Filter sum.
    Filter,
    /// Filter sum as an increment.
    Filtered,
    /// Scale error of one increment.
    Sloped,
    /// Held filter sum as a factor.
    Acceleration,
    /// Flexure × acceleration.
    Tilt,
    /// Output of a section of second order.
    Section,
    /// Tilts × increments of one sample.
    Tilted,
    /// The same, summed over an output period.
    AddTilted,
    /// Increment + tilted.
    Turn,
    /// Conversion of a lag factor at boot.
    LagFactor,
    /// Lag factors × differences.
    Lagged,
    /// Lagged × increment of one sample.
    Rectify,
    /// The same, summed over an output period.
    AddRectified,
    /// The same in fine units.
    Rectified,
    /// Increment and half a difference in fine units.
    Ahead,
    /// Increment + rest of the angle.
    Wanted,
    /// Angle since the output period's start.
    Advance,
    /// Angle with the terms within a sample.
    Lever,
    /// Lever × increment, summed.
    AddCross,
    /// Increment × increment, summed.
    AddProductOf,
    /// Increment at the end of a sample in fine units.
    AtEnd,
    /// Tilted in fine units.
    FineTilted,
    /// Cross/2 in fine units.
    FineCross,
    /// Their sum.
    Fine,
    /// Sum of products of factors over an adaptation window.
    AddCorrelation,
}

const OPERATIONS: usize = Operation::AddCorrelation as usize + 1;

impl Operation {
    /// Fractional bits F of the result, where it has a unit of its own.
    pub fn exponent(self) -> u32 {
        match self {
            Self::PulseWeight | Self::Tap | Self::ScaledCounts | Self::Step => 0,
            Self::Coefficient => COEFFICIENT,
            Self::FilterCoefficient => FILTER,
            Self::Flexure => FLEXURE,
            Self::Slope => SLOPE,
            Self::Pulses
            | Self::Strip
            | Self::AddProduct
            | Self::Difference
            | Self::Turn
            | Self::Increment
            | Self::Add
            | Self::AddScaled
            | Self::Filtered
            | Self::Wanted => INCREMENT,
            Self::Filter => INCREMENT + FILTER,
            Self::Acceleration => ACCELERATION,
            Self::Tilt | Self::Section | Self::Sloped => TILT,
            Self::Tilted | Self::AddTilted => TILTED,
            Self::LagFactor => LAG_FACTOR,
            Self::Lagged => LAGGED,
            Self::Rectify | Self::AddRectified => RECTIFIED,
            Self::Advance | Self::Lever => ANGLE,
            Self::AddCross | Self::AddProductOf => CROSS,
            Self::Rectified
            | Self::Ahead
            | Self::AtEnd
            | Self::FineTilted
            | Self::FineCross
            | Self::Fine => FINE,
            Self::AddCorrelation => 2 * (INCREMENT - REDUCED),
        }
    }
}

/// The smallest interval that contains all results of one operation in one source file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bound {
    /// The operation.
    pub operation: Operation,
    /// The source file of the operation.
    pub file: &'static str,
    /// Its results, not wrapped.
    pub span: Span,
    /// Bits of the word that keeps them, sign included.
    pub bits: u32,
}

impl Bound {
    /// True if every result fits its word.
    pub fn fits(&self) -> bool {
        let end = 1i128 << (self.bits - 1);
        self.span.low >= -end && self.span.high < end
    }

    /// Largest magnitude \[integer of the word\].
    pub fn magnitude(&self) -> i128 {
        self.span.low.abs().max(self.span.high.abs())
    }

    /// Largest magnitude \[the quantity's unit\].
    pub fn value(&self) -> f64 {
        libm::ldexp(self.magnitude() as f64, -(self.operation.exponent() as i32))
    }

    /// Range of the word over the largest magnitude \[1\]: below 1, the word wraps.
    pub fn headroom(&self) -> f64 {
        libm::ldexp(1.0, self.bits as i32 - 1) / self.magnitude() as f64
    }
}

thread_local! {
    static BOUNDS: RefCell<[Vec<Bound>; OPERATIONS]> =
        const { RefCell::new([const { Vec::new() }; OPERATIONS]) };
}

/// Takes the bounds of this thread's operations since the last call, in the order of [`Operation`].
pub fn take_bounds() -> Vec<Bound> {
    BOUNDS.with_borrow_mut(|bounds| bounds.iter_mut().flat_map(core::mem::take).collect())
}

/// Records a result that is kept in a word of `bits`.
#[track_caller]
fn record(operation: Operation, span: Span, bits: u32) -> Span {
    let file = Location::caller().file();
    BOUNDS.with_borrow_mut(|bounds| {
        let bounds = &mut bounds[operation as usize];
        match bounds.iter_mut().find(|bound| bound.file == file) {
            Some(bound) => {
                bound.span.low = bound.span.low.min(span.low);
                bound.span.high = bound.span.high.max(span.high);
            }
            None => bounds.push(Bound {
                operation,
                file,
                span,
                bits,
            }),
        }
    });
    span
}

#[track_caller]
fn word(operation: Operation, span: Span) -> Span {
    record(operation, span, 32)
}

#[track_caller]
fn long(operation: Operation, span: Span) -> Span {
    record(operation, span, 64)
}

/// A conversion at boot, which `Fixed` holds at the word's ends: its upper end itself is an LSB inside.
#[track_caller]
fn nearest(operation: Operation, value: f64, exponent: u32) -> Span {
    let value = libm::rint(libm::ldexp(value, exponent as i32)) as i128;
    let end = 1 << 31;
    let held = if value == end { end - 1 } else { value };
    word(operation, Span::point(held))
}

/// Mantissa of a pulse weight, shift and limit of its counts.
#[derive(Debug, Clone, Copy, Default)]
pub struct Scaled {
    shift: u32,
    limit: i32,
    mantissa: Span,
}

/// Shift and limit of pickoff steps.
#[derive(Debug, Clone, Copy, Default)]
pub struct Scale {
    shift: u32,
    limit: i32,
}

/// An angle, and the part of its increments below its LSB.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Summed {
    /// The angle.
    pub sum: Span,
    /// The rest.
    pub rest: Span,
}

impl Default for Summed {
    /// No angle; the rest begins at half an LSB.
    fn default() -> Self {
        Self {
            sum: Span::default(),
            rest: Span::point(1 << (INCREMENT - ANGLE - 1)),
        }
    }
}

impl Interval {
    /// Every tap from `low` to `high` \[fine units per code\].
    #[track_caller]
    pub(crate) fn taps_between(low: i64, high: i64, scale: Scale) -> Span {
        // Kept with the opposite sign.
        Span {
            low: Self::tap(high, scale).low,
            high: Self::tap(low, scale).high,
        }
    }
}

impl NumberSystem for Interval {
    const NAME: &'static str = "interval";

    type PulseWeight = Scaled;
    type StepScale = Scale;
    type Step = Span;
    type Tap = Span;
    type Increment = Span;
    type Coefficient = Span;
    type FilterCoefficient = Span;
    type FilterSum = Span;
    type Acceleration = Span;
    type Flexure = Span;
    type Tilt = Span;
    type Tilted = Span;
    type LagFactor = Span;
    type LagScale = LagScale;
    type Lagged = Span;
    type LagIncrement = Span;
    type Rectified = Span;
    type Angle = Summed;
    type Lever = Span;
    type Cross = Span;
    type Slope = Span;
    type Factor = Span;
    type Correlation = Span;

    const LOADS_FACTORS: bool = false;
    const RAD_PER_FACTOR: f64 = Fixed::RAD_PER_FACTOR;

    #[track_caller]
    fn pulse_weight(weight_rad: f64, limit_counts: i32) -> Scaled {
        let shift = filling(limit_counts);
        Scaled {
            shift,
            limit: limit_counts,
            mantissa: nearest(Operation::PulseWeight, weight_rad, INCREMENT + 32 - shift),
        }
    }
    fn step_scale(limit_codes: i32) -> Scale {
        Scale {
            shift: filling(limit_codes),
            limit: limit_codes,
        }
    }
    #[track_caller]
    fn tap(fine_per_code: i64, scale: Scale) -> Span {
        let up = INCREMENT + 32 - FINE;
        let negative = Span::point(fine_per_code).negative();
        word(Operation::Tap, negative.up(up).down(scale.shift))
    }
    #[track_caller]
    fn coefficient(value: f64) -> Span {
        nearest(Operation::Coefficient, value, COEFFICIENT)
    }
    #[track_caller]
    fn filter_coefficient(value: f64) -> Span {
        nearest(Operation::FilterCoefficient, value, FILTER)
    }
    #[track_caller]
    fn flexure(value: f64) -> Span {
        nearest(Operation::Flexure, value, FLEXURE)
    }
    #[track_caller]
    fn slope(value: f64) -> Span {
        nearest(Operation::Slope, value, SLOPE)
    }
    #[track_caller]
    fn increment(value: f64) -> Span {
        nearest(Operation::Increment, value, INCREMENT)
    }

    #[track_caller]
    fn pulses(weight: Scaled, _: i32) -> Span {
        let counts = word(
            Operation::ScaledCounts,
            Span::within(weight.limit).up(weight.shift),
        );
        word(Operation::Pulses, counts.upper(weight.mantissa))
    }
    #[track_caller]
    fn step(scale: Scale, _: i32) -> Span {
        word(Operation::Step, Span::within(scale.limit).up(scale.shift))
    }
    #[track_caller]
    fn strip(increment: Span, tap: Span, step: Span) -> Span {
        word(Operation::Strip, increment.plus(tap.upper(step)))
    }
    #[track_caller]
    fn add_product(to: Span, coefficient: Span, increment: Span) -> Span {
        word(Operation::AddProduct, to.plus(coefficient.upper(increment)))
    }
    #[track_caller]
    fn difference(now: Span, past: Span) -> Span {
        word(Operation::Difference, now.minus(past))
    }
    #[track_caller]
    fn add(a: Span, b: Span) -> Span {
        word(Operation::Add, a.plus(b))
    }
    fn difference_within(now: Span, past: Span, limit: Span) -> Span {
        let difference = now.minus(past);
        Span {
            low: difference.low.max(-limit.high).min(limit.high),
            high: difference.high.max(-limit.high).min(limit.high),
        }
    }
    #[track_caller]
    fn add_scaled(to: Span, factor: Span, increment: Span) -> Span {
        let product = factor.times(increment).down(SLOPE);
        word(Operation::AddScaled, to.plus(product))
    }
    #[track_caller]
    fn filtered(sum: Span) -> Span {
        word(Operation::Filtered, sum.down(FILTER))
    }
    #[track_caller]
    fn sloped(slope: Span, increment: Span) -> Span {
        let product = slope.times(increment);
        word(Operation::Sloped, product.down(SLOPE + INCREMENT - TILT))
    }
    #[track_caller]
    fn sloped_twice(slope: Span, increment: Span) -> Span {
        let twice = slope.upper(increment).times(increment);
        word(
            Operation::Sloped,
            twice.down(SLOPE + 2 * INCREMENT - 32 - TILT),
        )
    }
    #[track_caller]
    fn add_tilt(a: Span, b: Span) -> Span {
        word(Operation::Sloped, a.plus(b))
    }

    #[track_caller]
    fn filter(coefficients: &[Span; FILTER_TERMS], differences: [Span; FILTER_TERMS]) -> Span {
        let mut sum = Span::default();
        for (coefficient, difference) in coefficients.iter().zip(differences) {
            sum = long(Operation::Filter, sum.plus(coefficient.times(difference)));
        }
        sum
    }
    fn beyond(sum: Span) -> bool {
        let end = i128::from(ACCELERATION_LIMIT) << 32;
        sum.low < -end || sum.high >= end
    }
    /// The held values, joined with those within the limit, which stay as they are.
    fn held(sum: Span) -> Span {
        let end = i128::from(ACCELERATION_LIMIT) << 32;
        let limit = end - (1 << (INCREMENT + FILTER - ACCELERATION));
        Span {
            low: sum.low.clamp(-limit, limit).min(sum.low.max(-end)),
            high: sum.high.clamp(-limit, limit).max(sum.high.min(end - 1)),
        }
    }
    #[track_caller]
    fn acceleration(sum: Span) -> Span {
        word(
            Operation::Acceleration,
            sum.down(INCREMENT + FILTER - ACCELERATION),
        )
    }
    #[track_caller]
    fn tilt(flexure: Span, acceleration: Span) -> Span {
        word(Operation::Tilt, flexure.upper(acceleration))
    }
    #[track_caller]
    fn tilt_limit(value: f64) -> Span {
        nearest(Operation::Tilt, value, TILT)
    }
    fn hold_tilt(tilt: Span, limit: Span) -> Span {
        Span {
            low: tilt.low.max(-limit.high).min(limit.high),
            high: tilt.high.max(-limit.high).min(limit.high),
        }
    }
    #[track_caller]
    fn cubed(acceleration: Span, less: Span) -> Span {
        // The square is of 0 to 1: both factors are taken to be independent.
        let held = |a: i128| a.clamp(-(1 << CUBE_BITS), 1 << CUBE_BITS);
        let a = Span {
            low: held(acceleration.low),
            high: held(acceleration.high),
        };
        let most = a.low.abs().max(a.high.abs());
        let square = Span {
            low: 0,
            high: (most * most) >> (2 * CUBE_BITS - FILTER),
        };
        let factor = word(Operation::FilterCoefficient, square.minus(less));
        word(Operation::Acceleration, a.times(factor).down(FILTER))
    }
    /// The inputs' span times the ℓ¹ norm of the impulse response, plus rounding: intervals of a lightly damped
    /// section (|c₁| + |c₂| > 1) would grow without end. Joined with the outputs so far.
    #[track_caller]
    fn section(factors: &[Span; 5], inputs: [Span; 3], outputs: [Span; 2]) -> Span {
        let largest = inputs
            .iter()
            .fold(0, |most, input| most.max(-input.low).max(input.high));
        let [response, poles] = norms(factors.map(|factor| factor.low as i32));
        // Every result is rounded by half an LSB; one for the norms' own rounding.
        let most = (largest as f64 * response + 0.5 * poles).ceil() as i128 + 1;
        let most = if largest == 0 && outputs == [Span::default(); 2] {
            Span::default()
        } else {
            Span::within(most)
        };
        let span = Span {
            low: most.low.min(outputs[0].low).min(outputs[1].low),
            high: most.high.max(outputs[0].high).max(outputs[1].high),
        };
        word(Operation::Section, span)
    }
    #[track_caller]
    fn tilted(t_a: Span, r_a: Span, t_b: Span, r_b: Span) -> Span {
        long(Operation::Tilted, t_a.times(r_a).plus(t_b.times(r_b)))
    }
    #[track_caller]
    fn add_tilted(a: Span, b: Span) -> Span {
        long(Operation::AddTilted, a.plus(b))
    }
    #[track_caller]
    fn turn(increment: Span, tilted: Span) -> Span {
        let term = word(Operation::Turn, tilted.down(TILTED - INCREMENT));
        word(Operation::Turn, increment.plus(term))
    }

    #[track_caller]
    fn lag_factors(values: &LagFactors<f64>) -> (LagFactors<Span>, LagScale) {
        let scale = LagScale::of(values);
        let exponent = (LAG_FACTOR as i32 - scale.exponent) as u32;
        let mut converted = LagFactors::default();
        let all = values.as_flattened().as_flattened();
        let into = converted.as_flattened_mut().as_flattened_mut();
        for (into, value) in into.iter_mut().zip(all) {
            *into = nearest(Operation::LagFactor, *value, exponent);
        }
        (converted, scale)
    }
    #[track_caller]
    fn lagged(factors: &[Span; CENTRAL_PAIRS], differences: [Span; CENTRAL_PAIRS]) -> Span {
        let mut sum = Span::default();
        for (factor, difference) in factors.iter().zip(differences) {
            let more = sum.plus(factor.upper_nearest(difference));
            sum = word(Operation::Lagged, more);
        }
        sum
    }
    fn lag_increment(increment: Span) -> Span {
        increment
            .plus(Span::point(1 << (INCREMENT - ANGLE - 1)))
            .down(INCREMENT - ANGLE)
    }
    #[track_caller]
    fn rectify((p_a, d_a): (Span, Span), (p_b, d_b): (Span, Span)) -> Span {
        let negative = word(Operation::Lagged, p_b.negative());
        long(Operation::Rectify, p_a.times(d_a).plus(negative.times(d_b)))
    }
    #[track_caller]
    fn add_rectified(a: Span, b: Span) -> Span {
        long(Operation::AddRectified, a.plus(b))
    }
    #[track_caller]
    fn bend(increment: Span, rectified: Span, scale: LagScale) -> Span {
        let term = |rectified: i128| i128::from(Fixed::bend(0, rectified as i64, scale));
        let term = Span {
            low: term(rectified.low),
            high: term(rectified.high),
        };
        word(Operation::Turn, increment.plus(term))
    }
    fn rectified_beyond(sum: Span, scale: LagScale) -> bool {
        let beyond = |sum: i128| Fixed::rectified_beyond(sum as i64, scale);
        beyond(sum.low) || beyond(sum.high)
    }
    fn rectified_held(sum: Span, scale: LagScale) -> Span {
        let held = |sum: i128| i128::from(Fixed::rectified_held(sum as i64, scale));
        Span {
            low: held(sum.low),
            high: held(sum.high),
        }
    }
    #[track_caller]
    fn rectified(sum: Span, scale: LagScale) -> i64 {
        let exact = |sum: i128| i128::from(Fixed::rectified(sum as i64, scale));
        let fine = Span {
            low: exact(sum.low),
            high: exact(sum.high),
        };
        long(Operation::Rectified, fine);
        0
    }
    #[track_caller]
    fn ahead(now: Span, difference: Span) -> i64 {
        let twice = Span::point(2).times(now).plus(difference);
        long(Operation::Ahead, twice.up(FINE - INCREMENT - 1));
        0
    }

    #[track_caller]
    fn advance(angle: Summed, increment: Span) -> Summed {
        const DROP: u32 = INCREMENT - ANGLE;
        let wanted = word(Operation::Wanted, increment.plus(angle.rest));
        Summed {
            sum: word(Operation::Advance, angle.sum.plus(wanted.down(DROP))),
            rest: Span {
                low: 0,
                high: (1 << DROP) - 1,
            },
        }
    }
    #[track_caller]
    fn lever(angle: Summed, previous: Span, before_previous: Span) -> Span {
        let [one, two] = TWICE_CONING.map(Span::point);
        let with_previous = angle.sum.plus(one.upper_nearest(previous));
        let with_previous = word(Operation::Lever, with_previous);
        let lever = with_previous.plus(two.upper_nearest(before_previous));
        word(Operation::Lever, lever)
    }
    #[track_caller]
    fn add_cross(sum: Span, u_a: Span, d_b: Span, u_b: Span, d_a: Span) -> Span {
        let sum = long(Operation::AddCross, sum.plus(u_a.times(d_b)));
        let negative = word(Operation::Lever, u_b.negative());
        long(Operation::AddCross, sum.plus(negative.times(d_a)))
    }
    #[track_caller]
    fn add_product_of(sum: Span, a: Span, b: Span) -> Span {
        let product = a.down(INCREMENT - ANGLE).times(b);
        long(Operation::AddProductOf, sum.plus(product))
    }
    fn within_sample(difference: Span) -> Span {
        Span::point(KAPPA).upper(difference)
    }
    #[track_caller]
    fn at_end(now: Span, past: Span) -> i64 {
        let twice = Span::point(3).times(now).minus(past);
        long(Operation::AtEnd, twice.up(FINE - INCREMENT - 1));
        0
    }
    #[track_caller]
    fn fine(tilted: Span, cross: Span) -> i64 {
        let tilted = long(Operation::FineTilted, tilted.down(TILTED - FINE));
        let cross = long(Operation::FineCross, cross.down(CROSS + 1 - FINE));
        long(Operation::Fine, tilted.plus(cross));
        0
    }
    fn step_factor(step: Span) -> Span {
        step.down(REDUCED)
    }
    fn codes_per_factor(scale: Scale) -> f64 {
        Fixed::codes_per_factor(1 << scale.shift)
    }
    fn increment_factor(increment: Span) -> Span {
        increment.down(REDUCED)
    }
    #[track_caller]
    fn add_correlation(sum: Span, a: Span, b: Span) -> Span {
        long(Operation::AddCorrelation, sum.plus(a.times(b)))
    }
    /// Zero: a window without dither, after which the taps rest.
    fn correlation(_: Span) -> f32 {
        0.0
    }
}
