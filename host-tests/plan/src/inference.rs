//! Search over a Gaussian likelihood.

use crate::section::section;

section! {
    /// Thresholds of the likelihood and of its search.
    InferencePlan {
        /// Prices of the search.
        search: SearchPlan;
        /// Scan for steps, impulses and windows.
        events: EventPlan;
        /// Scan for the strongest line of a residual.
        lines: LineScanPlan;
        /// Periodogram of lines between the coefficients.
        periodogram: PeriodogramPlan;
    }
}

section! {
    /// Scan of a span for steps, impulses and windows.
    EventPlan {
        /// Rows at either end of a span without impulses and windows.
        end_rows: usize = 4, "rows", [0.0, 1000.0];
        /// Least number of rows at either end of a span without steps.
        step_end_rows: usize = 8, "rows", [1.0, 1e6];
        /// Ratio of successive lengths of a window.
        length_ratio: f64 = 1.15, "1", [1.001, 10.0];
        /// Number of places of a window per its length: an edge off by a sixteenth costs a thirtieth of the size.
        places: usize = 8, "1", [1.0, 1000.0];
        /// Inverse of the share of the rows at either end of a span without steps.
        step_end_one_in: usize = 100, "1", [4.0, 1e6];
    }
}

section! {
    /// Scan for the strongest line of a residual, against the median power around it.
    LineScanPlan {
        /// Coefficients of a block with one median.
        block: usize = 48, "1", [4.0, 1e6];
        /// Lowest coefficient; below it a line is a few periods long, as drift.
        first: usize = 6, "1", [1.0, 1e6];
    }
}

section! {
    /// Lines at all frequencies, against the noise and their neighbourhood.
    PeriodogramPlan {
        /// Turns in the record below which a line is drift.
        least_turns: usize = 4, "1", [1.0, 1000.0];
        /// Gain 2 Δ ln L of all records below which a frequency is no candidate.
        least_gain: f64 = 16.0, "1", [0.0, 1000.0];
        /// Half-width of the neighbourhood of a line, in resolutions of the record.
        around: usize = 48, "1", [4.0, 10000.0];
        /// Half-width of the line itself, excluded from its neighbourhood, in resolutions of the record.
        own: usize = 2, "1", [0.0, 1000.0];
    }
}

section! {
    /// Prior odds and prices of the search, in units of log posterior.
    SearchPlan {
        /// Prior expected number of effects missing from a model, over all hypotheses together.
        expected_effects: f64 = 0.3, "1", [1e-6, 100.0];
        /// Largest number of hypotheses in a set: more has not been needed, and the exchanges grow with the square.
        most_members: usize = 6, "1", [1.0, 100.0];
        /// Price of one drift term of one record: its level has a prior width of some e².
        drift_term: f64 = 2.0, "nat", [0.0, 100.0];
        /// Price of any drift: one unit in ten drifts visibly in one recording.
        drift_any: f64 = 2.3, "nat", [0.0, 100.0];
        /// Price of a record that drifts without its drift group, or the reverse.
        drift_odd: f64 = 3.0, "nat", [0.0, 100.0];
        /// Largest deficit of a screened addition against the best set, at the present noise, for a refit.
        screening: f64 = 3.0, "nat", [0.0, 1000.0];
        /// Largest gain of a screened rival by a refit of the noise.
        rival_margin: f64 = 5.0, "nat", [0.0, 1000.0];
        /// Number of candidates refitted at each step.
        refitted: usize = 4, "1", [1.0, 1000.0];
        /// Residual share of a member's squared size up to which a rival is an equivalent explanation.
        left_share: f64 = 0.01, "1", [0.0, 1.0];
        /// Largest excess of an estimate over its possible range attributed to chance.
        by_chance: f64 = 3.0, "σ", [0.0, 100.0];
    }
}
