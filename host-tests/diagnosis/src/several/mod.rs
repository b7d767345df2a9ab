//! Several recordings of one unit under one model: one likelihood, whose parts are the recordings.
//!
//! Each recording keeps its own motion, delays, noise and drift. It is settled by itself; then one search covers effects
//! common to all, effects with a size per recording, and effects of a single recording (`shared`, `search`). Findings are
//! confirmed by cross-validation on blocks of all recordings and by parametric bootstrap (`confirm`); the findings of the
//! recordings are joined (`report`). The whole: `flow`. Stretches of one recording longer than memory are searched in the
//! same way, together with sums over all of it (`sums`, used by [`crate::long`]).

pub(crate) mod shared;

mod delays;

pub(crate) mod search;

pub(crate) mod confirm;

pub(crate) mod report;

pub(crate) mod sums;

mod flow;

pub use flow::diagnose_also;
