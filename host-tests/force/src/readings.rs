//! Samples of the accelerometers: of one recording, or of several concatenated.
//!
//! The attitude and the level at the start belong to each recording, or stretch of a long one; the accelerometer errors are
//! common to all. So no operation on neighbouring rows (attitude, filters, transforms) crosses from one recording to the
//! next.

use std::ops::Range;

use rlg_inference::{Observations, TooFewRows};
use rlg_signal::accelerometer_rows::Rows;
use rlg_signal::axes::{Triad, each_axis};

/// Rows of one recording among all.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Rows of the recording.
    pub rows: Range<usize>,
    /// Start of the first row on the recording's clock \[s\].
    pub start_s: f64,
    /// Name of the recording.
    pub recording: String,
}

impl Piece {
    /// Converts rows counted from the recording's first to rows among all.
    pub fn among_all(&self, own: &Range<usize>) -> Range<usize> {
        own.start + self.rows.start..own.end + self.rows.start
    }
}

/// Rows of all recordings.
pub struct Readings {
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
    /// Number of rows.
    pub count: usize,
    /// Velocity increment of each accelerometer over each row \[m/s\].
    pub sensed_m_s: Triad,
    /// Rows with all accelerometers and the case's motion measured.
    pub usable: Vec<bool>,
    /// Recordings, in the order of their rows.
    pub pieces: Vec<Piece>,
}

impl Readings {
    /// Concatenates the rows of recordings.
    ///
    /// # Errors
    /// Two recordings differ in row rate.
    pub fn joined(each: &[(&str, Rows)]) -> Result<Self, String> {
        let mut pieces: Vec<Piece> = Vec::with_capacity(each.len());
        for (name, rows) in each {
            if rows.rate_hz != each[0].1.rate_hz {
                return Err(format!(
                    "the accelerometers of {} have {} rows a second, those of {name} {}",
                    each[0].0, each[0].1.rate_hz, rows.rate_hz
                ));
            }
            let first = pieces.last().map_or(0, |before| before.rows.end);
            pieces.push(Piece {
                rows: first..first + rows.count,
                start_s: rows.start_s,
                recording: (*name).to_string(),
            });
        }
        let all = || each.iter().map(|(_, rows)| rows);
        Ok(Self {
            rate_hz: each[0].1.rate_hz,
            count: pieces.last().map_or(0, |last| last.rows.end),
            sensed_m_s: each_axis(|axis| {
                let values = all().flat_map(|rows| &rows.sensed_m_s[axis]);
                values.copied().collect()
            }),
            usable: all().flat_map(|rows| &rows.usable).copied().collect(),
            pieces,
        })
    }

    /// Piece of a row.
    fn piece_of(&self, row: usize) -> &Piece {
        let mut pieces = self.pieces.iter();
        let own = pieces.find(|piece| row < piece.rows.end);
        own.unwrap_or(&self.pieces[self.pieces.len() - 1])
    }

    /// Recording of a row, if there are several.
    pub fn recording_of(&self, row: usize) -> Option<&str> {
        let first = &self.pieces[0].recording;
        let are_several = self.pieces.iter().any(|one| one.recording != *first);
        are_several.then(|| &*self.piece_of(row).recording)
    }

    /// Start and end of some rows of one recording, on its clock \[s\].
    pub fn span_s(&self, rows: &Range<usize>) -> [f64; 2] {
        let piece = self.piece_of(rows.start);
        [rows.start, rows.end]
            .map(|row| piece.start_s + (row - piece.rows.start) as f64 / self.rate_hz)
    }

    /// Period of a row \[s\].
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    /// Time from the first row of the recording to the middle of a row \[s\].
    pub fn since_start_s(&self, piece: &Piece, row: usize) -> f64 {
        let middle_s = piece.start_s + ((row - piece.rows.start) as f64 + 0.5) / self.rate_hz;
        middle_s - piece.start_s
    }

    /// Observations of the `seen` rows: a span for each recording of eight rows or more, gaps bridged.
    ///
    /// # Errors
    /// Every recording has fewer than eight rows.
    pub fn bridged(&self, seen: &[bool]) -> Result<Observations, TooFewRows> {
        let mut too_few = TooFewRows { have: 0, need: 1 };
        let each = self.pieces.iter().filter_map(|piece| {
            let mut own = match Observations::bridged(&seen[piece.rows.clone()]) {
                Ok(own) => own,
                Err(few) => {
                    too_few = few;
                    return None;
                }
            };
            for span in &mut own.spans {
                span.rows = piece.among_all(&span.rows);
                span.gaps
                    .iter_mut()
                    .for_each(|gap| *gap = piece.among_all(gap));
            }
            Some(own.spans)
        });
        let spans: Vec<_> = each.flatten().collect();
        if spans.is_empty() {
            return Err(too_few);
        }
        Ok(Observations {
            spans,
            record_rows: self.count,
        })
    }

    /// Places of the recordings with observations.
    pub fn looked_at(&self, observations: &Observations) -> Vec<usize> {
        let is_seen = |place: &usize| {
            let rows = &self.pieces[*place].rows;
            let mut spans = observations.spans.iter();
            spans.any(|span| span.rows.start < rows.end && rows.start < span.rows.end)
        };
        (0..self.pieces.len()).filter(is_seen).collect()
    }
}
