//! Sensitivity of the results to a number of the analysis plan, on the same trials.

use rlg_recording::error::InputError;
use serde::Serialize;

use super::groups::Counts;
use super::read_as::ReadAs;
use super::run::{Outcome, Plan, Prepared};
use super::table::{Scores, score};
use super::under_test::UnderTest;

/// Factors applied to the number.
pub const FACTORS: [f64; 5] = [0.5, 0.7, 1.0, 1.4, 2.0];

/// Result at one value of the number.
#[derive(Debug, Clone, Serialize)]
pub struct Point {
    /// Factor on the number's own value.
    pub factor: f64,
    /// Value of the number.
    pub value: f64,
    /// Recordings without an effect.
    pub nulls: Counts,
    /// Recordings with effects.
    pub positives: Counts,
}

/// Diagnoses all trials at each factor of the number `name`. Calls `progress` after each trial.
///
/// # Errors
/// A recording cannot be made.
pub fn curve(
    plan: &Plan,
    prepared: &Prepared,
    name: &str,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<Point>, InputError> {
    let of = |factor: f64| {
        let (varied, value) = rlg_plan::Plan::default()
            .scaled(name, factor)
            .ok_or_else(|| InputError::new("--vary", "is no number of the plan").value(name))?;
        let under_test = UnderTest::new(varied, false, ReadAs::Whole);
        let done = prepared.diagnose(
            (plan.seed, plan.declares),
            Some(&under_test),
            None,
            progress,
        )?;
        let outcomes: Vec<Outcome> = done.into_iter().map(|(outcome, _)| outcome).collect();
        let scores = score(plan, &prepared.answers, &outcomes);
        let [nulls, positives] = sums(&scores);
        Ok(Point {
            factor,
            value,
            nulls,
            positives,
        })
    };
    FACTORS.into_iter().map(of).collect()
}

/// Counts of all nulls and of all positives: sums over the families.
fn sums(scores: &Scores) -> [Counts; 2] {
    ["null, family", "positive, family"].map(|begin| {
        let groups = scores.groups.iter();
        groups
            .filter(|(name, _)| name.starts_with(begin))
            .fold(Counts::default(), |sum, (_, counts)| sum.and(*counts))
    })
}
