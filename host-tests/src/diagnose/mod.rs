//! The mismatch tool. The road, in order; each stage is a file that can be read and tested alone:
//!
//! declare → streams → qualify → scene (motion, signals) → residual → split → portion → noise, pulses → locate →
//! hypotheses → workbench → select (weigh), hunt (events, products, invariance, drift), shapes, local → self_test →
//! contradiction → identify → validate → explain
//!
//! Gyros that count coarse pulses without a dither are read first of all (lattice): what their pulses hide is no finding.
//!
//! Of a recording longer than memory stretches take this road, and sums over blocks of all its rows stand beside the
//! workbench (long, blocks). A reference slower than the gyros takes the same road over its attitudes (attitude/).
//!
//! At rest on the Earth (still) the motion is known without a reference: clock, cycle and lines come before the
//! hunt, and control repeats them on shuffled rows. Where there are accelerometers, the same road is gone for
//! them (accelerometer).
//!
//! Enters: a recording and the model that predicts it. Leaves: [`Outcome`]. Nothing here reads truth files or
//! imports the simulator.

pub mod declare;

pub mod pieces;

pub mod long;

pub mod streams;

mod channels;

mod unmeasured;

pub mod qualify;

mod outliers;

pub mod transforms;

pub mod motion;

pub mod scene;

pub mod signals;

pub mod residual;

pub mod split;

pub mod portion;

pub mod regressor;

pub mod levels;

mod declared;

pub mod noise;

pub mod pulses;

pub mod locate;

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

pub mod attitude;

pub mod still;

pub mod lines;

pub mod clock;

pub mod cycle;

pub mod control;

pub mod rows_found;

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

pub mod lattice;

pub mod readings;

pub mod timing;

pub mod excess;

pub mod wandering;

pub mod accelerometer;

pub mod identify;

pub mod validate;

pub mod contradiction;

pub mod self_test;

pub mod result;

pub mod explain;

mod entries;

mod doubt;

mod figures;

mod explained_model;

mod sentences;

mod still_words;

pub mod pictures;

pub use declared::{declared_noise, own_noise, reference_noise};

use std::path::Path;

use crate::error::InputError;
use crate::model::Model;
use crate::recording::Recording;

use blocks::Blocks;
use empirical::{Form, Term};
use hypotheses::{CATALOGUE, Subject, is_left, no_effects};
use lattice::Lattice;
use noise::Noise;
use portion::Portion;
use products::Products;
use scene::Scene;
use streams::Streams;
use workbench::{Parameters, Workbench};

/// Everything a diagnosis leaves behind.
pub struct Outcome {
    /// `diagnosis.json`.
    pub diagnosis: result::Diagnosis,
    /// The model with the found effects switched on.
    pub model: Model,
    /// What the report draws; absent where the recording was too short to say anything.
    pub pictures: Option<pictures::Pictures>,
}

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
    if attitude::is_slow(recording, model) {
        return attitude::diagnose(left_out, recording, model, model_file, seed, progress);
    }
    progress("aligning the channels");
    let streams = vec![Streams::align(recording, model)?];
    diagnose_aligned(left_out, streams, None, model, model_file, seed, progress)
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
            faults.retain(|fault| !qualify::is_known(fault, &streams, &model.effects));
            (streams, faults)
        })
        .collect();
    let (streams, faults) = pieces::join(qualified)?;
    let mut names: Vec<&str> = streams.pieces.iter().map(|one| &*one.recording).collect();
    names.dedup();
    let recording = names.join(" + ");
    let rate_hz = streams.rate_hz;
    let lattice = Lattice::of(&streams, model);
    let declared = lattice.beside(declared_noise(model, rate_hz));
    let split = split::split(&streams);
    let Some(portion) = Portion::new(split.fitted.clone(), rate_hz)
        .map(|portion| portion.within(streams.band_hz()))
        .filter(|portion| portion.seconds() >= LEAST_FITTED_S)
    else {
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

    progress("forming the regressors");
    let parameters = Parameters::of_catalogue();
    let candidates: Vec<usize> = (0..CATALOGUE.len())
        .filter(|&effect| CATALOGUE[effect].subject() == Subject::Gyros)
        .filter(|&effect| CATALOGUE[effect].missing(&scene).is_none())
        .filter(|&effect| {
            CATALOGUE[effect].card().kind != "earth_rate" || !model.earth_rate_in_reference
        })
        .filter(|&effect| is_left(effect, left_out))
        .filter(|&effect| {
            let kind = CATALOGUE[effect].card().kind;
            blocks.is_none() || long::NOT_TRIED.iter().all(|(not, _)| *not != kind)
        })
        .filter(|&effect| {
            scene.streams.at_rest.is_none() || still::KINDS.contains(&CATALOGUE[effect].card().kind)
        })
        .collect();
    let mut bench = Workbench::new(
        &scene,
        &before_rad,
        &parameters,
        portion,
        [Noise::unit(rate_hz); 3],
        &candidates,
        &no_effects(),
    );
    if let Some(blocks) = blocks {
        bench.stand_beside(blocks);
    }
    progress("fitting the noise");
    bench.refit_noise(&candidates, &declared, true);
    bench.allow_for(pulses::in_step(&bench, &parameters));

    let unusable = |problem| InputError::new(model_file, problem);
    let (mut rows_found, given) = match scene.streams.at_rest {
        None => Default::default(),
        Some(_) => {
            let given = rows_found::Given {
                parameters: &parameters,
                candidates: &candidates,
                declared: &declared,
                split: &split,
                model,
                seed,
            };
            rows_found::search(&mut bench, &given, progress).map_err(unusable)?
        }
    };

    let products = Products::new(&scene);
    let mut catch = readings::best(
        &mut bench,
        &readings::Hunt {
            parameters: &parameters,
            candidates: &candidates,
            declared: &declared,
            regimes: &split.regimes,
            products: &products,
            given: &given,
            lattice: &lattice,
        },
        progress,
    )
    .map_err(unusable)?;
    if scene.streams.at_rest.is_none() {
        progress("looking where the unlisted acts");
        local::confine(
            &mut bench,
            &parameters,
            &declared,
            &split.regimes,
            &mut catch,
        )
        .map_err(unusable)?;
    }

    if let Some(rest) = &scene.streams.at_rest {
        rest.widen(&mut catch.choice.chosen);
    }

    progress("sliding and injecting");
    let self_test = self_test::self_test(&bench, &parameters, &candidates, &catch, seed);

    progress("settling events");
    let noise = bench.noise;
    let settled = |found: &hunt::FoundTerm| timing::is_settled(&found.term);
    let (events, others) = catch.terms.into_iter().partition(settled);
    catch.terms = others;
    let events = timing::settle(
        &scene,
        &after_rad(&scene, &before_rad, &catch),
        noise,
        &parameters,
        (events, &split),
    );
    let events = events.map_err(unusable)?.into_iter();
    catch
        .terms
        .extend(events.filter(|found| !found.is_hidden(&lattice, &scene)));

    let asked = scene.streams.at_rest.is_none() && blocks.is_none();
    let contradicted = asked && !catch.choice.chosen.is_empty() && {
        let left_rad = after_rad(&scene, &before_rad, &catch);
        let rows = (&left_rad, split.held_out.as_slice());
        contradiction::take_back(&bench, &parameters, &mut catch, rows)
    };

    let left_bins = bench.left_over(&catch.values);
    let otherwise = match scene.streams.accelerometers {
        Ok(_) => accelerometer::otherwise(&mut bench, &parameters, &candidates, &catch.choice),
        Err(_) => Vec::new(),
    };
    let portion = bench.portion;
    let given = accelerometer::Given { model, left_out };
    let mut gyros = accelerometer::Gyros {
        parameters: &parameters,
        candidates: &candidates,
        catch: &mut catch,
        otherwise,
    };
    let accelerometers = accelerometer::weigh(&mut scene, &given, &mut gyros, progress);

    progress("locating");
    let all_rows: Vec<std::ops::Range<usize>> = split
        .fitted
        .iter()
        .chain(&split.held_out)
        .cloned()
        .collect();
    let locate = |residual_rad: &streams::Triad, noise: &[Noise; 3]| {
        let tiles = locate::tiles(
            &scene.streams,
            residual_rad,
            noise,
            &split.regimes,
            &all_rows,
        );
        locate::join(&tiles, &split.regimes, &all_rows)
    };
    let mut locations = locate(&before_rad, &noise);
    let products = Products::new(&scene);
    explain::name_regimes(&mut locations, &catch, &products);
    let fitted = &split.fitted;
    coherence::accompany(
        &scene,
        &before_rad,
        &noise,
        fitted,
        &products,
        &mut locations,
    );
    let mut after_rad = after_rad(&scene, &before_rad, &catch);
    let locate_left = |after_rad: &streams::Triad, noise: &[Noise; 3]| {
        let mut left = locate(after_rad, noise);
        left.retain(|location| !lattice.hides_location(location, rate_hz));
        left
    };
    let mut left = locate_left(&after_rad, &noise);
    // What no physics explains is still modelled, as a labelled constant over its stretch of time.
    let stretches: Vec<Term> = left
        .iter()
        .filter(|location| location.band_hz.0 == 0.0 && scene.streams.at_rest.is_none())
        // A constant has no size above the band that the blocks have.
        .filter(|_| blocks.is_none())
        .map(|location| {
            let (recording, [start_s, end_s]) = scene.streams.own_span(&location.rows);
            let mut expression = format!("window({start_s:.3},{end_s:.3})");
            if scene.streams.is_joined() {
                let name = pieces::name_in_expression(recording);
                expression += &format!("*recording({name})");
            }
            Term {
                axis: location.axis,
                form: Form::Product { expression },
            }
        })
        .collect();
    if !stretches.is_empty() {
        let described = timing::describe(&scene, &after_rad, noise, &parameters, stretches);
        subtract_terms(&scene, &mut after_rad, &described);
        catch.terms.extend(described);
        left = locate_left(&after_rad, &noise);
    }

    progress("validating on what was held out");
    let mut validations = validate::validate(
        &before_rad,
        &after_rad,
        &noise,
        (&split.held_out, scene.streams.band_hz()),
        &locations,
        rate_hz,
    );
    let whole = blocks.map(|blocks| (blocks, blocks.validate(&catch.values, &noise)));
    if let Some((_, slowly)) = &whole {
        validate::drifts_of(&mut validations, slowly);
    }
    rows_found.held_out_rad_s = [&before_rad, &after_rad]
        .map(|residual_rad| rows_found::scatter_rad_s(residual_rad, &split.held_out, rate_hz));
    let compared = excess::excess(
        &excess::Left {
            scene: &scene,
            regimes: &split.regimes,
            portion: &portion,
            bins: &left_bins,
            noise: &noise,
        },
        &declared,
    );
    if compared.own != noise {
        left = locate_left(&after_rad, &compared.own);
    }
    let mut excess = compared.found;
    lattice.take_over(&mut excess, (&portion, &left_bins, &noise), &declared);
    // Behind a soft mount the reference's own noise is compared with what the mount passes: random walk that no
    // instrument has.
    let mounted = |kind: &str| kind == "isolator_mode";
    let chosen = catch.choice.chosen.iter();
    if chosen
        .map(|one| CATALOGUE[one.effect].card().kind)
        .any(mounted)
        || model.effects.iter().any(|effect| mounted(&effect.kind))
    {
        excess.retain(|one| one.kind != "angle_random_walk");
    }
    let everything = vec![std::ops::Range {
        start: 0,
        end: scene.streams.rows,
    }];
    let tiles_after = locate::tiles(
        &scene.streams,
        &after_rad,
        &noise,
        &split.regimes,
        &everything,
    );
    let tiles_before = locate::tiles(
        &scene.streams,
        &before_rad,
        &noise,
        &split.regimes,
        &everything,
    );
    let pictures = pictures::draw(
        &scene.streams,
        &before_rad,
        &after_rad,
        &noise,
        (tiles_before, tiles_after),
        &split.held_out,
    );
    let by_recording = validate::by_recording(&scene.streams, &split, &after_rad, &noise);
    let findings = explain::Findings {
        wandering_rad_s: wandering::wandering_rad_s(&portion, &left_bins, &noise),
        recording: &recording,
        whole: whole
            .as_ref()
            .map(|(blocks, figures)| (*blocks, figures.as_slice())),
        by_recording: &by_recording,
        seed,
        scene: &scene,
        split: &split,
        noise: &noise,
        catch: &catch,
        excess: &excess,
        faults: &faults,
        locations: &locations,
        left: &left,
        validations: &validations,
        candidates: &candidates,
        rows_found: &rows_found,
        contradicted,
        self_test: Some(&self_test),
    };
    let mut outcome = Outcome {
        diagnosis: findings.diagnosis(),
        model: findings.explained_model(model),
        pictures: Some(pictures),
    };
    accelerometer::add(accelerometers, &mut outcome);
    Ok(outcome)
}

/// The residual with everything found taken out.
fn after_rad(scene: &Scene, before_rad: &streams::Triad, catch: &hunt::Catch) -> streams::Triad {
    let mut left = before_rad.clone();
    for one in &catch.choice.chosen {
        let prediction = CATALOGUE[one.effect].prediction(scene, one.values.as_slice());
        streams::add_triad(&mut left, &prediction, -1.0);
    }
    subtract_terms(scene, &mut left, &catch.terms);
    left
}

/// Takes found terms out of a residual.
fn subtract_terms(scene: &Scene, left: &mut streams::Triad, terms: &[hunt::FoundTerm]) {
    for found in terms {
        if let Ok(column) = found.term.column(scene) {
            streams::add(&mut left[found.term.axis], &column, -found.size);
        }
    }
}
