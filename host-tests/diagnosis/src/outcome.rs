//! The result of a diagnosis.

use rlg_findings::result;
use rlg_model::Model;

use super::pictures;

/// Everything a diagnosis leaves behind.
pub struct Outcome {
    /// `diagnosis.json`.
    pub diagnosis: result::Diagnosis,
    /// The model with the found effects switched on.
    pub model: Model,
    /// What the report draws; absent where the recording was too short to say anything.
    pub pictures: Option<pictures::Pictures>,
}
