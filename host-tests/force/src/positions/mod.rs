//! Accelerometers by themselves: still positions, and no reference but gravity.
//!
//! In the order of the data: [`still`] (positions, from the readings alone) → [`lengths`] (|f| − g by position, its noise within
//! positions and between them) → [`errors`] and [`candidates`] (what errors of accelerometers do to the length) →
//! [`search`] (linearisation and structure search in turn) → [`mod@diagnose`] (the flow) →
//! `words` and [`findings`].
//!
//! The length of gravity tells bias, scale error, square and the three angles between the sensing axes (IEEE 1293, multi-position
//! test; Shin and El-Sheimy 2002). How the three as one are turned against the case it does not tell.

pub mod still;

pub mod errors;

pub mod lengths;

pub mod candidates;

pub mod search;

pub mod diagnose;

mod words;

pub mod findings;

pub use diagnose::{diagnose, serves};
