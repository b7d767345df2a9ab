//! `calibration.json`: the contract's effect entry and next experiment, with the supporting figures.
//!
//! SI units. `format`, `effects` and `next_experiment` are the contract's; the rest are additions.

use serde::Serialize;
use std::collections::BTreeMap;

use rlg_findings::result::{EffectEntry, NoiseEntry, PlanEntry};
/// Names of the six coefficients.
pub use rlg_model::catalogue::SIX as NAMES;

/// Contents of the file.
#[derive(Debug, Clone, Serialize)]
pub struct Calibration {
    /// Format of this file.
    pub format: u32,
    /// Version of the tool.
    pub version: String,
    /// The recordings, in the order given.
    pub recordings: Vec<RecordingEntry>,
    /// One entry: the flexure of the axes.
    pub effects: Vec<EffectEntry>,
    /// Standard deviation of the worst direction over that of the best; null if a direction is not known at all.
    pub condition_number: Option<f64>,
    /// Eigenvectors of the covariance of the six K, smallest variance first.
    pub directions: Vec<DirectionEntry>,
    /// Combinations that are not identifiable from the recordings.
    pub not_identifiable: Vec<UnfixedEntry>,
    /// The six K of the new `model.toml`; null: switched off.
    pub in_model: BTreeMap<String, Option<f64>>,
    /// Nuisance parameters fitted with the six K.
    pub nuisances: Vec<NuisanceEntry>,
    /// Motion that would add most information.
    pub next_experiment: String,
    /// Summary, a line each.
    pub summary: Vec<String>,
    /// Thresholds other than the defaults, from `--plan FILE`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub plan: Vec<PlanEntry>,
}

/// One recording.
#[derive(Debug, Clone, Serialize)]
pub struct RecordingEntry {
    /// Its name.
    pub recording: String,
    /// `rates`: against reference increments; `attitude`: against attitude samples.
    pub method: &'static str,
    /// Duration used \[s\].
    pub seconds: f64,
    /// Largest angular acceleration about x, y, z \[rad/s²\].
    pub greatest_acceleration_rad_s2: [f64; 3],
    /// Residual power without flexure over the predicted noise power (1 = noise alone).
    pub normalised_power_before: f64,
    /// Residual power with flexure over the predicted noise power.
    pub normalised_power_after: f64,
    /// Matched-filter SNR of the calibrated flexure in this recording.
    pub snr: f64,
    /// Covariance of the six K from this recording alone \[s⁴\]; unobserved directions have the prior's.
    pub covariance: Vec<Vec<f64>>,
    /// Estimated noise of each gyro.
    pub noise: Vec<NoiseEntry>,
}

/// Direction in the space of the six K.
#[derive(Debug, Clone, Serialize)]
pub struct DirectionEntry {
    /// Unit vector, by name.
    pub combination: BTreeMap<String, f64>,
    /// Standard deviation \[s²\].
    pub std: f64,
}

/// Combination that is not identifiable.
#[derive(Debug, Clone, Serialize)]
pub struct UnfixedEntry {
    /// Parameter → weight.
    pub combination: BTreeMap<String, f64>,
    /// Standard deviation \[s²\].
    pub std: f64,
    /// Motion that would determine it.
    pub motion: String,
}

/// Nuisance parameter.
#[derive(Debug, Clone, Serialize)]
pub struct NuisanceEntry {
    /// The recording it belongs to.
    pub recording: String,
    /// Contract's kind.
    pub kind: &'static str,
    /// Contract's name.
    pub name: &'static str,
    /// Fitted value, in addition to the model's.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// Unit.
    pub unit: &'static str,
}
