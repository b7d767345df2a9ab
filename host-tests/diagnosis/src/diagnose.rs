//! The flow of a diagnosis against a reference on the gyros' rows.

use std::path::Path;

use rlg_model::Model;
use rlg_recording::error::InputError;

use super::outcome::Outcome;
use super::settings::Settings;
use super::{data, findings, search};
use rlg_signal::fault::Fault;
use rlg_signal::streams::Streams;

/// Whether this engine serves a recording: one record of increments with a reference on the same rows, and a model whose
/// effects it can predict.
pub fn serves(streams: &Streams, model: &Model) -> bool {
    streams.pieces.len() == 1
        && !streams.pieces[0].held_out
        && !streams.own_motion
        && streams.at_rest.is_none()
        && data::can_predict(model)
}

/// Diagnoses an aligned and qualified recording, using up its sensed increments; `None` where too few rows can be fitted.
///
/// # Errors
/// The model's installation matrix has no inverse.
pub fn diagnose(
    settings: &Settings,
    streams: &mut Streams,
    faults: &[Fault],
    (model, model_file): (&Model, &Path),
    progress: &dyn Fn(&str),
) -> Result<Option<Outcome>, InputError> {
    let Settings {
        left_out,
        ref plan,
        seed,
        ..
    } = *settings;
    let mut data = data::Data::new(streams, model, plan, model_file)?;
    let Some(mut found) = search::find(&mut data, left_out, plan, progress) else {
        return Ok(None);
    };
    // The set stands: its findings need no columns by frequency, which are most of the memory.
    found.equations.truncate(0);
    progress("writing the findings");
    Ok(findings::outcome(&data, &mut found, faults, seed, plan))
}
