//! Rows that are a stretch of a recording longer than memory.

use std::ops::Range;

use super::streams::Streams;

/// Stretches are judged above this \[Hz\]: their level and what drifts slowly are those of the whole recording.
const STRETCHES_ABOVE_HZ: f64 = 5.0;

impl Streams {
    /// Beginning and end of some rows on the recording's clock \[s\].
    pub fn span_of(&self, rows: &Range<usize>) -> [f64; 2] {
        [rows.start, rows.end].map(|row| self.begin_s(row))
    }

    /// The band in which rows are judged \[Hz\].
    pub fn band_hz(&self) -> [f64; 2] {
        match self.is_stretch() {
            true => [STRETCHES_ABOVE_HZ, f64::INFINITY],
            false => [0.0, f64::INFINITY],
        }
    }

    /// Seconds from the first row to the last, of a recording of which these are a stretch all of it.
    pub fn span_s(&self) -> f64 {
        let origin = self.piece.origin.as_ref();
        origin.map_or(self.rows as f64 / self.rate_hz, |origin| origin.seconds)
    }

    /// Whether the rows are a part of a longer recording.
    pub fn is_stretch(&self) -> bool {
        self.piece.origin.is_some()
    }
}
