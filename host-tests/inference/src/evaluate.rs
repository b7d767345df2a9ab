//! Log marginal likelihood of a set of hypotheses: coefficients integrated out, noise levels maximised.
//!
//! Each hypothesis has a g-prior, `N(0, g F⁻¹)` with F its own information, g by empirical Bayes (MacKay's update). The
//! noise levels are refitted for every set, from residual powers with the posterior covariance of the fit included: without
//! it every level is underestimated and every significance overestimated.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rlg_plan::SearchPlan;

use crate::assembled::{Assembled, BesideGaps, binned};
use crate::hypothesis::Hypothesis;
use crate::likelihood::Likelihood;
use crate::linear::{LEAST_INFORMATION, invert, sub_matrix};
use crate::noise::{NoiseLevels, TERMS};
use crate::work::count_evaluation;

/// Drift term of one record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drift {
    /// No drift.
    None,
    /// Flicker, 1/f.
    Flicker,
    /// Random walk of the record.
    Walk,
}

impl Drift {
    /// All drift terms.
    pub const ALL: [Self; 3] = [Self::None, Self::Flicker, Self::Walk];

    /// Mask of the fitted noise terms.
    pub fn active(self) -> [bool; TERMS] {
        [true, true, self == Self::Flicker, self == Self::Walk]
    }
}

/// A fitted set.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Places of the members, ascending.
    pub members: Vec<usize>,
    /// Log marginal likelihood.
    pub log_likelihood: f64,
    /// Log posterior: log marginal likelihood less the prices of drift and members.
    pub score: f64,
    /// Noise of each record.
    pub levels: Vec<NoiseLevels>,
    /// Drift of each record.
    pub drift: Vec<Drift>,
    /// Parameters of each member.
    pub blocks: Vec<Range<usize>>,
    /// Parameters of each record's gaps.
    pub gaps: Vec<Range<usize>>,
    /// Posterior means.
    pub estimate: DVector<f64>,
    /// Posterior covariance.
    pub covariance: DMatrix<f64>,
    /// Rank of each member's information: number of directions observed by the data.
    pub ranks: Vec<usize>,
    /// Squared size of each member in standard deviations (Mahalanobis distance from 0).
    pub squared_sizes: Vec<f64>,
    /// A member is collinear with the others.
    pub is_redundant: bool,
    /// Places among the members of estimates outside their possible range.
    pub impossible: Vec<usize>,
}

impl Fit {
    /// True if every member adds a direction, and all estimates are possible.
    pub fn is_possible(&self) -> bool {
        !self.is_redundant && self.impossible.is_empty()
    }
}

/// Limits of the iterations of an evaluation.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Largest number of alternations between coefficients and noise.
    pub alternations: usize,
    /// Change of the log likelihood at convergence.
    pub tolerance: f64,
}

impl Effort {
    /// Iterations to convergence.
    pub const FULL: Self = Self {
        alternations: 14,
        tolerance: 5e-3,
    };
    /// A quick evaluation from nearly converged noise.
    pub const QUICK: Self = Self {
        alternations: 5,
        tolerance: 5e-3,
    };
}

/// Share of a block's largest information below which a direction is unobserved.
const LEAST_DIRECTION: f64 = 1e-9;

/// Share of a member's scaled information given the others, below which it is collinear; columns are stored in single
/// precision.
const LEAST_ADDED: f64 = 1e-8;

/// Bounds of g.
const G_RANGE: [f64; 2] = [1.0, 1e12];

/// Prior of a block by the eigenvectors of its information.
struct BlockPrior {
    information: DMatrix<f64>,
    rank: usize,
    /// Prior precision independent of g: of unobserved directions, to keep them finite, and of physical size.
    fixed: DMatrix<f64>,
}

impl BlockPrior {
    /// # Inputs
    /// `of_size`: prior precision of each parameter by its physical size.
    fn new(information: DMatrix<f64>, of_size: &[f64]) -> Self {
        let eigen = SymmetricEigen::new(information.clone());
        let largest = eigen.eigenvalues.max().max(LEAST_INFORMATION);
        let size = information.nrows();
        let mut rank = 0;
        let mut fixed = DMatrix::zeros(size, size);
        for (value, direction) in eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
        {
            if *value > LEAST_DIRECTION * largest && *value > LEAST_INFORMATION {
                rank += 1;
            } else {
                fixed += direction * direction.transpose() * largest;
            }
        }
        for (k, precision) in of_size.iter().enumerate() {
            fixed[(k, k)] += precision;
        }
        Self {
            information,
            rank,
            fixed,
        }
    }

    /// Precision of the block's prior.
    fn precision(&self, g: f64) -> DMatrix<f64> {
        &self.information / g + &self.fixed
    }
}

/// Fits a set with given drift terms, its noise from `start`.
///
/// # Returns
/// A [`Fit`] with the `log_likelihood` as its `score`.
pub fn evaluate(
    data: &impl Likelihood,
    set: &[&Hypothesis],
    start: &[NoiseLevels],
    drift: &[Drift],
    effort: Effort,
    plan: &SearchPlan,
) -> Fit {
    let assembled = Assembled::new(data, set);
    evaluate_assembled(data, (set, &assembled), start, drift, effort, plan)
}

/// Fits a set that is assembled already.
pub(crate) fn evaluate_assembled(
    data: &impl Likelihood,
    (set, assembled): (&[&Hypothesis], &Assembled),
    start: &[NoiseLevels],
    drift: &[Drift],
    effort: Effort,
    plan: &SearchPlan,
) -> Fit {
    count_evaluation();
    let mut levels: Vec<NoiseLevels> = start
        .iter()
        .zip(drift)
        .map(|(levels, drift)| start_level(*levels, *drift))
        .collect();
    let mut g = vec![100.0; set.len()];
    let mut last = f64::NEG_INFINITY;
    let mut alternation = 0;
    loop {
        let mut posterior = Posterior::new(data, set, assembled, &levels, &g);
        let settled = (posterior.log_likelihood - last).abs() < effort.tolerance && alternation > 2;
        alternation += 1;
        if settled || alternation >= effort.alternations {
            if set.iter().any(|one| is_beyond_a_value(one)) {
                posterior.free_deviations(set, assembled, &g);
            }
            let drift = drift.to_vec();
            return posterior.fit(set, assembled, levels, drift, plan.by_chance);
        }
        last = posterior.log_likelihood;
        for ((block, prior), g) in assembled.blocks.iter().zip(&posterior.priors).zip(&mut g) {
            *g = posterior.g_of(block, prior, *g);
        }
        let Posterior {
            estimate,
            covariance,
            ..
        } = &posterior;
        for (record, (levels, drift)) in levels.iter_mut().zip(drift).enumerate() {
            let power = assembled.records[record].residual_power(estimate, covariance);
            *levels = data.basis(record).fit(&power, *levels, drift.active());
        }
    }
}

/// Posterior of a set's parameters at given noise levels and prior widths.
struct Posterior {
    /// Log marginal likelihood.
    log_likelihood: f64,
    /// Information of each parameter by itself.
    own_information: DVector<f64>,
    /// Information with the gaps integrated out.
    beside: BesideGaps,
    priors: Vec<BlockPrior>,
    score: DVector<f64>,
    covariance: DMatrix<f64>,
    estimate: DVector<f64>,
}

impl Posterior {
    /// # Inputs
    /// `g`: prior variance of each member over the inverse of its own information.
    fn new(
        data: &impl Likelihood,
        set: &[&Hypothesis],
        assembled: &Assembled,
        levels: &[NoiseLevels],
        g: &[f64],
    ) -> Self {
        let powers = binned(data, levels);
        let (information, score) = assembled.sums(&powers);
        let mut log_likelihood = noise_likelihood(data, assembled, &powers);
        let beside = assembled.beside_gaps(&information);
        let of_size: Vec<f64> = set
            .iter()
            .flat_map(|one| (0..one.parameters).map(|parameter| one.bound(parameter).std))
            .zip(&assembled.scale)
            .map(|(std, scale)| (scale / std).powi(2))
            .collect();
        let priors: Vec<BlockPrior> = assembled
            .blocks
            .iter()
            .map(|block| {
                let of_block = sub_matrix(&beside.information, block);
                BlockPrior::new(of_block, &of_size[block.clone()])
            })
            .collect();
        let mut precision = beside.information.clone();
        for ((block, prior), g) in assembled.blocks.iter().zip(&priors).zip(g) {
            let of_block = prior.precision(*g);
            add_block(&mut precision, block, &of_block);
            log_likelihood += 0.5 * invert(&of_block).1;
        }
        let (of_members, log_determinant) = invert(&precision);
        let covariance = beside.covariance(&of_members);
        let estimate = &covariance * &score;
        log_likelihood += 0.5 * (score.dot(&estimate) - log_determinant - beside.log_determinant);
        Self {
            log_likelihood,
            own_information: information.diagonal(),
            beside,
            priors,
            score,
            covariance,
            estimate,
        }
    }

    /// Replaces estimate and covariance by those without a g-prior on deviations from a nonzero value.
    fn free_deviations(&mut self, set: &[&Hypothesis], assembled: &Assembled, g: &[f64]) {
        let mut precision = self.beside.information.clone();
        let each = set.iter().zip(&assembled.blocks);
        for ((one, block), (prior, g)) in each.zip(self.priors.iter().zip(g)) {
            let g = if is_beyond_a_value(one) {
                f64::INFINITY
            } else {
                *g
            };
            add_block(&mut precision, block, &prior.precision(g));
        }
        self.covariance = self.beside.covariance(&invert(&precision).0);
        self.estimate = &self.covariance * &self.score;
    }

    /// Updates g of a member by empirical Bayes (MacKay).
    fn g_of(&self, block: &Range<usize>, prior: &BlockPrior, g: f64) -> f64 {
        let of_block = self.estimate.rows_range(block.clone()).into_owned();
        let of_spread = sub_matrix(&self.covariance, block);
        let lost = (&of_spread * &prior.information).trace() / g;
        let freedom = (prior.rank as f64 - lost).max(1e-3);
        let power = of_block.dot(&(&prior.information * &of_block));
        (power / freedom).clamp(G_RANGE[0], G_RANGE[1])
    }

    /// The fit, in the parameters' own units.
    ///
    /// # Inputs
    /// `by_chance`: excess over a possible range attributed to chance \[σ\].
    fn fit(
        self,
        set: &[&Hypothesis],
        assembled: &Assembled,
        levels: Vec<NoiseLevels>,
        drift: Vec<Drift>,
        by_chance: f64,
    ) -> Fit {
        let Self {
            log_likelihood,
            own_information,
            beside,
            priors,
            covariance,
            estimate,
            ..
        } = self;
        let scale = &assembled.scale;
        let blocks = assembled.blocks.clone();
        let squared_sizes = blocks
            .iter()
            .map(|block| {
                let of_block = estimate.rows_range(block.clone()).into_owned();
                squared_size(&of_block, &sub_matrix(&covariance, block))
            })
            .collect();
        let count = scale.len();
        let is_impossible = |(one, block): (&&Hypothesis, &Range<usize>)| {
            block.clone().enumerate().any(|(parameter, k)| {
                let std = covariance[(k, k)].max(0.0).sqrt() * scale[k];
                let bound = one.bound(parameter);
                bound.excludes(estimate[k] * scale[k], std, by_chance)
            })
        };
        let impossible = (0..set.len())
            .filter(|&place| is_impossible((&set[place], &blocks[place])))
            .collect();
        Fit {
            impossible,
            members: Vec::new(),
            is_redundant: is_redundant(&beside.information, &own_information, &blocks),
            log_likelihood,
            score: log_likelihood,
            levels,
            drift,
            estimate: DVector::from_fn(count, |k, _| estimate[k] * scale[k]),
            covariance: DMatrix::from_fn(count, count, |i, j| {
                covariance[(i, j)] * scale[i] * scale[j]
            }),
            blocks,
            gaps: assembled.gaps.clone(),
            ranks: priors.iter().map(|prior| prior.rank).collect(),
            squared_sizes,
        }
    }
}

/// Log likelihood of all records as noise of given powers.
fn noise_likelihood(data: &impl Likelihood, assembled: &Assembled, powers: &[Vec<f64>]) -> f64 {
    let mut log_likelihood = 0.0;
    for (record, (of_record, powers)) in assembled.records.iter().zip(powers).enumerate() {
        let counts = &data.basis(record).counts;
        let bins = powers.iter().zip(counts).zip(&of_record.energy);
        log_likelihood -= 0.5
            * bins
                .map(|((power, count), energy)| count * power.ln() + energy / power)
                .sum::<f64>();
    }
    log_likelihood
}

/// Adds a matrix to a block on the diagonal of another.
fn add_block(matrix: &mut DMatrix<f64>, block: &Range<usize>, of_block: &DMatrix<f64>) {
    let shape = (block.len(), block.len());
    let mut own = matrix.view_mut((block.start, block.start), shape);
    own += of_block;
}

/// True if a hypothesis's columns are made about a nonzero value: the parameters are then deviations from it, and a g-prior
/// about 0 would halve their variance at that value.
fn is_beyond_a_value(one: &Hypothesis) -> bool {
    !one.fixed.is_empty()
}

/// Expected residual energy, by record and bin \[the record's unit squared\]: that of the mean residual, and that of the
/// posterior covariance.
pub fn residual_power(data: &impl Likelihood, set: &[&Hypothesis], fit: &Fit) -> Vec<Vec<f64>> {
    let assembled = Assembled::new(data, set);
    let scale = &assembled.scale;
    let estimate = DVector::from_fn(scale.len(), |k, _| fit.estimate[k] / scale[k]);
    let covariance = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
        fit.covariance[(i, j)] / (scale[i] * scale[j])
    });
    let records = assembled.records.iter();
    records
        .map(|record| record.residual_power(&estimate, &covariance))
        .collect()
}

/// Initial noise levels: a drift term that was off starts at three times the white one.
fn start_level(levels: NoiseLevels, drift: Drift) -> NoiseLevels {
    let begun = |level: f64| {
        if level > 0.0 {
            level
        } else {
            3.0 * levels.white
        }
    };
    match drift {
        Drift::None => levels.stationary(),
        Drift::Flicker => NoiseLevels {
            flicker: begun(levels.flicker),
            walk: 0.0,
            ..levels
        },
        Drift::Walk => NoiseLevels {
            flicker: 0.0,
            walk: begun(levels.walk),
            ..levels
        },
    }
}

/// Mahalanobis distance xᵀ V⁻¹ x over the directions of nonzero variance.
fn squared_size(estimate: &DVector<f64>, covariance: &DMatrix<f64>) -> f64 {
    let eigen = SymmetricEigen::new(covariance.clone());
    let largest = eigen.eigenvalues.max();
    eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
        .filter(|(value, _)| **value > 1e-10 * largest)
        .map(|(value, direction)| direction.dot(estimate).powi(2) / value)
        .sum()
}

/// True if a member is collinear with the others and the gaps.
///
/// # Inputs
/// `beside_gaps`: information with the gaps integrated out; `own`: information of each parameter by itself.
fn is_redundant(beside_gaps: &DMatrix<f64>, own: &DVector<f64>, blocks: &[Range<usize>]) -> bool {
    let all: Vec<usize> = (0..beside_gaps.nrows()).collect();
    let rank = |of: &[usize]| {
        let scale = |k: usize| 1.0 / own[k].max(LEAST_INFORMATION).sqrt();
        let scaled = DMatrix::from_fn(of.len(), of.len(), |i, j| {
            beside_gaps[(of[i], of[j])] * scale(of[i]) * scale(of[j])
        });
        let eigen = scaled.symmetric_eigenvalues();
        eigen.iter().filter(|value| **value > LEAST_ADDED).count()
    };
    if blocks.len() < 2 {
        return false;
    }
    let whole = rank(&all);
    // At full rank no member is collinear.
    whole < all.len()
        && blocks.iter().any(|block| {
            let others: Vec<usize> = all.iter().copied().filter(|k| !block.contains(k)).collect();
            rank(&others) == whole
        })
}
