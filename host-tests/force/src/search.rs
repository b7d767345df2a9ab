//! Iterates prediction, columns and structure search until the set, its delays and the vertical converge.

use std::collections::BTreeSet;
use std::ops::Range;

use rlg_catalogue::accelerometers::DELAY;
use rlg_findings::result::UNLISTED;
use rlg_inference::judgement::Judged;
use rlg_inference::search::DriftPrior;
use rlg_inference::{Fit, Hypothesis, NoiseLevels, NormalEquations, Observations, Search, Term};
use rlg_model::Model;
use rlg_signal::axes::{Triad, add};

use crate::candidates::{Candidate, Pool, PoolColumns, Scope};
use crate::prediction::Prediction;
use crate::residual::residual_m_s;
use crate::vertical::UNKNOWNS;

/// Result of a search.
pub struct Found {
    /// Selected set.
    pub fit: Fit,
    /// Each member with its cost of omission and rivals.
    pub judged: Vec<Judged>,
    /// Places of the candidates that span each member's effect.
    pub spanned_by: Vec<Vec<usize>>,
    /// Fit of the set without each member.
    pub without: Vec<Fit>,
    /// All candidates.
    pub candidates: Vec<Candidate>,
    /// Columns of the candidates.
    pub pool: Pool,
    /// Residual of the model with the verticals of the selected set \[m/s per row\].
    pub residual_m_s: Triad,
    /// Normal equations of the residual and the columns.
    pub equations: NormalEquations,
    /// Places of the recordings whose verticals are fitted.
    pub recordings: Vec<usize>,
    /// Number of sets evaluated.
    pub tried: usize,
}

/// Parameters of the verticals of `recordings` recordings, without a prior, over [`Prediction::vertical_columns`].
fn vertical_parameters(recordings: usize) -> Hypothesis {
    let parameters = recordings * UNKNOWNS;
    let terms = (0..parameters).flat_map(|parameter| {
        (0..3).map(move |record| Term {
            parameter,
            record,
            column: 3 * parameter + record,
            coefficient: 1.0,
        })
    });
    Hypothesis::of_terms(parameters, terms.collect())
}

/// Normal equations over the rows of `observations`, with the columns of `pool` and those of the observed verticals.
pub fn equations(
    made_of: &Prediction,
    residual_m_s: &Triad,
    observations: &Observations,
    pool: &Pool,
    levels: NoiseLevels,
) -> NormalEquations {
    let columns = PoolColumns {
        columns: &pool.columns,
        made_of,
    };
    let recordings = made_of.rows.looked_at(observations);
    let verticals = made_of.vertical_columns(&recordings);
    NormalEquations::with_free(
        observations.clone(),
        residual_m_s,
        &columns,
        levels,
        (&verticals, vertical_parameters(recordings.len())),
    )
}

/// Parameters of the verticals in a fit, recording by recording.
pub fn of_verticals(fit: &Fit) -> Range<usize> {
    fit.gaps.last().cloned().unwrap_or(0..0)
}

/// Estimated unknowns of each vertical, and true if all have converged.
///
/// # Inputs `recordings`: places of the observed recordings.
pub fn verticals_of(
    fit: &Fit,
    recordings: &[usize],
    settled: f64,
) -> (Vec<(usize, [f64; UNKNOWNS])>, bool) {
    let block = of_verticals(fit);
    let (each, _) = fit.estimate.as_slice()[block.clone()].as_chunks();
    let moves = recordings.iter().copied().zip(each.iter().copied());
    let stays = block.into_iter().all(|at| {
        let std = fit.covariance[(at, at)].max(0.0).sqrt();
        fit.estimate[at].abs() <= settled * std
    });
    (moves.collect(), stays)
}

/// Runs the search; `made_of` then has the verticals of the selected set.
///
/// # Inputs `levels`: initial noise.
pub fn find(
    made_of: &mut Prediction,
    model: &Model,
    observations: &Observations,
    mut levels: Vec<NoiseLevels>,
    scope: Scope,
) -> Found {
    let plan = scope.plan;
    let recordings = made_of.rows.looked_at(observations);
    let mut delay_s = [0.0; 3];
    let mut before: Vec<Candidate> = Vec::new();
    let mut pass = 0;
    loop {
        pass += 1;
        let residual_m_s = residual_m_s(made_of, model);
        let mut pool = Pool::default();
        let mut candidates = pool.candidates(made_of, delay_s, scope);
        let mean = NoiseLevels::mean(&levels);
        let sums = equations(made_of, &residual_m_s, observations, &pool, mean);
        candidates.retain(|one| {
            let mut terms = one.hypothesis.terms.iter();
            terms.all(|term| sums.scale(term.column) > 0.0)
        });
        let hypotheses: Vec<Hypothesis> = candidates
            .iter()
            .map(|one| one.hypothesis.clone())
            .collect();
        let kinds: BTreeSet<&str> = candidates.iter().map(|one| one.kind).collect();
        let mut search = Search::new(
            &sums,
            &hypotheses,
            kinds.len().max(1),
            &plan.inference.search,
            &DriftPrior::Unknown,
            levels.clone(),
        );
        let is_in = |set: &[Candidate], one: &Candidate| set.iter().any(|other| one.is_same(other));
        let start: Vec<usize> = (0..candidates.len())
            .filter(|&place| is_in(&before, &candidates[place]))
            .collect();
        let fit = search.run(&start, plan.inference.search.most_members);
        levels.clone_from(&fit.levels);
        let members = fit.members.iter();
        let members: Vec<Candidate> = members.map(|&place| candidates[place].clone()).collect();
        let (now_s, delays_stay) = delays(&fit, &candidates, delay_s, plan.force.settled);
        let (moves, vertical_stays) = verticals_of(&fit, &recordings, plan.force.settled);
        let is_same_set =
            members.len() == before.len() && members.iter().all(|one| is_in(&before, one));
        let stands = is_same_set && delays_stay && vertical_stays;
        if !(stands || pass >= plan.judgement.passes) {
            made_of.move_verticals(&moves);
            delay_s = now_s;
            before = members;
            continue;
        }
        let judged = search.judge(&fit, plan.judgement.class_within);
        let spanned_by = spanned_by(&search, &fit, &candidates, plan.judgement.separation);
        let without = fit.members.iter().map(|&member| {
            let rest = search.without(&fit.members, member);
            search.fit(&rest, Some(&fit.levels))
        });
        let without = without.collect();
        let tried = search.tried_sets();
        return Found {
            fit,
            judged,
            spanned_by,
            without,
            candidates,
            pool,
            residual_m_s,
            equations: sums,
            recordings,
            tried,
        };
    }
}

/// Places of the candidates of other kinds that span each member's effect to less than `separation` \[σ\].
fn spanned_by(
    search: &Search,
    fit: &Fit,
    candidates: &[Candidate],
    separation: f64,
) -> Vec<Vec<usize>> {
    let spans = |member: usize, other: usize| {
        let kind = candidates[other].kind;
        kind != candidates[member].kind
            && kind != UNLISTED
            && search.separation(fit, member, other) < separation
    };
    let of_member = |&member: &usize| {
        let others = (0..candidates.len()).filter(|place| !fit.members.contains(place));
        others.filter(|&other| spans(member, other)).collect()
    };
    fit.members.iter().map(of_member).collect()
}

/// Estimated delay of each accelerometer \[s\], and true if all stay at their linearisation point.
fn delays(fit: &Fit, candidates: &[Candidate], at_s: [f64; 3], settled: f64) -> ([f64; 3], bool) {
    let (mut delay_s, mut stays) = ([0.0; 3], true);
    for (&member, block) in fit.members.iter().zip(&fit.blocks) {
        for (axis, estimate_s, std_s) in delays_in(&candidates[member], block.start, fit) {
            delay_s[axis] = linearised_at(estimate_s, std_s, settled);
            stays &= (delay_s[axis] - at_s[axis]).abs() <= settled * std_s;
        }
    }
    (delay_s, stays)
}

/// Delays of a candidate whose parameters start at `first` in a fit: accelerometer, estimate and its standard deviation
/// \[s\].
pub fn delays_in(one: &Candidate, first: usize, fit: &Fit) -> Vec<(usize, f64, f64)> {
    if one.kind != DELAY {
        return Vec::new();
    }
    let terms = one.hypothesis.terms.iter();
    terms
        .map(|term| {
            let at = first + term.parameter;
            let std_s = fit.covariance[(at, at)].max(0.0).sqrt();
            (term.record, fit.estimate[at], std_s)
        })
        .collect()
}

/// Linearisation point of a delay \[s\]: its estimate if significant for the second-order term, else 0.
pub fn linearised_at(estimate_s: f64, std_s: f64, settled: f64) -> f64 {
    if settled * estimate_s.abs() > std_s {
        estimate_s
    } else {
        0.0
    }
}

impl Found {
    /// Effect of a member of a fit on each accelerometer \[m/s per row\].
    pub fn effect_m_s(&self, made_of: &Prediction, fit: &Fit, member: usize) -> Triad {
        let hypothesis = &self.candidates[fit.members[member]].hypothesis;
        let block = &fit.blocks[member];
        let mut sum: Triad = std::array::from_fn(|_| vec![0.0; made_of.rows.count]);
        let fixed = hypothesis.fixed.iter();
        let parts = fixed.map(|one| (one.record, one.column, one.size));
        let terms = hypothesis.terms.iter().map(|term| {
            let size = term.coefficient * fit.estimate[block.start + term.parameter];
            (term.record, term.column, size)
        });
        for (record, column, size) in parts.chain(terms) {
            add(
                &mut sum[record],
                &self.pool.columns[column].values(made_of),
                size,
            );
        }
        sum
    }

    /// Residual of a fit \[m/s per row\], its verticals subtracted too.
    pub fn left_m_s(&self, made_of: &Prediction, fit: &Fit) -> Triad {
        let mut left = self.residual_m_s.clone();
        for member in 0..fit.members.len() {
            let effect = self.effect_m_s(made_of, fit, member);
            for (left, effect) in left.iter_mut().zip(&effect) {
                add(left, effect, -1.0);
            }
        }
        let first = of_verticals(fit).start;
        let columns = made_of.vertical_columns(&self.recordings).columns;
        for (place, (rows, column)) in columns.into_iter().enumerate() {
            let own = left[place % 3][rows].iter_mut().zip(column);
            own.for_each(|(left, value)| *left -= fit.estimate[first + place / 3] * value);
        }
        left
    }
}
