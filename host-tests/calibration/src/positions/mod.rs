//! Accelerometers alone: still positions, with gravity as the only reference.
//!
//! In the order of the data: [`still`] (positions, from the samples alone) → [`lengths`] (|f| − g by position, its noise
//! within and between positions) → [`errors`] and [`candidates`] (effect of accelerometer errors on the length) →
//! [`search`] (alternate linearisation and structure search) → [`mod@diagnose`] (the flow) → `words` and [`findings`].
//!
//! The length of gravity determines bias, scale error, quadratic error and the three angles between the sensing axes (IEEE
//! 1293, multi-position test; Shin and El-Sheimy 2002); beside it, [`turns`] compares gyros, if there are any. The rotation of the triad against the case is not observable.

pub mod still;

pub mod errors;

pub mod lengths;

pub mod candidates;

pub mod search;

pub mod diagnose;

mod few_positions;

mod words;

mod too_few;

pub mod turns;

pub mod findings;

pub use diagnose::{diagnose, serves};
