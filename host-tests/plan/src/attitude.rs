//! Gyros with an attitude reference.

use crate::OwnLinesPlan;
use crate::section::section;

section! {
    /// Thresholds of a diagnosis against attitudes.
    AttitudePlan {
        /// Least number of stamps for an estimate of their noise; below, the noise is declared by the model or has a prior.
        least_stamps: usize = 40, "1", [4.0, 1e6];
        /// Median of the white noise of an attitude reference that the model does not declare, for rows too few to estimate
        /// it: optical tracking has 1e-4 to 1e-3, a camera 2e-3, a table or corner by hand up to 1e-2.
        undeclared_attitude_noise_rad: f64 = 1e-3, "rad", [1e-9, 1.0];
        /// Standard deviation of the logarithm of an undeclared noise level, for few rows.
        undeclared_log_std: f64 = 1.15, "1", [1e-3, 10.0];
        /// Share of the stamps, at the end, held out for validation.
        tested_share: f64 = 0.2, "1", [0.01, 0.9];
        /// Least gain in log likelihood, deflated by the design effect of blocks and less the price of the search.
        least_gain: f64 = 4.0, "nat", [0.0, 1000.0];
        /// Least gain in log likelihood of a physical effect in cross-validation over blocks.
        least_predicted: f64 = 4.0, "nat", [0.0, 1000.0];
        /// Largest deficit in log likelihood of a kind not distinguishable from the winner.
        alike_within: f64 = 5.0, "nat", [0.0, 1000.0];
        /// Least share of the best gain at which a registration group is a separate start.
        nearly: f64 = 0.5, "1", [0.0, 1.0];
        /// Most physical effects.
        most_effects: usize = 6, "1", [0.0, 100.0];
        /// Residual power on held-out rows, relative to the noise model, above which the record is not fully explained.
        most_power: f64 = 10.0, "1", [1.0, 1e6];
        /// Test of the attitudes' convention.
        conventions: ConventionPlan;
        /// Search for the settling of an attitude filter.
        settling: SettlingPlan;
        /// Search for automatic zeroing.
        zeroing: ZeroingPlan;
        /// Search for lines of the gyros alone.
        lines: OwnLinesPlan;
    }
}

section! {
    /// Criteria for another convention.
    ConventionPlan {
        /// Residual share of the turns' squares below which the declared convention is accepted.
        fits: f64 = 0.01, "1", [0.0, 1.0];
        /// Largest residual power of a better convention, relative to the declared one's: an attitude filter's own error is
        /// in both.
        better: f64 = 0.5, "1", [0.0, 1.0];
        /// Largest relative residual power of a better convention where the declared one has a plausible mount.
        far_better: f64 = 0.05, "1", [0.0, 1.0];
        /// Least rotation of an implausible mount.
        implausible_rad: f64 = 60.0 * std::f64::consts::PI / 180.0, "rad", [0.0, 4.0];
        /// Largest residual power of an equally good convention, relative to the best one's: another order of the
        /// components is the inverse between other constant rotations. Of these the one of the smallest mount is selected.
        as_well: f64 = 2.0, "1", [1.0, 1000.0];
    }
}

section! {
    /// Thresholds of the search for a settling.
    SettlingPlan {
        /// Shortest time constant in samples.
        least_samples: f64 = 6.0, "1", [1.0, 1000.0];
        /// Least length of the record in time constants.
        least_lengths: f64 = 3.0, "1", [1.0, 1000.0];
        /// Ratio of neighbouring time constants that are tried.
        step: f64 = 1.4, "1", [1.01, 10.0];
        /// Least gain in 2 ln L over no decay.
        least_gain: f64 = 50.0, "nat", [0.0, 1e6];
        /// Gain in 2 ln L that separates it from a decaying bias of the gyros.
        apart: f64 = 10.0, "nat", [0.0, 1e6];
        /// Largest share of the squares of the first two time constants that is left.
        left: f64 = 0.3, "1", [0.0, 1.0];
    }
}

section! {
    /// Thresholds of the search for automatic zeroing.
    ZeroingPlan {
        /// Time over which increments are summed: delays and noise matter less.
        block_s: f64 = 0.1, "s", [1e-4, 10.0];
        /// Largest share of the squares left without a high pass that one leaves.
        left: f64 = 0.3, "1", [0.0, 1.0];
    }
}
