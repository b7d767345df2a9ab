//! Cross-validation of the selected set in blocks of the fitted rows, and the final fit.

use rlg_plan::Plan;
use rlg_signal::partition::blocks;
use std::ops::Range;

use rlg_findings::result::UNLISTED;
use rlg_inference::block_validation::BlockSums;
use rlg_inference::search::DriftPrior;
use rlg_inference::transform::Transform;
use rlg_inference::{Columns, Fit, Hypothesis, NoiseLevels, Search, TooFewRows};

use crate::candidates::Candidate;
use crate::prediction::Prediction;
use crate::search::Found;

/// Cross-validation of one member: each block predicted from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Confirmation {
    /// Gain of the member in predictive log score.
    pub gain: f64,
    /// Design effect: factor by which the likelihood ratio is too large, from the scatter of the estimates between blocks;
    /// 1 if not significant (χ²).
    pub design_effect: f64,
}

/// Confirmed part of a search.
pub struct Confirmed {
    /// Places of the search's members that are reported.
    pub named: Vec<usize>,
    /// Candidate that each of them is named after.
    pub headlines: Vec<usize>,
    /// Places of the members that fail the cross-validation.
    pub unconfirmed: Vec<usize>,
    /// Places of the members that are no larger than the error of an expression in the set.
    pub undescribed: Vec<usize>,
    /// Cross-validation of every member of the search.
    pub confirmations: Vec<Confirmation>,
    /// Fit of the headlines.
    pub fit: Fit,
}

/// Removes members that fail the cross-validation in blocks of the rows.
///
/// # Errors
/// Too few rows are left.
pub fn confirm(
    made_of: &Prediction,
    found: &Found,
    seen: &[bool],
    plan: &Plan,
) -> Result<Confirmed, TooFewRows> {
    let confirmations = confirmations(made_of, found, seen, plan)?;
    let is_costly = |place: &usize| found.judged[*place].cost_without > plan.judgement.naming;
    // The design effect reduces the likelihood ratio.
    let holds = |place: &usize| {
        let said = &confirmations[*place];
        let ratio = found.fit.log_likelihood - found.without[*place].log_likelihood;
        let lost = ratio * (1.0 - 1.0 / said.design_effect);
        said.gain > 0.0 && found.judged[*place].cost_without - lost > plan.judgement.naming
    };
    let (held, unconfirmed): (Vec<usize>, Vec<usize>) =
        (0..found.judged.len()).filter(is_costly).partition(holds);
    let powers = powers(made_of, found, seen);
    let is_member_listed =
        |place: &usize| found.candidates[found.fit.members[*place]].kind != UNLISTED;
    let described = |axis: usize| -> f64 {
        let unlisted = held.iter().filter(|place| !is_member_listed(place));
        unlisted.map(|&place| powers[place][axis]).sum()
    };
    // An expression only approximates its cause: a member must exceed a practical share of its power.
    let stands = |place: &usize| {
        !is_member_listed(place)
            || (0..3)
                .any(|axis| powers[*place][axis] > plan.judgement.practical_share * described(axis))
    };
    let (named, undescribed): (Vec<usize>, Vec<usize>) = held.iter().copied().partition(stands);
    let hypotheses: Vec<Hypothesis> = found
        .candidates
        .iter()
        .map(|one| one.hypothesis.clone())
        .collect();
    let mut search = Search::new(
        &found.equations,
        &hypotheses,
        1,
        &plan.inference.search,
        &DriftPrior::Unknown,
        found.fit.levels.clone(),
    );
    let mut headlines: Vec<usize> = Vec::with_capacity(named.len());
    for &place in &named {
        let one = headline(found, place);
        let is_taken = headlines.contains(&one) || found.fit.members.contains(&one);
        headlines.push(if is_taken {
            found.fit.members[place]
        } else {
            one
        });
    }
    let fit = search.fit(&headlines, None);
    Ok(Confirmed {
        named,
        headlines,
        unconfirmed,
        undescribed,
        confirmations,
        fit,
    })
}

/// Candidate that a member is named after: of an expression, the kind of the catalogue with the fewest parameters that
/// explains or spans it.
fn headline(found: &Found, place: usize) -> usize {
    let member = found.fit.members[place];
    if found.candidates[member].kind != UNLISTED {
        return member;
    }
    let rivals = found.judged[place].rivals.iter().map(|(rival, _)| *rival);
    let all = rivals.chain(found.spanned_by[place].iter().copied());
    let listed = all.filter(|&rival| found.candidates[rival].kind != UNLISTED);
    listed
        .min_by_key(|&rival| found.candidates[rival].hypothesis.parameters)
        .unwrap_or(member)
}

/// Power of each member's effect on each accelerometer in the rows that are `seen`.
fn powers(made_of: &Prediction, found: &Found, seen: &[bool]) -> Vec<[f64; 3]> {
    let power = |values: &Vec<f64>| -> f64 {
        let seen = values.iter().zip(seen).filter(|(_, seen)| **seen);
        seen.map(|(value, _)| value * value).sum()
    };
    (0..found.fit.members.len())
        .map(|member| {
            let effect = found.effect_m_s(made_of, &found.fit, member);
            effect.each_ref().map(power)
        })
        .collect()
}

/// Cross-validates each member in blocks.
fn confirmations(
    made_of: &Prediction,
    found: &Found,
    seen: &[bool],
    plan: &Plan,
) -> Result<Vec<Confirmation>, TooFewRows> {
    let observations = made_of.rows.bridged(seen)?;
    let fit = &found.fit;
    let (transform, basis) = Transform::with_basis(observations, NoiseLevels::mean(&fit.levels));
    let roots: Vec<Vec<f64>> = fit
        .levels
        .iter()
        .map(|levels| {
            let powers = basis.by_coefficient(*levels).into_iter();
            powers.map(f64::sqrt).collect()
        })
        .collect();
    let whitened = |record: usize, rows: &[f64]| -> Vec<f64> {
        let mut spectrum = transform.spectrum(rows);
        let pairs = spectrum.iter_mut().zip(&roots[record]);
        pairs.for_each(|(value, root)| *value /= root);
        let mut rows = transform.rows_of(&spectrum);
        let unseen = rows.iter_mut().zip(seen).filter(|(_, seen)| !**seen);
        unseen.for_each(|(value, _)| *value = 0.0);
        rows
    };
    let members: Vec<&Candidate> = fit
        .members
        .iter()
        .map(|&place| &found.candidates[place])
        .collect();
    let columns = MemberColumns::new(made_of, found, &members, &whitened);
    let records: Vec<Vec<f64>> = (0..3)
        .map(|axis| whitened(axis, &found.residual_m_s[axis]))
        .collect();
    let blocks = blocks(seen, made_of.rows.rate_hz, &plan.rates.blocks);
    let sums = BlockSums::new(&records, &columns.columns, &blocks);
    let of_member = |place: usize| {
        let own: Vec<usize> = columns.own[place].clone().collect();
        let said = sums.validate(&own, &columns.fixed);
        Confirmation {
            gain: said.gain,
            design_effect: said.significant_design_effect(plan.judgement.reenactment_chance),
        }
    };
    Ok((0..members.len()).map(of_member).collect())
}

/// Whitened columns of a set's parameters; those of the verticals follow.
struct MemberColumns {
    /// By record and parameter.
    columns: Vec<Vec<Vec<f64>>>,
    /// Parameters of each member.
    own: Vec<Range<usize>>,
    /// Parameters that carry a member's fixed terms, which have no parameter of their own.
    fixed: Vec<usize>,
}

impl MemberColumns {
    fn new(
        made_of: &Prediction,
        found: &Found,
        members: &[&Candidate],
        whitened: &impl Fn(usize, &[f64]) -> Vec<f64>,
    ) -> Self {
        let whole: Vec<Hypothesis> = members
            .iter()
            .map(|one| one.hypothesis.with_fixed_as_parameter())
            .collect();
        let count: usize = whole.iter().map(|one| one.parameters).sum();
        let verticals = made_of.vertical_columns(&found.recordings);
        let unknowns = verticals.count() / 3;
        let mut columns = vec![vec![Vec::new(); count + unknowns]; 3];
        let (mut own, mut fixed) = (Vec::new(), Vec::new());
        let mut first = 0;
        for (one, member) in whole.iter().zip(members) {
            for term in &one.terms {
                let values = found.pool.columns[term.column].values(made_of);
                let sum: &mut Vec<f64> = &mut columns[term.record][first + term.parameter];
                sum.resize(values.len(), 0.0);
                rlg_signal::axes::add(sum, &values, term.coefficient);
            }
            fixed.extend((member.hypothesis.parameters..one.parameters).map(|k| first + k));
            own.push(first..first + one.parameters);
            first += one.parameters;
        }
        for place in 0..3 * unknowns {
            columns[place % 3][count + place / 3] = verticals.column(place);
        }
        for (record, columns) in columns.iter_mut().enumerate() {
            for column in columns.iter_mut().filter(|column| !column.is_empty()) {
                *column = whitened(record, column);
            }
        }
        Self {
            columns,
            own,
            fixed,
        }
    }
}
