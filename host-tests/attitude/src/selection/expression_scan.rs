//! Effects outside the catalogue: expressions in measured channels on single gyros, by score tests of the residual of a fit.

use rayon::prelude::*;
use rlg_catalogue::candidates::Variant;
use rlg_catalogue::families::{expressions, time_constants_about};
use rlg_catalogue::{Candidate, Pool};
use rlg_diagnosis::candidates::scores::integrated;

use crate::gyros::scanned::{OnGyro, Scanned};
use crate::rows::blocks::Null;
use crate::selection::group_selection::Candidates;
use crate::selection::residual_scan::{Given, Sought};

/// Expressions of a search.
pub(crate) struct Vocabulary {
    /// Each on some gyros.
    groups: Vec<Vec<OnGyro>>,
    /// Number of all, on any gyro.
    places: usize,
}

impl Vocabulary {
    /// Expressions of the channels that vary, but those that are a listed effect on their gyro.
    pub(crate) fn new(given: &Given, pool: &Pool, listed: &Candidates) -> Self {
        let listed: Vec<Candidate> = listed.effects.iter().map(|(one, _)| one.clone()).collect();
        let family = expressions(&given.gyro.signals, [true; 3], &listed, pool);
        let groups: Vec<Vec<OnGyro>> = family.groups.iter().map(|group| of(group)).collect();
        Self {
            places: groups.iter().map(Vec::len).sum(),
            groups,
        }
    }

    /// Finds the expression of largest statistic; `None` if a smooth drift of its gyro explains as much.
    pub(crate) fn seek(&self, given: Given, null: &Null) -> Option<Sought> {
        let mut ranked = gains(&given, null, self.groups.par_iter().flatten().copied());
        ranked.truncate(given.plan.rates.families.strongest);
        let finer = ranked.iter().flat_map(|(one, _)| {
            let family = time_constants_about(one.expression, one.axis, &given.gyro.signals);
            family
                .groups
                .iter()
                .flat_map(|group| of(group))
                .collect::<Vec<_>>()
        });
        let finer: Vec<OnGyro> = finer.collect();
        ranked.extend(gains(&given, null, finer.into_par_iter()));
        let (best, gain) = ranked.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        if integrated(gain, 1) - (self.places as f64).ln() < given.plan.attitude.least_gain {
            return None;
        }
        let scanned = Scanned::Expression(best);
        let columns = scanned.columns(given.about, given.gyro);
        let sought = Sought {
            statistic: given.statistic(&columns),
            columns,
            scanned,
            places: self.places,
        };
        given.is_beyond_drift(&sought).then_some(sought)
    }
}

/// Expressions of candidates.
fn of(group: &[Candidate]) -> Vec<OnGyro> {
    let each = group.iter().filter_map(|one| match one.variant {
        Variant::Expression { axis, expression } => Some(OnGyro { axis, expression }),
        _ => None,
    });
    each.collect()
}

/// Expressions with their gains in log likelihood, the largest first.
fn gains(
    given: &Given,
    null: &Null,
    each: impl ParallelIterator<Item = OnGyro>,
) -> Vec<(OnGyro, f64)> {
    let gain = |one: OnGyro| {
        let columns = Scanned::Expression(one).columns(given.about, given.gyro);
        (
            one,
            given.blocks.project(null, &columns).gain().log_likelihood,
        )
    };
    let mut all: Vec<(OnGyro, f64)> = each.map(gain).collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all
}
