//! Which rows come from which recording.

use std::ops::Range;

use nalgebra::UnitQuaternion;
use rlg_recording::Segment;

/// Where a stretch of a longer recording stands in it.
#[derive(Debug, Clone)]
pub struct Origin {
    /// Beginning of the recording \[s\].
    pub start_s: f64,
    /// Temperature there \[K\]; `None` without thermometers, and in the stretch that tells it.
    pub temperature_k: Option<[f64; 3]>,
    /// Attitude at the stretch's beginning against the recording's.
    pub start_from_body: UnitQuaternion<f64>,
    /// Length of the recording \[s\].
    pub seconds: f64,
    /// The stretch's rows are held out from this time of the recording's clock on \[s\].
    pub held_out_from_s: f64,
}

/// One recording's share of the rows, or a stretch of one.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Where it begins in its recording; `None` at the recording's own beginning.
    pub origin: Option<Origin>,
    /// Name of the recording.
    pub recording: String,
    /// Its rows.
    pub rows: Range<usize>,
    /// Beginning of its first row on its own clock \[s\].
    pub start_s: f64,
    /// Its named stretches, on its own clock.
    pub segments: Vec<Segment>,
    /// Whether it is kept for validation as a whole.
    pub held_out: bool,
}
