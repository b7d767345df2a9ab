//! Origin of rows: a recording, or a stretch of one too long for memory.

use nalgebra::UnitQuaternion;
use rlg_recording::Segment;

/// Position of a stretch in a longer recording.
#[derive(Debug, Clone)]
pub struct Origin {
    /// Beginning of the recording \[s\].
    pub start_s: f64,
    /// Temperature of each block there \[K\]; `None` without thermometers.
    pub temperature_k: Option<[f64; 3]>,
    /// Attitude at the stretch's beginning relative to the recording's.
    pub start_from_body: UnitQuaternion<f64>,
    /// Length of the recording \[s\].
    pub seconds: f64,
}

/// Recording, or stretch of one, of the rows.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Position in the recording; `None` for a whole recording.
    pub origin: Option<Origin>,
    /// Name of the recording.
    pub recording: String,
    /// The recording's named stretches, on its own clock.
    pub segments: Vec<Segment>,
    /// The whole recording is kept for validation.
    pub held_out: bool,
}
