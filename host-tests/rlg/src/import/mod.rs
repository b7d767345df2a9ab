//! Imports foreign streams as recordings: one file a format.
//!
//! The bytes of a file become a [`Recording`](crate::recording::Recording), with a report of what was met on the way.
//! Telemetry is read whole; foreign files pass through row by row. A new format is a file here and a variant of
//! `command::import`.

pub mod frames;

pub mod f64x7;

pub mod psins_imu;

pub mod known;

pub mod hashed;

pub mod still;
