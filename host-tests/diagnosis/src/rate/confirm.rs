//! What is found must predict rows that were not fitted; then it is fitted on both.

use rlg_catalogue::candidates::PoolColumns;
use rlg_catalogue::entries::UNLISTED;
use rlg_catalogue::{Candidate, Pool};
use rlg_inference::normal_equations::Transform;
use rlg_inference::predict::log_score;
use rlg_inference::{Fit, Hypothesis, NoiseBasis, NormalEquations, Observations, Search};
use rlg_signal::partition::Use;

use super::data::Data;
use super::goodness::{Misfit, misfits};
use super::noise::drift_prior;
use super::plan::AnalysisPlan;
use super::reenact::{Named, Reenactment, reenact};
use super::search::{Found, mean, sizes_on, subtract};
use crate::streams::Triad;

/// Shortest stretch that is scored \[rows\].
const LEAST_ROWS: usize = 32;

/// Log score that each member of the found set gains on the rows that confirm.
///
/// # Returns
/// A number for each member, in the order of the set.
fn gains(data: &Data, found: &Found) -> Vec<f64> {
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

/// Members of the found set by what becomes of them.
pub struct Confirmed {
    /// Those with a name, as places in [`Found::judged`].
    pub named: Vec<usize>,
    /// What a named member is called, as places in [`Found::candidates`].
    pub headlines: Vec<usize>,
    /// Log score of every member of the found set on rows that confirm.
    pub gains: Vec<f64>,
    /// Places in [`Found::judged`] that do not predict those rows.
    pub unconfirmed: Vec<usize>,
    /// Places in [`Found::judged`] that the recording re-enacted without them shows as well.
    pub reenacted_away: Vec<usize>,
    /// Re-enactments without each named member.
    pub reenactments: Vec<Reenactment>,
    /// The fit of the headlines.
    pub last: Final,
}

/// Takes away what does not predict other rows, and what the recording shows even where it is re-enacted without it; `None`
/// where too few rows are left.
pub fn confirmed(data: &Data, found: &Found, plan: &AnalysisPlan) -> Option<Confirmed> {
    let gains = gains(data, found);
    let is_costly = |place: &usize| found.judged[*place].cost_without > plan.naming;
    let (mut named, unconfirmed): (Vec<usize>, Vec<usize>) = (0..found.judged.len())
        .filter(is_costly)
        .partition(|&place| gains[place] > 0.0);
    let mut reenacted_away = Vec::new();
    loop {
        let headlines: Vec<usize> = named.iter().map(|&place| headline(found, place)).collect();
        let last = refit(data, found, &headlines, plan)?;
        let ratios: Vec<Named> = named
            .iter()
            .map(|&place| Named {
                log_likelihood_ratio: found.fit.log_likelihood
                    - found.without[place].log_likelihood,
                to_spare: found.judged[place].cost_without - plan.naming,
            })
            .collect();
        let reenactments = reenact(data, found, (&last.fit, &ratios), plan);
        let Some(weakest) = (0..named.len())
            .filter(|&place| ratios[place].falls(&reenactments[place], plan))
            .max_by(|&a, &b| {
                reenactments[a]
                    .inflation()
                    .total_cmp(&reenactments[b].inflation())
            })
        else {
            return Some(Confirmed {
                named,
                headlines,
                gains,
                unconfirmed,
                reenacted_away,
                reenactments,
                last,
            });
        };
        reenacted_away.push(named.remove(weakest));
    }
}

/// The candidate with the fewest free numbers among a member and the rivals that reach it.
fn headline(found: &Found, place: usize) -> usize {
    let judged = &found.judged[place];
    // An expression is no name where a listed effect reaches it.
    let numbers = |candidate: usize| {
        let one = &found.candidates[candidate];
        (one.kind == UNLISTED, one.hypothesis.parameters)
    };
    let own = (numbers(judged.hypothesis), 0.0, judged.hypothesis);
    judged
        .rivals
        .iter()
        .map(|&(rival, behind)| (numbers(rival), behind, rival))
        .fold(own, |best, one| if one.0 < best.0 { one } else { best })
        .2
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
fn refit(data: &Data, found: &Found, members: &[usize], plan: &AnalysisPlan) -> Option<Final> {
    let fitted = data.rows_of(&[Use::Train, Use::Confirm]);
    let observations = Observations::bridged(&fitted)?.to_fast_length();
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
