//! Several recordings of one unit under one model: one likelihood, whose parts are the recordings.
//!
//! Each recording keeps its own motion, delays, noise and drift. It is settled by itself; then one search goes over effects
//! that all have in common, that have a value of their own in each, and that are in one of them alone (`shared`,
//! `search`). What is found must hold in blocks of all recordings and fall where they are re-enacted without it
//! (`confirm`); what is written of each recording is joined (`report`). The whole: `flow`.

mod shared;

mod search;

mod confirm;

mod report;

mod flow;

pub use flow::diagnose;
