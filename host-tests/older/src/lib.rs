//! The older stages of the diagnosis, and the choice between them and the new engine ([`diagnose_under`]). In order; each
//! stage is a file that can be read and tested alone:
//!
//! declare → streams → qualify → scene (motion, signals) → residual → split → portion → noise, pulses → locate →
//! hypotheses → workbench → select (weigh), hunt (events, products, invariance, drift), shapes, local → self_test →
//! contradiction → identify → validate → explain
//!
//! From the split on it is one file (look), gone again with other rows held out where something is left to explain. Several
//! recordings go to the new engine (together).
//!
//! Gyros that count coarse pulses without a dither are read first of all (lattice): what their pulses hide is no finding.
//!
//! Of a recording longer than memory stretches take this road, and sums over blocks of all its rows stand beside the
//! workbench (long, blocks). Gyros beside attitudes, or beside increments on other rows, have a likelihood of their own
//! (attitudes, rlg-attitude).
//!
//! A unit at rest on the Earth goes to the new engine (at_rest). Accelerometers have a likelihood of their own
//! (beside, rlg-force).
//!
//! Enters: a recording and the model that predicts it. Leaves: [`Outcome`]. Nothing here reads truth files or
//! imports the simulator.

pub mod declare;

pub mod together;

mod look;

pub mod long;

pub mod wiring;

pub mod motion;

pub mod scene;

pub mod signals;

pub mod residual;

pub mod levels;

mod declared;

pub mod noise;

pub mod pulses;

pub mod coherence;

pub mod information;

pub mod hypotheses;

pub mod empirical;

pub mod bench;

pub mod columns;

pub mod blocks;

pub mod workbench;

pub mod select;

pub mod weigh;

pub mod tone;

pub mod events;

pub mod bursts;

pub mod steps;

pub mod products;

pub mod invariance;

pub mod wander;

pub mod slow;

pub mod drift;

pub mod hunt;

mod sight;

mod names;

pub mod local;

pub mod shapes;

pub mod readings;

pub mod timing;

pub mod excess;

pub mod wandering;

pub mod identify;

pub mod contradiction;

pub mod self_test;

pub mod explain;

mod entries;

mod doubt;

mod figures;

mod explained_model;

mod sentences;

pub mod settings;

mod beside;

mod at_rest;

mod attitudes;

pub use declared::{declared_noise, own_noise, reference_noise};
pub use settings::Settings;
pub use together::diagnose_together;

pub use rlg_attitude::serves as is_slow;
pub use rlg_diagnosis::{Outcome, lattice, locate, pictures, portion, regressor, split, validate};
pub use rlg_findings::result;
pub use rlg_signal::{pieces, qualify, streams};

use std::path::Path;

use rlg_diagnosis::{data_words, put_right};
use rlg_model::Model;
use rlg_recording::Recording;
use rlg_recording::error::InputError;

use blocks::Blocks;
use lattice::Lattice;
use look::{Cut, Given, look};
use result::Verdict;
use scene::Scene;
use split::Part;
use streams::Streams;

/// A search that tried more than this has looked for long enough: it is not repeated on other rows.
const MOST_TRIALS: usize = 4000;

/// Least seconds of usable rows to fit on: below this not even the noise is known.
const LEAST_FITTED_S: f64 = 2.0;

/// Diagnoses `recording` against `model`, read from `model_file`.
pub fn diagnose(
    recording: &Recording,
    model: &Model,
    model_file: &Path,
    seed: u64,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    diagnose_without(&[], recording, model, model_file, seed, progress)
}

/// The same with some kinds taken out of the catalogue: what the tool says of physics it does not know.
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

/// The same under chosen settings.
pub fn diagnose_under(
    settings: &Settings,
    recording: &Recording,
    model: &Model,
    model_file: &Path,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    if is_slow(recording, model) {
        return attitudes::diagnose(settings, recording, (model, model_file), progress);
    }
    progress("aligning the channels");
    let streams = Streams::align(recording, model)?;
    let again = || Streams::align(recording, model);
    let of = (model, model_file);
    diagnose_streams(settings, (streams, &again), of, progress)
}

/// The same on aligned channels, so that the recording's own tables need not stay in memory.
///
/// # Inputs
/// `again`: aligns the channels once more, for the older stages behind the new engine.
pub fn diagnose_streams(
    settings: &Settings,
    (streams, again): (Streams, &dyn Fn() -> Result<Streams, InputError>),
    (model, model_file): (&Model, &Path),
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let mut streams = streams;
    let asked = settings.of_new_engine();
    let put_right = put_right::put_right(&asked, &mut streams, model, model_file)?;
    let Some(put_right) = put_right else {
        return diagnose_in_order(settings, (streams, again), (model, model_file), progress);
    };
    let again = || {
        let mut streams = again()?;
        put_right.apply(&mut streams);
        Ok(streams)
    };
    let of = (model, model_file);
    let mut outcome = diagnose_in_order(settings, (streams, &again), of, progress)?;
    put_right.report(&mut outcome);
    Ok(outcome)
}

/// The same where gyros and reference mean the same axes.
fn diagnose_in_order(
    settings: &Settings,
    (streams, again): (Streams, &dyn Fn() -> Result<Streams, InputError>),
    (model, model_file): (&Model, &Path),
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let Settings { left_out, seed, .. } = *settings;
    let old = |streams: Streams| {
        let streams = vec![streams];
        diagnose_aligned(left_out, streams, None, model, model_file, seed, progress)
    };
    if rlg_diagnosis::at_rest::serves(&streams, model) {
        let mut still = streams;
        let found = at_rest::diagnose(settings, &mut still, (model, model_file), progress)?;
        return match found {
            Some(found) => Ok(found),
            None => old(again()?),
        };
    }
    if !rlg_diagnosis::serves(&streams, model) {
        return old(streams);
    }
    let mut qualified = streams;
    let faults = qualify::unknown_faults(&mut qualified, &model.effects);
    let of = (model, model_file);
    let found = rlg_diagnosis::diagnose::diagnose_also(
        &settings.of_new_engine(),
        &mut qualified,
        &faults,
        of,
        progress,
        |_, found| rlg_force::reference::measured_noise(&found.motion),
    )?;
    let Some((mut found, reference_noise)) = found else {
        return old(again()?);
    };
    let lines = data_words::lines(&qualified, &faults);
    found.diagnosis.summary.extend(lines);
    let asked = rlg_force::Asked {
        model,
        effects: &found.model.effects.clone(),
        reference_noise,
        left_out,
        open: &[],
        plan: settings.of_force(),
    };
    beside::add_force(&qualified, &asked, &mut found, progress);
    Ok(found)
}

/// The motion of aligned channels under a model.
fn derive(streams: Streams, model: &Model) -> Scene {
    let mut scene = Scene::new(streams, reference_noise(model), model.gyro.scale_error);
    // A matrix without an inverse is refused with the residual.
    if let Some(inverse) = residual::body_from_sensing(&model.gyro.installation_rad).try_inverse() {
        scene.sensing_from_body = inverse;
    }
    scene
}

/// The same on the channels of one or several recordings, aligned before, so that the recordings' own tables need not
/// stay in memory. Pieces that are marked so are held out as a whole. Where they are stretches of one recording longer
/// than memory, `blocks` are sums over all its rows.
pub fn diagnose_aligned(
    left_out: &[&str],
    aligned: Vec<Streams>,
    blocks: Option<&Blocks>,
    model: &Model,
    model_file: &Path,
    seed: u64,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    progress("qualifying the data");
    let qualified = aligned
        .into_iter()
        .map(|mut streams| {
            let mut faults = qualify::qualify(&mut streams);
            if !faults.is_empty() {
                streams.stand_still_again(model);
            }
            faults.retain(|fault| !qualify::is_known(fault, &streams, &model.effects));
            (streams, faults)
        })
        .collect();
    let (streams, faults) = pieces::join(qualified)?;
    let mut names: Vec<&str> = streams.pieces.iter().map(|one| &*one.recording).collect();
    names.dedup();
    let recording = names.join(" + ");
    let rate_hz = streams.rate_hz;
    let lattice = Lattice::of(&streams, model, &|_| true);
    let declared = lattice.beside(declared_noise(model, rate_hz));
    let Some(cut) = Cut::of(&streams, Part::End) else {
        return Ok(Outcome {
            diagnosis: explain::unusable(
                &recording,
                seed,
                "fewer than two seconds of rows with all channels measured",
                faults
                    .iter()
                    .map(|fault| entries::fault_entry(&streams, fault))
                    .collect(),
            ),
            model: model.clone(),
            pictures: None,
        });
    };
    progress("deriving the motion");
    let mut scene = derive(streams, model);
    let before_rad = residual::residual_rad(&scene, model, model_file)?;
    wiring::check(&scene, &before_rad, &recording, model_file)?;

    let given = Given {
        left_out,
        recording: &recording,
        faults: &faults,
        lattice: &lattice,
        declared: &declared,
        blocks,
        model,
        model_file,
        seed,
    };
    let found = look(&mut scene, &before_rad, cut, &given, progress)?;
    let again = split::can_be_cut_otherwise(&scene.streams)
        && !found.diagnosis.verdict.is_told()
        && found.diagnosis.trials < MOST_TRIALS;
    let Some(cut) = again
        .then(|| Cut::of(&scene.streams, Part::Inside))
        .flatten()
    else {
        return Ok(found);
    };
    // What acts at the end of every stretch, as in a sweep, was held out whole.
    let stage = |stage: &str| progress(&format!("held out otherwise: {stage}"));
    let otherwise = look(&mut scene, &before_rad, cut, &given, &stage)?;
    let trials = found.diagnosis.trials + otherwise.diagnosis.trials;
    let explains = otherwise.diagnosis.verdict == Verdict::Explained;
    let mut best = if explains { otherwise } else { found };
    best.diagnosis.trials = trials;
    Ok(best)
}
