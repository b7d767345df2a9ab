//! What rows are of: a recording, or a stretch of one that is longer than memory.

use std::ops::Range;

use nalgebra::UnitQuaternion;
use rlg_recording::Segment;
use rlg_recording::error::InputError;

use super::streams::Streams;

/// Where a stretch of a longer recording stands in it.
#[derive(Debug, Clone)]
pub struct Origin {
    /// Beginning of the recording \[s\].
    pub start_s: f64,
    /// Temperature of each block there \[K\]; `None` without thermometers.
    pub temperature_k: Option<[f64; 3]>,
    /// Attitude at the stretch's beginning against the recording's.
    pub start_from_body: UnitQuaternion<f64>,
    /// Length of the recording \[s\].
    pub seconds: f64,
}

/// What rows are of.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Where they begin in their recording; `None` where they are all of it.
    pub origin: Option<Origin>,
    /// Name of the recording.
    pub recording: String,
    /// Its named stretches, on its own clock.
    pub segments: Vec<Segment>,
    /// Whether it is kept for validation as a whole.
    pub held_out: bool,
}

/// Stretches are judged above this \[Hz\]: their level and what drifts slowly are those of the whole recording.
const STRETCHES_ABOVE_HZ: f64 = 5.0;

/// Asks for names that tell recordings apart.
///
/// # Errors
/// Two have the same.
pub fn distinct(all: &[Streams]) -> Result<(), InputError> {
    for (place, streams) in all.iter().enumerate() {
        let name = &streams.piece.recording;
        if all[..place].iter().any(|one| one.piece.recording == *name) {
            return Err(
                InputError::new(name, "has the name of another recording of this list")
                    .expected("names that tell the recordings apart (name in recording.toml)"),
            );
        }
    }
    Ok(())
}

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
