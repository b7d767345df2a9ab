//! What is found must predict rows that were not fitted; then it is fitted on both.

use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::PoolColumns;
use rlg_inference::evaluate::{Effort, evaluate};
use rlg_inference::normal_equations::Transform;
use rlg_inference::predict::log_score;
use rlg_inference::{Fit, Hypothesis, NoiseBasis, NormalEquations, Observations};
use rlg_signal::partition::Use;

use super::data::Data;
use super::search::{Found, mean, subtract};
use crate::streams::Triad;

/// Shortest stretch that is scored \[rows\].
const LEAST_ROWS: usize = 32;

/// Log score that each member of the found set gains on the rows that confirm.
///
/// # Returns
/// A number for each member, in the order of the set.
pub fn gains(data: &Data, found: &Found) -> Vec<f64> {
    let observations = Observations::separate(&data.rows_of(&[Use::Confirm]), LEAST_ROWS);
    if found.fit.members.is_empty() || observations.spans.is_empty() {
        return vec![0.0; found.fit.members.len()];
    }
    let basis = NoiseBasis::new(&observations);
    let transform = Transform::new(observations, &basis, mean(&found.fit.levels));
    let score = |fit: &Fit| -> f64 {
        let mut left: Triad = found.residual_rad.clone();
        subtract(
            &mut left,
            fit,
            &found.candidates,
            &found.pool,
            &found.motion.signals,
        );
        (0..3)
            .map(|gyro| log_score(&basis, &transform.spectrum(&left[gyro]), fit.levels[gyro]))
            .sum()
    };
    let whole = score(&found.fit);
    found.without.iter().map(|fit| whole - score(fit)).collect()
}

/// Fits `members`, places in `found.candidates`, on rows to fit and rows to confirm together.
///
/// # Returns
/// The fit, its blocks in the order of `members`; `None` where too few rows are left.
pub fn refit(data: &Data, found: &Found, members: &[usize]) -> Option<(Fit, Triad)> {
    let observations = Observations::bridged(&data.rows_of(&[Use::Train, Use::Confirm]))?;
    let mut columns = Vec::new();
    let hypotheses: Vec<Hypothesis> = members
        .iter()
        .map(|&member| {
            let mut hypothesis = found.candidates[member].hypothesis.clone();
            for term in &mut hypothesis.terms {
                let column = found.pool.columns[term.column];
                let place = columns.iter().position(|other| *other == column);
                term.column = place.unwrap_or_else(|| {
                    columns.push(column);
                    columns.len() - 1
                });
            }
            hypothesis
        })
        .collect();
    let made = PoolColumns {
        columns: &columns,
        signals: &found.motion.signals,
    };
    let levels = &found.fit.levels;
    let equations = NormalEquations::new(observations, &found.residual_rad, &made, mean(levels));
    let set: Vec<&Hypothesis> = hypotheses.iter().collect();
    let mut fit = evaluate(&equations, &set, levels, &found.fit.drift, Effort::FULL);
    fit.members = members.to_vec();
    let mut left = found.residual_rad.clone();
    let (candidates, pool): (&[Candidate], _) = (&found.candidates, &found.pool);
    subtract(&mut left, &fit, candidates, pool, &found.motion.signals);
    Some((fit, left))
}
