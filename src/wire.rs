//! Formats that leave or enter the unit as bytes: telemetry, and what the emulator's image plays and reports.

pub mod telemetry;

#[cfg(feature = "bank")]
pub mod bank_record;

pub mod run_report;
