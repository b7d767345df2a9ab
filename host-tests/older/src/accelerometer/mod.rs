//! The same road for the accelerometers: what the model leaves out of the specific force.
//!
//! rows → carried (attitude, lever arms) → vertical → felt (prediction) → residual → level (noise) → shaken (what no
//! gravity explains is left out) → search (bench, select, reach, steady, rivals, held_out) → whose (the gyros' error or their
//! reference's, and once more) → validate → words
//!
//! Enters: a recording's model, the scene of the gyros' road and what was found on it. Leaves: that, with names that gravity
//! decided, and findings to be added to its [`Outcome`]. Predicted is the force of a unit that is turned and not shaken:
//! gravity, carried by the reference, and what lever arms feel of the turning.
//!
//! At rest gravity is one number for three accelerometers: nothing is named there (words.rs says what is not).
//! Deliberately not here: unlisted expressions of the force; where no entry fits, only the location is told.

pub mod bench;

pub mod carried;

pub mod felt;

mod held_out;

pub mod level;

pub mod reach;

mod residual;

pub mod rivals;

pub use rlg_signal::accelerometer_rows as rows;

mod search;

pub mod shaken;

pub mod steady;

pub mod vertical;

mod whose;

mod words;

use std::ops::Range;

use super::explained_model::with_chosen;
use super::hypotheses::{CATALOGUE, Subject, is_left};
use super::invariance::Verdict;
use super::locate::{self, Location};
use super::noise::{Declared, Noise};
use super::portion::Portion;
use super::scene::Scene;
use super::select::Choice;
use super::split::{self, Part, Split};
use super::streams::{Streams, Triad};
use super::validate::{self, Validation};
use super::wandering::wandering_rad_s;
use super::workbench::Parameters;
use super::{LEAST_FITTED_S, Outcome};
use rlg_model::Model;

use carried::Carried;
use felt::Felt;
use level::{declared, quiet_noise};
use residual::{residual_m_s, scene_felt};
use search::{Weighed, search, settle_vertical};
use shaken::{name_shaken, without_shaken};
use vertical::Vertical;

pub use whose::{Gyros, otherwise};

/// What is given.
pub struct Given<'a> {
    /// The model that was diagnosed.
    pub model: &'a Model,
    /// Kinds taken out of the catalogue.
    pub left_out: &'a [&'a str],
    /// Which part of each stretch is held out.
    pub held_out: Part,
}

/// What the accelerometers showed.
pub struct Found {
    streams: Streams,
    noise: [Noise; 3],
    declared: [Declared; 3],
    choice: Choice,
    verdicts: Vec<Verdict>,
    vetoed: Vec<(usize, String)>,
    locations: Vec<Location>,
    left: Vec<Location>,
    validations: Vec<Validation>,
    /// By how much each wanders beyond the model's noise, where it does.
    wandering_m_s2: [Option<f64>; 3],
    /// Names of regimes left out because the case was shaken in them.
    shaken: Vec<String>,
    /// What of the recording has a known attitude \[s\], where that is not all of it.
    carried_s: Option<[f64; 2]>,
    candidates: Vec<usize>,
}

/// Weighs the accelerometers' effects, and with them what the gyros found by what gravity says of their reference. Why
/// nothing was weighed, where there is a reason.
pub fn weigh(
    scene: &mut Scene,
    given: &Given,
    gyros: &mut Gyros,
    progress: &dyn Fn(&str),
) -> Result<Found, String> {
    let own = candidates(given);
    let open = whose::open(&gyros.catch.choice, gyros.candidates);
    let both = [&own[..], &open[..]].concat();
    let parameters = gyros.parameters;
    let found =
        |gyros: &Gyros, scene: &Scene| with_chosen(given.model, gyros.catch, &scene.streams);
    let known = found(gyros, scene);
    let mut look = Look::new(scene, given, &known, (parameters, &both), progress)?;
    if !open.is_empty() {
        let (felt, maybe, instead) = whose::felt(&look.weighed, &open);
        let weighed = (&look.weighed, &look.split);
        let mut changed = false;
        if !maybe.is_empty()
            && let Some(said) = whose::said(scene, weighed, gyros, (&open, &instead))
        {
            let all = [&felt[..], &maybe].concat();
            changed = whose::decide(gyros, &said, (&all, false), &open, weighed.0);
        }
        if !changed && let Some(said) = whose::said(scene, weighed, gyros, (&open, &[])) {
            changed = whose::decide(gyros, &said, (&felt, true), &open, weighed.0);
        }
        if changed || !felt.is_empty() {
            let known = found(gyros, scene);
            look = Look::new(scene, given, &known, (parameters, &own), progress)?;
        }
    }
    Ok(look.found(scene, own))
}

/// Weighs the accelerometers' effects alone, in a scene whose motion has no error that is known.
pub fn weigh_alone(
    scene: &mut Scene,
    given: &Given,
    parameters: &Parameters,
    progress: &dyn Fn(&str),
) -> Result<Found, String> {
    let own = candidates(given);
    let look = Look::new(scene, given, given.model, (parameters, &own), progress)?;
    Ok(look.found(scene, own))
}

/// The accelerometers' effects that are asked about.
fn candidates(given: &Given) -> Vec<usize> {
    (0..CATALOGUE.len())
        .filter(|&effect| CATALOGUE[effect].subject() == Subject::Accelerometers)
        .filter(|&effect| is_left(effect, given.left_out))
        .collect()
}

/// One look at the accelerometers under one attitude.
struct Look {
    streams: Streams,
    split: Split,
    shaken: Vec<String>,
    declared: [Declared; 3],
    weighed: Weighed,
}

impl Look {
    fn new(
        scene: &mut Scene,
        given: &Given,
        found: &Model,
        (parameters, candidates): (&Parameters, &[usize]),
        progress: &dyn Fn(&str),
    ) -> Result<Self, String> {
        progress("predicting the accelerometers");
        let (streams, split) = prepare(scene, given, found)?;
        let noise = quiet_noise(scene_felt(scene), &residual_m_s(scene, given), &split);
        settle_vertical(scene, given, parameters, &split, noise, &[]);
        let first = residual_m_s(scene, given);
        let was_shaken = shaken::shaken(scene, &first, parameters, candidates, &split, noise);
        let shaken: Vec<String> = name_shaken(&split, &was_shaken);
        let split = without_shaken(split, &was_shaken);
        let rate_hz = streams.rate_hz;
        if Portion::new(split.fitted.clone(), rate_hz)
            .is_none_or(|portion| portion.seconds() < LEAST_FITTED_S)
        {
            let reason = "less than two seconds in which the case was turned and not shaken";
            return Err(reason.to_string());
        }
        settle_vertical(scene, given, parameters, &split, noise, &[]);
        progress("weighing the accelerometers' effects");
        let declared = declared(given.model, rate_hz);
        let beside = (noise, &declared);
        let weighed = search(scene, given, parameters, candidates, &split, beside);
        Ok(Self {
            streams,
            split,
            shaken,
            declared,
            weighed,
        })
    }

    /// Locates and validates what was weighed.
    fn found(self, scene: &Scene, candidates: Vec<usize>) -> Found {
        let Self {
            streams,
            split,
            weighed,
            ..
        } = self;
        let noise = weighed.noise;
        let parts = split.fitted.iter().chain(&split.held_out);
        let all_rows: Vec<Range<usize>> = parts.cloned().collect();
        let locate = |residual: &Triad| {
            let tiles = locate::tiles(&streams, residual, &noise, &split.regimes, &all_rows);
            locate::join(&tiles, &split.regimes, &all_rows)
        };
        let locations = locate(&weighed.before);
        let mut left = locate(&weighed.after);
        for location in &mut left {
            let best = weighed
                .grows
                .as_ref()
                .and_then(|grows| grows[location.axis].as_ref());
            if let Some(best) = best {
                location.regime = format!("grows as {}", best.name);
            }
        }
        let validations = validate::validate(
            &weighed.before,
            &weighed.after,
            &noise,
            (&split.held_out, [0.0, f64::INFINITY]),
            &locations,
            streams.rate_hz,
        );
        let portion = Portion::new(split.fitted.clone(), streams.rate_hz);
        let wandering_m_s2 = portion.map_or([None; 3], |portion| {
            let left = weighed
                .after
                .each_ref()
                .map(|values| portion.transform(values));
            // The same law for increments of velocity.
            wandering_rad_s(&portion, &left, &noise)
        });
        let carried = scene.streams.longest_carried();
        let carried_s = (carried.len() < scene.streams.rows)
            .then(|| [carried.start, carried.end].map(|row| scene.streams.begin_s(row)));
        Found {
            streams,
            noise,
            declared: self.declared,
            choice: weighed.choice,
            verdicts: weighed.verdicts,
            vetoed: weighed.vetoed,
            locations,
            left,
            validations,
            wandering_m_s2,
            shaken: self.shaken,
            carried_s,
            candidates,
        }
    }
}

/// Adds what the accelerometers showed to the gyros' outcome, or why they showed nothing.
pub fn add(found: Result<Found, String>, outcome: &mut Outcome) {
    match found {
        Ok(found) => found.add_to(outcome),
        Err(reason) => words::say_why_not(&reason, outcome),
    }
}

/// Why the force of a unit at rest names nothing.
pub fn why_not_at_rest(streams: &Streams) -> String {
    if let Err(reason) = &streams.accelerometers {
        return reason.clone();
    }
    let ratio = streams
        .at_rest
        .as_ref()
        .and_then(|rest| rest.force_over_gravity);
    let length = ratio.map_or_else(String::new, |ratio| {
        format!(" ({ratio:.6} of the site's gravity)")
    });
    format!(
        "the unit stood still, and the accelerometers show one number there, the length of the force{length}, in which bias, scale error and a wrong gravity are the same"
    )
}

/// Rows, motion and a first vertical, or why the force cannot be predicted.
fn prepare(scene: &mut Scene, given: &Given, found: &Model) -> Result<(Streams, Split), String> {
    if scene.streams.is_joined() {
        return Err("accelerometers are diagnosed one recording at a time".to_string());
    }
    if scene.streams.pieces[0].origin.is_some() {
        return Err("of a recording longer than memory the gyros alone are diagnosed".to_string());
    }
    let mut rows = scene.streams.accelerometers.clone()?;
    rows.mask(&scene.streams);
    let site = scene
        .streams
        .site
        .filter(|site| site.gravity_m_s2 > 0.0)
        .ok_or("the recording names no site with its gravity")?;
    if scene.streams.at_rest.is_some() {
        return Err(why_not_at_rest(&scene.streams));
    }
    let piece = &scene.streams.pieces[0];
    let streams = Streams::bare(rows.rate_hz, rows.start_s, rows.usable.clone(), piece);
    let split = split::split(&streams, given.held_out);
    if Portion::new(split.fitted.clone(), rows.rate_hz)
        .is_none_or(|portion| portion.seconds() < LEAST_FITTED_S)
    {
        return Err("fewer than two seconds with accelerometers and motion measured".to_string());
    }
    let carried = Carried::new(scene, &rows, &found.effects);
    let earth = given.model.earth_rate_in_reference;
    let vertical = Vertical::new(&rows, &carried, site, earth, &split.fitted)
        .ok_or("the specific force is not the site's gravity carried about by the reference")?;
    let scale_error = given
        .model
        .accelerometer
        .as_ref()
        .map_or([0.0; 3], |accelerometer| accelerometer.scale_error);
    scene.felt = Some(Felt::new(rows, carried, vertical, scale_error));
    Ok((streams, split))
}
