//! Flow of a diagnosis: one likelihood per kind of recording, and one for its accelerometers.
//!
//! | recording | likelihood |
//! |---|---|
//! | gyros with a reference on the same rows | `rlg-diagnosis` ([`diagnose_streams`]) |
//! | a unit at rest on the turning Earth | `rlg-diagnosis::at_rest` (`at_rest.rs`) |
//! | several recordings of one unit | `rlg-diagnosis::several` (`together.rs`) |
//! | a recording longer than memory | `rlg-diagnosis::long` (`long.rs`) |
//! | gyros with attitudes, or with increments on other rows | `rlg-attitude` (`attitudes.rs`) |
//! | accelerometers, with each of these | `rlg-force` |
//! | accelerometers in still positions, gyros turned between them | `rlg-calibration::positions` |
//! | gyros that move without a reference | none (`rlg-force::without_reference`) |
//!
//! Input: a recording and the model that predicts it. Output: [`Outcome`]. No truth file is read and the simulator is
//! not imported.

mod at_rest;

mod attitudes;

mod long;

mod lost_rows;

mod second_pass;

mod together;

pub use long::{LongRecording, MOST_ROWS};
pub use rlg_attitude::serves as is_slow;
pub use rlg_calibration::positions::serves as stands_in_positions;
pub use rlg_diagnosis::tiles::{locate, pictures};
pub use rlg_diagnosis::{Outcome, Settings};
pub use rlg_findings::result;
pub use rlg_force::without_reference::diagnose_without_reference;
pub use rlg_signal::{qualify, streams};
pub use together::diagnose_together;

use std::borrow::Borrow;
use std::path::Path;

use rlg_diagnosis::residual::reference_noise_from_gyros::read_by_gyros;
use rlg_diagnosis::rows::channel_correction::Stopped;
use rlg_diagnosis::rows::{channel_correction, data_words};
use rlg_diagnosis::unfit::{TooFewRows, Unfit};
use rlg_force::Part;
use rlg_model::{DeclaredModel, Model};
use rlg_recording::Recording;
use rlg_recording::error::InputError;

use streams::Streams;

/// Reason of an unusable recording of increments.
fn too_few_rows(of: TooFewRows) -> String {
    format!("{of}: rows with all channels measured, besides those held out")
}

/// Diagnoses `recording` against `model`, read from `model_file`.
///
/// # Errors
/// As of [`diagnose_under`].
pub fn diagnose(
    recording: &Recording,
    model: &Model,
    model_file: &Path,
    seed: u64,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    diagnose_without(&[], recording, model, model_file, seed, progress)
}

/// Diagnoses with some kinds left out of the catalogue: the response to an effect unknown to the catalogue.
///
/// # Errors
/// As of [`diagnose_under`].
pub fn diagnose_without(
    left_out: &[&str],
    recording: &Recording,
    model: &Model,
    model_file: &Path,
    seed: u64,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let settings = Settings {
        left_out,
        seed,
        ..Settings::default()
    };
    diagnose_under(&settings, recording, model, model_file, progress)
}

/// Diagnoses under the given settings; a recording that is given away takes no memory once its channels are aligned.
///
/// # Errors
/// A channel is missing or of another unit, or axes are exchanged or reversed; or the model holds an effect that cannot
/// be predicted here.
pub fn diagnose_under(
    settings: &Settings,
    recording: impl Borrow<Recording>,
    model: &Model,
    model_file: &Path,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let read = recording.borrow();
    let of = DeclaredModel::new(model, model_file);
    if stands_in_positions(read, &settings.plan) {
        rlg_diagnosis::rows::model_effects::is_predictable(model, model_file)?;
        return rlg_calibration::positions::diagnose(settings, read, model, progress);
    }
    if is_slow(read, model) {
        let mut outcome = attitudes::diagnose(settings, read, of, progress)?;
        outcome
            .diagnosis
            .judge_noise(&settings.plan.findings.instruments);
        return Ok(outcome);
    }
    progress("aligning the channels");
    let aligned = align(settings, read, model)?;
    // The tables of a recording given away are freed here; the rows are in the streams.
    drop(recording);
    let mut outcome = diagnose_streams(settings, aligned.streams, of, progress)?;
    outcome.diagnosis.prepend(aligned.restored);
    Ok(outcome)
}

/// Channels of a recording on the gyros' rows.
pub struct Aligned {
    /// The channels.
    pub streams: Streams,
    /// Sentences on rows that were lost without a stamp and are restored as unmeasured.
    pub restored: Vec<String>,
}

impl From<Streams> for Aligned {
    /// Takes channels whose rows are whole.
    fn from(streams: Streams) -> Self {
        Self {
            streams,
            restored: Vec::new(),
        }
    }
}

/// Aligns the channels of a recording with a reference on its gyros' rows, or at rest, and restores lost rows.
///
/// # Errors
/// A channel is missing or of another unit.
pub fn align(
    settings: &Settings,
    recording: &Recording,
    model: &Model,
) -> Result<Aligned, InputError> {
    let plan = &settings.plan.signal;
    let whole = lost_rows::put_back(recording, model, &plan.lost_rows, |recording, model| {
        Streams::align(recording, model, &plan.align)
    })?;
    Ok(Aligned {
        streams: whole.streams,
        restored: whole.said,
    })
}

/// Diagnoses channels without lost rows.
///
/// # Errors
/// As of [`diagnose_under`].
pub fn diagnose_streams(
    settings: &Settings,
    mut streams: Streams,
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let DeclaredModel { model, file } = of;
    let name = streams.piece.recording.clone();
    let correction = match channel_correction::correct_channels(settings, &mut streams, model, file)
    {
        Err(Stopped::Apart(why, _)) => {
            return Ok(channel_correction::of_two_motions(
                &name,
                settings.seed,
                &why,
                model,
            ));
        }
        checked => checked?,
    };
    rlg_diagnosis::rows::model_effects::is_predictable(model, file)?;
    let found = if streams.at_rest.is_some() {
        at_rest::diagnose(settings, &mut streams, of, progress)
    } else {
        beside_reference(settings, &mut streams, of, progress)
    };
    let found = found.map(|mut outcome| {
        if let Some(correction) = correction {
            correction.report(&mut outcome);
        }
        outcome
            .diagnosis
            .judge_noise(&settings.plan.findings.instruments);
        outcome
    });
    or_unusable(found, &name, settings, model, too_few_rows)
}

/// Diagnoses gyros with a reference on the same rows, and their accelerometers.
fn beside_reference(
    settings: &Settings,
    streams: &mut Streams,
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
) -> Result<Outcome, Unfit> {
    let model = of.model;
    let faults = qualify::unknown_faults(streams, &model.effects, &settings.plan.signal.faults);
    let sensed_rad = streams.sensed_rad.clone();
    let run = |settings: &Settings, of: DeclaredModel<'_>| {
        streams.sensed_rad.clone_from(&sensed_rad);
        rlg_diagnosis::diagnose::diagnose_also(
            settings,
            streams,
            &faults,
            of,
            progress,
            |data, found| {
                let has_any = data.streams.accelerometers.is_ok();
                let noise = rlg_force::reference::measured_noise(&found.motion);
                (noise, has_any.then(|| read_by_gyros(data, found)).flatten())
            },
        )
    };
    let found = second_pass::until_nothing_returns(settings, of, progress, run)?;
    drop(sensed_rad);
    let (mut found, (reference_noise, read_by_gyros)) = found;
    let lines = data_words::lines(streams, &faults);
    found.diagnosis.summary.extend(lines);
    let part = Part {
        streams,
        reference_noise,
        read_by_gyros,
    };
    accelerometers(settings, vec![part], (model, &mut found), progress);
    Ok(found)
}

/// Diagnoses the accelerometers of recordings, given the outcome of their gyros; recordings without accelerometers are
/// skipped.
fn accelerometers(
    settings: &Settings,
    mut parts: Vec<Part>,
    (model, outcome): (&Model, &mut Outcome),
    progress: &dyn Fn(&str),
) {
    let has_any = |part: &Part| part.streams.accelerometers.is_ok();
    if parts.iter().any(has_any) {
        parts.retain(has_any);
    }
    let asked = rlg_force::Asked {
        model,
        effects: &outcome.model.effects.clone(),
        left_out: settings.left_out,
        open: &[],
        plan: settings.plan,
    };
    if let Err(reason) = rlg_force::beside(&parts, &asked, outcome, progress) {
        rlg_force::say_why_not(&reason, outcome);
    }
}

/// Returns the outcome of an unusable recording where too few rows can be fitted, with the reason by `why`.
///
/// # Errors
/// Data or model are in error.
fn or_unusable(
    found: Result<Outcome, Unfit>,
    recording: &str,
    settings: &Settings,
    model: &Model,
    why: impl FnOnce(TooFewRows) -> String,
) -> Result<Outcome, InputError> {
    match found {
        Ok(outcome) => Ok(outcome),
        Err(Unfit::TooFewRows(rows)) => Ok(Outcome::unusable(
            recording,
            settings.seed,
            &why(rows),
            model,
        )),
        Err(Unfit::Input(error)) => Err(error),
    }
}
