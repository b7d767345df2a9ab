//! What is found must predict rows that were not fitted; then it is fitted on both.

use rlg_catalogue::candidates::PoolColumns;
use rlg_catalogue::{Candidate, Pool};
use rlg_inference::normal_equations::Transform;
use rlg_inference::predict::log_score;
use rlg_inference::{Fit, Hypothesis, NoiseBasis, NormalEquations, Observations, Search};
use rlg_signal::partition::Use;

use super::data::Data;
use super::goodness::{Misfit, misfits};
use super::noise::drift_prior;
use super::plan::AnalysisPlan;
use super::search::{Found, mean, sizes_on, subtract};
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

/// What is found, fitted on rows to fit and rows to confirm together.
pub struct Final {
    /// The fit, its blocks in the order of the members.
    pub fit: Fit,
    /// What it leaves \[rad\].
    pub left_rad: Triad,
    /// Where what it leaves is not the noise that was fitted.
    pub misfits: Vec<Misfit>,
}

/// Fits `members`, places in `found.candidates`; `None` where too few rows are left.
pub fn refit(data: &Data, found: &Found, members: &[usize], plan: &AnalysisPlan) -> Option<Final> {
    let observations = Observations::bridged(&data.rows_of(&[Use::Train, Use::Confirm]))?;
    let mut pool = Pool::default();
    let candidates: Vec<Candidate> = members
        .iter()
        .map(|&member| pool.adopt(&found.candidates[member], &found.pool.columns))
        .collect();
    let hypotheses: Vec<Hypothesis> = candidates
        .iter()
        .map(|one| one.hypothesis.clone())
        .collect();
    let made = PoolColumns {
        columns: &pool.columns,
        signals: &found.motion.signals,
    };
    let levels = &found.fit.levels;
    let equations = NormalEquations::new(observations, &found.residual_rad, &made, mean(levels));
    let drift = drift_prior(&data.model.gyro);
    let kinds = hypotheses.len().max(1);
    // Drift is chosen anew: what had no name may have stood for it.
    let mut search = Search::new(
        &equations,
        &hypotheses,
        kinds,
        &plan.search,
        &drift,
        levels.clone(),
    );
    let all: Vec<usize> = (0..hypotheses.len()).collect();
    let mut fit = search.fit(&all, None);
    let misfits = (0..3)
        .flat_map(|gyro| {
            let sizes = sizes_on(&fit, &candidates, gyro);
            let residual = equations.residual_spectrum(gyro, &sizes);
            misfits(&equations.basis, &residual, fit.levels[gyro], gyro, plan)
        })
        .collect();
    fit.members = members.to_vec();
    let mut left_rad = found.residual_rad.clone();
    subtract(
        &mut left_rad,
        &fit,
        &found.candidates,
        &found.pool,
        &found.motion.signals,
    );
    Some(Final {
        fit,
        left_rad,
        misfits,
    })
}
