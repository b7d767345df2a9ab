//! Settings of the analysis, fixed before the data are seen.

use rlg_diagnosis::AnalysisPlan;

use crate::positions_plan::PositionPlan;

/// Thresholds of the accelerometers' diagnosis; those shared with the gyros are the gyros'.
#[derive(Debug, Clone, Copy)]
pub struct ForcePlan {
    /// Shared settings: partition, priors, naming, equivalence classes.
    pub shared: AnalysisPlan,
    /// Largest relative difference of the mean force from gravity that a bias and a scale error may explain \[1\].
    pub far_from_gravity: f64,
    /// Ratio of a band's power to that of the quietest stretch above which a stretch counts as shaken \[1\].
    pub shaken_ratio: f64,
    /// Least number of observations of a band for a decision.
    pub fewest_in_band: f64,
    /// Least duration of rows to fit \[s\]; below it not even the noise is estimable.
    pub least_fitted_s: f64,
    /// Convergence limit of a vertical or a delay between passes \[σ\].
    pub settled: f64,
    /// Settings for still positions without a reference.
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
