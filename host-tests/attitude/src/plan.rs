//! Decision thresholds. Calibrated by `cargo test -p rlg --test diagnose attitude` and on rotated blocks of
//! real recordings.

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
    /// Test of the attitudes' convention.
    pub conventions: ConventionPlan,
    /// Search for the settling of an attitude filter.
    pub settling: SettlingPlan,
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
            conventions: ConventionPlan::default(),
            settling: SettlingPlan::default(),
            zeroing: ZeroingPlan::default(),
            lines: OwnLinesPlan::default(),
        }
    }
}

/// Criteria for another convention.
#[derive(Debug, Clone, Copy)]
pub struct ConventionPlan {
    /// Residual share of the turns' squares below which the declared convention is accepted \[1\].
    pub fits: f64,
    /// Largest residual power of a better convention, relative to the declared one's \[1\]: an attitude filter's own error is
    /// in both.
    pub better: f64,
    /// Largest relative residual power of a better convention where the declared one has a plausible mount \[1\].
    pub far_better: f64,
    /// Least rotation of an implausible mount \[rad\].
    pub implausible_rad: f64,
    /// Largest residual power of an equally good convention, relative to the best one's \[1\]: another order of the
    /// components is the inverse between other constant rotations. Of these the one of the smallest mount is selected.
    pub as_well: f64,
}

impl Default for ConventionPlan {
    fn default() -> Self {
        Self {
            fits: 0.01,
            better: 0.5,
            far_better: 0.05,
            implausible_rad: 60.0 * std::f64::consts::PI / 180.0,
            as_well: 2.0,
        }
    }
}

/// Thresholds of the search for a settling.
#[derive(Debug, Clone, Copy)]
pub struct SettlingPlan {
    /// Shortest time constant \[samples\].
    pub least_samples: f64,
    /// Least length of the record \[time constants\].
    pub least_lengths: f64,
    /// Ratio of neighbouring time constants that are tried \[1\].
    pub step: f64,
    /// Least gain in 2 ln L over no decay.
    pub least_gain: f64,
    /// Gain in 2 ln L that separates it from a decaying bias of the gyros.
    pub apart: f64,
    /// Largest share of the squares of the first two time constants that is left \[1\].
    pub left: f64,
}

impl Default for SettlingPlan {
    fn default() -> Self {
        Self {
            least_samples: 6.0,
            least_lengths: 3.0,
            step: 1.4,
            least_gain: 50.0,
            apart: 10.0,
            left: 0.3,
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
