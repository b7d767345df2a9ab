//! Next experiment in `diagnosis.json`: moves, predicted separations and precisions.

use schemars::JsonSchema;
use serde::Serialize;

/// Predicted benefit of the next experiment, from the Fisher information of its motion under this recording's noise.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ExperimentEntry {
    /// Description of the experiment.
    pub programme: String,
    /// The moves, in order.
    pub moves: Vec<MoveEntry>,
    /// Number of repetitions of all moves.
    pub repeats: u32,
    /// Sampling interval of the attitudes \[s\], for an attitude reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude_every_s: Option<f64>,
    /// Predicted separations of kinds that are not distinguishable here.
    pub separations: Vec<SeparationEntry>,
    /// Standard deviations of the parameters of the found effects.
    pub precisions: Vec<PrecisionEntry>,
}

/// One move of a table, as in a scenario.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct MoveEntry {
    /// `still`, `coning` or `spin`.
    pub kind: &'static str,
    /// Axis of the cone or the spin.
    pub axis: &'static str,
    /// Spin rate \[rad/s\].
    pub rate_rad_s: f64,
    /// Axis of the oscillation.
    pub oscillation_axis: &'static str,
    /// Frequency of the oscillation or the cone \[Hz\].
    pub frequency_hz: f64,
    /// Peak angle of either \[rad\].
    pub angle_rad: f64,
    /// Phase of the oscillation's rate at the beginning \[rad\].
    pub phase_rad: f64,
    /// Ramp at either end \[s\].
    pub ramp_s: f64,
    /// Duration, ramps included \[s\].
    pub duration_s: f64,
}

/// Distance between an effect of the estimated size and the nearest effect of a rival kind \[σ\].
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SeparationEntry {
    /// Kind assumed true.
    pub truth: String,
    /// Rival kind.
    pub rival: String,
    /// Separation in this recording \[σ\]; null: not computed.
    pub here_sigma: Option<f64>,
    /// Predicted separation in the experiment \[σ\].
    pub promised_sigma: f64,
}

impl SeparationEntry {
    /// Returns the kind that `own` is separated from.
    pub fn other_than(&self, own: &str) -> &str {
        if self.truth == own {
            &self.rival
        } else {
            &self.truth
        }
    }
}

/// Standard deviation of a parameter of a found effect, here and in the experiment.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct PrecisionEntry {
    /// The parameter.
    pub name: String,
    /// Standard deviation in this recording.
    pub here_std: f64,
    /// Predicted standard deviation in the experiment.
    pub promised_std: f64,
    /// Unit of both.
    pub unit: String,
}
