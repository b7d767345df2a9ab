//! `calibration.json`: the contract's effect entry and next experiment, with what stands behind them.
//!
//! SI units. `format`, `effects` and `next_experiment` are the contract's; the rest are additions.

use serde::Serialize;
use std::collections::BTreeMap;

use rlg_findings::result::{EffectEntry, NoiseEntry};
/// Names of the six coefficients.
pub use rlg_model::catalogue::SIX as NAMES;

/// The whole file.
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
    /// Spread of the worst known direction over that of the best; null where a direction is not known at all.
    pub condition_number: Option<f64>,
    /// Eigenvectors of the covariance of the six K, best known first.
    pub directions: Vec<DirectionEntry>,
    /// Combinations that the recordings do not fix.
    pub not_identifiable: Vec<UnfixedEntry>,
    /// The six K that `model.toml` now has; null: switched off.
    pub in_model: BTreeMap<String, Option<f64>>,
    /// What was fitted beside the six K.
    pub nuisances: Vec<NuisanceEntry>,
    /// The motion that would tell more.
    pub next_experiment: String,
    /// For people, a line each.
    pub summary: Vec<String>,
}

/// One recording.
#[derive(Debug, Clone, Serialize)]
pub struct RecordingEntry {
    /// Its name.
    pub recording: String,
    /// `rates`: against reference increments; `attitude`: against attitude samples.
    pub method: &'static str,
    /// Seconds used.
    pub seconds: f64,
    /// The greatest angular acceleration about x, y, z \[rad/s²\].
    pub greatest_acceleration_rad_s2: [f64; 3],
    /// Residual power without flexure over what the noise predicts (1 = nothing left).
    pub normalised_power_before: f64,
    /// The same with flexure.
    pub normalised_power_after: f64,
    /// Matched-filter SNR of the calibrated flexure in this recording.
    pub snr: f64,
    /// Covariance of the six K from this recording alone \[s⁴\]; what it does not show has the prior's.
    pub covariance: Vec<Vec<f64>>,
    /// Noise each gyro was judged with.
    pub noise: Vec<NoiseEntry>,
}

/// A direction among the six K.
#[derive(Debug, Clone, Serialize)]
pub struct DirectionEntry {
    /// Unit vector, by name.
    pub combination: BTreeMap<String, f64>,
    /// Its spread \[s²\].
    pub std: f64,
}

/// A combination that is not fixed.
#[derive(Debug, Clone, Serialize)]
pub struct UnfixedEntry {
    /// Parameter → weight.
    pub combination: BTreeMap<String, f64>,
    /// Its spread \[s²\].
    pub std: f64,
    /// The motion that would fix it.
    pub motion: String,
}

/// Another number that was fitted.
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
