//! Rows of a stretch of a recording too long for memory.

use std::ops::Range;

use rlg_plan::LongPlan;

use super::streams::Streams;

impl Streams {
    /// Start and end time of some rows on the recording's clock \[s\].
    pub fn span_of(&self, rows: &Range<usize>) -> [f64; 2] {
        [rows.start, rows.end].map(|row| self.begin_s(row))
    }

    /// Frequency band of the evaluation \[Hz\].
    pub fn band_hz(&self, plan: &LongPlan) -> [f64; 2] {
        match self.is_stretch() {
            true => [plan.above_hz, f64::INFINITY],
            false => [0.0, f64::INFINITY],
        }
    }

    /// Duration \[s\]; for a stretch, of the whole recording.
    pub fn span_s(&self) -> f64 {
        let origin = self.piece.origin.as_ref();
        origin.map_or(self.rows as f64 / self.rate_hz, |origin| origin.seconds)
    }

    /// True if the rows are a part of a longer recording.
    pub fn is_stretch(&self) -> bool {
        self.piece.origin.is_some()
    }
}
