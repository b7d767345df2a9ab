//! What a number is: the words in which the stages are written, and their two meanings.
//!
//! An *increment* is an angle over one sample \[rad\]; a *coefficient* a dimensionless term of the
//! installation matrix or a scale error (within ±1/64); a *correction* a sum of their products, finer than
//! an increment, that is not yet rounded. Increments larger than
//! [`INCREMENT_LIMIT_RAD`](crate::design_parameters::INCREMENT_LIMIT_RAD) do not occur: the counts and
//! dither stages hold theirs, and the design parameters leave room for what is added after.
//!
//! It deliberately is not a general arithmetic: each operation is one that a stage needs, so that each has
//! its own format, rounding and range.

pub mod fixed;

pub mod float;

pub use fixed::Fixed;
pub use float::F32;

use core::fmt::Debug;
use core::ops::{Add, Sub};

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Fixed {}
    impl Sealed for super::F32 {}
}

/// An increment and the small terms that are still to be added to it \[rad\]: their sum, not yet rounded.
///
/// The stages pass this on and add their terms, so that what is summed in the end is rounded once.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unrounded<N: NumberSystem> {
    /// The large part.
    pub increment: N::Increment,
    /// Bias, scale, misalignment and remainders: at most 1/16 of the increment's range.
    pub small: N::Correction,
}

/// A number system of the chain: [`F32`] or [`Fixed`]. Conversions from `f64` run at boot only.
pub trait NumberSystem: sealed::Sealed + Debug + Clone + Copy + Default + 'static {
    /// As users call it: `f32` or `fixed`.
    const NAME: &'static str;

    /// Short pulse weight \[rad per pulse\].
    type PulseWeight: Debug + Clone + Copy + Default;
    /// Pickoff gain times code weight \[rad per code\].
    type PickoffGain: Debug + Clone + Copy + Default;
    /// Angle over one sample \[rad\].
    type Increment: Debug + Clone + Copy + Default + PartialEq;
    /// Scale error or matrix term \[1\], within ±1/64.
    type Coefficient: Debug
        + Clone
        + Copy
        + Default
        + PartialEq
        + Add<Output = Self::Coefficient>
        + Sub<Output = Self::Coefficient>;
    /// Sum of coefficient × increment \[rad\], not yet rounded to an increment.
    type Correction: Debug + Clone + Copy + Default + Add<Output = Self::Correction>;
    /// K/T² \[1\], within ±8.
    type Flexure: Debug + Clone + Copy + Default;
    /// Coefficient c_p of the acceleration filter \[1\], within ±2.
    type FilterCoefficient: Debug + Clone + Copy + Default;
    /// Sum of filter products \[rad per sample²\].
    type FilterSum: Debug + Clone + Copy + Default + Add<Output = Self::FilterSum>;
    /// Angular acceleration × T² \[rad per sample²\].
    type Acceleration: Debug + Clone + Copy + Default + PartialEq;
    /// Angle summed over an output period \[rad\].
    type Angle: Debug + Clone + Copy + Default;
    /// Half the summed angle plus the within-sample terms \[rad\]: what the increment is crossed with.
    type Lever: Debug + Clone + Copy + Default;
    /// Coning correction summed over an output period \[rad\].
    type Coning: Debug + Clone + Copy + Default + Add<Output = Self::Coning>;
    /// What rounding an output left \[parts of a code\].
    type OutputCarry: Debug + Clone + Copy + Default;

    /// From a short weight \[rad\]: exact.
    fn pulse_weight(short_rad: f64) -> Self::PulseWeight;
    /// From rad per code.
    fn pickoff_gain(rad_per_code: f64) -> Self::PickoffGain;
    /// From a number within ±1/64.
    fn coefficient(value: f64) -> Self::Coefficient;
    /// From rad per sample, well within the increment's range.
    fn correction(value_rad: f64) -> Self::Correction;
    /// From K/T².
    fn flexure(value: f64) -> Self::Flexure;
    /// From a number within ±2.
    fn filter_coefficient(value: f64) -> Self::FilterCoefficient;

    /// weight × counts; counts are within the sensed limit.
    fn pulses(weight: Self::PulseWeight, counts: i32) -> Self::Increment;
    /// sensed − gain × codes; codes are within the dither limit.
    fn strip(sensed: Self::Increment, gain: Self::PickoffGain, codes: i32) -> Unrounded<Self>;
    /// coefficient × increment.
    fn product(coefficient: Self::Coefficient, increment: Self::Increment) -> Self::Correction;
    /// Rounded to nearest: for factors of products and for differences, whose roundings do not add up.
    fn rounded(value: Unrounded<Self>) -> Self::Increment;

    /// coefficient × (now − past).
    fn difference(
        coefficient: Self::FilterCoefficient,
        now: Self::Increment,
        past: Self::Increment,
    ) -> Self::FilterSum;
    /// The filter's sum as an acceleration, held within the acceleration limit, and whether it was held.
    fn acceleration(sum: Self::FilterSum) -> (Self::Acceleration, bool);
    /// flexure × acceleration \[rad\].
    fn tilt(flexure: Self::Flexure, acceleration: Self::Acceleration) -> Self::Coefficient;

    /// angle + value with nothing lost, and the value rounded.
    fn accumulate(angle: Self::Angle, value: Unrounded<Self>) -> (Self::Angle, Self::Increment);
    /// angle/2 + c₁ D_{k−1} + c₂ D_{k−2}, c of
    /// [`CONING_COEFFICIENTS`](crate::design_parameters::CONING_COEFFICIENTS).
    fn lever(
        angle: Self::Angle,
        previous: Self::Increment,
        before_previous: Self::Increment,
    ) -> Self::Lever;
    /// u_a D_b − u_b D_a: one component of lever × increment.
    fn cross(
        u_a: Self::Lever,
        d_b: Self::Increment,
        u_b: Self::Lever,
        d_a: Self::Increment,
    ) -> Self::Coning;
    /// (angle + coning + carry) in output codes, held within ±(2³¹ − 1); the part of a code goes to `carry`.
    fn output_code(
        angle: Self::Angle,
        coning: Self::Coning,
        carry: &mut Self::OutputCarry,
    ) -> (i32, bool);
}
