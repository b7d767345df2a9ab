//! The numbers of the analysis, decided before looking.

use rlg_diagnosis::AnalysisPlan;

use crate::positions_plan::PositionPlan;

/// Thresholds of the accelerometers' part; what they share with the gyros' is theirs.
#[derive(Debug, Clone, Copy)]
pub struct ForcePlan {
    /// What both parts share: partition, prices, naming, classes.
    pub shared: AnalysisPlan,
    /// Share by which the mean force may differ from gravity and still be a bias and a scale error beside it \[1\].
    pub far_from_gravity: f64,
    /// Power of a band over that of the quietest stretch beyond which a stretch was shaken \[1\].
    pub shaken_ratio: f64,
    /// Observations that a band must hold to be judged.
    pub fewest_in_band: f64,
    /// Least seconds of rows to fit: below this not even the noise is known \[s\].
    pub least_fitted_s: f64,
    /// A vertical or a delay that moves by less than this between passes has settled \[σ\].
    pub settled: f64,
    /// Still positions without a reference.
    pub positions: PositionPlan,
    /// Matched-filter SNR below which a kind of typical size is not excluded \[1\].
    pub needed_snr: f64,
}

impl Default for ForcePlan {
    fn default() -> Self {
        Self {
            shared: AnalysisPlan::default(),
            far_from_gravity: 0.1,
            shaken_ratio: 2.0,
            fewest_in_band: 20.0,
            least_fitted_s: 2.0,
            settled: 0.1,
            positions: PositionPlan::default(),
            needed_snr: rlg_findings::sentences::NEEDED_SNR,
        }
    }
}
