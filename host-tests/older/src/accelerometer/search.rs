//! Selection of the accelerometers' effects together with the vertical, until every name stands.
//!
//! Enters: the scene with the vertical that fits best without an effect, candidates, the split, the noise to begin with.
//! Leaves: [`Weighed`], and the scene with the vertical where the selection puts it. A name that is not the same in
//! every regime, that single expressions outside the catalogue beat, or that the held-out rows contradict, is vetoed, and
//! the selection begins again without it.

use super::Given;
use super::bench::ForceBench;
use super::held_out;
use super::level::start_noise;
use super::reach::reach;
use super::residual::{prediction, residual_m_s, scene_felt};
use super::rivals::{self, Rivalry, rivalry};
use super::steady;
use crate::bench::Bench as _;
use crate::hunt::VETO;
use crate::hypotheses::no_effects;
use crate::invariance::Verdict;
use crate::noise::{Declared, Noise};
use crate::portion::Portion;
use crate::scene::Scene;
use crate::select::{self, Choice, Chosen};
use crate::split::Split;
use crate::streams::{Triad, add_triad};
use crate::weigh::prior_width;
use crate::workbench::Parameters;

/// Selection, then the vertical, then selection again: the angles are small and each round squares their error.
const MOST_ROUNDS: usize = 5;

/// What the search leaves.
pub(super) struct Weighed {
    /// The effects that stand.
    pub(super) choice: Choice,
    /// What the regimes say of each.
    pub(super) verdicts: Vec<Verdict>,
    /// Names taken back, with the reason.
    pub(super) vetoed: Vec<(usize, String)>,
    /// Noise of each accelerometer.
    pub(super) noise: [Noise; 3],
    /// The residual under the model, beside the vertical that fits it best \[m/s per row\].
    pub(super) before: Triad,
    /// The same beside the vertical that the selection left.
    pub(super) beside: Triad,
    /// That less what was found.
    pub(super) after: Triad,
    /// The expression that what is left follows best.
    pub(super) grows: Option<[Option<rivals::Best>; 3]>,
}

/// Searches.
pub(super) fn search(
    scene: &mut Scene,
    given: &Given,
    parameters: &Parameters,
    candidates: &[usize],
    split: &Split,
    (noise, declared): ([Noise; 3], &[Declared; 3]),
) -> Weighed {
    let mut allowed = candidates.to_vec();
    let mut vetoed: Vec<(usize, String)> = Vec::new();
    let expressions = rivals::expressions(scene, scene_felt(scene));
    let under_model = residual_m_s(scene, given);
    loop {
        let (choice, noise) = choose(scene, given, parameters, &allowed, split, (noise, declared));
        let beside = residual_m_s(scene, given);
        let felt = scene_felt(scene);
        let predictions = predictions(scene, &choice.chosen);
        let mut after = beside.clone();
        for prediction in &predictions {
            add_triad(&mut after, prediction, -1.0);
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
                parameters,
                (&choice, split, noise),
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
                    add_triad(&mut with, prediction, 1.0);
                    let rivalry = bench_of(&with, Some(one.effect))?;
                    let names = rivalry.beats_effect()?;
                    Some((
                        one.effect,
                        format!("{names} explains more with fewer numbers"),
                    ))
                })
        };
        let contradicted = || {
            let mut chosen = choice.chosen.iter();
            chosen.find_map(|one| {
                let why = held_out::contradicts(scene, &after, parameters, split, noise, one)?;
                Some((one.effect, why))
            })
        };
        let Some((effect, reason)) = unsteady.or_else(beaten).or_else(contradicted) else {
            let grows = bench_of(&after, None).map(|rivalry| rivalry.best);
            let before = match choice.chosen.is_empty() {
                true => beside.clone(),
                false => under_model,
            };
            return Weighed {
                choice,
                verdicts,
                vetoed,
                noise,
                before,
                beside,
                after,
                grows,
            };
        };
        allowed.retain(|&kept| kept != effect);
        vetoed.push((effect, reason));
    }
}

/// Gauss–Newton on the vertical alone, beside what was chosen.
pub(super) fn settle_vertical(
    scene: &mut Scene,
    given: &Given,
    parameters: &Parameters,
    split: &Split,
    noise: [Noise; 3],
    chosen: &[Chosen],
) {
    /// From a per cent of tilt to below a microradian.
    const STEPS: usize = 3;
    for _ in 0..STEPS {
        let mut residual = residual_m_s(scene, given);
        for prediction in predictions(scene, chosen) {
            add_triad(&mut residual, &prediction, -1.0);
        }
        let rate_hz = scene_felt(scene).rows.rate_hz;
        let Some(portion) = Portion::new(split.fitted.clone(), rate_hz) else {
            return;
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
}

/// What each of the chosen adds to the readings \[m/s per row\].
fn predictions(scene: &Scene, chosen: &[Chosen]) -> Vec<Triad> {
    let of = |one: &Chosen| prediction(scene, one.effect, one.values.as_slice());
    chosen.iter().map(of).collect()
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
) -> (Choice, [Noise; 3]) {
    /// A vertical that moves by less than this many of its standard deviations stays.
    const STAYS: f64 = 0.1;
    let mut round = 0;
    loop {
        round += 1;
        let residual = residual_m_s(scene, given);
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
        let set = choice.effects();
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
            // The values kept are likelier than those of this fit, and what a tilt took off theirs would be left.
            settle_vertical(scene, given, parameters, split, noise, &choice.chosen);
            return (choice, noise);
        }
        move_vertical(scene, &moves);
    }
}
