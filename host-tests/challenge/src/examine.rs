//! Run of one trial: makes the recording, diagnoses it, and records the [`Outcome`].
//!
//! The diagnosis gets the recording and the model without the concealed effects, but not the [`Answer`].

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

/// Number of rows with an angle that jumps for one sample, in a record with glitches.
const JUMPS: usize = 3;

/// Number of lost rows in a record with glitches.
const LOST_ROWS: usize = 20;

/// Size of a jump, over the white angle noise: typical of a loose connector or an interrupted transfer.
const JUMP_SIGMAS: f64 = 6.0;

/// Estimate with its standard deviation.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Estimate {
    /// Value.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
}

/// Reported effect.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Finding {
    /// Its kind.
    pub kind: String,
    /// Kinds in its equivalence class.
    pub or: Vec<String>,
    /// Estimated parameters.
    pub parameters: BTreeMap<String, Estimate>,
    /// Expression, if any.
    pub expression: Option<String>,
    /// p-value.
    pub p_value: f64,
}

/// Result of a diagnosis.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Outcome {
    /// Number of the trial.
    pub trial: u64,
    /// Verdict in one word.
    pub verdict: String,
    /// Reported effects.
    pub findings: Vec<Finding>,
    /// Number of stretches in which model and recording differ.
    pub locations: usize,
    /// Residual power after the findings over the fitted and the held-out rows, in units of the noise, if the found kinds
    /// are the concealed ones and linear.
    pub leaves: Option<[f64; 2]>,
}

impl Finding {
    /// True for a kind of the catalogue that predicts a signal.
    pub fn is_physics(&self) -> bool {
        self.kind != "unlisted"
            && !NOISE_KINDS.contains(&self.kind.as_str())
            && !FAULT_KINDS.contains(&self.kind.as_str())
    }

    /// True if the finding only excludes rows as unusable.
    pub fn is_fault(&self) -> bool {
        FAULT_KINDS.contains(&self.kind.as_str())
    }

    /// True if a kind is the finding's own or in its equivalence class.
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
            // The expression of a listed kind is its rival.
            expression: entry
                .expression
                .clone()
                .filter(|_| entry.kind == "unlisted"),
            p_value: entry.p_value,
        }
    }
}

/// Makes the recording of a trial and its model.
pub fn record(answer: &Answer, scene: &Scene) -> Result<(Recording, Model), InputError> {
    let scenario = scene.scenario(true, &answer.toml())?;
    let seeds = Seeds {
        motion: scene.motion_seed,
        noise: answer.noise_seed,
    };
    let mut simulation = simulate(&scenario, seeds, |_| {});
    // A generator separate from the simulator's streams, whose numbers end far below.
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
        // The excess of one sample is subtracted from the next: the running angle is unchanged.
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

/// Adds a random-walk pressure and a white voltage: channels without meaning.
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

/// Makes the recording, diagnoses it and records the outcome. With `leave_one_out` the concealed kinds are taken out of the
/// catalogue.
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

/// Simulates the recording of a trial and diagnoses it. With `leave_one_out` the concealed kinds are taken out of the
/// catalogue.
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

/// Converts a diagnosis to the challenge's form.
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
    // Noise kinds and excluded rows predict no signal.
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
