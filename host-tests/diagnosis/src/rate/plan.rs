//! The numbers of a diagnosis against a reference on the gyros' rows, decided before looking.

use rlg_inference::SearchPlan;
use rlg_signal::partition::PartitionPlan;
use rlg_signal::shrinkage::Gate;

/// All thresholds of this engine.
///
/// `rlg challenge --marks --engine new` shows what they give on seeds that they were not chosen on.
#[derive(Debug, Clone, Copy)]
pub struct AnalysisPlan {
    /// Rows fitted, confirmed, tested.
    pub partition: PartitionPlan,
    /// Prices of the search.
    pub search: SearchPlan,
    /// Log posterior that a named effect must cost to do without.
    pub naming: f64,
    /// A rival that comes within this in log posterior stands in the effect's class.
    pub class_within: f64,
    /// A rival whose columns leave less of the effect than this \[σ\] stands in its class.
    pub separation: f64,
    /// How often the recording is re-enacted without an effect at most.
    pub reenactments: usize,
    /// Chance below which what re-enactments show is no chance: an effect is deflated, or more of them cannot take its name.
    pub reenactment_chance: f64,
    /// Share of the residual's power below which an effect that turns no gyro further than its noise has no practical size.
    pub practical_share: f64,
    /// An effect that drift explains to within this, drift unpriced, may be drift.
    pub drift_within: f64,
    /// Standard deviation of the reference's noise power about its declaration \[1\].
    pub reference_std: f64,
    /// Where the reference shows motion.
    pub gate: Gate,
    /// Cells of time and frequency above the gate below which an axis shows no motion: some neighbourhoods of nine.
    pub least_cells: usize,
    /// Size of an event below which it is not tried \[σ\].
    pub event: f64,
    /// Chance of a band's power below which the fit leaves something there, all bands counted.
    pub unexplained: f64,
    /// Excess of a noise level over what is declared and measured below which it is no finding \[σ\].
    pub excess_noise: f64,
    /// The same as a ratio of powers.
    pub excess_ratio: f64,
    /// Most passes between motion, columns and search.
    pub passes: usize,
}

impl Default for AnalysisPlan {
    fn default() -> Self {
        Self {
            partition: PartitionPlan::default(),
            search: SearchPlan::default(),
            naming: 4.0,
            class_within: 3.0,
            separation: 5.0,
            reenactments: 8,
            reenactment_chance: 1e-3,
            practical_share: 0.01,
            drift_within: 6.0,
            reference_std: 0.5,
            gate: Gate::default(),
            least_cells: 27,
            event: 3.5,
            unexplained: 1e-4,
            excess_noise: 6.0,
            excess_ratio: 1.1,
            passes: 8,
        }
    }
}
