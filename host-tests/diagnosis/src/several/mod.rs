//! Several recordings of one unit under one model: one likelihood, whose parts are the recordings.
//!
//! Each recording keeps its own motion, delays, noise and drift. It is settled by itself; then one search goes over effects
//! that all have in common, that have a value of their own in each, and that are in one of them alone (`shared`,
//! `search`). What is found must hold in blocks of all recordings and fall where they are re-enacted without it
//! (`confirm`); what is written of each recording is joined (`report`). The whole: `flow`. Stretches of one recording that is
//! longer than memory are searched in the same way, beside sums over all of it (`sums`, used by [`crate::long`]).

pub(crate) mod shared;

mod delays;

pub(crate) mod search;

pub(crate) mod confirm;

pub(crate) mod report;

pub(crate) mod sums;

mod flow;

pub use flow::diagnose_also;
