//! References slower than the gyros: attitudes at any rate, down to one before and one after a motion. The road:
//!
//! samples, own_motion → path → align → record → cut → levels (whiten) → bench → hunt → judge → words
//!
//! Enters: gyros at their rate and `reference_attitude`, or `reference_increment` on a clock of its own; the model.
//! Leaves: [`Outcome`], in the types and words of the diagnosis on rows, whose catalogue, selection and invariance
//! serve here too. The case's motion is the gyros' own; what is judged is the growth of its attitude's error.
//!
//! Deliberately not here: lever arms, a frame that travels, dither (it averages out of an attitude).

pub mod align;

pub mod bench;

pub mod cut;

pub mod spare;

pub mod hunt;

pub mod judge;

pub mod levels;

pub mod own_motion;

pub mod path;

pub mod record;

pub mod samples;

pub mod whiten;

pub mod promise;

mod words;

use std::path::Path as FilePath;

use nalgebra::{UnitQuaternion, Vector3};

use super::Outcome;
use super::entries;
use super::explain;
use super::hypotheses::{self, CATALOGUE};
use super::products::Products;
use super::qualify;
use super::residual::{body_from_sensing, residual_rad};
use super::scene::Scene;
use super::split;
use super::streams::{Streams, Triad};
use super::workbench::Parameters;
use crate::error::InputError;
use crate::model::{EffectValue, Model, MotionSource};
use crate::recording::{Clock, Quantity, Recording};

use bench::{AttitudeBench, Behind};
use levels::DeclaredLevels;
use record::{Lie, Record};
use samples::AttitudeSample;

/// Kinds that an attitude now and then cannot show, with the reason printed in `not_excluded`.
pub const NOT_SHOWN: [(&str, &str); 7] = [
    ("dither_gain", AVERAGES_OUT),
    ("dither_delay", AVERAGES_OUT),
    ("dither_cubic", AVERAGES_OUT),
    ("dither_crosstalk", AVERAGES_OUT),
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

const AVERAGES_OUT: &str =
    "the dither swings hundreds of times between two attitudes and averages out of them";

/// Whether the recording's only reference is slower than the gyros, or on a clock of its own.
pub fn is_slow(recording: &Recording, model: &Model) -> bool {
    if model.motion != MotionSource::Reference {
        return false;
    }
    let gyro = [
        Quantity::GyroCount,
        Quantity::GyroIncrement,
        Quantity::GyroRate,
    ]
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
                /// Closer than this share of a row, two clocks are the same clock (streams.rs).
                const SAME_ROW: f64 = 0.01;
                let drift = (own_hz - rate_hz) / rate_hz * gyro.rows as f64;
                let offset = (own_s - start_s) * rate_hz;
                drift.abs() >= SAME_ROW || (offset - offset.round()).abs() >= SAME_ROW
            }
            _ => samples::has_attitude(recording),
        },
        _ => samples::has_attitude(recording),
    }
}

/// Everything before the search: the gyros' own motion beside the samples.
struct Prepared {
    scene: Scene,
    faults: Vec<qualify::Fault>,
    samples: Vec<AttitudeSample>,
    increments_rad: Triad,
    lie: Lie,
    declared: DeclaredLevels,
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
    let before = record_of(&prepared, model, &prepared.lie);
    progress("looking for the reference's clock");
    let lie = align(&prepared, &before, model, &parameters);
    let moved;
    let record = match &lie {
        None => &before,
        Some(lie) => {
            moved = record_of(&prepared, model, lie);
            &moved
        }
    };
    let regimes = split::split(streams).regimes;
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
    let nearer = relinearised(&prepared, model, record, lie.as_ref(), &catch);
    let mut record = record;
    if let Some(nearer) = &nearer {
        progress("once more from what was found");
        (bench, catch) = run(nearer)?;
        record = nearer;
    }

    progress("validating on what was held out");
    Ok(words::Told {
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
    .outcome(catch))
}

fn prepare(
    recording: &Recording,
    model: &Model,
    model_file: &FilePath,
    progress: &dyn Fn(&str),
) -> Result<Prepared, InputError> {
    progress("aligning the channels");
    let samples = samples::slow_samples(recording)?;
    let mut streams = Streams::align_without_reference(recording, model)?;
    let from_sensing = body_from_sensing(&model.gyro.installation_rad);
    own_motion::take_own_motion(&mut streams, model, &from_sensing);
    progress("qualifying the data");
    let faults: Vec<qualify::Fault> = qualify::qualify(&mut streams)
        .into_iter()
        .filter(|fault| !qualify::is_known(fault, &streams, &model.effects))
        .collect();
    progress("deriving the motion");
    let declared = declared_levels(model);
    let own_noise_rad = declared
        .gyro_white_rad2
        .iter()
        .fold(0.0, |most: f64, v| most.max(*v));
    let scene = Scene::new(streams, Some(own_noise_rad.sqrt()), model.gyro.scale_error);
    // The clock and frame of the reference are undone exactly; everything else through its own hypothesis.
    let number = |kind: &str, name: &str| -> f64 {
        let of_kind = model.effects.iter().filter(|effect| effect.kind == kind);
        of_kind
            .filter_map(|effect| match effect.parameters.get(name) {
                Some(EffectValue::Number(value)) => Some(*value),
                _ => None,
            })
            .sum()
    };
    let lie = Lie {
        delay_s: number("reference_delay", "all"),
        turn_rad: Vector3::new(
            number("reference_misalignment", "x"),
            number("reference_misalignment", "y"),
            number("reference_misalignment", "z"),
        ),
    };
    let mut rest = model.clone();
    rest.effects.retain(|effect| {
        !matches!(
            effect.kind.as_str(),
            "reference_delay" | "reference_misalignment"
        )
    });
    // Own motion inverts the model, so what is left of the residual is what the known effects add.
    let known = residual_rad(&scene, &rest, model_file)?;
    let one_less_scale = Vector3::from(model.gyro.scale_error.map(|scale| 1.0 - scale));
    let mut increments_rad = scene.streams.case_rad.clone();
    for row in 0..scene.streams.rows {
        let sensed = Vector3::from_fn(|axis, _| one_less_scale[axis] * known[axis][row]);
        let part = from_sensing * sensed;
        for axis in 0..3 {
            increments_rad[axis][row] += part[axis];
        }
    }
    Ok(Prepared {
        scene,
        faults,
        samples,
        increments_rad,
        lie,
        declared,
    })
}

/// Noise that the model declares: pulses and pickoff are read with the gyros, gyro and reference walk at random.
fn declared_levels(model: &Model) -> DeclaredLevels {
    let squares = |kind: &str, axis: usize| -> f64 {
        let of_kind = model.effects.iter().filter(|effect| effect.kind == kind);
        of_kind
            .filter_map(
                |effect| match effect.parameters.get(super::streams::AXES[axis]) {
                    Some(EffectValue::Number(value)) => Some(value * value),
                    _ => None,
                },
            )
            .sum()
    };
    let reference = model.reference.as_ref();
    let reference_walk = reference.map_or(0.0, |reference| {
        reference.angle_random_walk_rad_sqrt_s.powi(2)
    });
    DeclaredLevels {
        walk_rad2_s: [0, 1, 2].map(|axis: usize| {
            let walk = model.gyro.angle_random_walk_rad_sqrt_s?[axis].powi(2);
            Some(walk + reference_walk + squares("angle_random_walk", axis))
        }),
        gyro_white_rad2: [0, 1, 2].map(|axis: usize| {
            let pickoff = model.dither.as_ref().map_or(0.0, |dither| {
                dither.pickoff_gain[axis] * dither.pickoff_noise_rad[axis]
            });
            let pulses = model.gyro.pulse_weight_rad[axis].powi(2) / 12.0;
            pulses + pickoff.powi(2) + squares("pulse_quantisation", axis) / 12.0
        }),
        reference_white_rad2: reference.map(|reference| reference.angle_noise_rad.powi(2)),
    }
}

/// The record at what was found: where the gyros' errors turn their attitude far, their own columns turn with it, and
/// the errors are linear in them only nearby. `None` where it makes no difference.
fn relinearised(
    prepared: &Prepared,
    model: &Model,
    record: &Record,
    lie: Option<&Lie>,
    catch: &super::hunt::Catch,
) -> Option<Record> {
    /// The square of this is below what any reference reads.
    const FAR_RAD: f64 = 2e-4;
    let scene = &prepared.scene;
    let near = record.error_rad.iter().all(|error| error.norm() < FAR_RAD);
    let linear = || {
        let chosen = catch.choice.chosen.iter();
        chosen.filter(|one| CATALOGUE[one.effect].is_linear())
    };
    if near || (linear().next().is_none() && catch.terms.is_empty()) {
        return None;
    }
    let mut sensed: Triad = [0, 1, 2].map(|_| vec![0.0; scene.streams.rows]);
    for one in linear() {
        let part = CATALOGUE[one.effect].prediction(scene, one.values.as_slice());
        for (sum, part) in sensed.iter_mut().zip(part) {
            sum.iter_mut()
                .zip(part)
                .for_each(|(sum, part)| *sum += part);
        }
    }
    for found in &catch.terms {
        let column = found.term.column(scene).ok()?;
        let sum = &mut sensed[found.term.axis];
        sum.iter_mut()
            .zip(column)
            .for_each(|(sum, slope)| *sum += found.size * slope);
    }
    let from_sensing = body_from_sensing(&model.gyro.installation_rad);
    let one_less_scale = Vector3::from(model.gyro.scale_error.map(|scale| 1.0 - scale));
    let mut increments_rad = prepared.increments_rad.clone();
    for row in 0..scene.streams.rows {
        let part = Vector3::from_fn(|axis, _| one_less_scale[axis] * sensed[axis][row]);
        let part = from_sensing * part;
        for axis in 0..3 {
            increments_rad[axis][row] -= part[axis];
        }
    }
    let mut nearer = Record::new(
        scene,
        increments_rad,
        &from_sensing,
        &prepared.samples,
        lie.unwrap_or(&prepared.lie),
        prepared.declared.gyro_white_rad2,
    );
    // Moved so that a linear solution is the whole value, not the rest of it.
    let taken = nearer.push(sensed.each_ref().map(|values| Some(values.as_slice())));
    for (error, part) in nearer.error_rad.iter_mut().zip(taken) {
        *error += part;
    }
    Some(nearer)
}

fn record_of(prepared: &Prepared, model: &Model, lie: &Lie) -> Record {
    Record::new(
        &prepared.scene,
        prepared.increments_rad.clone(),
        &body_from_sensing(&model.gyro.installation_rad),
        &prepared.samples,
        lie,
        prepared.declared.gyro_white_rad2,
    )
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
            CATALOGUE[effect].missing(scene).is_none()
                && (kind != "earth_rate" || !model.earth_rate_in_reference)
                && !left_out.contains(&kind)
                && !NOT_SHOWN.iter().any(|(hidden, _)| *hidden == kind)
                && !is_behind(kind)
        })
        .collect()
}

/// How a reference lies that lies far off: searched coarsely, then by Gauss–Newton with the gyros' plain errors free.
fn align(
    prepared: &Prepared,
    before: &Record,
    model: &Model,
    parameters: &Parameters,
) -> Option<Lie> {
    /// Gauss–Newton steps; the coarse search ends within a few milliseconds, from which three suffice.
    const STEPS: usize = 4;
    let streams = &prepared.scene.streams;
    let turned_back = UnitQuaternion::from_scaled_axis(-prepared.lie.turn_rad);
    let as_modelled: Vec<AttitudeSample> = prepared
        .samples
        .iter()
        .map(|sample| AttitudeSample {
            time_s: sample.time_s - prepared.lie.delay_s,
            navigation_from_body: sample.navigation_from_body * turned_back,
            ..*sample
        })
        .collect();
    let found = align::coarse(
        &before.path,
        &as_modelled,
        &streams.usable,
        streams.rate_hz,
        prepared.scene.motion_edge_hz,
    )?;
    let far_turn = found.turn_rad != Vector3::zeros();
    let far_delay = found.delay_s != 0.0;
    // The reference reads C R; the model's turn was undone on its right, so what was found stands on its left.
    let compose = |more: &Vector3<f64>, base: &Vector3<f64>| {
        (UnitQuaternion::from_scaled_axis(*more) * UnitQuaternion::from_scaled_axis(*base))
            .scaled_axis()
    };
    let mut lie = prepared.lie;
    lie.delay_s += found.delay_s;
    if far_turn {
        lie.turn_rad = compose(&found.turn_rad, &lie.turn_rad);
    }
    let plain: Vec<usize> = ["gyro_bias", "gyro_scale", "installation"]
        .iter()
        .filter_map(|kind| hypotheses::find(kind).map(|(effect, _)| effect))
        .collect();
    for _ in 0..STEPS {
        let record = record_of(prepared, model, &lie);
        let whole = cut::cut(&record, split::split(streams).regimes, &cut::last_part).fitted;
        if whole.is_empty() {
            return None;
        }
        let levels = prepared.declared.plain();
        let mut bench =
            AttitudeBench::new(&prepared.scene, &record, parameters, whole, levels, &plain);
        bench.levels = levels::first(&prepared.declared, &bench);
        if far_delay {
            bench.stand_behind(Behind::Delay).ok()?;
        }
        if far_turn {
            for axis in 0..3 {
                bench.stand_behind(Behind::Turn(axis)).ok()?;
            }
        }
        let (values, _) = hunt::fit(&bench, parameters, &plain);
        let mut more = Vector3::zeros();
        for (behind, (_, value)) in bench.behind().zip(
            values
                .iter()
                .filter(|(index, _)| *index >= parameters.count()),
        ) {
            match behind {
                Behind::Delay => lie.delay_s += value,
                Behind::Turn(axis) => more[*axis] = *value,
                Behind::Term(_) => {}
            }
        }
        if far_turn {
            lie.turn_rad = compose(&more, &lie.turn_rad);
        }
    }
    Some(lie)
}
