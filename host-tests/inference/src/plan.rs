//! Settings of the search, chosen before any data.

/// Prior odds and prices of the search, in units of log posterior.
///
/// Each was chosen on trials with seeds other than those of the marks; `rlg challenge --marks` shows their results.
#[derive(Debug, Clone, Copy)]
pub struct SearchPlan {
    /// Prior expected number of effects missing from a model, over all hypotheses together \[1\].
    pub expected_effects: f64,
    /// Largest number of hypotheses in a set: more has not been needed, and the exchanges grow with the square.
    pub most_members: usize,
    /// Price of one drift term of one record: its level has a prior width of some e².
    pub drift_term: f64,
    /// Price of any drift: one unit in ten drifts visibly in one recording.
    pub drift_any: f64,
    /// Price of a record that drifts without its drift group, or the reverse.
    pub drift_odd: f64,
    /// Largest deficit of a screened addition against the best set, at the present noise, for a refit.
    pub screening: f64,
    /// Number of candidates refitted at each step.
    pub refitted: usize,
    /// Residual share of a member's squared size up to which a rival is an equivalent explanation \[1\].
    pub left_share: f64,
}

impl Default for SearchPlan {
    fn default() -> Self {
        Self {
            expected_effects: 0.3,
            most_members: 6,
            drift_term: 2.0,
            drift_any: 2.3,
            drift_odd: 3.0,
            screening: 3.0,
            refitted: 4,
            left_share: 0.01,
        }
    }
}
