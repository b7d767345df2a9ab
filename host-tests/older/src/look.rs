//! The road from the regressors to the result, on one cut of the rows.
//!
//! Enters: the scene, the residual before anything is explained, which rows are fitted and which held out. Leaves:
//! [`Outcome`]. The scene keeps nothing of it.

use std::path::Path;

use super::blocks::Blocks;
use super::empirical::{Form, Term};
use super::hypotheses::{CATALOGUE, earth_rate, is_left, no_effects};
use super::lattice::Lattice;
use super::noise::{Declared, Noise};
use super::portion::Portion;
use super::products::Products;
use super::qualify::Fault;
use super::scene::Scene;
use super::split::{self, Part, Split};
use super::streams::{self, Streams};
use super::workbench::{Parameters, Workbench};
use super::{LEAST_FITTED_S, Outcome};
use super::{
    beside, coherence, contradiction, excess, explain, hunt, local, locate, long, pictures, pieces,
    pulses, readings, self_test, timing, validate, wandering,
};
use rlg_model::Model;
use rlg_recording::error::InputError;
/// What is fitted and what is held out, where there is enough to fit on.
pub(super) struct Cut {
    split: Split,
    portion: Portion,
}

impl Cut {
    pub(super) fn of(streams: &Streams, held_out: Part) -> Option<Self> {
        let split = split::split(streams, held_out);
        let portion = Portion::new(split.fitted.clone(), streams.rate_hz)?;
        let portion = portion.within(streams.band_hz());
        (portion.seconds() >= LEAST_FITTED_S).then_some(Self { split, portion })
    }
}

/// What does not change with the rows that are fitted.
pub(super) struct Given<'a> {
    /// Kinds taken out of the catalogue.
    pub(super) left_out: &'a [&'a str],
    /// Name of the recording, or names of several.
    pub(super) recording: &'a str,
    /// Faults of the data.
    pub(super) faults: &'a [Fault],
    /// What counters without a dither hide.
    pub(super) lattice: &'a Lattice,
    /// Noise as the model declares it.
    pub(super) declared: &'a [Declared; 3],
    /// Of a recording longer than memory, sums over all its rows.
    pub(super) blocks: Option<&'a Blocks>,
    /// The model that was diagnosed.
    pub(super) model: &'a Model,
    /// Where it was read.
    pub(super) model_file: &'a Path,
    /// Of the self-test.
    pub(super) seed: u64,
}

/// Locates, explains and proves, on one cut of the rows.
pub(super) fn look(
    scene: &mut Scene,
    before_rad: &streams::Triad,
    Cut { split, portion }: Cut,
    given: &Given,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let Given {
        left_out,
        recording,
        faults,
        lattice,
        declared,
        blocks,
        model,
        model_file,
        seed,
    } = *given;
    let rate_hz = scene.streams.rate_hz;
    progress("forming the regressors");
    let parameters = Parameters::of_catalogue();
    let lacks_earth = !model.earth_rate_in_reference || earth_rate::is_left(scene, before_rad);
    let candidates: Vec<usize> = (0..CATALOGUE.len())
        .filter(|&effect| CATALOGUE[effect].missing(scene).is_none())
        .filter(|&effect| CATALOGUE[effect].card().kind != "earth_rate" || lacks_earth)
        .filter(|&effect| is_left(effect, left_out))
        .filter(|&effect| {
            let kind = CATALOGUE[effect].card().kind;
            blocks.is_none() || long::NOT_TRIED.iter().all(|(not, _)| *not != kind)
        })
        .collect();
    let mut bench = Workbench::new(
        scene,
        before_rad,
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
    bench.refit_noise(&candidates, declared, true);
    bench.allow_for(pulses::in_step(&bench, &parameters));

    let unusable = |problem| InputError::new(model_file, problem);
    let products = Products::new(scene);
    let mut catch = readings::best(
        &mut bench,
        &readings::Hunt {
            parameters: &parameters,
            candidates: &candidates,
            declared,
            regimes: &split.regimes,
            products: &products,
            given: &[],
            lattice,
        },
        progress,
    )
    .map_err(unusable)?;
    if scene.streams.at_rest.is_none() {
        progress("looking where the unlisted acts");
        local::confine(
            &mut bench,
            &parameters,
            declared,
            &split.regimes,
            &mut catch,
        )
        .map_err(unusable)?;
    }

    progress("sliding and injecting");
    let self_test = self_test::self_test(&bench, &parameters, &candidates, &catch, seed);

    progress("settling events");
    let noise = bench.noise;
    let settled = |found: &hunt::FoundTerm| timing::is_settled(&found.term);
    let (events, others) = catch.terms.into_iter().partition(settled);
    catch.terms = others;
    let events = timing::settle(
        scene,
        &after_rad(scene, before_rad, &catch),
        noise,
        &parameters,
        (events, &split),
    );
    let events = events.map_err(unusable)?.into_iter();
    catch
        .terms
        .extend(events.filter(|found| !found.is_hidden(lattice, scene)));

    let asked = scene.streams.at_rest.is_none() && blocks.is_none();
    let contradicted = asked && !catch.choice.chosen.is_empty() && {
        let left_rad = after_rad(scene, before_rad, &catch);
        let rows = (&left_rad, split.held_out.as_slice());
        contradiction::take_back(&bench, &parameters, &mut catch, rows)
    };

    let left_bins = bench.left_over(&catch.values);
    let portion = bench.portion;
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
    let mut locations = locate(before_rad, &noise);
    let products = Products::new(scene);
    explain::name_regimes(&mut locations, &catch, &products);
    let fitted = &split.fitted;
    coherence::accompany(scene, before_rad, &noise, fitted, &products, &mut locations);
    let mut after_rad = after_rad(scene, before_rad, &catch);
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
        let described = timing::describe(scene, &after_rad, noise, &parameters, stretches);
        subtract_terms(scene, &mut after_rad, &described);
        catch.terms.extend(described);
        left = locate_left(&after_rad, &noise);
    }

    progress("validating on what was held out");
    let mut validations = validate::validate(
        before_rad,
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
    let compared = excess::excess(
        &excess::Left {
            scene,
            regimes: &split.regimes,
            portion: &portion,
            bins: &left_bins,
            noise: &noise,
        },
        declared,
    );
    if compared.own != noise {
        left = locate_left(&after_rad, &compared.own);
    }
    let mut excess = compared.found;
    excess.retain(|one| !left_out.contains(&one.kind));
    lattice.take_over(&mut excess, &|axis| {
        let known =
            declared[axis].white_angle.unwrap_or_default() - lattice.unknown_rad2(axis) / 12.0;
        Some(
            0.5 * super::noise::ratio_over_level(
                &portion,
                &left_bins[axis],
                &noise[axis],
                1,
                known,
            ),
        )
    });
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
        before_rad,
        &noise,
        &split.regimes,
        &everything,
    );
    let pictures = pictures::draw(
        &scene.streams,
        before_rad,
        &after_rad,
        &noise,
        (tiles_before, tiles_after),
        &split.held_out,
    );
    let by_recording = validate::by_recording(&scene.streams, &split, &after_rad, &noise);
    let findings = explain::Findings {
        wandering_rad_s: wandering::wandering_rad_s(&portion, &left_bins, &noise),
        recording,
        whole: whole
            .as_ref()
            .map(|(blocks, figures)| (*blocks, figures.as_slice())),
        by_recording: &by_recording,
        seed,
        scene,
        split: &split,
        noise: &noise,
        catch: &catch,
        excess: &excess,
        faults,
        locations: &locations,
        left: &left,
        validations: &validations,
        candidates: &candidates,
        lattice,
        contradicted,
        self_test: Some(&self_test),
    };
    let mut outcome = Outcome {
        diagnosis: findings.diagnosis(),
        model: findings.explained_model(model),
        pictures: Some(pictures),
    };
    beside::add_force_of_scene(scene, (model, left_out), &mut outcome, progress);
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
