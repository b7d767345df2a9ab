//! Registration alone: alignment of gyros and attitudes without a search for physical effects.

use rlg_catalogue::entries::CATALOGUE;
use rlg_diagnosis::Outcome;
use rlg_model::DeclaredModel;
use rlg_recording::Recording;
use rlg_recording::error::InputError;

use crate::diagnose::diagnose;
use rlg_diagnosis::Settings;

/// Aligns gyros and attitudes of a recording by the same likelihood without physical effects; `None` as in [`diagnose`].
///
/// # Errors
/// As in [`diagnose`].
pub fn align(
    settings: &Settings,
    recording: &Recording,
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
) -> Result<Option<Outcome>, InputError> {
    let left_out: Vec<&str> = CATALOGUE.iter().map(|entry| entry.kind).collect();
    let mut asked = Settings {
        left_out: &left_out,
        ..*settings
    };
    asked.plan.attitude.most_effects = 0;
    let diagnosed = diagnose(&asked, recording, of, progress)?;
    Ok(diagnosed.map(|diagnosed| diagnosed.outcome))
}
