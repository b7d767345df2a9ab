//! Score test (Rao) of a hypothesis as an addition to a fit, with the fit's members as nuisance parameters.
//!
//! Nothing is refitted or stored: a long list of expressions, frequencies or orders is screened at the cost of one transform
//! a column. With X the hypothesis' columns, M the members', W = 1/S: A = XᵀWX − XᵀWM (MᵀWM)⁻¹ MᵀWX,
//! h = XᵀWr − XᵀWM (MᵀWM)⁻¹ MᵀWr, and ln L grows by ½ hᵀA⁻¹h.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::evaluate::Fit;
use crate::hypothesis::{Hypothesis, Term};
use crate::linear::{dot, pseudo_inverse};
use crate::noise::NoiseLevels;
use crate::normal_equations::{Columns, NormalEquations};

/// The null model: a fit and its noise.
pub struct ScoreTest<'a> {
    equations: &'a NormalEquations,
    /// 1/S of each coefficient, by record.
    weights: Vec<Vec<f64>>,
    /// The records' own coefficients over their noise power.
    weighted: Vec<Vec<f64>>,
    members: Vec<Member<'a>>,
    /// (MᵀWM)⁻¹.
    inverse: DMatrix<f64>,
    /// MᵀWr.
    score: DVector<f64>,
}

/// Contribution of a member's parameter to one record.
struct Member<'a> {
    parameter: usize,
    record: usize,
    values: Values<'a>,
}

/// Coefficients of a member.
enum Values<'a> {
    /// Own coefficients.
    Own(Vec<f64>),
    /// Coefficients of a stored column of the equations, times a factor.
    Kept(&'a [f32], f64),
}

impl Values<'_> {
    /// Copies a range of coefficients into `block`.
    fn read(&self, rows: Range<usize>, block: &mut [f64]) {
        match self {
            Self::Own(values) => block.copy_from_slice(&values[rows]),
            Self::Kept(values, factor) => {
                for (out, value) in block.iter_mut().zip(&values[rows]) {
                    *out = factor * f64::from(*value);
                }
            }
        }
    }
}

/// The largest growth of ln L, and its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// Growth of ln L.
    pub log_likelihood: f64,
    /// Parameters, each in its own unit.
    pub estimate: Vec<f64>,
}

/// Share of a parameter's information given the members, below which it is collinear.
const LEAST_FREE: f64 = 1e-6;

/// Coefficients of the members of a fit, then of the nuisance parameters of gaps, summed by parameter and record.
fn members_of<'a>(
    equations: &'a NormalEquations,
    set: &[&Hypothesis],
    columns: &impl Columns,
) -> Vec<Member<'a>> {
    let mut members: Vec<Member> = Vec::new();
    let mut first = 0;
    for one in set {
        for term in &one.terms {
            let spectrum = equations.transform.spectrum(&columns.column(term.column));
            let parameter = first + term.parameter;
            let is_same = |member: &&mut Member| {
                (member.parameter, member.record) == (parameter, term.record)
            };
            if let Some(Values::Own(sum)) =
                members.iter_mut().find(is_same).map(|one| &mut one.values)
            {
                add(sum, &spectrum, term.coefficient);
            } else {
                let mut sum = vec![0.0; spectrum.len()];
                add(&mut sum, &spectrum, term.coefficient);
                members.push(Member {
                    parameter,
                    record: term.record,
                    values: Values::Own(sum),
                });
            }
        }
        first += one.parameters;
    }
    for one in equations.gaps() {
        members.extend(one.terms.iter().map(|term| {
            let (values, factor) = equations.kept(term.column);
            Member {
                parameter: first + term.parameter,
                record: term.record,
                values: Values::Kept(values, term.coefficient * factor),
            }
        }));
        first += one.parameters;
    }
    members
}

impl<'a> ScoreTest<'a> {
    /// Prepares the members of a fit.
    ///
    /// # Inputs
    /// `set`: the fit's members; `columns`: columns of their terms; `levels`: the noise, by record.
    pub fn new(
        equations: &'a NormalEquations,
        set: &[&Hypothesis],
        columns: &impl Columns,
        levels: &[NoiseLevels],
    ) -> Self {
        let weights: Vec<Vec<f64>> = levels
            .iter()
            .map(|levels| equations.basis.weights(*levels))
            .collect();
        let weighted: Vec<Vec<f64>> = (0..equations.record_count())
            .map(|record| {
                let mut left = equations.record(record).to_vec();
                let fixed = set.iter().flat_map(|one| &one.fixed);
                for one in fixed.filter(|one| one.record == record) {
                    let spectrum = equations.transform.spectrum(&columns.column(one.column));
                    add(&mut left, &spectrum, -one.size);
                }
                times(&left, &weights[record])
            })
            .collect();
        let members = members_of(equations, set, columns);
        let parameters = set.iter().copied().chain(equations.gaps());
        let count = parameters.map(|one| one.parameters).sum();
        let mut information = DMatrix::zeros(count, count);
        let mut score = DVector::zeros(count);
        for (record, weights) in weights.iter().enumerate() {
            let of_record: Vec<&Member> =
                members.iter().filter(|one| one.record == record).collect();
            blocks(&of_record, weights.len(), |rows, values| {
                let residual = &weighted[record][rows.clone()];
                for (place, member) in of_record.iter().enumerate() {
                    let own = &values[place * BLOCK..place * BLOCK + rows.len()];
                    score[member.parameter] += dot(own, residual);
                    let weighed = times(own, &weights[rows.clone()]);
                    for (other_place, other) in of_record.iter().enumerate().take(place + 1) {
                        let others = &values[other_place * BLOCK..other_place * BLOCK + rows.len()];
                        let product = dot(&weighed, others);
                        information[(member.parameter, other.parameter)] += product;
                        if other_place < place {
                            information[(other.parameter, member.parameter)] += product;
                        }
                    }
                }
            });
        }
        Self {
            members,
            inverse: pseudo_inverse(&information),
            score,
            equations,
            weights,
            weighted,
        }
    }

    /// Projects the members out of a hypothesis' information and score.
    ///
    /// # Inputs
    /// `spectra`: coefficients of the columns of its terms, by column.
    pub fn project(
        &self,
        hypothesis: &Hypothesis,
        spectra: &BTreeMap<usize, Vec<f64>>,
    ) -> Projected {
        let count = hypothesis.parameters;
        let mut own = DMatrix::zeros(count, count);
        let mut cross = DMatrix::zeros(count, self.score.len());
        let mut score = DVector::zeros(count);
        for (record, weights) in self.weights.iter().enumerate() {
            let of_record = |term: &&Term| term.record == record;
            let terms: Vec<&Term> = hypothesis.terms.iter().filter(of_record).collect();
            if terms.is_empty() {
                continue;
            }
            let members = self.members.iter().filter(|one| one.record == record);
            let members: Vec<&Member> = members.collect();
            blocks(&members, weights.len(), |rows, of_members| {
                let own_weights = &weights[rows.clone()];
                let residual = &self.weighted[record][rows.clone()];
                for (place, term) in terms.iter().enumerate() {
                    let values = &spectra[&term.column][rows.clone()];
                    let (a, size) = (term.parameter, term.coefficient);
                    score[a] += size * dot(values, residual);
                    let mut weighed = [0.0; BLOCK];
                    for ((weighed, value), weight) in
                        weighed.iter_mut().zip(values).zip(own_weights)
                    {
                        *weighed = value * weight;
                    }
                    let weighed = &weighed[..rows.len()];
                    for (of_member, member) in of_members.chunks(BLOCK).zip(&members) {
                        let products = dot(weighed, &of_member[..rows.len()]);
                        cross[(a, member.parameter)] += size * products;
                    }
                    for other in &terms[..=place] {
                        let b = other.parameter;
                        let others = &spectra[&other.column][rows.clone()];
                        let product = size * other.coefficient * dot(weighed, others);
                        own[(a, b)] += product;
                        // A pair of terms of one parameter enters its square twice.
                        if !std::ptr::eq(*term, *other) {
                            own[(b, a)] += product;
                        }
                    }
                }
            });
        }
        let through = &cross * &self.inverse;
        Projected {
            free: &own - &through * cross.transpose(),
            score: score - &through * &self.score,
            own: own.diagonal(),
        }
    }
}

/// Computes the gain of each hypothesis over each of several fits.
///
/// # Inputs
/// `groups`: hypotheses of common columns; the columns of one group are in memory at once, on each thread.
///
/// # Returns
/// Gains by group, hypothesis and test.
pub fn gains(
    tests: &[ScoreTest],
    groups: &[Vec<Hypothesis>],
    columns: &impl Columns,
) -> Vec<Vec<Vec<Gain>>> {
    groups
        .par_iter()
        .map(|group| {
            let spectra = spectra(tests, group, columns);
            let of = |one: &Hypothesis| {
                let each = tests.iter().map(|test| test.project(one, &spectra).gain());
                each.collect()
            };
            group.iter().map(of).collect()
        })
        .collect()
}

/// Coefficients of the columns of some hypotheses.
pub fn spectra(
    tests: &[ScoreTest],
    hypotheses: &[Hypothesis],
    columns: &impl Columns,
) -> BTreeMap<usize, Vec<f64>> {
    let Some(test) = tests.first() else {
        return BTreeMap::new();
    };
    let terms = hypotheses.iter().flat_map(|one| &one.terms);
    let used: BTreeSet<usize> = terms.map(|term| term.column).collect();
    let each = used.into_par_iter().map(|place| {
        let rows = columns.column(place);
        (place, test.equations.transform.spectrum(&rows))
    });
    each.collect()
}

/// Information and score of a hypothesis given the members of a fit.
#[derive(Debug, Clone)]
pub struct Projected {
    free: DMatrix<f64>,
    score: DVector<f64>,
    own: DVector<f64>,
}

impl Projected {
    /// # Inputs
    /// `free`, `score`: information and score given the members; `own`: information of each parameter alone.
    pub fn new(free: DMatrix<f64>, score: DVector<f64>, own: DVector<f64>) -> Self {
        Self { free, score, own }
    }

    /// Information and score in parameters mapped to the hypothesis' by `sizes`, (its parameters × theirs).
    pub fn along(&self, sizes: &DMatrix<f64>) -> Self {
        let free = sizes.transpose() * &self.free * sizes;
        Self {
            score: sizes.transpose() * &self.score,
            own: free.diagonal(),
            free,
        }
    }

    /// Adds information and score of independent data on the same parameters.
    pub fn joined(&self, other: &Self) -> Self {
        Self {
            free: &self.free + &other.free,
            score: &self.score + &other.score,
            own: &self.own + &other.own,
        }
    }

    /// Growth of ln L at given parameters.
    pub fn at(&self, parameters: &DVector<f64>) -> f64 {
        self.score.dot(parameters) - 0.5 * parameters.dot(&(&self.free * parameters))
    }

    /// The other parameters of largest growth given the first at 1.
    pub fn beside_one(&self) -> DVector<f64> {
        let others = self.score.len() - 1;
        let free = self.free.view((1, 1), (others, others)).into_owned();
        let toward = self.score.rows(1, others) - self.free.view((1, 0), (others, 1));
        pseudo_inverse(&free) * toward
    }

    /// Computes the largest growth.
    pub fn gain(&self) -> Gain {
        let count = self.score.len();
        let shown: Vec<usize> = (0..count)
            .filter(|&k| self.own[k] > 0.0 && self.free[(k, k)] > LEAST_FREE * self.own[k])
            .collect();
        let information = DMatrix::from_fn(shown.len(), shown.len(), |i, j| {
            self.free[(shown[i], shown[j])]
        });
        let score = DVector::from_fn(shown.len(), |i, _| self.score[shown[i]]);
        let sizes = pseudo_inverse(&information) * &score;
        let mut estimate = vec![0.0; count];
        for (&k, size) in shown.iter().zip(sizes.iter()) {
            estimate[k] = *size;
        }
        let log_likelihood = 0.5 * score.dot(&sizes);
        Gain {
            log_likelihood: if log_likelihood.is_finite() {
                log_likelihood
            } else {
                0.0
            },
            estimate,
        }
    }
}

/// Noise of a fit with and without its drift: the search includes effects absorbed by drift.
pub fn noises(fit: &Fit) -> Vec<Vec<NoiseLevels>> {
    let stationary: Vec<NoiseLevels> = fit.levels.iter().map(|one| one.stationary()).collect();
    if stationary == fit.levels {
        vec![stationary]
    } else {
        vec![fit.levels.clone(), stationary]
    }
}

fn add(sum: &mut [f64], values: &[f64], factor: f64) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

fn times(values: &[f64], weights: &[f64]) -> Vec<f64> {
    values.iter().zip(weights).map(|(a, b)| a * b).collect()
}

/// Runs `of` on all members' coefficients block by block, [`BLOCK`] of each member, within the cache.
fn blocks(members: &[&Member], rows: usize, mut of: impl FnMut(Range<usize>, &[f64])) {
    let mut values = vec![0.0; members.len() * BLOCK];
    for first in (0..rows).step_by(BLOCK) {
        let rows = first..rows.min(first + BLOCK);
        for (member, block) in members.iter().zip(values.chunks_mut(BLOCK)) {
            member.values.read(rows.clone(), &mut block[..rows.len()]);
        }
        of(rows, &values);
    }
}

/// Rows of a block of products: some dozens of columns of this length fit into a second-level cache.
const BLOCK: usize = 512;

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::{ScoreTest, gains};
    use crate::evaluate::{Drift, Effort, evaluate};
    use crate::{Columns, Hypothesis, NoiseLevels, NormalEquations, Observations, Term};
    use rlg_plan::SearchPlan;

    struct Rows(Vec<Vec<f64>>);

    impl Columns for Rows {
        fn count(&self) -> usize {
            self.0.len()
        }

        fn column(&self, place: usize) -> Vec<f64> {
            self.0[place].clone()
        }
    }

    fn normals(seed: u64) -> Vec<f64> {
        let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        StandardNormal.sample_iter(rng).take(4096).collect()
    }

    fn on_first(column: usize) -> Hypothesis {
        Hypothesis::of_terms(
            1,
            vec![Term {
                parameter: 0,
                record: 0,
                column,
                coefficient: 1.0,
            }],
        )
    }

    /// Given a correlated member, the growth is that of least squares on both less that on one.
    #[test]
    fn the_growth_is_that_of_a_refit_and_what_members_span_adds_nothing() {
        let (own, other) = (normals(1), normals(2));
        let alike: Vec<f64> = own.iter().zip(&other).map(|(a, b)| a + 0.5 * b).collect();
        let noise = normals(3);
        let record: Vec<f64> = (0..4096)
            .map(|k| noise[k] + 0.2 * own[k] + 0.1 * other[k])
            .collect();
        let columns = Rows(vec![own.clone(), alike.clone()]);
        let white = NoiseLevels {
            white: 1.0,
            ..NoiseLevels::default()
        };
        let observations = Observations::bridged(&[true; 4096]).expect("rows");
        let equations =
            NormalEquations::new(observations, std::slice::from_ref(&record), &columns, white);
        let member = on_first(0);
        let fit = evaluate(
            &equations,
            &[&member],
            &[white],
            &[Drift::None],
            Effort::FULL,
            &SearchPlan::default(),
        );
        let test = ScoreTest::new(&equations, &[&member], &columns, &fit.levels);
        let found = gains(&[test], &[vec![on_first(1), on_first(0)]], &columns);
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        // By Gram–Schmidt; the end rows, dropped in the test, hardly matter.
        let share = dot(&alike, &own) / dot(&own, &own);
        let free: Vec<f64> = alike.iter().zip(&own).map(|(a, b)| a - share * b).collect();
        let size = dot(&free, &record) / dot(&free, &free);
        let expected = 0.5 * size * dot(&free, &record) / fit.levels[0].white;
        let first = &found[0][0][0];
        assert!(
            (first.log_likelihood / expected - 1.0).abs() < 0.02,
            "{first:?} {expected}"
        );
        assert!(
            (first.estimate[0] / size - 1.0).abs() < 0.02,
            "{first:?} {size}"
        );
        assert_eq!(found[0][1][0].log_likelihood, 0.0);
    }
}
