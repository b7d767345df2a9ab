//! What rows are of: a recording, or a stretch of one that is longer than memory.

use nalgebra::UnitQuaternion;
use rlg_recording::Segment;

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
