//! Errors of accelerometers that rotate in the gravity field, beyond a given model: one likelihood, one structure search.
//!
//! In the order of the data: [`readings`] (of one recording or several) and [`mod@reference`] (known errors corrected) →
//! [`carried`] (attitude, lever arms) → [`vertical`] → [`prediction`] (predicted specific force) → [`residual`] →
//! [`shaken`] (exclusion of stretches with unmodelled linear acceleration) → [`search`] (columns, candidates, structure
//! search with the vertical as nuisance parameters) → [`confirm`] (cross-validation in blocks of rows) → [`findings`].
//! [`diagnose`](mod@diagnose) is the flow; [`whose`] attributes an error to the gyros or to their reference by the joint
//! likelihood of gyros and accelerometers.
//!
//! The predicted force is that of a unit that rotates without linear acceleration: gravity resolved by the reference's
//! attitude, and the lever-arm terms. At rest gravity is one number for three accelerometers, so no error is identifiable.
//! A unit that stands still in many attitudes without a reference is calibrated by `rlg-calibration`.

pub mod reference;

pub mod readings;

pub mod carried;

pub mod vertical;

pub mod prediction;

pub mod column;

pub mod candidates;

pub mod residual;

pub mod search;

pub mod shaken;

pub mod confirm;

pub mod diagnose;

mod effects;

pub mod findings;

pub mod whose;

pub mod without_reference;

pub use diagnose::{Asked, Diagnosed, Part, diagnose, why_not_at_rest};
pub use findings::say_why_not;
pub use reference::ReferenceNoise;
pub use whose::beside;
