//! Runs one trial: makes the recording, diagnoses it, and records the [`Outcome`].
//!
//! The diagnosis gets the recording and the model that admits nothing; the [`Answer`] stays here.

use std::collections::BTreeMap;
use std::path::Path;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::answer::Answer;
use super::predict::PredictionProducts;
use super::scene::Scene;
use rlg_findings::result::{Diagnosis, EffectEntry, ParameterEntry};
use rlg_flow::{Settings, diagnose_under};
use rlg_model::Model;
use rlg_model::kinds::{FAULT_KINDS, NOISE_KINDS};
use rlg_recording::error::InputError;
use rlg_recording::{Channel, Quantity, Recording};
use rlg_simulator::instrument::normal;
use rlg_simulator::{Seeds, simulate};

/// Rows of an angle that jumps for one reading, in a record with glitches.
const JUMPS: usize = 3;

/// Rows that are lost there.
const LOST_ROWS: usize = 20;

/// A jump, over the white noise of angle: what a loose connector or an interrupted transfer leaves.
const JUMP_SIGMAS: f64 = 6.0;

/// An estimate.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Estimate {
    /// Value.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
}

/// One effect that the diagnosis reports.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Finding {
    /// Its kind.
    pub kind: String,
    /// Kinds that it cannot be told from.
    pub or: Vec<String>,
    /// Its numbers.
    pub parameters: BTreeMap<String, Estimate>,
    /// Its expression.
    pub expression: Option<String>,
    /// Its p-value.
    pub p_value: f64,
}

/// What the diagnosis said.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Outcome {
    /// Number of the trial.
    pub trial: u64,
    /// The verdict in one word.
    pub verdict: String,
    /// What it found.
    pub findings: Vec<Finding>,
    /// Stretches in which model and recording differ.
    pub locations: usize,
    /// Where the kinds found are the kinds concealed and linear: power that the findings leave over the fitted and
    /// the held-out rows, in units of the noise.
    pub leaves: Option<[f64; 2]>,
}

impl Finding {
    /// A kind of the catalogue that predicts something, claimed by name.
    pub fn is_physics(&self) -> bool {
        self.kind != "unlisted"
            && !NOISE_KINDS.contains(&self.kind.as_str())
            && !FAULT_KINDS.contains(&self.kind.as_str())
    }

    /// Whether the rows are only said to be unusable.
    pub fn is_fault(&self) -> bool {
        FAULT_KINDS.contains(&self.kind.as_str())
    }

    /// Whether a kind is the finding's own or in its class of indistinguishable kinds.
    pub fn covers(&self, kind: &str) -> bool {
        self.kind == kind || self.or.iter().any(|other| other == kind)
    }

    fn of(entry: &EffectEntry) -> Self {
        let numbers = entry
            .parameters
            .iter()
            .filter_map(|parameter| match parameter {
                ParameterEntry::Number {
                    name, value, std, ..
                } => Some((
                    name.clone(),
                    Estimate {
                        value: *value,
                        std: *std,
                    },
                )),
                ParameterEntry::Text { .. } => None,
            });
        Self {
            kind: entry.kind.clone(),
            or: entry.indistinguishable_from.clone(),
            parameters: numbers.collect(),
            // Beside a listed kind it is its rival.
            expression: entry
                .expression
                .clone()
                .filter(|_| entry.kind == "unlisted"),
            p_value: entry.p_value,
        }
    }
}

/// Makes the recording of a trial and the model that goes with it.
pub fn record(answer: &Answer, scene: &Scene) -> Result<(Recording, Model), InputError> {
    let scenario = scene.scenario(true, &answer.toml())?;
    let seeds = Seeds {
        motion: scene.motion_seed,
        noise: answer.noise_seed,
    };
    let mut simulation = simulate(&scenario, seeds, |_| {});
    // A generator beside the simulator's streams, which end far below.
    let mut rng = ChaCha8Rng::seed_from_u64(answer.noise_seed);
    rng.set_stream(u64::MAX);
    let recording = &mut simulation.recording;
    recording.name = format!("trial {}", answer.trial);
    if answer.glitches {
        glitch(recording, scene, &mut rng);
    }
    if answer.dummies {
        add_dummies(recording, &mut rng);
    }
    Ok((simulation.recording, simulation.model))
}

fn glitch(recording: &mut Recording, scene: &Scene, rng: &mut ChaCha8Rng) {
    let pulse_rad = scene.levels.pulse_rad;
    let table = &mut recording.tables[0];
    let rows = table.rows;
    for _ in 0..JUMPS {
        let axis = rng.random_range(0..3);
        let row = rng.random_range(rows / 10..rows - rows / 10);
        let jump = JUMP_SIGMAS * scene.levels.reference_rad.max(pulse_rad[axis]);
        // What one reading has too much the next has too little: the angle itself goes on.
        let value = if scene.is_dithered() {
            (jump / pulse_rad[axis]).ceil()
        } else {
            jump
        };
        table.channels[axis].values[row] += value;
        table.channels[axis].values[row + 1] -= value;
    }
    let first = rng.random_range(rows / 10..rows - rows / 10);
    for channel in &mut table.channels[..3] {
        channel.values[first..first + LOST_ROWS].fill(f64::NAN);
    }
}

/// Adds a pressure that walks at random and a voltage that is white: channels without meaning.
fn add_dummies(recording: &mut Recording, rng: &mut ChaCha8Rng) {
    let table = &mut recording.tables[0];
    let mut walked = 0.0;
    let pressure: Vec<f64> = (0..table.rows)
        .map(|_| {
            walked += 0.1 * normal(rng);
            101_325.0 + walked
        })
        .collect();
    let voltage: Vec<f64> = (0..table.rows).map(|_| 5.0 + 1e-3 * normal(rng)).collect();
    for (name, values) in [("pressure", pressure), ("supply_voltage", voltage)] {
        table.channels.push(Channel {
            column: name.to_owned(),
            quantity: Quantity::Other(name.to_owned()),
            axis: None,
            scale: 1.0,
            offset: 0.0,
            values,
        });
    }
}

/// Makes the recording, diagnoses it and records the outcome. With `leave_one_out` the diagnosis does not know the
/// concealed kinds.
pub fn examine(
    answer: &Answer,
    scene: &Scene,
    products: &PredictionProducts,
    leave_one_out: bool,
) -> Result<Outcome, InputError> {
    let said = diagnose_trial(answer, scene, leave_one_out)?;
    let mut outcome = outcome_of(answer.trial, &said);
    outcome.leaves = leaves(answer, &outcome, products);
    Ok(outcome)
}

/// Simulates the recording of a trial and diagnoses it. With `leave_one_out` the diagnosis does not know the
/// concealed kinds.
pub fn diagnose_trial(
    answer: &Answer,
    scene: &Scene,
    leave_one_out: bool,
) -> Result<Diagnosis, InputError> {
    let (recording, model) = record(answer, scene)?;
    let without: Vec<&str> = if leave_one_out {
        answer
            .effects
            .iter()
            .map(|effect| effect.kind.as_str())
            .collect()
    } else {
        Vec::new()
    };
    let file = Path::new("model.toml");
    let settings = Settings {
        left_out: &without,
        ..Settings::default()
    };
    let outcome = diagnose_under(&settings, &recording, &model, file, &|_| {})?;
    Ok(outcome.diagnosis)
}

/// What a diagnosis said, in the challenge's form.
pub fn outcome_of(trial: u64, said: &Diagnosis) -> Outcome {
    Outcome {
        trial,
        verdict: serde_json::to_value(said.verdict)
            .ok()
            .and_then(|word| word.as_str().map(str::to_owned))
            .unwrap_or_default(),
        findings: said.effects.iter().map(Finding::of).collect(),
        locations: said.locations.len(),
        leaves: None,
    }
}

/// |s − ŝ|² over the fitted and the held-out rows.
fn leaves(answer: &Answer, outcome: &Outcome, products: &PredictionProducts) -> Option<[f64; 2]> {
    // More noise predicts nothing, and rows left out predict nothing.
    let predicts = |one: &&Finding| one.is_physics() || one.kind == "unlisted";
    let physics: Vec<&Finding> = outcome.findings.iter().filter(predicts).collect();
    if answer.effects.is_empty() || physics.is_empty() {
        return None;
    }
    let truth: Vec<(String, BTreeMap<String, f64>)> = answer
        .effects
        .iter()
        .map(|effect| (effect.kind.clone(), effect.numbers()))
        .collect();
    let found: Vec<(String, BTreeMap<String, f64>)> = physics
        .iter()
        .map(|one| {
            let values = one
                .parameters
                .iter()
                .map(|(name, at)| (name.clone(), at.value));
            (one.kind.clone(), values.collect())
        })
        .collect();
    let pairs = |list: &[(String, BTreeMap<String, f64>)]| {
        products.vector(list.iter().map(|(kind, values)| (kind.as_str(), values)))
    };
    let left = pairs(&found)? - pairs(&truth)?;
    Some([products.power(&left, 0), products.power(&left, 1)])
}
