//! Recording longer than memory: stretches of it row by row, and all of its rows in sums over blocks.
//!
//! extent → `cut` (stretches, blocks) → stretches as records of one search (`several`) → `forming` (residual and columns
//! along the found effects, chunk by chunk, summed) → the same search together with the sums → confirmed, reported.
//!
//! Held at once: the stretches, one chunk, and the blocks; none of them grows with the recording. Out of scope: events and
//! expressions between the stretches, resonances beyond those in the stretches.

mod cut;

mod forming;

mod flow;

pub use cut::Long;
pub use flow::{WithStretches, diagnose_also};
