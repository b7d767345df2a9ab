//! Gyros with a reference on the same rows.

use crate::section::section;

section! {
    /// Thresholds of this kind of recording alone.
    RatesPlan {
        /// Blocks for the cross-validation of an effect.
        blocks: BlockPlan;
        /// Search for effects far from the model.
        coarse: CoarsePlan;
        /// Effects of some rows only.
        window: WindowPlan;
        /// Families of effects that are scanned.
        families: FamilyPlan;
        /// Lock-in of gyros without a dither.
        lock_in: LockInPlan;
        /// Significance from which a gyro's delay or low pass is used: a gyro that hardly turns fits one of any length.
        path_deviations: f64 = 3.0, "σ", [0.0, 100.0];
        /// Convergence limit of a parameter about which columns are linearised.
        settled: f64 = 0.1, "σ", [1e-6, 10.0];
    }
}

section! {
    /// Search for the rows in which a gyro follows a channel.
    WindowPlan {
        /// Number of trial edges; the best are refined between them.
        edges: usize = 128, "1", [2.0, 10000.0];
        /// Fall of the log likelihood within which an edge may lie: three standard deviations.
        edge_within: f64 = 4.5, "nat", [0.0, 100.0];
    }
}

impl WindowPlan {
    /// Half-width of the range of an edge \[σ\].
    pub fn edge_deviations(&self) -> f64 {
        (2.0 * self.edge_within).sqrt()
    }
}

section! {
    /// Scan of families of effects by score tests.
    FamilyPlan {
        /// Largest number of members of a family for the search.
        strongest: usize = 3, "1", [1.0, 1000.0];
        /// Number of rows above which long lists are tested over sums of rows; faster effects are left to the exact columns.
        most_rows: usize = 20_000, "rows", [1000.0, 1e9];
        /// Number of maxima of a grid of resonances refined with exact columns: more have not been the best.
        refined: usize = 3, "1", [1.0, 1000.0];
        /// Lowest frequency of a resonance.
        resonance_from_hz: f64 = 5.0, "Hz", [1e-3, 1e5];
        /// Highest frequency of a resonance, as a share of the row rate.
        resonance_of_rate: f64 = 0.45, "1", [0.01, 0.5];
    }
}

section! {
    /// Search for lock-in thresholds.
    LockInPlan {
        /// Smallest and largest threshold: those of real lasers, 2 to 2000 °/h.
        range_rad_s: [f64; 2] = [1e-5, 1e-2], "rad/s", [1e-9, 10.0];
        /// Largest dead band attributed to rounding of single increments.
        rounded_units: f64 = 2.0, "units", [0.0, 100.0];
    }
}

section! {
    /// Blocks of rows for the cross-validation of an effect.
    BlockPlan {
        /// Length of a block.
        length_s: f64 = 6.0, "s", [1e-3, 1e5];
        /// Least number of blocks, however short.
        least: usize = 16, "1", [2.0, 1000.0];
        /// Largest number of blocks, however long.
        most: usize = 64, "1", [2.0, 100000.0];
    }
}

section! {
    /// Criteria of the coarse search for effects far from the model.
    CoarsePlan {
        /// Longest delay that is sought.
        longest_delay_s: f64 = 0.5, "s", [0.0, 60.0];
        /// Longest time constant of a low pass, here and in the search; a longer one is no bandwidth.
        longest_low_pass_s: f64 = 0.5, "s", [0.0, 60.0];
        /// Least share of the residual's power that a coarse effect explains.
        explained: f64 = 0.5, "1", [0.0, 1.0];
        /// Alternative criterion: its gain in blocks of rows, over their scatter.
        far_deviations: f64 = 6.0, "σ", [0.0, 100.0];
        /// Difference in log likelihood within which lags are tied: for a periodic motion the lag nearest to zero counts.
        tie: f64 = 10.0, "nat", [0.0, 1000.0];
        /// Number of rows above which sums of rows are used.
        most_rows: usize = 60_000, "rows", [1000.0, 1e9];
        /// Number of blocks of rows in which a gross departure is tested.
        blocks: usize = 16, "1", [2.0, 1000.0];
        /// Time constants of a low pass after which its output no longer depends on the values before the record.
        settled_time_constants: f64 = 5.0, "1", [0.0, 100.0];
    }
}
