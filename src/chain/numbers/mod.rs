//! Defines the numbers of the chain: the operations in which the stages are written, and their two implementations.
//!
//! An *increment* is an angle over one sample, counted in increment units: 2ˢ rad, s = 0 from 4 kHz on
//! ([`increment_unit_log2`](crate::chain::design_parameters::increment_unit_log2)), so that the formats' ranges follow the
//! sample rate. On this page \[rad\] stands for this unit, and \[rad²\] for its square. Increments are factors of
//! products (acceleration, tilt, coning) and are rounded; they are summed only where the sum is a factor again. Sums
//! over an output period are exact and common to both systems ([`exact`]). A velocity over one sample is an increment
//! too, in units of [`VELOCITY_UNIT_M_S`](exact::VELOCITY_UNIT_M_S): it has an angle's formats, and its products with
//! angles those of angles with angles.
//!
//! This is no general arithmetic: each operation is one that a stage needs, so that each has its own format, rounding
//! and range.

pub mod exact;

pub mod fixed;

pub mod float;

#[cfg(feature = "proof")]
pub mod interval;

#[cfg(feature = "proof")]
mod span;

pub use fixed::Fixed;
pub use float::F32;
#[cfg(feature = "proof")]
pub use interval::Interval;

use core::fmt::Debug;

use crate::chain::design_parameters::{CENTRAL_PAIRS, FILTER_TERMS};

/// Factors by gyro, axis and difference.
pub type LagFactors<T> = [[[T; CENTRAL_PAIRS]; 2]; 3];

/// Largest Σ |factor| of an axis \[1\].
fn largest_lag_sum(values: &LagFactors<f64>) -> f64 {
    let sums = values.as_flattened().iter();
    let sums = sums.map(|axis| axis.iter().map(|factor| factor.abs()).sum());
    sums.fold(0.0, f64::max)
}

/// Largest acceleration × T² whose cube is formed \[rad per sample²\]: 2⁻¹³, 1950 rad/s² at 4 kHz; the unit of cubes.
pub const CUBE_REACH: f64 = 1.0 / 8192.0;

mod sealed {
    pub trait Sealed {}
    impl Sealed for crate::chain::numbers::Fixed {}
    impl Sealed for crate::chain::numbers::F32 {}
    #[cfg(feature = "proof")]
    impl Sealed for crate::chain::numbers::Interval {}
}

/// A number system of the chain: [`F32`] or [`Fixed`]; for proofs also `Interval`. Conversions from `f64` run at boot only.
pub trait NumberSystem: sealed::Sealed + Debug + Clone + Copy + Default + 'static {
    /// The number system's name on command lines: `f32` or `fixed`.
    const NAME: &'static str;

    /// Pulse weight \[rad per pulse\].
    type PulseWeight: Debug + Clone + Copy + Default;
    /// Scaling of a pickoff step for its taps.
    type StepScale: Debug + Clone + Copy + Default;
    /// Difference of two pickoff readings \[codes\], scaled.
    type Step: Debug + Clone + Copy + Default;
    /// Strip per pickoff code \[rad\], scaled.
    type Tap: Debug + Clone + Copy + Default;
    /// Angle over one sample \[rad\].
    type Increment: Debug + Clone + Copy + Default + PartialEq;
    /// Term of the matrix at rest \[1\], within ±1/64.
    type Coefficient: Debug + Clone + Copy + Default;
    /// Coefficient of the acceleration filter \[1\], within ±2.
    type FilterCoefficient: Debug + Clone + Copy + Default;
    /// Angular acceleration × T² \[rad per sample²\], not yet held.
    type FilterSum: Debug + Clone + Copy + Default;
    /// Angular acceleration × T² \[rad per sample²\], held.
    type Acceleration: Debug + Clone + Copy + Default;
    /// K/T² \[1\], within ±8.
    type Flexure: Debug + Clone + Copy + Default;
    /// Flexure × acceleration \[rad\], within 1/128.
    type Tilt: Debug + Clone + Copy + Default;
    /// Tilt × increment, and its sum over an output period \[rad\].
    type Tilted: Debug + Clone + Copy + Default;
    /// Factor of a difference of increments \[1\], in a scale of its own.
    type LagFactor: Debug + Clone + Copy + Default;
    /// The scale of lag factors.
    type LagScale: Debug + Clone + Copy + Default;
    /// Lag factors × differences \[rad\], in that scale.
    type Lagged: Debug + Clone + Copy + Default;
    /// An increment as the other factor of a lagged value.
    type LagIncrement: Debug + Clone + Copy + Default;
    /// Lagged × increment, and its sum over an output period \[rad\], in that scale.
    type Rectified: Debug + Clone + Copy + Default;
    /// Angle since the output period's start \[rad\].
    type Angle: Debug + Clone + Copy + Default;
    /// Angle with the terms within a sample \[rad\]: the first factor of a cross product with an increment.
    type Lever: Debug + Clone + Copy + Default;
    /// Lever × increment, and its sum over an output period \[rad²\].
    type Cross: Debug + Clone + Copy + Default;
    /// Scale error per increment, or per its square \[1\], or a factor of an increment, within ±64.
    type Slope: Debug + Clone + Copy + Default;
    /// A step or increment as a factor of a correlation.
    type Factor: Debug + Clone + Copy + Default;
    /// Sum of products of factors over an adaptation window.
    type Correlation: Debug + Clone + Copy + Default;

    /// True if a lag factor costs more to load than a branch that spares half of them: where registers hold factors,
    /// not words.
    const LOADS_FACTORS: bool;

    /// Increment of one unit of a factor \[rad\].
    const RAD_PER_FACTOR: f64;

    /// Converts a pulse weight \[rad per pulse\], for counts of up to `limit_counts`.
    fn pulse_weight(weight_rad: f64, limit_counts: i32) -> Self::PulseWeight;
    /// The scale for steps of up to `limit_codes`.
    fn step_scale(limit_codes: i32) -> Self::StepScale;
    /// Converts a tap from fine units per code.
    fn tap(fine_per_code: i64, scale: Self::StepScale) -> Self::Tap;
    /// Converts a matrix term, within ±1/64.
    fn coefficient(value: f64) -> Self::Coefficient;
    /// Converts a filter coefficient, within ±2.
    fn filter_coefficient(value: f64) -> Self::FilterCoefficient;
    /// Converts K/T².
    fn flexure(value: f64) -> Self::Flexure;
    /// Converts a scale error per increment.
    fn slope(value: f64) -> Self::Slope;
    /// Converts an increment.
    fn increment(value: f64) -> Self::Increment;

    /// weight × counts; counts are within their limit.
    fn pulses(weight: Self::PulseWeight, counts: i32) -> Self::Increment;
    /// Scales a difference of codes, which is within its limit.
    fn step(scale: Self::StepScale, codes: i32) -> Self::Step;
    /// increment − tap × step.
    fn strip(increment: Self::Increment, tap: Self::Tap, step: Self::Step) -> Self::Increment;
    /// to + coefficient × increment.
    fn add_product(
        to: Self::Increment,
        coefficient: Self::Coefficient,
        increment: Self::Increment,
    ) -> Self::Increment;
    /// now − past.
    fn difference(now: Self::Increment, past: Self::Increment) -> Self::Increment;

    /// a + b.
    fn add(a: Self::Increment, b: Self::Increment) -> Self::Increment;
    /// now − past, held within ±limit.
    fn difference_within(
        now: Self::Increment,
        past: Self::Increment,
        limit: Self::Increment,
    ) -> Self::Increment;
    /// to + factor × increment, for factors beyond a coefficient's range.
    fn add_scaled(
        to: Self::Increment,
        factor: Self::Slope,
        increment: Self::Increment,
    ) -> Self::Increment;
    /// The sum of a filter as an increment.
    fn filtered(sum: Self::FilterSum) -> Self::Increment;
    /// slope × increment, as a scale error.
    fn sloped(slope: Self::Slope, increment: Self::Increment) -> Self::Tilt;
    /// slope × increment², slope a scale error per square of an increment.
    fn sloped_twice(slope: Self::Slope, increment: Self::Increment) -> Self::Tilt;
    /// a + b.
    fn add_tilt(a: Self::Tilt, b: Self::Tilt) -> Self::Tilt;

    /// Σ coefficient × difference.
    fn filter(
        coefficients: &[Self::FilterCoefficient; FILTER_TERMS],
        differences: [Self::Increment; FILTER_TERMS],
    ) -> Self::FilterSum;
    /// True if the sum is beyond the acceleration limit.
    fn beyond(sum: Self::FilterSum) -> bool;
    /// The acceleration limit with the sign of the sum.
    fn held(sum: Self::FilterSum) -> Self::FilterSum;
    /// The sum as an acceleration; the sum must be within the limit.
    fn acceleration(sum: Self::FilterSum) -> Self::Acceleration;
    /// flexure × acceleration.
    fn tilt(flexure: Self::Flexure, acceleration: Self::Acceleration) -> Self::Tilt;
    /// Converts a limit of a tilt, within ±1/8.
    fn tilt_limit(value: f64) -> Self::Tilt;
    /// The tilt, held within ±limit.
    fn hold_tilt(tilt: Self::Tilt, limit: Self::Tilt) -> Self::Tilt;
    /// a ((a/r)² − less), r = [`CUBE_REACH`], a held within ±r, less within 0 to 1.
    fn cubed(acceleration: Self::Acceleration, less: Self::FilterCoefficient)
    -> Self::Acceleration;
    /// A section of second order: Σ factor × value over the input, its last two values and the last two outputs, to
    /// nearest. The result must be within ±1/8.
    fn section(
        factors: &[Self::FilterCoefficient; 5],
        inputs: [Self::Tilt; 3],
        outputs: [Self::Tilt; 2],
    ) -> Self::Tilt;
    /// t_a r_a + t_b r_b.
    fn tilted(
        t_a: Self::Tilt,
        r_a: Self::Increment,
        t_b: Self::Tilt,
        r_b: Self::Increment,
    ) -> Self::Tilted;
    /// a + b.
    fn add_tilted(a: Self::Tilted, b: Self::Tilted) -> Self::Tilted;
    /// increment + tilted.
    fn turn(increment: Self::Increment, tilted: Self::Tilted) -> Self::Increment;

    /// Converts lag factors, and gives the scale that they need.
    fn lag_factors(values: &LagFactors<f64>) -> (LagFactors<Self::LagFactor>, Self::LagScale);
    /// Σ factor × difference.
    fn lagged(
        factors: &[Self::LagFactor; CENTRAL_PAIRS],
        differences: [Self::Increment; CENTRAL_PAIRS],
    ) -> Self::Lagged;
    /// The increment as a factor of lagged values.
    fn lag_increment(increment: Self::Increment) -> Self::LagIncrement;
    /// p_a d_a − p_b d_b.
    fn rectify(
        a: (Self::Lagged, Self::LagIncrement),
        b: (Self::Lagged, Self::LagIncrement),
    ) -> Self::Rectified;
    /// a + b.
    fn add_rectified(a: Self::Rectified, b: Self::Rectified) -> Self::Rectified;
    /// increment + rectified, as a factor of products.
    fn bend(
        increment: Self::Increment,
        rectified: Self::Rectified,
        scale: Self::LagScale,
    ) -> Self::Increment;
    /// True if the sum is beyond ±[`FLEXURE_ANGLE_LIMIT_RAD`](crate::chain::design_parameters::FLEXURE_ANGLE_LIMIT_RAD).
    fn rectified_beyond(sum: Self::Rectified, scale: Self::LagScale) -> bool;
    /// That limit with the sign of the sum.
    fn rectified_held(sum: Self::Rectified, scale: Self::LagScale) -> Self::Rectified;
    /// The sum \[fine units\]; the sum must be within the limit.
    fn rectified(sum: Self::Rectified, scale: Self::LagScale) -> i64;
    /// now + ½ difference \[fine units\].
    fn ahead(now: Self::Increment, difference: Self::Increment) -> i64;

    /// angle + increment.
    fn advance(angle: Self::Angle, increment: Self::Increment) -> Self::Angle;
    /// angle + 2 c₁ D_{k−1} + 2 c₂ D_{k−2}, c of
    /// [`CONING_COEFFICIENTS`](crate::chain::design_parameters::CONING_COEFFICIENTS).
    fn lever(
        angle: Self::Angle,
        previous: Self::Increment,
        before_previous: Self::Increment,
    ) -> Self::Lever;
    /// sum + u_a D_b − u_b D_a: one component of lever × increment.
    fn add_cross(
        sum: Self::Cross,
        u_a: Self::Lever,
        d_b: Self::Increment,
        u_b: Self::Lever,
        d_a: Self::Increment,
    ) -> Self::Cross;
    /// sum + a b, in the format of the sum of crossed increments.
    fn add_product_of(sum: Self::Cross, a: Self::Increment, b: Self::Increment) -> Self::Cross;
    /// κ × difference, κ of [`WITHIN_SAMPLE`](crate::chain::design_parameters::WITHIN_SAMPLE).
    fn within_sample(difference: Self::Increment) -> Self::Increment;
    /// now + ½ (now − past) \[fine units\].
    fn at_end(now: Self::Increment, past: Self::Increment) -> i64;
    /// tilted + cross/2 \[fine units\].
    fn fine(tilted: Self::Tilted, cross: Self::Cross) -> i64;
    /// Converts a step to a factor of a correlation.
    fn step_factor(step: Self::Step) -> Self::Factor;
    /// Pickoff codes in one unit of a step's factor.
    fn codes_per_factor(scale: Self::StepScale) -> f64;
    /// Converts an increment to a factor of a correlation.
    fn increment_factor(increment: Self::Increment) -> Self::Factor;
    /// sum + a b.
    fn add_correlation(
        sum: Self::Correlation,
        a: Self::Factor,
        b: Self::Factor,
    ) -> Self::Correlation;
    /// The sum \[factor units²\], once per window.
    fn correlation(sum: Self::Correlation) -> f32;
}
