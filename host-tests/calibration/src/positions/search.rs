//! Iterates linearisation and structure search until the set and its sizes converge.

use nalgebra::{DVector, Vector3};
use rlg_findings::result::UNLISTED;
use rlg_inference::judgement::JudgedSet;
use rlg_inference::search::DriftPrior;
use rlg_inference::{Fit, Hypothesis, NoiseLevels, Search};
use rlg_plan::{Plan, PositionPlan};

use super::candidates::{Candidate, Column, MadeOf, candidates};
use super::errors::Errors;
use super::lengths::{Lengths, Readings, Record, usual_m2_s4};

/// Measurements of a recording by position.
#[derive(Clone)]
pub struct Observed {
    /// Means by position.
    pub readings: Readings,
    /// Warming since the first \[K\].
    pub warming_k: Option<Vec<Vector3<f64>>>,
    /// Gravity, and its standard deviation, 0 if known \[m/s²\].
    pub gravity_m_s2: [f64; 2],
    /// Accelerometer errors of the model.
    pub known: Errors,
    /// Scale errors of the model, for the factor 1/(1 − s_i) of a sample.
    pub scale_error: [f64; 3],
}

impl Observed {
    /// Subset of the positions.
    pub fn of(&self, places: &[usize]) -> Self {
        fn of<T: Clone>(all: &[T], places: &[usize]) -> Vec<T> {
            places.iter().map(|&place| all[place].clone()).collect()
        }
        let readings = &self.readings;
        Self {
            readings: Readings {
                mean_m_s2: of(&readings.mean_m_s2, places),
                variance_m2_s4: of(&readings.variance_m2_s4, places),
                time_s: of(&readings.time_s, places),
                ..readings.clone()
            },
            warming_k: self
                .warming_k
                .as_ref()
                .map(|warming_k| of(warming_k, places)),
            ..self.clone()
        }
    }

    /// Computes the record linearised about errors beyond the model's.
    ///
    /// # Inputs `about`: the errors; `sizes`: their sizes, by column.
    pub fn record(
        &self,
        about: &Errors,
        columns: &[Column],
        sizes: &[f64],
        plan: &PositionPlan,
    ) -> Record {
        let all = self.known.plus(about);
        let undone = |read: &Vector3<f64>| all.undone_m_s2(read, self.scale_error);
        let readings = &self.readings;
        let force_m_s2: Vec<Vector3<f64>> = readings.mean_m_s2.iter().map(undone).collect();
        let [gravity, gravity_std_m_s2] = self.gravity_m_s2;
        let made_of = MadeOf {
            force_m_s2: &force_m_s2,
            time_s: &readings.time_s,
            warming_k: self.warming_k.as_deref(),
        };
        let columns: Vec<Vec<f64>> = columns
            .iter()
            .map(|column| column.values(&made_of))
            .collect();
        let mut length_m_s2: Vec<f64> = force_m_s2
            .iter()
            .map(|force| force.norm() - gravity)
            .collect();
        for (column, size) in columns.iter().zip(sizes).filter(|(_, size)| **size != 0.0) {
            let put_back = length_m_s2.iter_mut().zip(column);
            put_back.for_each(|(length, value)| *length += size * value);
        }
        let along: Vec<Vector3<f64>> = force_m_s2.iter().map(|force| force.normalize()).collect();
        let within = along.iter().zip(&readings.variance_m2_s4);
        let within_m2_s4: Vec<f64> = within
            .map(|(along, variance)| along.map(|one| one * one).dot(variance))
            .collect();
        Record {
            length_m_s2,
            columns,
            along,
            time_s: readings.time_s.clone(),
            freedom: readings.freedom,
            scatter_m2_s4: readings
                .slow_m2_s4
                .max(usual_m2_s4(&within_m2_s4))
                .max(plan.least_scatter_m_s2.powi(2)),
            gravity_std_m_s2: match gravity_std_m_s2 > 0.0 {
                true => gravity_std_m_s2.max(plan.gravity_std_m_s2),
                false => 0.0,
            },
            within_m2_s4,
        }
    }
}

/// Selected set, and its named members.
pub struct Concluded {
    /// Selected set.
    pub fit: Fit,
    /// Members with costs and rivals.
    pub judged: JudgedSet,
    /// Places of the members whose cost of omission exceeds the naming threshold.
    pub named: Vec<usize>,
    /// Candidate that each of them is named after.
    pub headlines: Vec<usize>,
    /// Fit of the headlines.
    pub named_fit: Fit,
    /// Errors beyond the model's according to that fit.
    pub named_errors: Errors,
    /// Number of sets evaluated.
    pub tried: usize,
}

/// Result of a search.
pub struct Found {
    /// Selected set.
    pub concluded: Concluded,
    /// Gain of each member in predictive log score (leave-one-out cross-validation over the positions).
    pub confirmed_gain: Vec<f64>,
    /// All candidates.
    pub candidates: Vec<Candidate>,
    /// Record linearised at the estimates.
    pub record: Record,
    /// Sums of the record.
    pub lengths: Lengths,
}

impl std::ops::Deref for Found {
    type Target = Concluded;

    fn deref(&self) -> &Concluded {
        &self.concluded
    }
}

/// Runs the search.
pub fn find(observed: &Observed, (plan, left_out): (&Plan, &[&str])) -> Found {
    let own = &plan.positions;
    let count = observed.readings.mean_m_s2.len();
    let mut columns: Vec<Column> = Vec::new();
    let sought = (count, observed.warming_k.is_some());
    let odds = &plan.catalogue.odds;
    let candidates = candidates(sought, left_out, &mut columns, odds);
    let hypotheses: Vec<Hypothesis> = candidates
        .iter()
        .map(|one| one.hypothesis.clone())
        .collect();
    let mut kinds: Vec<&str> = candidates.iter().map(|one| one.kind).collect();
    kinds.dedup();
    let mut about = Errors::default();
    let mut sizes = vec![0.0; columns.len()];
    let mut before: Vec<usize> = Vec::new();
    let mut levels: Option<NoiseLevels> = None;
    let mut pass = 0;
    loop {
        pass += 1;
        let record = observed.record(&about, &columns, &sizes, own);
        let start = levels.unwrap_or_else(|| first_levels(&record));
        let lengths = Lengths::new(&record, start, own);
        let search_plan = &plan.inference.search;
        let prior = DriftPrior::Unknown;
        let mut search = Search::new(
            &lengths,
            &hypotheses,
            kinds.len(),
            search_plan,
            &prior,
            vec![start],
        );
        // Every position with an own offset is one observation less.
        let most = search_plan.most_members.min(count / own.of_effect);
        // With few positions no error alone is worth its parameters if two act: a second search starts from the errors of a
        // new unit.
        let first = search.run(&before, most);
        let new_unit = new_unit(&candidates, most.min(own.new_unit_kinds));
        let second = search.run(&new_unit, most);
        let fit = rlg_inference::search::best_of(vec![second], first);
        let (next, settled) = sizes_of((&fit, &candidates), &sizes, plan.positions.settled);
        let stays = settled && fit.members == before;
        if !(stays || pass >= plan.judgement.passes) {
            about = errors_of(&fit, &candidates);
            (sizes, before) = (next, fit.members.clone());
            levels = Some(fit.levels[0]);
            continue;
        }
        let concluded = conclude(search, fit, &candidates, plan);
        return Found {
            confirmed_gain: gains(&concluded, (&candidates, &record), &lengths, own),
            concluded,
            candidates,
            record,
            lengths,
        };
    }
}

/// Places of at most `most` whole everyday kinds, bias and scale error first.
fn new_unit(candidates: &[Candidate], most: usize) -> Vec<usize> {
    let is_whole = |place: &usize| {
        let one = &candidates[*place];
        one.row().is_some_and(|kind| kind.everyday) && one.columns.len() == 3
    };
    let mut whole: Vec<usize> = (0..candidates.len()).filter(is_whole).collect();
    whole.truncate(most);
    whole
}

/// Size of each column in a fit, and true if all stay at their linearisation point.
fn sizes_of(
    (fit, candidates): (&Fit, &[Candidate]),
    before: &[f64],
    settled: f64,
) -> (Vec<f64>, bool) {
    let (mut sizes, mut stays) = (vec![0.0; before.len()], true);
    for (&member, block) in fit.members.iter().zip(&fit.blocks) {
        let one = &candidates[member];
        if one.kind == UNLISTED {
            continue;
        }
        for term in &one.hypothesis.terms {
            let at = block.start + term.parameter;
            let std = fit.covariance[(at, at)].max(0.0).sqrt();
            sizes[term.column] += fit.estimate[at];
            stays &= (sizes[term.column] - before[term.column]).abs() <= settled * std;
        }
    }
    (sizes, stays)
}

/// Initial noise: within positions, and the prior of the scatter between them. From below, a level converges in one step;
/// from above it would take many if the set has nearly as many parameters as positions.
fn first_levels(record: &Record) -> NoiseLevels {
    NoiseLevels {
        white: 1.0,
        angle: record.scatter_m2_s4 / record.unit_m_s2().powi(2),
        ..NoiseLevels::default()
    }
}

/// Judges the selected set, names its members above the threshold and fits these alone.
fn conclude(
    mut search: Search<Lengths>,
    fit: Fit,
    candidates: &[Candidate],
    plan: &Plan,
) -> Concluded {
    let judged = search.judge_set(&fit, plan.judgement.class_within, plan.judgement.separation);
    let named: Vec<usize> = (0..judged.members.len())
        .filter(|&place| judged.members[place].cost_without > plan.judgement.naming)
        .collect();
    let mut headlines: Vec<usize> = Vec::with_capacity(named.len());
    for &place in &named {
        let one = headline((&fit, &judged), candidates, place);
        let is_taken = headlines.contains(&one) || fit.members.contains(&one);
        headlines.push(if is_taken { fit.members[place] } else { one });
    }
    let named_fit = search.fit(&headlines, Some(&fit.levels));
    Concluded {
        named_errors: errors_of(&named_fit, candidates),
        tried: search.tried_sets(),
        fit,
        judged,
        named,
        headlines,
        named_fit,
    }
}

/// Errors according to a fit.
fn errors_of(fit: &Fit, candidates: &[Candidate]) -> Errors {
    let mut errors = Errors::default();
    for (&member, block) in fit.members.iter().zip(&fit.blocks) {
        errors.add(&candidates[member].effect(&fit.estimate.as_slice()[block.clone()]));
    }
    errors
}

/// Candidate that a member is named after: of an expression, the kind of the catalogue with the fewest parameters that
/// explains or spans it; or one position, if its offset alone explains as much as a kind and the error is not the unit's.
fn headline((fit, judged): (&Fit, &JudgedSet), candidates: &[Candidate], place: usize) -> usize {
    let member = fit.members[place];
    let rivals = || judged.members[place].rivals.iter().map(|(rival, _)| *rival);
    if candidates[member].row().is_some() {
        let mut alone = rivals().filter(|&rival| candidates[rival].position().is_some());
        return alone.next().unwrap_or(member);
    }
    if candidates[member].position().is_some() {
        return member;
    }
    let all = rivals().chain(judged.spanned_by[place].iter().copied());
    let listed = all.filter(|&rival| candidates[rival].row().is_some());
    listed
        .min_by_key(|&rival| candidates[rival].hypothesis.parameters)
        .unwrap_or(member)
}

/// Loss of leave-one-out predictive log score without each member.
fn gains(
    of: &Concluded,
    made_of: (&[Candidate], &Record),
    lengths: &Lengths,
    plan: &PositionPlan,
) -> Vec<f64> {
    let score = |fit: &Fit| predictive_score(fit, made_of, lengths.unit_m_s2, plan);
    let whole = score(&of.fit);
    let without = of.judged.without.iter();
    without.map(|without| whole - score(without)).collect()
}

/// Leave-one-out predictive log score Σ ln p, with physical priors of the sizes: with K the inverse of the full covariance,
/// position k is predicted with the error (K y)_k / K_kk and the variance 1/K_kk (Rasmussen and Williams 2006, eq. 5.12).
fn predictive_score(
    fit: &Fit,
    (candidates, record): (&[Candidate], &Record),
    unit_m_s2: f64,
    plan: &PositionPlan,
) -> f64 {
    let count = record.length_m_s2.len();
    let mut covariance = record.covariance(fit.levels[0], unit_m_s2);
    let mut add = |column: &[f64], std: f64| {
        for a in 0..count {
            for b in 0..count {
                covariance[(a, b)] += std * std * column[a] * column[b];
            }
        }
    };
    add(&vec![1.0; count], record.gravity_std_m_s2);
    for &member in &fit.members {
        let one = &candidates[member].hypothesis;
        for term in &one.terms {
            let column = &record.columns[term.column];
            let most = column
                .iter()
                .fold(f64::MIN_POSITIVE, |most, one| one.abs().max(most));
            add(
                column,
                one.bound(term.parameter).std.min(plan.largest_m_s2 / most),
            );
        }
    }
    let Some(cholesky) = covariance.cholesky() else {
        return f64::NEG_INFINITY;
    };
    let inverse = cholesky.inverse();
    let weighted = &inverse * DVector::from_column_slice(&record.length_m_s2);
    (0..count)
        .map(|k| {
            let precision = inverse[(k, k)];
            0.5 * (precision.ln() - weighted[k].powi(2) / precision)
        })
        .sum()
}
