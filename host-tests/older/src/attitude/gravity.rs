//! The accelerometers beside a slow reference: gravity is carried by the gyros, less what was found of their errors.
//!
//! Enters: the gyros' own motion and what the search named. Leaves: a scene for the road of the accelerometers
//! (accelerometer/), in which nothing is wrong with the motion that is known. What the gyros still err by is of the size
//! of what the search could not see; a slow turn of the vertical is fitted with it.

use super::own_motion::add_sensed;
use super::prepare::Prepared;
use super::samples::SlowSample;
use crate::empirical::Term;
use crate::hunt::Catch;
use crate::hypotheses::CATALOGUE;
use crate::residual::body_from_sensing;
use crate::scene::Scene;
use crate::streams::{Triad, add, add_triad};
use rlg_model::Model;

/// Longest time between attitudes \[s\] over which kinds that explain them alike carry gravity alike.
const UNWATCHED_S: f64 = 2.0;

/// What the gyros err by, as it was found.
pub(super) struct Errors {
    effects: Vec<(usize, Vec<f64>)>,
    terms: Vec<(Term, f64)>,
}

impl Errors {
    /// Of the search's catch; or why the gyros' motion is not known from it.
    pub(super) fn of(catch: &Catch, samples: &[SlowSample]) -> Result<Self, String> {
        let is_reference = |effect: usize| CATALOGUE[effect].turns_reference();
        let chosen = &catch.choice.chosen;
        let undecided = chosen.iter().any(|one| {
            let others = one.indistinguishable_from.iter();
            others
                .clone()
                .any(|&other| is_reference(other) != is_reference(one.effect))
        });
        if undecided {
            let why = "what was found may be the gyros' or the reference's, and gravity would be carried wrongly by one of them";
            return Err(why.to_string());
        }
        let gaps_s = samples
            .windows(2)
            .map(|pair| pair[1].time_s - pair[0].time_s);
        let longest_s = gaps_s.fold(0.0, f64::max);
        let has_a_class = chosen
            .iter()
            .any(|one| !one.indistinguishable_from.is_empty());
        if has_a_class && longest_s > UNWATCHED_S {
            return Err(format!(
                "no attitude was read for {longest_s:.0} s, over which each of the kinds that what was found may be carries gravity otherwise"
            ));
        }
        let of_gyros = chosen.iter().filter(|one| !is_reference(one.effect));
        let terms = catch.terms.iter();
        Ok(Self {
            effects: of_gyros
                .map(|one| (one.effect, one.values.iter().copied().collect()))
                .collect(),
            terms: terms.map(|one| (one.term.clone(), one.size)).collect(),
        })
    }
}

/// What is given without the reference's errors: it does not carry gravity here.
pub(super) fn without_reference(model: &Model) -> Model {
    let mut model = model.clone();
    model
        .effects
        .retain(|effect| !effect.kind.starts_with("reference_"));
    model
}

/// The scene whose motion is the gyros' without those errors.
pub(super) fn carried(prepared: Prepared, model: &Model, errors: &Errors) -> Result<Scene, String> {
    let Prepared {
        scene,
        increments_rad,
        own_noise,
        ..
    } = prepared;
    let mut sensed: Triad = [0, 1, 2].map(|_| vec![0.0; scene.streams.rows]);
    for (effect, values) in &errors.effects {
        add_triad(
            &mut sensed,
            &CATALOGUE[*effect].prediction(&scene, values),
            -1.0,
        );
    }
    for (term, size) in &errors.terms {
        add(&mut sensed[term.axis], &term.column(&scene)?, -size);
    }
    let from_sensing = body_from_sensing(&model.gyro.installation_rad);
    let mut streams = scene.streams;
    streams.case_rad = increments_rad;
    add_sensed(&mut streams.case_rad, &sensed, model, &from_sensing);
    Ok(Scene::new(streams, Some(own_noise), model.gyro.scale_error))
}
