//! System under test: our diagnosis with its settings, or another one's answers; and the summary of a diagnosis.

use rlg_plan::Plan;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rlg_flow::Settings;
use rlg_model::{DeclaredModel, Model};
use rlg_recording::Recording;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::read_as::ReadAs;

/// Estimate with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Value.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
}

/// Reported effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FoundEffect {
    /// Its kind.
    pub kind: String,
    /// Kinds in its equivalence class, except those excluded by gravity.
    pub indistinguishable_from: Vec<String>,
    /// `named`, `measured`, `class`; `None` if the engine labels nothing and so names all it reports.
    pub label: Option<String>,
    /// Estimated parameters.
    pub numbers: BTreeMap<String, Estimate>,
    /// Linear combinations of the parameters that are identifiable: weights, and estimates.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub combinations: Vec<(BTreeMap<String, f64>, Estimate)>,
    /// Text parameters: `axis`.
    pub texts: BTreeMap<String, String>,
    /// Expression, if `unlisted`.
    pub expression: Option<String>,
    /// Gain of ln evidence.
    #[serde(default)]
    pub gain: f64,
}

/// Summary of a diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DiagnosisSummary {
    /// Verdict in one word.
    pub verdict: String,
    /// Reported effects.
    pub effects: Vec<FoundEffect>,
    /// Joint estimate of the alignment of two instruments, all parameters fitted together.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub registration: Vec<FoundEffect>,
    /// Diagnosis of the same recording with the updated model, if requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub again: Option<Box<DiagnosisSummary>>,
}

impl DiagnosisSummary {
    /// Reads a `diagnosis.json`.
    pub fn from_json(diagnosis: &Value) -> Result<Self, String> {
        let text = |value: &Value| value.as_str().map(str::to_owned);
        let effects = diagnosis["effects"].as_array().ok_or("no effects")?;
        Ok(Self {
            verdict: text(&diagnosis["verdict"]).ok_or("no verdict")?,
            effects: effects.iter().map(found).collect(),
            registration: diagnosis["registration"]
                .as_array()
                .into_iter()
                .flatten()
                .map(found)
                .collect(),
            again: None,
        })
    }
}

/// Combination of several parameters; `None` for a single one, which is among the numbers already.
fn combination(one: &Value) -> Option<(BTreeMap<String, f64>, Estimate)> {
    let weights = one["combination"].as_object()?.iter();
    let weights: BTreeMap<String, f64> = weights
        .filter_map(|(name, weight)| Some((name.clone(), weight.as_f64()?)))
        .collect();
    let [value, std] = [one["value"].as_f64()?, one["std"].as_f64()?];
    (weights.len() > 1).then_some((weights, Estimate { value, std }))
}

fn found(effect: &Value) -> FoundEffect {
    let text = |name: &str| effect[name].as_str().map(str::to_owned);
    let mut numbers = BTreeMap::new();
    let mut texts = BTreeMap::new();
    for parameter in effect["parameters"].as_array().into_iter().flatten() {
        let Some(name) = parameter["name"].as_str() else {
            continue;
        };
        match (parameter["value"].as_f64(), parameter["value"].as_str()) {
            (Some(value), _) => {
                let std = parameter["std"].as_f64().unwrap_or(f64::INFINITY);
                numbers.insert(name.to_owned(), Estimate { value, std });
            }
            (None, Some(value)) => {
                texts.insert(name.to_owned(), value.to_owned());
            }
            (None, None) => {}
        }
    }
    let alike = effect["indistinguishable_from"].as_array();
    let against = effect["gravity_speaks_against"].as_array();
    let is_open = |kind: &str| !against.into_iter().flatten().any(|other| *other == *kind);
    let identifiable = effect["identifiable"].as_array();
    FoundEffect {
        combinations: identifiable
            .into_iter()
            .flatten()
            .filter_map(combination)
            .collect(),
        kind: text("kind").unwrap_or_default(),
        indistinguishable_from: alike
            .into_iter()
            .flatten()
            .filter_map(|kind| kind.as_str().map(str::to_owned))
            .filter(|kind| is_open(kind))
            .collect(),
        label: text("label"),
        numbers,
        texts,
        expression: text("expression"),
        gain: effect["log_evidence_gain"].as_f64().unwrap_or(0.0),
    }
}

/// System under test.
pub enum UnderTest {
    /// Our diagnosis.
    Ours(Box<Ours>),
    /// Folder of answers: TRIAL/diagnosis.json, with the trials' names of the export.
    Answers(PathBuf),
}

/// Our diagnosis with its settings.
pub struct Ours {
    settings: Settings<'static>,
    is_twice: bool,
    read_as: ReadAs,
}

impl UnderTest {
    /// Diagnoses with the numbers of a plan, and once more with the updated model if `is_twice`.
    pub fn new(plan: Plan, is_twice: bool, read_as: ReadAs) -> Self {
        let settings = Settings {
            plan,
            ..Settings::default()
        };
        Self::Ours(Box::new(Ours {
            settings,
            is_twice,
            read_as,
        }))
    }

    /// Diagnosis of a trial, or the reason for its absence.
    pub fn answer(
        &self,
        name: &str,
        recording: &Recording,
        model: &Model,
    ) -> Result<DiagnosisSummary, String> {
        match self {
            Self::Ours(ours) => ours.diagnose(recording, model),
            Self::Answers(folder) => {
                let file = folder.join(name).join("diagnosis.json");
                let text = std::fs::read_to_string(&file)
                    .map_err(|error| format!("{}: {error}", file.display()))?;
                let json: Value = serde_json::from_str(&text)
                    .map_err(|error| format!("{}: {error}", file.display()))?;
                DiagnosisSummary::from_json(&json)
            }
        }
    }
}

impl Ours {
    fn once(
        &self,
        recording: &Recording,
        model: &Model,
    ) -> Result<(DiagnosisSummary, Model), String> {
        let file = Path::new("model.toml");
        let outcome = self
            .read_as
            .diagnose(&self.settings, recording, DeclaredModel::new(model, file))
            .map_err(|error| error.to_string())?;
        let json = serde_json::to_value(&outcome.diagnosis).map_err(|error| error.to_string())?;
        Ok((DiagnosisSummary::from_json(&json)?, outcome.model))
    }

    /// Diagnoses a recording with a model, or returns the reason why it cannot.
    fn diagnose(&self, recording: &Recording, model: &Model) -> Result<DiagnosisSummary, String> {
        let (mut said, written) = self.once(recording, model)?;
        if self.is_twice {
            // The same model gives the same diagnosis.
            let again = match written == *model {
                true => said.clone(),
                false => self.once(recording, &written)?.0,
            };
            said.again = Some(Box::new(again));
        }
        Ok(said)
    }
}
