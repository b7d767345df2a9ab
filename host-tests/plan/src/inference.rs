//! Search over a Gaussian likelihood.

use crate::section::section;

section! {
    /// Thresholds of the likelihood and of its search.
    InferencePlan {
        /// Prices of the search.
        search: SearchPlan;
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
    }
}
