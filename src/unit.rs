//! Around the chain: where readings come from, what is done about faults, what is remembered of them.

pub mod sample_source;

pub mod counter_bank;

pub mod health;

pub mod processor;

pub mod clock_start;

pub mod trace;
