//! Residual relative to the motion, for `diagnosis.json`.

use rlg_findings::result::{CoherenceEntry, ResidualEntry};
use rlg_plan::CoherencePlan;
use rlg_signal::coherence::by_octave;
use rlg_signal::in_step::{Block, share_left};
use rlg_signal::streams::Triad;

/// Residual and motion of the same rows.
pub struct Rows<'a> {
    /// Residual by row \[rad\].
    pub residual_rad: &'a Triad,
    /// Turn of the unit by row \[rad\].
    pub motion_rad: &'a Triad,
    /// Rows with both known.
    pub is_used: &'a dyn Fn(usize) -> bool,
    /// Period of the rows \[s\].
    pub period_s: f64,
}

/// Returns the entry; `None` where the residual exceeds the motion.
///
/// `blocks`: powers of both by blocks of time.
pub fn entry(rows: &Rows, blocks: &[Block], plan: &CoherencePlan) -> Option<ResidualEntry> {
    let share = share_left(blocks)?;
    let octaves = by_octave(
        rows.residual_rad,
        rows.motion_rad,
        rows.is_used,
        rows.period_s,
        plan,
    );
    let coherence = octaves.iter().map(|octave| CoherenceEntry {
        low_hz: octave.band_hz[0],
        high_hz: octave.band_hz[1],
        gyros: octave.coherence,
    });
    Some(ResidualEntry {
        share_of_motion: share,
        coherence: coherence.collect(),
    })
}
