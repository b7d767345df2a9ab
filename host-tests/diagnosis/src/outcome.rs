//! The result of a diagnosis.

use rlg_findings::result;
use rlg_model::Model;

use crate::tiles::pictures;

/// Files and pictures of a diagnosis.
pub struct Outcome {
    /// `diagnosis.json`.
    pub diagnosis: result::Diagnosis,
    /// The model with the found effects switched on.
    pub model: Model,
    /// Series of the report's pictures; `None` if the recording was too short for a diagnosis.
    pub pictures: Option<pictures::Pictures>,
}

impl Outcome {
    /// Outcome of an unusable recording, with the reason.
    pub fn unusable(recording: &str, seed: u64, why: &str, model: &Model) -> Self {
        Self {
            diagnosis: result::Diagnosis::unusable(recording, seed, why),
            model: model.clone(),
            pictures: None,
        }
    }
}
