//! Foreign streams into recordings: one file a format.
//!
//! Enters: the bytes of a file. Leaves: a [`Recording`](crate::recording::Recording), and what was met on the
//! way. Telemetry is taken whole; foreign files pass through row by row. A new format is a file here and a variant of `command::import`.

pub mod frames;

pub mod f64x7;

pub mod psins_imu;

pub mod known;

pub mod hashed;

pub mod still;
