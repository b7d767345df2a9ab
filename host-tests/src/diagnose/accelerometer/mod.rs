//! The same road for the accelerometers: what the model leaves out of the specific force.
//!
//! rows → carried (attitude, lever arms) → vertical → felt (prediction) → shaken (what no gravity explains is left
//! out) → bench, select → steady (invariance) → validate → words
//!
//! Enters: a recording, its model with what the gyros' road found, and the scene of that road. Leaves: findings
//! added to its [`Outcome`](super::Outcome). Predicted is the force of a unit that is turned and not shaken:
//! gravity, carried by the reference, and what lever arms feel of the turning.
//!
//! At rest gravity is one number for three accelerometers: nothing is named there (words.rs says what is not).
//! Deliberately not here: unlisted expressions of the force; where no entry fits, only the location is told.

pub mod bench;

pub mod carried;

pub mod felt;

pub mod rivals;

pub mod rows;

pub mod shaken;

pub mod steady;

pub mod vertical;

mod words;

use std::ops::Range;
use std::path::Path;

use nalgebra::{DMatrix, DVector};

use super::bench::Bench as _;
use super::hypotheses::{self, CATALOGUE, Subject, no_effects};
use super::information::{Information, stable_inverse};
use super::invariance::Verdict;
use super::locate::{self, Location};
use super::noise::{Declared, Noise};
use super::portion::Portion;
use super::scene::Scene;
use super::select::{self, Choice, prior_width};
use super::split::{self, Split, intersect};
use super::streams::{Streams, Triad};
use super::validate::{self, Validation};
use super::workbench::Parameters;
use super::{LEAST_FITTED_S, Outcome, residual};
use crate::error::InputError;
use crate::model::Model;

use bench::ForceBench;
use carried::Carried;
use felt::Felt;
use vertical::Vertical;

/// Chance of the scatter between regimes below which a name is vetoed, as for the gyros.
const VETO: f64 = 1e-5;

/// Selection, then the vertical, then selection again: the angles are small and each round squares their error.
const MOST_ROUNDS: usize = 5;

/// What is given.
pub struct Given<'a> {
    /// The model that was diagnosed.
    pub model: &'a Model,
    /// Its file.
    pub model_file: &'a Path,
    /// Kinds taken out of the catalogue.
    pub left_out: &'a [&'a str],
}

/// What the accelerometers showed.
struct Found<'a> {
    streams: &'a Streams,
    felt: &'a Felt,
    noise: [Noise; 3],
    declared: [Declared; 3],
    choice: Choice,
    verdicts: Vec<Verdict>,
    vetoed: Vec<(usize, String)>,
    locations: Vec<Location>,
    left: Vec<Location>,
    validations: Vec<Validation>,
    /// Names of regimes left out because the case was shaken in them.
    shaken: Vec<String>,
    candidates: Vec<usize>,
}

/// Diagnoses the accelerometers and adds what they show.
pub fn add(
    scene: &mut Scene,
    given: &Given,
    outcome: &mut Outcome,
    progress: &dyn Fn(&str),
) -> Result<(), InputError> {
    progress("predicting the accelerometers");
    let (streams, split) = match prepare(scene, given, &outcome.model) {
        Ok(prepared) => prepared,
        Err(reason) => {
            words::say_why_not(&reason, outcome);
            return Ok(());
        }
    };
    let parameters = Parameters::of_catalogue();
    let candidates: Vec<usize> = (0..CATALOGUE.len())
        .filter(|&effect| CATALOGUE[effect].subject() == Subject::Accelerometers)
        .filter(|&effect| !given.left_out.contains(&CATALOGUE[effect].card().kind))
        .collect();
    let quietest = |residual: &Triad| quiet_noise(scene_felt(scene), residual, &split);
    let noise = quietest(&residual_m_s(scene, given)?);
    settle_vertical(scene, given, &parameters, &split, noise)?;
    let first = residual_m_s(scene, given)?;
    let was_shaken = shaken::shaken(scene, &first, &parameters, &candidates, &split, noise);
    let shaken: Vec<String> = name_shaken(&split, &was_shaken);
    let split = without_shaken(split, &was_shaken);
    let rate_hz = streams.rate_hz;
    if Portion::new(split.fitted.clone(), rate_hz)
        .is_none_or(|portion| portion.seconds() < LEAST_FITTED_S)
    {
        let reason = "less than two seconds in which the case was turned and not shaken";
        words::say_why_not(reason, outcome);
        return Ok(());
    }
    settle_vertical(scene, given, &parameters, &split, noise)?;

    progress("weighing the accelerometers' effects");
    let declared = [declared(given.model, rate_hz); 3];
    let mut allowed = candidates.clone();
    let mut vetoed: Vec<(usize, String)> = Vec::new();
    let expressions = rivals::expressions(scene, scene_felt(scene));
    let (choice, verdicts, noise, before, after, grows) = loop {
        let (choice, noise) = choose(
            scene,
            given,
            &parameters,
            &allowed,
            &split,
            (noise, &declared),
        )?;
        let before = residual_m_s(scene, given)?;
        let felt = scene_felt(scene);
        let predictions: Vec<Triad> = choice
            .chosen
            .iter()
            .map(|one| CATALOGUE[one.effect].prediction(scene, one.values.as_slice()))
            .collect();
        let mut after = before.clone();
        for prediction in &predictions {
            subtract(&mut after, prediction);
        }
        let verdicts: Vec<Verdict> = predictions
            .iter()
            .map(|prediction| {
                steady::test(
                    felt,
                    &noise,
                    prediction,
                    &after,
                    &split.fitted,
                    &split.regimes,
                )
            })
            .collect();
        let bench_of = |residual: &Triad, with: Option<usize>| -> Option<Rivalry> {
            rivalry(
                scene,
                residual,
                &parameters,
                (&choice, &split, noise),
                with,
                &expressions,
            )
        };
        let unsteady = choice
            .chosen
            .iter()
            .zip(&verdicts)
            .find_map(|(one, verdict)| {
                let chance = verdict.p_value;
                (chance < VETO).then(|| {
                    let reason =
                        format!("its size differs between the regimes (chance {chance:.1e})");
                    (one.effect, reason)
                })
            });
        let beaten = || {
            choice
                .chosen
                .iter()
                .zip(&predictions)
                .find_map(|(one, prediction)| {
                    let mut with = after.clone();
                    add_to(&mut with, prediction);
                    let rivalry = bench_of(&with, Some(one.effect))?;
                    let names = rivalry.beats_effect()?;
                    Some((
                        one.effect,
                        format!("{names} explains more with fewer numbers"),
                    ))
                })
        };
        let Some((effect, reason)) = unsteady.or_else(beaten) else {
            let grows = bench_of(&after, None).map(|rivalry| rivalry.best);
            break (choice, verdicts, noise, before, after, grows);
        };
        allowed.retain(|&kept| kept != effect);
        vetoed.push((effect, reason));
    };

    let all_rows: Vec<Range<usize>> = split
        .fitted
        .iter()
        .chain(&split.held_out)
        .cloned()
        .collect();
    let locate = |residual: &Triad| {
        let tiles = locate::tiles(&streams, residual, &noise, &split.regimes, &all_rows);
        locate::join(&tiles, &split.regimes, &all_rows)
    };
    let locations = locate(&before);
    let mut left = locate(&after);
    for location in &mut left {
        let best = grows
            .as_ref()
            .and_then(|grows| grows[location.axis].as_ref());
        if let Some(best) = best {
            location.regime = format!("grows as {}", best.name);
        }
    }
    let validations = validate::validate(
        &before,
        &after,
        &noise,
        &split.held_out,
        &locations,
        rate_hz,
    );
    let found = Found {
        streams: &streams,
        felt: scene_felt(scene),
        noise,
        declared,
        choice,
        verdicts,
        vetoed,
        locations,
        left,
        validations,
        shaken,
        candidates,
    };
    found.add_to(outcome);
    Ok(())
}

/// Rows, motion and a first vertical, or why the force cannot be predicted.
fn prepare(scene: &mut Scene, given: &Given, found: &Model) -> Result<(Streams, Split), String> {
    if scene.streams.is_joined() {
        return Err("accelerometers are diagnosed one recording at a time".to_string());
    }
    let mut rows = scene.streams.accelerometers.clone()?;
    rows.mask(&scene.streams);
    let site = scene
        .streams
        .site
        .filter(|site| site.gravity_m_s2 > 0.0)
        .ok_or("the recording names no site with its gravity")?;
    if let Some(rest) = &scene.streams.at_rest {
        let length = rest.force_over_gravity.map_or_else(String::new, |ratio| {
            format!(" ({ratio:.6} of the site's gravity)")
        });
        return Err(format!(
            "the unit stood still, and the accelerometers show one number there, the length of the force{length}, in which bias, scale error and a wrong gravity are the same"
        ));
    }
    let piece = &scene.streams.pieces[0];
    let streams = Streams::bare(rows.rate_hz, rows.start_s, rows.usable.clone(), piece);
    let split = split::split(&streams);
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

/// The prediction that [`prepare`] left.
fn scene_felt(scene: &Scene) -> &Felt {
    scene.felt.as_ref().expect("prepared before")
}

/// Readings less the model's prediction, its own accelerometer effects included \[m/s per row\].
fn residual_m_s(scene: &Scene, given: &Given) -> Result<Triad, InputError> {
    let felt = scene_felt(scene);
    let bias_m_s2 = given
        .model
        .accelerometer
        .as_ref()
        .map_or([0.0; 3], |accelerometer| accelerometer.bias_m_s2);
    let mut residual = felt.rows.sensed_m_s.clone();
    let plain = [0, 1, 2].map(|axis: usize| felt.sensed_m_s(axis, bias_m_s2[axis]));
    subtract(&mut residual, &plain);
    for effect in &given.model.effects {
        let known = hypotheses::find(&effect.kind).map(|(_, hypothesis)| hypothesis);
        if let Some(hypothesis) = known.filter(|h| h.subject() == Subject::Accelerometers) {
            let values = residual::values_of(hypothesis, effect);
            subtract(&mut residual, &hypothesis.prediction(scene, &values));
        }
    }
    Ok(residual)
}

fn subtract(from: &mut Triad, part: &Triad) {
    for (values, part) in from.iter_mut().zip(part) {
        values
            .iter_mut()
            .zip(part)
            .for_each(|(value, part)| *value -= part);
    }
}

fn add_to(into: &mut Triad, part: &Triad) {
    for (values, part) in into.iter_mut().zip(part) {
        values
            .iter_mut()
            .zip(part)
            .for_each(|(value, part)| *value += part);
    }
}

/// An effect against expressions outside the catalogue.
struct Rivalry {
    best: [Option<rivals::Best>; 3],
    /// Likelihood ratio of the effect with all its parameters.
    share: f64,
}

impl Rivalry {
    /// The expressions, where they explain clearly more than the effect.
    fn beats_effect(&self) -> Option<String> {
        /// How much better (2 Δ ln L) they must be, as for the gyros.
        const CLEARLY_BETTER: f64 = 20.0;
        let all: f64 = self.best.iter().flatten().map(|best| best.ratio).sum();
        let names: Vec<&str> = self
            .best
            .iter()
            .flatten()
            .map(|best| best.name.as_str())
            .collect();
        (all > self.share + CLEARLY_BETTER).then(|| names.join(", "))
    }
}

/// Weighs expressions on a residual from which every chosen effect but `open` is taken.
fn rivalry(
    scene: &Scene,
    residual: &Triad,
    parameters: &Parameters,
    (choice, split, noise): (&Choice, &Split, [Noise; 3]),
    open: Option<usize>,
    expressions: &[rivals::Expression],
) -> Option<Rivalry> {
    let portion = Portion::new(split.fitted.clone(), noise[0].rate_hz)?;
    let set: Vec<usize> = choice.chosen.iter().map(|one| one.effect).collect();
    let mut at = no_effects();
    for one in &choice.chosen {
        at[one.effect] = one.values.iter().copied().collect();
    }
    let bench = ForceBench::new(scene, residual, parameters, portion, noise, &set, &at);
    let information = bench.information();
    let gain = |set: &[usize]| {
        let mut indices = parameters.of_all(set);
        indices.extend(bench.unknowns());
        let prior = |index| prior_width(parameters, &information, index);
        information.solve(&indices, &prior).log_likelihood_gain
    };
    let rest: Vec<usize> = set
        .iter()
        .copied()
        .filter(|&kept| Some(kept) != open)
        .collect();
    Some(Rivalry {
        best: rivals::best(&bench, expressions, open),
        share: 2.0 * (gain(&set) - gain(&rest)),
    })
}

/// White noise of each accelerometer as the quietest regime shows it between neighbouring rows.
fn quiet_noise(felt: &Felt, residual: &Triad, split: &Split) -> [Noise; 3] {
    [0, 1, 2].map(|axis: usize| {
        let level = |rows: &[Range<usize>]| {
            let mut steps: Vec<f64> = rows
                .iter()
                .flat_map(|rows| residual[axis][rows.clone()].windows(2))
                .map(|pair| (pair[1] - pair[0]).abs())
                .collect();
            steps.sort_by(f64::total_cmp);
            // Median of |difference| of two normals: 0.6745 √2 σ.
            steps
                .get(steps.len() / 2)
                .map(|median| (median / 0.954).powi(2))
        };
        let levels = split.regimes.iter().filter_map(|regime| {
            level(&intersect(
                std::slice::from_ref(&regime.rows),
                &split.fitted,
            ))
        });
        let white = levels
            .filter(|level| *level > 0.0)
            .fold(f64::INFINITY, f64::min);
        let white = if white.is_finite() {
            white
        } else {
            f64::MIN_POSITIVE.sqrt()
        };
        start_noise(white, felt.rows.rate_hz)
    })
}

/// Where the noise fit starts: white force noise; everything else small, growing only if the data pull it.
fn start_noise(white: f64, rate_hz: f64) -> Noise {
    /// Share of the white noise with which the other terms start, at one hertz where they drift.
    const SEED: f64 = 1e-3;
    let one_hz = (std::f64::consts::TAU / rate_hz).powi(2);
    Noise {
        theta: [white, SEED * white, SEED * white, SEED * white * one_hz],
        rate_hz,
    }
}

/// White noise of n m/s²/√Hz (one-sided) is a random walk of velocity: n²T/2 a row.
fn declared(model: &Model, rate_hz: f64) -> Declared {
    let density = model
        .accelerometer
        .as_ref()
        .map(|accelerometer| accelerometer.noise_m_s2_sqrt_hz)
        .filter(|density| *density > 0.0);
    Declared {
        random_walk: density.map(|density| density * density / (2.0 * rate_hz)),
        white_angle: None,
    }
}

/// Gauss–Newton on the vertical alone.
fn settle_vertical(
    scene: &mut Scene,
    given: &Given,
    parameters: &Parameters,
    split: &Split,
    noise: [Noise; 3],
) -> Result<(), InputError> {
    /// From a per cent of tilt to below a microradian.
    const STEPS: usize = 3;
    for _ in 0..STEPS {
        let residual = residual_m_s(scene, given)?;
        let rate_hz = scene_felt(scene).rows.rate_hz;
        let Some(portion) = Portion::new(split.fitted.clone(), rate_hz) else {
            return Ok(());
        };
        let moves = {
            let bench = ForceBench::new(
                scene,
                &residual,
                parameters,
                portion,
                noise,
                &[],
                &no_effects(),
            );
            let information = bench.information();
            let solution = information.solve(&bench.unknowns(), &|index| {
                prior_width(parameters, &information, index)
            });
            solution.values
        };
        move_vertical(scene, moves.as_slice());
    }
    Ok(())
}

fn move_vertical(scene: &mut Scene, unknowns: &[f64]) {
    if let Some(felt) = &mut scene.felt {
        felt.moved(unknowns);
    }
}

/// Selects, moves the vertical to where the selection puts it, and selects again until it stays.
fn choose(
    scene: &mut Scene,
    given: &Given,
    parameters: &Parameters,
    allowed: &[usize],
    split: &Split,
    (noise, declared): ([Noise; 3], &[Declared; 3]),
) -> Result<(Choice, [Noise; 3]), InputError> {
    /// A vertical that moves by less than this many of its standard deviations stays.
    const STAYS: f64 = 0.1;
    let mut round = 0;
    loop {
        round += 1;
        let residual = residual_m_s(scene, given)?;
        let rate_hz = scene_felt(scene).rows.rate_hz;
        let portion = Portion::new(split.fitted.clone(), rate_hz).expect("checked before");
        let start = [0, 1, 2].map(|axis: usize| match declared[axis].random_walk {
            Some(white) => start_noise(white, rate_hz),
            None => noise[axis],
        });
        let at = no_effects();
        let mut bench = ForceBench::new(scene, &residual, parameters, portion, start, allowed, &at);
        bench.fit_noise(allowed, declared);
        let mut choice = select::select(&mut bench, parameters, allowed, Some(declared));
        let information = bench.information();
        choice.reach = reach(&information, parameters, allowed, &bench.unknowns());
        let set: Vec<usize> = choice.chosen.iter().map(|one| one.effect).collect();
        let mut indices = parameters.of_all(&set);
        indices.extend(bench.unknowns());
        let solution = information.solve(&indices, &|index| {
            prior_width(parameters, &information, index)
        });
        let first = indices.len() - bench.unknowns().len();
        let moves: Vec<f64> = solution.values.iter().skip(first).copied().collect();
        let stays = (first..indices.len()).all(|place| {
            solution.values[place].abs() < STAYS * solution.covariance[(place, place)].sqrt()
        });
        let noise = bench.noise;
        if stays || round == MOST_ROUNDS {
            return Ok((choice, noise));
        }
        move_vertical(scene, &moves);
    }
}

/// Matched-filter SNR of each effect at its typical size, the strongest parameter's, with the vertical not known: a
/// bias of a unit that keeps its attitude is a tilt.
fn reach(
    information: &Information,
    parameters: &Parameters,
    allowed: &[usize],
    unknowns: &[usize],
) -> Vec<(usize, f64)> {
    let scale: Vec<f64> = unknowns
        .iter()
        .map(|&u| {
            information.fisher[(u, u)]
                .max(f64::MIN_POSITIVE)
                .sqrt()
                .recip()
        })
        .collect();
    let count = unknowns.len();
    let gram = DMatrix::from_fn(count, count, |a, b| {
        information.fisher[(unknowns[a], unknowns[b])] * scale[a] * scale[b]
    });
    let inverse = stable_inverse(&gram);
    let own = |index: usize| {
        let shared = DVector::from_fn(count, |a, _| {
            information.fisher[(index, unknowns[a])] * scale[a]
        });
        information.fisher[(index, index)] - shared.dot(&(&inverse * &shared))
    };
    allowed
        .iter()
        .map(|&effect| {
            let power = parameters.of(effect).map(own).fold(0.0, f64::max);
            (effect, CATALOGUE[effect].card().typical * power.sqrt())
        })
        .collect()
}

fn name_shaken(split: &Split, shaken: &[Option<bool>]) -> Vec<String> {
    split
        .regimes
        .iter()
        .zip(shaken)
        .filter(|(_, shaken)| **shaken == Some(true))
        .map(|(regime, _)| regime.name.clone())
        .collect()
}

/// The split without regimes that were shaken.
fn without_shaken(split: Split, shaken: &[Option<bool>]) -> Split {
    let kept: Vec<Range<usize>> = split
        .regimes
        .iter()
        .zip(shaken)
        .filter(|(_, shaken)| **shaken != Some(true))
        .map(|(regime, _)| regime.rows.clone())
        .collect();
    Split {
        fitted: intersect(&split.fitted, &kept),
        held_out: intersect(&split.held_out, &kept),
        regimes: split
            .regimes
            .into_iter()
            .filter(|regime| kept.contains(&regime.rows))
            .collect(),
    }
}
