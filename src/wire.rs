//! Formats that leave or enter the unit as bytes: telemetry, the raw stream, and the emulator image's input and report.

pub mod frame_finder;

pub mod telemetry;

pub mod raw_frame;

pub mod service_frame;

#[cfg(feature = "bank")]
pub mod bank_record;

pub mod inertial_message;

pub mod run_report;
