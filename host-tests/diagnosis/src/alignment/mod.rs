//! Coarse alignment of reference and gyros, and the motion of the case from both.

pub(crate) mod axis_regression;

pub(crate) mod coarse_path;

pub mod coarse;

pub mod case_motion;
