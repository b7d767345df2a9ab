//! What is decided before looking at the data: the numbers of the search.

/// Prior odds and prices of the search, in units of log posterior.
///
/// Each was chosen on trials whose seeds are not those of the marks; `rlg challenge --marks` shows what they give.
#[derive(Debug, Clone, Copy)]
pub struct SearchPlan {
    /// Effects that a model is expected to lack, over all hypotheses together \[1\].
    pub expected_effects: f64,
    /// Most hypotheses in one set: more has not been needed, and the exchanges grow with the square.
    pub most_members: usize,
    /// Price of one drift term of one record: its level is free over some e² of prior width.
    pub drift_term: f64,
    /// Price of any drift: one unit in ten drifts visibly in one recording.
    pub drift_any: f64,
    /// Price of a record that drifts where its sisters do not, or the reverse.
    pub drift_odd: f64,
    /// How far behind the best set an addition may be at the present noise and still be refitted.
    pub screening: f64,
    /// Candidates refitted at each step.
    pub refitted: usize,
    /// Share of a member's squared size that a rival may leave and still explain as much \[1\].
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
