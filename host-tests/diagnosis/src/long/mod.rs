//! A recording longer than memory: stretches of it row by row, and all of its rows in sums over blocks.
//!
//! extent → `cut` (stretches, blocks) → stretches as records of one search (`several`) → `forming` (residual and columns along
//! what was found, chunk by chunk, summed) → the same search beside the sums → confirmed, reported.
//!
//! Held at once: the stretches, one chunk, and the blocks; none of them grows with the recording. Deliberately not here:
//! events and expressions between the stretches, resonances beyond those that the stretches show.

mod cut;

mod forming;

mod flow;

pub use cut::Long;
pub use flow::{WithStretches, diagnose_also};
