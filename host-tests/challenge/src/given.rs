//! Examination of others' recordings with their truth: committed to, diagnosed, scored.
//!
//! From a recording's folder (with its `model.toml`) and its truth file, a [`Given`]. The truth is read for its hash before
//! the diagnosis and parsed only after it.
//!
//! A truth file: `{"effects": [{"kind": ..., "parameters": {...}}]}`, as written by `rlg simulate`; further keys are
//! ignored. Strengths are unknown here, so there is no comparison with theory.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::commit::sha256;
use super::examine::{Finding, outcome_of};
use rlg_findings::result::Diagnosis;
use rlg_findings::sentences::combination;
use rlg_flow::{Settings, diagnose_under};
use rlg_model::Model;
use rlg_recording::Recording;
use rlg_recording::error::InputError;

/// File of the model in a recording's folder.
pub const MODEL: &str = "model.toml";

/// Recording with its truth.
#[derive(Debug, Clone)]
pub struct Pair {
    /// Folder of the recording.
    pub recording: PathBuf,
    /// File of the truth.
    pub truth: PathBuf,
    /// Bytes of the truth, hashed before the diagnosis and parsed after it.
    bytes: Vec<u8>,
}

/// Content of a truth file.
#[derive(Debug, Deserialize)]
struct Truth {
    effects: Vec<Concealed>,
}

/// Concealed effect.
#[derive(Debug, Deserialize)]
struct Concealed {
    kind: String,
    #[serde(default)]
    parameters: BTreeMap<String, Value>,
}

/// Combination of parameters reported as identifiable, with its truth.
#[derive(Debug, Clone, Serialize)]
pub struct Known {
    /// Kind of the effect.
    pub kind: String,
    /// Combination, as "xy + xz".
    pub combination: String,
    /// True value.
    pub truth: f64,
    /// Estimated value.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
}

/// Score of one recording.
#[derive(Debug, Clone, Serialize)]
pub struct Given {
    /// Name of the recording.
    pub recording: String,
    /// Hash of its truth file, committed to before the diagnosis.
    pub truth_sha256: String,
    /// Concealed kinds.
    pub concealed: Vec<String>,
    /// Kinds taken out of the tool's catalogue.
    pub left_out: Vec<String>,
    /// Verdict in one word.
    pub verdict: String,
    /// Findings.
    pub found: Vec<Finding>,
    /// Every concealed kind was claimed and nothing else; on effect-free records, nothing was.
    pub right: bool,
    /// Claims that are false.
    pub wrong: Vec<String>,
    /// Combinations reported as identifiable.
    pub known: Vec<Known>,
}

impl Pair {
    /// Reads the bytes of the truth without parsing them.
    pub fn new(recording: &Path, truth: &Path) -> Result<Self, InputError> {
        let bytes = fs::read(truth).map_err(|error| InputError::unreadable(truth, &error))?;
        Ok(Self {
            recording: recording.to_path_buf(),
            truth: truth.to_path_buf(),
            bytes,
        })
    }

    /// Line of `commitments.txt`.
    pub fn commitment(&self) -> (String, String) {
        let name = self.truth.file_name().unwrap_or_default();
        (name.to_string_lossy().into_owned(), sha256(&self.bytes))
    }

    /// Diagnoses and scores. With `leave_one_out` the concealed kinds are first taken out of the catalogue, for which the
    /// truth has to be parsed.
    pub fn score(&self, leave_one_out: bool) -> Result<Given, InputError> {
        let file = self.recording.join(MODEL);
        let (model, _) = Model::read_with_warnings(&file)?;
        let recording = Recording::read(&self.recording)?;
        let left_out: Vec<String> = if leave_one_out {
            self.open()?
                .effects
                .into_iter()
                .map(|effect| effect.kind)
                .collect()
        } else {
            Vec::new()
        };
        let kinds: Vec<&str> = left_out.iter().map(String::as_str).collect();
        let settings = Settings {
            left_out: &kinds,
            ..Settings::default()
        };
        let said = diagnose_under(&settings, &recording, &model, &file, &|_| {})?.diagnosis;
        Ok(given(&self.commitment().1, &said, &self.open()?, left_out))
    }

    fn open(&self) -> Result<Truth, InputError> {
        serde_json::from_slice(&self.bytes).map_err(|error| {
            InputError::new(&self.truth, error.to_string())
                .expected("{\"effects\": [{\"kind\": ..., \"parameters\": {...}}]}")
        })
    }
}

fn given(hash: &str, said: &Diagnosis, truth: &Truth, left_out: Vec<String>) -> Given {
    let outcome = outcome_of(0, said);
    let claims: Vec<&Finding> = outcome
        .findings
        .iter()
        .filter(|one| one.kind != "unlisted" && (!one.is_fault() || told(truth, one)))
        .collect();
    let wrong: Vec<String> = claims
        .iter()
        .filter(|one| !truth.effects.iter().any(|effect| one.covers(&effect.kind)))
        .map(|one| one.kind.clone())
        .collect();
    let claimed = |effect: &Concealed| claims.iter().any(|one| one.covers(&effect.kind));
    let outside = |effect: &Concealed| {
        effect.kind == "unlisted" && outcome.findings.iter().any(|one| one.kind == "unlisted")
    };
    let all = truth
        .effects
        .iter()
        .all(|effect| claimed(effect) || outside(effect));
    let nothing = !truth.effects.is_empty() || outcome.findings.iter().all(Finding::is_fault);
    Given {
        recording: said.recording.clone(),
        truth_sha256: hash.to_owned(),
        concealed: truth
            .effects
            .iter()
            .map(|effect| effect.kind.clone())
            .collect(),
        left_out,
        verdict: outcome.verdict.clone(),
        right: all && nothing && wrong.is_empty(),
        wrong,
        known: known(said, truth),
        found: outcome.findings,
    }
}

/// True if a data fault is among the concealed effects: only then is its report scored.
fn told(truth: &Truth, one: &Finding) -> bool {
    truth.effects.iter().any(|effect| one.covers(&effect.kind))
}

fn known(said: &Diagnosis, truth: &Truth) -> Vec<Known> {
    let mut list = Vec::new();
    for effect in &said.effects {
        let its = truth
            .effects
            .iter()
            .find(|concealed| concealed.kind == effect.kind);
        let Some(its) = its else { continue };
        for one in &effect.identifiable {
            let number = |name: &String| {
                its.parameters
                    .get(name)
                    .and_then(Value::as_f64)
                    .unwrap_or(0.0)
            };
            list.push(Known {
                kind: effect.kind.clone(),
                combination: combination(&one.combination),
                truth: one
                    .combination
                    .iter()
                    .map(|(name, weight)| weight * number(name))
                    .sum(),
                value: one.value,
                std: one.std,
            });
        }
    }
    list
}
