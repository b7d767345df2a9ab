//! Run of a challenge: trials drawn, committed to, recorded, diagnosed.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;
use rlg_model::Model;
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use rlg_recording::output::write_file;
use serde::{Deserialize, Serialize};

use super::trial::Trial;
use super::under_test::{DiagnosisSummary, UnderTest};
use crate::acceptance::record::{Answer, Declares, record};
use crate::given::MODEL;
use crate::marks::family::{CYCLE, Family};
use crate::marks::setting::Limits;
use crate::recorded::base::Base;
use crate::{attitude, force, positions, recorded, rest};

/// Plan of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Seed of all draws.
    pub seed: u64,
    /// Number of trials.
    pub trials: u64,
    /// Families; numbers of other families are skipped.
    pub families: Vec<Family>,
    /// Injected effects with attitudes or at rest; numbers of others are skipped, none if empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub planted: Vec<String>,
    /// Base recording of the trials, if the family needs one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording: Option<PathBuf>,
    /// Number of a single trial.
    pub only: Option<u64>,
    /// Largest factor by which the declared noise of the reference is wrong.
    pub declared_within: f64,
    /// Noise declared by the models.
    pub declares: Declares,
    /// Length of the longest recording \[s\].
    pub longest_s: f64,
    /// Largest number of rows.
    pub most_rows: f64,
}

impl Plan {
    /// Returns a plan with the marks' defaults.
    pub fn new(seed: u64, trials: u64, families: &[Family]) -> Self {
        let all = CYCLE.into_iter().filter(|family| *family != Family::Hour);
        Self {
            seed,
            trials,
            families: if families.is_empty() || families.contains(&Family::Rates) {
                all.collect()
            } else {
                families.to_vec()
            },
            planted: Vec::new(),
            recording: None,
            only: None,
            declared_within: 1.5,
            declares: Declares::AsDrawn,
            longest_s: 600.0,
            most_rows: 240_000.0,
        }
    }

    /// Returns the limits of the drawn settings.
    pub fn limits(&self) -> Limits {
        Limits {
            length_s: [20.0, self.longest_s],
            most_rows: self.most_rows,
            declared_within: self.declared_within,
        }
    }

    /// Returns the numbers of the trials.
    pub fn numbers(&self) -> Vec<u64> {
        match self.only {
            Some(number) => vec![number],
            None => (0..)
                .filter(|number| self.families.contains(&self.family(*number)))
                .filter(|number| self.planted.is_empty() || self.plants(*number))
                .take(self.trials as usize)
                .collect(),
        }
    }

    /// Returns the family of a trial's number.
    pub fn family(&self, number: u64) -> Family {
        match self.families.as_slice() {
            [one] if one.is_alone() => *one,
            _ => Family::of(number),
        }
    }

    fn plants(&self, number: u64) -> bool {
        let name = match self.family(number) {
            Family::Attitude => attitude::planted::Planted::of(number).name(),
            Family::Rest => rest::planted::Planted::of(number).name(),
            Family::Force => force::planted::Planted::of(number).name(),
            Family::Positions => positions::planted::Planted::of(number).name(),
            Family::Recorded => recorded::planted::Planted::of(number).name(),
            _ => return false,
        };
        self.planted.contains(&name)
    }
}

/// Diagnosis of a trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Number of the trial.
    pub trial: u64,
    /// Diagnosis.
    pub said: Option<DiagnosisSummary>,
    /// Reason for its absence.
    pub failure: Option<String>,
}

/// Cost of one trial's diagnosis; not part of the outcome, which is reproducible byte for byte.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cost {
    /// Number of the trial.
    pub trial: u64,
    /// Number of rows of the recording.
    pub rows: usize,
    /// Elapsed time of the diagnosis \[s\].
    pub seconds: f64,
}

/// Storage of the recordings.
#[derive(Debug, Clone, Copy)]
pub struct Keep<'a> {
    /// Folder of the trials.
    pub folder: &'a Path,
    /// Each truth is written in its trial's folder.
    pub with_truth: bool,
}

/// Trials with their answers, before any diagnosis.
pub struct Prepared {
    /// Trials in order.
    pub trials: Vec<Trial>,
    /// Their answers.
    pub answers: Vec<Answer>,
    /// Each answer as its hashed line.
    pub lines: Vec<(u64, String)>,
}

/// Draws every trial. Calls `progress` after each.
pub fn prepare(plan: &Plan, progress: &(dyn Fn() + Sync)) -> Result<Prepared, InputError> {
    let limits = plan.limits();
    let base = plan.recording.as_deref().map(Base::read).transpose()?;
    let base = base.map(Arc::new);
    let drawn: Vec<(Trial, Answer, String)> = plan
        .numbers()
        .into_par_iter()
        .map(|number| {
            let trial = match (plan.family(number), &base) {
                (Family::Recorded, Some(base)) => Trial::of_recording(plan.seed, number, base)?,
                (family, _) => Trial::draw(plan.seed, (number, family), &limits)?,
            };
            let answer = Answer::of(plan.seed, &trial);
            let line = serde_json::to_string(&answer).map_err(no_json)?;
            progress();
            Ok((trial, answer, line))
        })
        .collect::<Result<_, InputError>>()?;
    let mut prepared = Prepared {
        trials: Vec::new(),
        answers: Vec::new(),
        lines: Vec::new(),
    };
    for (trial, answer, line) in drawn {
        prepared.lines.push((trial.number, line));
        prepared.trials.push(trial);
        prepared.answers.push(answer);
    }
    Ok(prepared)
}

impl Prepared {
    /// Diagnoses every trial by the system under test, or makes the recordings alone. They are stored as `keep` states;
    /// calls `progress` after each trial.
    pub fn diagnose(
        &self,
        (seed, declares): (u64, Declares),
        under_test: Option<&UnderTest>,
        keep: Option<Keep>,
        progress: &(dyn Fn() + Sync),
    ) -> Result<Vec<(Outcome, Cost)>, InputError> {
        self.trials
            .par_iter()
            .zip(&self.lines)
            .map(|(trial, (_, line))| {
                let (recording, model) = record(trial, declares)?;
                let name = format!("trial-{seed}-{:06}", trial.number);
                if let Some(Keep { folder, with_truth }) = keep {
                    let truth = with_truth.then_some(line.as_str());
                    keep_trial(&folder.join(&name), &recording, &model, truth)?;
                }
                let named = (trial.number, name.as_str());
                let done = diagnose(named, under_test, &recording, &model);
                progress();
                Ok(done)
            })
            .collect()
    }
}

fn diagnose(
    (trial, name): (u64, &str),
    under_test: Option<&UnderTest>,
    recording: &Recording,
    model: &Model,
) -> (Outcome, Cost) {
    let begun = Instant::now();
    // A recording on which the tool fails is a result, and the other trials go on.
    let said = under_test.map(|under_test| {
        catch_unwind(AssertUnwindSafe(|| {
            under_test.answer(name, recording, model)
        }))
        .unwrap_or_else(|_| Err("panicked".to_owned()))
    });
    let cost = Cost {
        trial,
        rows: recording.tables.first().map_or(0, |table| table.rows),
        seconds: begun.elapsed().as_secs_f64(),
    };
    let (said, failure) = match said {
        Some(Ok(said)) => (Some(said), None),
        Some(Err(failure)) => (None, Some(failure)),
        None => (None, None),
    };
    let outcome = Outcome {
        trial,
        said,
        failure,
    };
    (outcome, cost)
}

/// Writes `recording/` with its model, and next to it `truth.json` if the truth is given.
fn keep_trial(
    folder: &Path,
    recording: &Recording,
    model: &Model,
    truth: Option<&str>,
) -> Result<(), InputError> {
    let mut out = Recording::create_folder(folder.join("recording"))?;
    recording.write_into(&mut out)?;
    out.write(MODEL, model.to_toml().as_bytes())?;
    out.commit()?;
    match truth {
        Some(truth) => write_file(folder.join("truth.json"), format!("{truth}\n").as_bytes()),
        None => Ok(()),
    }
}

fn no_json(error: serde_json::Error) -> InputError {
    InputError::new("challenge", format!("a result has no JSON form ({error})"))
}
