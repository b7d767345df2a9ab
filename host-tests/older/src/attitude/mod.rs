//! References slower than the gyros: attitudes at any rate, down to one before and one after a motion. The road:
//!
//! samples, own_motion (prepare) → path → align, lie → record → cut → levels (whiten) → bench → hunt → judge → words →
//! gravity (accelerometer/)
//!
//! Enters: gyros at their rate and `reference_attitude`, or `reference_increment` on a clock of its own; the model.
//! Leaves: [`Outcome`], in the types and words of the diagnosis on rows, whose catalogue, selection and invariance
//! serve here too. The case's motion is the gyros' own; what is judged is the growth of its attitude's error.
//!
//! Deliberately not here: lever arms, a frame that travels.

pub mod align;

mod lie;

pub mod bench;

pub mod cut;

pub mod spare;

pub mod hunt;

pub mod judge;

pub mod levels;

pub mod own_motion;

pub mod path;

mod gravity;

mod prepare;

pub mod record;

pub use rlg_signal::attitude_samples as samples;

pub mod whiten;

pub mod promise;

mod words;

use std::path::Path as FilePath;

use super::Outcome;
use super::accelerometer::{self, Given};
use super::entries;
use super::explain;
use super::hypotheses::{CATALOGUE, Subject, is_left};
use super::products::Products;
use super::scene::Scene;
use super::split;
use super::workbench::Parameters;
use rlg_model::{Model, MotionSource};
use rlg_recording::error::InputError;
use rlg_recording::{Clock, Quantity, Recording};
use rlg_signal::channels::SAME_ROW;

use bench::Behind;
use prepare::prepare;

/// Kinds that an attitude now and then cannot show, with the reason printed in `not_excluded`.
pub const NOT_SHOWN: [(&str, &str); 3] = [
    (
        "reference_scale",
        "an attitude reference cannot tell it from gyro_scale, with which it is reported",
    ),
    (
        "reference_harmonic",
        "needs the table's angle row by row, and the reference is slower than the gyros",
    ),
    (
        "isolator_mode",
        "needs the reference's motion row by row, and the reference is slower than the gyros",
    ),
];

/// Whether the recording's only reference is slower than the gyros, or on a clock of its own.
pub fn is_slow(recording: &Recording, model: &Model) -> bool {
    if model.motion != MotionSource::Reference {
        return false;
    }
    let gyro = Quantity::GYROS
        .iter()
        .find_map(|quantity| recording.channel(quantity, "x"));
    let reference = recording.channel(&Quantity::ReferenceIncrement, "x");
    match (gyro, reference) {
        (Some((gyro, _)), Some((reference, _))) => match (&gyro.clock, &reference.clock) {
            (
                Clock::Uniform { rate_hz, start_s },
                Clock::Uniform {
                    rate_hz: own_hz,
                    start_s: own_s,
                },
            ) => {
                let drift = (own_hz - rate_hz) / rate_hz * gyro.rows as f64;
                let offset = (own_s - start_s) * rate_hz;
                drift.abs() >= SAME_ROW || (offset - offset.round()).abs() >= SAME_ROW
            }
            _ => samples::has_attitude(recording),
        },
        _ => samples::has_attitude(recording),
    }
}

/// Diagnoses a recording with a slow reference.
pub fn diagnose(
    left_out: &[&str],
    recording: &Recording,
    model: &Model,
    model_file: &FilePath,
    seed: u64,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let prepared = prepare(recording, model, model_file, progress)?;
    let scene = &prepared.scene;
    let streams = &scene.streams;
    let parameters = Parameters::of_catalogue();
    progress("comparing attitudes");
    let before = prepared.record(model, &prepared.lie);
    progress("looking for the reference's clock");
    let lie = lie::settle(&prepared, &before, model, &parameters);
    let moved;
    let record = match &lie {
        None => &before,
        Some(lie) => {
            moved = prepared.record(model, lie);
            &moved
        }
    };
    let regimes = split::split(streams, split::Part::End).regimes;
    let (far_delay, far_turn) = lie.map_or((false, false), |lie| {
        (
            lie.delay_s != prepared.lie.delay_s,
            lie.turn_rad != prepared.lie.turn_rad,
        )
    });
    let candidates = candidates(scene, model, left_out, far_delay, far_turn);
    let spare = |steps: &[usize]| {
        let levels = prepared.declared.plain();
        spare::spare(scene, record, &parameters, &candidates, &levels, steps)
    };
    let cut = cut::cut(record, regimes.clone(), &spare);
    // A clock that was looked for had samples enough to hold out a part of every regime.
    let cut_before = match &lie {
        None => cut.clone(),
        Some(_) => cut::cut(&before, regimes, &cut::last_part),
    };
    let unusable = |why: &str| Outcome {
        diagnosis: explain::unusable(
            &recording.name,
            seed,
            why,
            prepared
                .faults
                .iter()
                .map(|fault| entries::fault_entry(streams, fault))
                .collect(),
        ),
        model: model.clone(),
        pictures: None,
    };
    if cut.fitted.is_empty() {
        return Ok(unusable(
            "no two attitudes with gyros measured all the way between them",
        ));
    }
    let degrees: usize = cut.fitted.iter().map(|run| 3 * (run.len() - 1)).sum();
    if degrees < levels::ENOUGH && prepared.declared.walk_rad2_s.contains(&None) {
        return Err(InputError::new(
            model_file,
            "does not state the gyros' random walk, which so few attitudes cannot show",
        )
        .channel("gyro.angle_random_walk_rad_sqrt_s")
        .expected("three numbers in rad/sqrt(s)"));
    }

    progress("forming the regressors");
    let products = Products::new(scene);
    let search = hunt::Hunt {
        parameters: &parameters,
        candidates: &candidates,
        declared: &prepared.declared,
        cut: &cut,
        products: &products,
    };
    let mut behind = Vec::new();
    if far_delay {
        behind.push(Behind::Delay);
    }
    if far_turn {
        behind.extend([0, 1, 2].map(Behind::Turn));
    }
    let run = |record| {
        search
            .run(scene, record, &behind, progress)
            .map_err(|problem| InputError::new(model_file, problem))
    };
    let (mut bench, mut catch) = run(record)?;
    let nearer = prepare::relinearised(&prepared, model, record, lie.as_ref(), &catch);
    let mut record = record;
    if let Some(nearer) = &nearer {
        progress("once more from what was found");
        (bench, catch) = run(nearer)?;
        record = nearer;
    }

    let errors = gravity::Errors::of(&catch, &prepared.samples);
    progress("validating on what was held out");
    let mut outcome = words::Told {
        recording,
        model,
        seed,
        prepared: &prepared,
        before: (&before, &cut_before),
        after: (record, &cut),
        lie: lie.as_ref(),
        bench: &bench,
        parameters: &parameters,
        candidates: &candidates,
        products: &products,
    }
    .outcome(catch);
    let found = errors.and_then(|errors| {
        let model = &gravity::without_reference(model);
        let mut scene = gravity::carried(prepared, model, &errors)?;
        let given = Given {
            model,
            left_out,
            held_out: split::Part::End,
        };
        accelerometer::weigh_alone(&mut scene, &given, &parameters, progress)
    });
    accelerometer::add(found, &mut outcome);
    Ok(outcome)
}

/// The effects to try.
fn candidates(
    scene: &Scene,
    model: &Model,
    left_out: &[&str],
    far_delay: bool,
    far_turn: bool,
) -> Vec<usize> {
    let is_behind = |kind: &str| {
        (kind == "reference_delay" && far_delay) || (kind == "reference_misalignment" && far_turn)
    };
    (0..CATALOGUE.len())
        .filter(|&effect| {
            let kind = CATALOGUE[effect].card().kind;
            CATALOGUE[effect].subject() == Subject::Gyros
                && CATALOGUE[effect].missing(scene).is_none()
                && (kind != "earth_rate" || !model.earth_rate_in_reference)
                && is_left(effect, left_out)
                && !NOT_SHOWN.iter().any(|(hidden, _)| *hidden == kind)
                && !is_behind(kind)
        })
        .collect()
}
