//! Around the chain: where readings come from, what is done about faults, what is remembered of them.

pub mod sample_source;

#[cfg(feature = "bank")]
pub mod counter_bank;

#[cfg(feature = "bank")]
pub mod bank_bus;

pub mod health;

pub mod telemetry_frame;

pub mod processor;

pub mod raw_period;

pub mod clock_start;

pub mod trace;
