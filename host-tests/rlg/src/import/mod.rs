//! Imports foreign streams and files as recordings.
//!
//! The bytes of a file become a [`Recording`](crate::recording::Recording), with a report of the import. Telemetry and the
//! raw stream are read whole; files of fixed form pass through row by row, one file a format; files with columns go through
//! `files`, `mapping` and `forming`. A new format is a file here or in `files`, and a variant of `command::import`.

pub mod frames;

pub mod raw;

pub mod bank;

pub mod f64x7;

pub mod psins_imu;

pub mod known;

pub mod hashed;

pub mod still;

pub mod files;

pub mod mapping;

pub mod forming;
