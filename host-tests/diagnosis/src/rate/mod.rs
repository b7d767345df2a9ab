//! Diagnosis against a reference on the gyros' rows: one likelihood, one search, one honest test.
//!
//! In the order of the data: [`data`] (residual, rows) → [`coarse`] (what is far off) → [`motion`] (independent of the residual) → [`search`] (passes of
//! columns and structure search on the rows to fit, by [`scores`] of [`families`] and [`lock_in`]) → [`confirm`] (on rows that were not fitted, and by [`reenact`]ing
//! the recording without an effect; [`goodness`] of what is left) → [`findings`] and [`excess_noise`].

pub mod plan;

pub mod data;

pub mod noise;

pub mod motion;

pub mod coarse;

pub mod scores;

pub mod lock_in;

pub mod families;

pub mod search;

pub mod goodness;

pub mod reenact;

pub mod confirm;

pub mod excess_noise;

pub mod findings;

pub use plan::AnalysisPlan;

use std::path::Path;

use rlg_model::Model;
use rlg_recording::error::InputError;

use crate::Outcome;
use crate::qualify::Fault;
use crate::settings::Settings;
use crate::streams::Streams;

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

/// The result where the older stages were asked as well: theirs of the accelerometers, and of gyros whose error gravity may
/// tell from the reference's. What the new engine explains to the end, with nothing found, is no effect of a gyro.
pub fn beside(found: Outcome, older: Outcome, model: &Model) -> Outcome {
    let of_accelerometers = |kind: &str| kind.starts_with("accel_") || kind == "size_effect";
    let names_gyros = older
        .diagnosis
        .effects
        .iter()
        .any(|effect| !of_accelerometers(&effect.kind));
    if found.diagnosis.verdict != crate::result::Verdict::Matches || !names_gyros {
        return older;
    }
    let mut merged = found;
    let from = older.diagnosis;
    let effects: Vec<_> = from
        .effects
        .into_iter()
        .filter(|effect| of_accelerometers(&effect.kind))
        .collect();
    if !effects.is_empty() {
        merged.diagnosis.verdict = crate::result::Verdict::Explained;
        merged.diagnosis.summary[0] =
            crate::sentences::opening(merged.diagnosis.verdict).to_string();
    }
    merged.diagnosis.effects.extend(effects);
    let is_of_accelerometer = |channel: &str| channel.starts_with("accel_");
    let locations = from
        .locations
        .into_iter()
        .filter(|one| is_of_accelerometer(&one.channel));
    merged.diagnosis.locations.extend(locations);
    let channels = from
        .fit
        .channels
        .into_iter()
        .filter(|one| is_of_accelerometer(&one.channel));
    merged.diagnosis.fit.channels.extend(channels);
    merged.diagnosis.accelerometer_noise = from.accelerometer_noise;
    let known = |effect: &&rlg_model::ModelEffect| {
        of_accelerometers(&effect.kind) && !model.effects.contains(effect)
    };
    let added: Vec<_> = older.model.effects.iter().filter(known).cloned().collect();
    for effect in added {
        merged
            .model
            .effects
            .retain(|other| other.kind != effect.kind);
        merged.model.effects.push(effect);
    }
    merged
}
