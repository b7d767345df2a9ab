//! The older stages of the diagnosis, for recordings longer than memory ([`long`]). In order:
//!
//! declare → streams → qualify → scene (motion, signals) → residual → split → portion → noise, pulses → locate →
//! hypotheses → workbench → select (weigh), hunt (events, products, invariance, drift), shapes, local → self_test →
//! contradiction → identify → validate → explain
//!
//! From the split on it is one file (look), gone again with other rows held out where something is left to explain. Sums over
//! blocks of all rows stand beside the workbench (blocks).
//!
//! Enters: stretches of a recording, and sums over its rows. Leaves: [`Outcome`]. Nothing here reads truth files or
//! imports the simulator.

pub mod declare;

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

mod beside;

pub use declared::{declared_noise, own_noise, reference_noise};
pub use rlg_diagnosis::{Outcome, lattice, locate, pictures, portion, regressor, split, validate};
pub use rlg_findings::result;
pub use rlg_signal::{pieces, qualify, streams};

use std::path::Path;

use rlg_model::Model;
use rlg_recording::error::InputError;

use blocks::Blocks;
use lattice::Lattice;
use look::{Cut, Given, look};
use result::{Diagnosis, Verdict};
use scene::Scene;
use split::Part;
use streams::Streams;

/// A search that tried more than this has looked for long enough: it is not repeated on other rows.
const MOST_TRIALS: usize = 4000;

/// Least seconds of usable rows to fit on: below this not even the noise is known.
const LEAST_FITTED_S: f64 = 2.0;

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
            diagnosis: Diagnosis {
                effects: faults
                    .iter()
                    .map(|fault| entries::fault_entry(&streams, fault))
                    .collect(),
                ..Diagnosis::unusable(
                    &recording,
                    seed,
                    "fewer than two seconds of rows with all channels measured",
                )
            },
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
