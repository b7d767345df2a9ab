//! Blind test of the diagnosis: effects drawn from a seed are concealed, diagnosed and scored.
//!
//! draws (`trial`) → scenes (`scene`) → predictions without noise (`predict`, `whiten`, `bounds`) → answers (`kinds`,
//! `answer`) → commitments (`commit`) → recordings and diagnoses (`examine`) → scores (`score`, `catalogue_marks`,
//! `chance`)
//!
//! Recordings of others, each with a truth file, are examined in the same way (`given`). The results on fixed trials and
//! recordings are kept as a table, for comparison with later versions (`golden`). Ordinary recordings are examined against
//! marks (`marks`, `acceptance`): with references of rate, of attitude (`attitude`), at rest (`rest`), with accelerometers (`force`), and
//! recorded by others (`recorded`).
//!
//! A [`Plan`] gives answers, commitments to them, outcomes and [`score::Scores`]. The examiner knows the simulator and
//! calls the diagnosis; the diagnosis gets only a recording and a model.
//!
//! The same plan gives the same bytes for any number of threads and shards: every trial has its own ChaCha stream, and
//! scores are computed from the written lines.

pub mod acceptance;
pub mod answer;
pub mod attitude;
pub mod bounds;
pub mod case;
pub mod catalogue_marks;
pub mod chance;
pub mod commit;
pub mod examine;
pub mod force;
pub mod given;
pub mod golden;
pub mod kinds;
pub mod marks;
pub mod positions;
pub mod predict;
pub mod recorded;
pub mod rest;
pub mod scene;
pub mod score;
pub mod trial;
pub mod whiten;

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Instant;

use rayon::prelude::*;

use answer::{Answer, conceal};
pub use case::Plan;
use examine::{Outcome, diagnose_trial, examine, record};
use predict::{PredictionProducts, ScenePredictions};
use rlg_findings::result::Diagnosis;
use rlg_model::Model;
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use scene::Scene;
use trial::TrialDraw;

/// Selection of a plan's trials for this run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Share {
    /// Trials with a number of this remainder modulo the number of shards.
    Shard(u64, u64),
    /// One trial.
    One(u64),
    /// Trials from the first number up to, but without, the second.
    Range(u64, u64),
}

impl Share {
    /// Numbers of the selected trials, of `all` trials.
    pub fn trials(self, all: u64) -> Vec<u64> {
        let mine = |trial: &u64| match self {
            Self::Shard(shard, of) => trial % of == shard,
            Self::One(one) => *trial == one,
            Self::Range(first, end) => (first..end).contains(trial),
        };
        (0..all).filter(mine).collect()
    }
}

/// Trials with their answers, before any diagnosis.
pub struct Prepared {
    /// Answers in the order of the trials.
    pub answers: Vec<Answer>,
    /// Each answer as its hashed line.
    pub lines: Vec<(u64, String)>,
    scenes: BTreeMap<usize, (Scene, PredictionProducts)>,
    leave_one_out: bool,
}

/// Draws the concealed effects of the numbered `trials`. `progress` is called with the scenes done and their total.
pub fn prepare(
    plan: &Plan,
    trials: &[u64],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Prepared, InputError> {
    let trial_draws: Vec<TrialDraw> = trials
        .iter()
        .map(|&trial| TrialDraw::draw(plan.seed, trial, &plan.families))
        .collect();
    let numbers: BTreeSet<usize> = trial_draws
        .iter()
        .map(|trial_draw| trial_draw.scene)
        .collect();
    let mut answers = Vec::with_capacity(trial_draws.len());
    let mut scenes = BTreeMap::new();
    for (done, &number) in numbers.iter().enumerate() {
        progress(done, numbers.len());
        let scene = Scene::draw(plan.seed, number);
        let predictions = ScenePredictions::open(&scene)?;
        let here: Vec<&TrialDraw> = trial_draws
            .iter()
            .filter(|trial_draw| trial_draw.scene == number)
            .collect();
        let found: Vec<Answer> = here
            .par_iter()
            .map(|trial_draw| conceal((*trial_draw).clone(), &scene, &predictions))
            .collect::<Result<_, _>>()?;
        answers.extend(found);
        let products = predictions.products;
        scenes.insert(number, (scene, products));
    }
    answers.sort_by_key(|answer| answer.trial);
    let lines = answers
        .iter()
        .map(|answer| Ok((answer.trial, answer.line().map_err(no_json)?)))
        .collect::<Result<_, InputError>>()?;
    Ok(Prepared {
        answers,
        lines,
        scenes,
        leave_one_out: plan.leave_one_out,
    })
}

impl Prepared {
    /// Makes the first trial's recording and model, for inspection.
    pub fn first_recording(&self) -> Option<Result<(Recording, Model), InputError>> {
        let answer = self.answers.first()?;
        Some(record(answer, &self.scenes[&answer.scene].0))
    }

    /// Diagnoses every trial, as lines of JSON in the order of the trials. `progress` is called after each.
    pub fn examine(&self, progress: &(dyn Fn() + Sync)) -> Result<Vec<String>, InputError> {
        self.answers
            .par_iter()
            .map(|answer| {
                let (scene, products) = &self.scenes[&answer.scene];
                // A recording on which the tool fails is a result, and the other trials go on.
                let outcome = caught(|| examine(answer, scene, products, self.leave_one_out))
                    .unwrap_or_else(|reason| without_verdict(answer, reason));
                progress();
                serde_json::to_string(&outcome).map_err(no_json)
            })
            .collect()
    }

    /// Diagnoses every trial on all threads and maps each result, in the order of the trials. `map` gets the answer, the
    /// diagnosis or the reason for its absence, and the wall-clock time of simulation and diagnosis \[s\].
    pub fn diagnose_each<T: Send>(
        &self,
        map: impl Fn(&Answer, Result<Diagnosis, String>, f64) -> T + Sync,
    ) -> Vec<T> {
        self.answers
            .par_iter()
            .map(|answer| {
                let (scene, _) = &self.scenes[&answer.scene];
                let begun = Instant::now();
                let said = caught(|| diagnose_trial(answer, scene, self.leave_one_out));
                map(answer, said, begun.elapsed().as_secs_f64())
            })
            .collect()
    }
}

/// Result of one trial, or the reason for its absence in words.
fn caught<T>(run: impl FnOnce() -> Result<T, InputError>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(Ok(result)) => Ok(result),
        Ok(Err(error)) => Err(format!("refused: {error}")),
        Err(_) => Err("panicked".to_owned()),
    }
}

fn without_verdict(answer: &Answer, verdict: String) -> Outcome {
    Outcome {
        trial: answer.trial,
        verdict,
        findings: Vec::new(),
        locations: 0,
        leaves: None,
    }
}

fn no_json(error: serde_json::Error) -> InputError {
    InputError::new("challenge", format!("a result has no JSON form ({error})"))
}

/// Reads lines of JSON written by a challenge.
pub fn lines_of<T: serde::de::DeserializeOwned>(
    text: &str,
    file: &Path,
) -> Result<Vec<T>, InputError> {
    text.lines()
        .enumerate()
        .map(|(row, line)| {
            serde_json::from_str(line).map_err(|error| {
                InputError::new(file, format!("line {}: {error}", row + 1))
                    .expected("a line that rlg challenge wrote")
            })
        })
        .collect()
}
