//! Surrounds the chain: source of readings, handling of faults, record of both.

pub mod sample_source;

#[cfg(feature = "bank")]
pub mod counter_bank;

#[cfg(feature = "bank")]
pub mod bank_bus;

pub mod health;

pub mod self_test;

pub mod telemetry_frame;

pub mod processor;

pub mod raw_period;

pub mod slow_channels;

pub mod pulse_clock;

pub mod clock_start;

pub mod trace;
