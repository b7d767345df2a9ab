//! Several recordings of one unit under one model: one likelihood, whose parts are the recordings.
//!
//! Each recording keeps its own motion, delays, noise and drift. It is settled by itself; then one search covers effects
//! common to all, effects with a size per recording, and effects of a single recording (`search`, over the
//! hypotheses of `crate::confirm::sharing`). Findings are confirmed as those of one recording ([`crate::confirm`]) and joined
//! (`report`). The whole: `flow`. Stretches of one recording longer than memory are searched in the same way, together with
//! sums over all of it ([`crate::long`]).

mod delays;

pub(crate) mod search;

pub(crate) mod report;

mod flow;

pub use flow::diagnose_also;
