//! Decision thresholds. Calibrated by `cargo test -p rlg --test diagnose attitude` and on rotated blocks of
//! real recordings (inference.md, B6).

use rlg_signal::own_lines::OwnLinesPlan;

/// Decision thresholds of a diagnosis against attitudes.
#[derive(Debug, Clone, Copy)]
pub struct AttitudePlan {
    /// Least number of stamps for an estimate of their noise; below, the noise is declared by the model or has a prior.
    pub least_stamps: usize,
    /// Median of the white noise of an attitude reference that the model does not declare, for rows too few to estimate it
    /// \[rad\]: optical tracking has 1e-4 to 1e-3, a camera 2e-3, a table or corner by hand up to 1e-2.
    pub undeclared_attitude_noise_rad: f64,
    /// Standard deviation of the logarithm of an undeclared noise level, for few rows.
    pub undeclared_log_std: f64,
    /// Share of the stamps, at the end, held out for validation \[1\].
    pub tested_share: f64,
    /// Least gain in log likelihood, deflated by the design effect of blocks and less the price of the search.
    pub least_gain: f64,
    /// Least gain in log likelihood of a physical effect in cross-validation over blocks.
    pub least_predicted: f64,
    /// Largest deficit in log likelihood of a kind not distinguishable from the winner.
    pub alike_within: f64,
    /// Least share of the best gain at which a registration group is a separate start \[1\].
    pub nearly: f64,
    /// Most physical effects.
    pub most_effects: usize,
    /// Residual power on held-out rows, relative to the noise model, above which the record is not fully explained.
    pub most_power: f64,
    /// Search for automatic zeroing.
    pub zeroing: ZeroingPlan,
    /// Search for lines of the gyros alone.
    pub lines: OwnLinesPlan,
}

impl Default for AttitudePlan {
    fn default() -> Self {
        Self {
            least_stamps: 40,
            undeclared_attitude_noise_rad: 1e-3,
            undeclared_log_std: 1.15,
            tested_share: 0.2,
            least_gain: 4.0,
            least_predicted: 4.0,
            alike_within: 5.0,
            nearly: 0.5,
            most_effects: 6,
            most_power: 10.0,
            zeroing: ZeroingPlan::default(),
            lines: OwnLinesPlan::default(),
        }
    }
}

/// Thresholds of the search for automatic zeroing.
#[derive(Debug, Clone, Copy)]
pub struct ZeroingPlan {
    /// Time over which increments are summed \[s\]: delays and noise matter less.
    pub block_s: f64,
    /// Largest share of the squares left without a high pass that one leaves \[1\].
    pub left: f64,
}

impl Default for ZeroingPlan {
    fn default() -> Self {
        Self {
            block_s: 0.1,
            left: 0.3,
        }
    }
}
