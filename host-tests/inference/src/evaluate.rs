//! The log posterior of one set of hypotheses: coefficients integrated out, noise at its best.
//!
//! Each hypothesis has a g-prior, `N(0, g F⁻¹)` with F its own information, g by empirical Bayes (MacKay's update). The
//! noise levels are refitted under every set, from residual powers that hold the posterior covariance of the fit: without
//! it every level comes out low and everything looks significant.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::hypothesis::Hypothesis;
use crate::noise::{NoiseLevels, TERMS};
use crate::normal_equations::NormalEquations;

/// The drift term of one record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drift {
    /// None.
    None,
    /// 1/f.
    Flicker,
    /// A random walk of the record itself.
    Walk,
}

impl Drift {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::None, Self::Flicker, Self::Walk];

    /// Which noise terms are fitted.
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
    /// With prices of drift and of the members.
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
    /// Number of directions of each member that the data show.
    pub ranks: Vec<usize>,
    /// Squared size of each member in standard deviations.
    pub squared_sizes: Vec<f64>,
    /// Whether one member adds no direction to the others.
    pub is_redundant: bool,
    /// Places among the members of those with a value that they cannot have.
    pub impossible: Vec<usize>,
}

impl Fit {
    /// Whether every member adds a direction, and none has a value that it cannot have.
    pub fn is_possible(&self) -> bool {
        !self.is_redundant && self.impossible.is_empty()
    }
}

/// Standard deviations by which an estimate may lie outside what is possible: chance brings it there.
const BY_CHANCE: f64 = 3.0;

/// Steps of an evaluation.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Most alternations between coefficients and noise.
    pub alternations: usize,
    /// Change of the log likelihood at which they end.
    pub tolerance: f64,
}

impl Effort {
    /// To the end.
    pub const FULL: Self = Self {
        alternations: 14,
        tolerance: 5e-3,
    };
    /// A first look from noise that is nearly right.
    pub const QUICK: Self = Self {
        alternations: 5,
        tolerance: 5e-3,
    };
}

/// Directions with less than this share of a block's largest information are not seen.
const LEAST_DIRECTION: f64 = 1e-9;

/// The same for a member beside others, of columns scaled alike; columns are kept in single precision.
const LEAST_ADDED: f64 = 1e-8;

/// Bounds of g.
const G_RANGE: [f64; 2] = [1.0, 1e12];

/// Columns of a set, record by record, in parameters scaled to unit power.
pub(crate) struct Assembled {
    /// Parameters of each member.
    pub blocks: Vec<Range<usize>>,
    /// What a scaled parameter is in its own unit.
    pub scale: Vec<f64>,
    records: Vec<OfRecord>,
}

struct OfRecord {
    /// Σ of the squared record in each bin, less what members add whatever their parameters.
    energy: Vec<f64>,
    /// Parameters that this record shows.
    parameters: Vec<usize>,
    /// Per bin G, row by row.
    gram: Vec<Vec<f64>>,
    /// Per bin h.
    moments: Vec<Vec<f64>>,
}

impl Assembled {
    pub(crate) fn new(equations: &NormalEquations, set: &[&Hypothesis]) -> Self {
        let mut blocks = Vec::new();
        let mut count = 0;
        for one in set {
            blocks.push(count..count + one.parameters);
            count += one.parameters;
        }
        let records = equations.record_count();
        let mut columns: Vec<Vec<Vec<(usize, f64)>>> = vec![vec![Vec::new(); count]; records];
        let mut power = vec![0.0; count];
        for (one, block) in set.iter().zip(&blocks) {
            for term in &one.terms {
                let scale = equations.scale(term.column);
                if scale > 0.0 {
                    let size = term.coefficient / scale;
                    let parameter = block.start + term.parameter;
                    columns[term.record][parameter].push((term.column, size));
                    power[parameter] += size * size;
                }
            }
        }
        let scale: Vec<f64> = power
            .iter()
            .map(|power| {
                if *power > 0.0 {
                    1.0 / power.sqrt()
                } else {
                    1.0
                }
            })
            .collect();
        let records = columns
            .into_iter()
            .enumerate()
            .map(|(record, of_parameters)| {
                let fixed = set.iter().flat_map(|one| &one.fixed);
                let fixed: Vec<(usize, f64)> = fixed
                    .filter(|one| one.record == record && equations.scale(one.column) > 0.0)
                    .map(|one| (one.column, one.size / equations.scale(one.column)))
                    .collect();
                OfRecord::new(equations, record, &of_parameters, &scale, &fixed)
            })
            .collect();
        Self {
            blocks,
            scale,
            records,
        }
    }

    fn parameters(&self) -> usize {
        self.scale.len()
    }

    /// Information and score of all parameters under noise powers by bin, `[record][bin]`.
    fn sums(&self, powers: &[Vec<f64>]) -> (DMatrix<f64>, DVector<f64>) {
        let count = self.parameters();
        let mut information = DMatrix::zeros(count, count);
        let mut score = DVector::zeros(count);
        for (record, powers) in self.records.iter().zip(powers) {
            let size = record.parameters.len();
            let mut gram = vec![0.0; size * size];
            let mut moments = vec![0.0; size];
            for ((of_bin, of_moments), power) in record.gram.iter().zip(&record.moments).zip(powers)
            {
                let weight = 1.0 / power;
                for (sum, value) in gram.iter_mut().zip(of_bin) {
                    *sum += weight * value;
                }
                for (sum, value) in moments.iter_mut().zip(of_moments) {
                    *sum += weight * value;
                }
            }
            for (i, &a) in record.parameters.iter().enumerate() {
                score[a] += moments[i];
                for (j, &b) in record.parameters.iter().enumerate() {
                    information[(a, b)] += gram[i * size + j];
                }
            }
        }
        (information, score)
    }

    /// Information of all parameters, scaled, under the noise of a fit.
    pub(crate) fn information(
        &self,
        equations: &NormalEquations,
        levels: &[NoiseLevels],
    ) -> DMatrix<f64> {
        let powers: Vec<Vec<f64>> = levels
            .iter()
            .map(|levels| equations.basis.binned(*levels))
            .collect();
        self.sums(&powers).0
    }
}

impl OfRecord {
    fn new(
        equations: &NormalEquations,
        record: usize,
        of_parameters: &[Vec<(usize, f64)>],
        scale: &[f64],
        fixed: &[(usize, f64)],
    ) -> Self {
        let mut energy = equations.energy(record).to_vec();
        for (bin, energy) in energy.iter_mut().enumerate() {
            for &(column, size) in fixed {
                *energy -= 2.0 * size * equations.moment(record, bin, column);
                for &(other, other_size) in fixed {
                    *energy += size * other_size * equations.product(bin, column, other);
                }
            }
            *energy = energy.max(LEAST_INFORMATION);
        }
        let parameters: Vec<usize> = (0..of_parameters.len())
            .filter(|&parameter| !of_parameters[parameter].is_empty())
            .collect();
        let bins = equations.basis.bins.len();
        let size = parameters.len();
        let mut gram = vec![vec![0.0; size * size]; bins];
        let mut moments = vec![vec![0.0; size]; bins];
        for (i, &a) in parameters.iter().enumerate() {
            for &(column, weight) in &of_parameters[a] {
                for (bin, moments) in moments.iter_mut().enumerate() {
                    let mut moment = equations.moment(record, bin, column);
                    for &(other, size) in fixed {
                        moment -= size * equations.product(bin, column, other);
                    }
                    moments[i] += weight * scale[a] * moment;
                }
            }
            for (j, &b) in parameters.iter().enumerate().take(i + 1) {
                for &(first, first_weight) in &of_parameters[a] {
                    for &(second, second_weight) in &of_parameters[b] {
                        let weight = first_weight * second_weight * scale[a] * scale[b];
                        for (bin, gram) in gram.iter_mut().enumerate() {
                            gram[i * size + j] += weight * equations.product(bin, first, second);
                        }
                    }
                }
            }
        }
        for gram in &mut gram {
            for i in 0..size {
                for j in 0..i {
                    gram[j * size + i] = gram[i * size + j];
                }
            }
        }
        Self {
            energy,
            parameters,
            gram,
            moments,
        }
    }
}

/// What a block's information says by its directions.
struct BlockPrior {
    information: DMatrix<f64>,
    rank: usize,
    /// Prior precision that does not depend on g: of directions that are not seen, to keep them finite, and of physical
    /// size.
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

/// Information below which a direction counts as empty.
const LEAST_INFORMATION: f64 = 1e-200;

/// Fits a set with given drift terms, its noise from `start`.
///
/// # Returns
/// A [`Fit`] whose `score` is still its `log_likelihood`.
pub fn evaluate(
    equations: &NormalEquations,
    set: &[&Hypothesis],
    start: &[NoiseLevels],
    drift: &[Drift],
    effort: Effort,
) -> Fit {
    let whole: Vec<&Hypothesis> = set.iter().copied().chain(equations.gaps()).collect();
    let assembled = Assembled::new(equations, &whole);
    let basis = &equations.basis;
    let count = assembled.parameters();
    let of_gaps = set.iter().map(|one| one.parameters).sum();
    let mut levels: Vec<NoiseLevels> = start
        .iter()
        .zip(drift)
        .map(|(levels, drift)| start_level(*levels, *drift))
        .collect();
    let of_size: Vec<f64> = set
        .iter()
        .flat_map(|one| (0..one.parameters).map(|parameter| one.bound(parameter).std))
        .zip(&assembled.scale)
        .map(|(std, scale)| (scale / std).powi(2))
        .collect();
    let mut g = vec![100.0; set.len()];
    let mut last = f64::NEG_INFINITY;
    let mut alternation = 0;
    loop {
        let powers: Vec<Vec<f64>> = levels.iter().map(|levels| basis.binned(*levels)).collect();
        let (information, score) = assembled.sums(&powers);
        let mut log_likelihood = 0.0;
        for (record, powers) in powers.iter().enumerate() {
            let bins = powers
                .iter()
                .zip(&basis.counts)
                .zip(&assembled.records[record].energy);
            log_likelihood -= 0.5
                * bins
                    .map(|((power, count), energy)| count * power.ln() + energy / power)
                    .sum::<f64>();
        }
        let mut precision = information.clone();
        let seen = beside(&information, of_gaps);
        let priors: Vec<BlockPrior> = assembled.blocks[..set.len()]
            .iter()
            .map(|block| BlockPrior::new(sub_matrix(&seen, block), &of_size[block.clone()]))
            .collect();
        for ((block, prior), g) in assembled.blocks.iter().zip(&priors).zip(&g) {
            let of_block = prior.precision(*g);
            for i in 0..block.len() {
                for j in 0..block.len() {
                    precision[(block.start + i, block.start + j)] += of_block[(i, j)];
                }
            }
            log_likelihood += 0.5 * invert(&of_block).1;
        }
        let (inverse, log_determinant) = invert(&precision);
        let estimate = &inverse * &score;
        log_likelihood += 0.5 * (score.dot(&estimate) - log_determinant);
        let settled = (log_likelihood - last).abs() < effort.tolerance && alternation > 2;
        alternation += 1;
        if settled || alternation >= effort.alternations {
            return finish(Finished {
                set,
                assembled,
                levels,
                drift,
                information,
                inverse,
                estimate,
                ranks: priors.iter().map(|prior| prior.rank).collect(),
                log_likelihood,
            });
        }
        last = log_likelihood;
        for ((block, prior), g) in assembled.blocks.iter().zip(&priors).zip(&mut g) {
            let of_block = estimate.rows_range(block.clone()).into_owned();
            let covariance = sub_matrix(&inverse, block);
            let lost = (&covariance * &prior.information).trace() / *g;
            let freedom = (prior.rank as f64 - lost).max(1e-3);
            let power = of_block.dot(&(&prior.information * &of_block));
            *g = (power / freedom).clamp(G_RANGE[0], G_RANGE[1]);
        }
        for (record, of_record) in assembled.records.iter().enumerate() {
            let power = of_record.residual_power(&estimate, &inverse);
            levels[record] = basis.fit(&power, levels[record], drift[record].active());
        }
        debug_assert_eq!(estimate.len(), count);
    }
}

impl OfRecord {
    /// Expected power left in each bin: of the mean, and of the posterior spread.
    fn residual_power(&self, estimate: &DVector<f64>, covariance: &DMatrix<f64>) -> Vec<f64> {
        let size = self.parameters.len();
        let of_record: Vec<f64> = self.parameters.iter().map(|&a| estimate[a]).collect();
        let mut second = vec![0.0; size * size];
        for (i, &a) in self.parameters.iter().enumerate() {
            for (j, &b) in self.parameters.iter().enumerate() {
                second[i * size + j] = covariance[(a, b)] + estimate[a] * estimate[b];
            }
        }
        let bins = self.energy.iter().zip(&self.gram).zip(&self.moments);
        bins.map(|((energy, gram), moments)| {
            let cross: f64 = moments.iter().zip(&of_record).map(|(h, x)| h * x).sum();
            let square: f64 = gram.iter().zip(&second).map(|(g, v)| g * v).sum();
            (energy - 2.0 * cross + square).max(LEAST_INFORMATION)
        })
        .collect()
    }
}

/// What is left of the information of parameters before `rest` beside those from there on.
fn beside(information: &DMatrix<f64>, rest: usize) -> DMatrix<f64> {
    let others = information.nrows() - rest;
    let own = information.view((0, 0), (rest, rest)).into_owned();
    if rest == 0 || others == 0 {
        return own;
    }
    let between = information.view((0, rest), (rest, others));
    let of_others = information.view((rest, rest), (others, others));
    own - between * invert(&of_others.into_owned()).0 * between.transpose()
}

/// Noise to start from: a drift term that was off begins at three times the white one.
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

/// Inverse and ln determinant of a positive matrix, scaled to unit diagonal before.
fn invert(precision: &DMatrix<f64>) -> (DMatrix<f64>, f64) {
    let count = precision.nrows();
    if count == 0 {
        return (DMatrix::zeros(0, 0), 0.0);
    }
    let scale: Vec<f64> = (0..count)
        .map(|k| 1.0 / precision[(k, k)].max(LEAST_INFORMATION).sqrt())
        .collect();
    // Members that add nothing to each other leave a matrix without an inverse; their set is refused by its rank.
    for ridge in [1e-12, 1e-9, 1e-6] {
        let mut scaled =
            DMatrix::from_fn(count, count, |i, j| precision[(i, j)] * scale[i] * scale[j]);
        for k in 0..count {
            scaled[(k, k)] += ridge;
        }
        if let Some(cholesky) = scaled.cholesky() {
            let log_determinant = 2.0
                * (0..count)
                    .map(|k| cholesky.l_dirty()[(k, k)].ln() - scale[k].ln())
                    .sum::<f64>();
            let inverse = cholesky.inverse();
            let inverse =
                DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
            return (inverse, log_determinant);
        }
    }
    (DMatrix::zeros(count, count), f64::INFINITY)
}

fn sub_matrix(matrix: &DMatrix<f64>, block: &Range<usize>) -> DMatrix<f64> {
    matrix
        .view((block.start, block.start), (block.len(), block.len()))
        .into_owned()
}

struct Finished<'a> {
    set: &'a [&'a Hypothesis],
    assembled: Assembled,
    levels: Vec<NoiseLevels>,
    drift: &'a [Drift],
    information: DMatrix<f64>,
    inverse: DMatrix<f64>,
    estimate: DVector<f64>,
    ranks: Vec<usize>,
    log_likelihood: f64,
}

fn finish(
    Finished {
        set,
        assembled,
        levels,
        drift,
        information,
        inverse,
        estimate,
        ranks,
        log_likelihood,
    }: Finished,
) -> Fit {
    let scale = &assembled.scale;
    let mut blocks = assembled.blocks.clone();
    let gaps = blocks.split_off(set.len());
    let squared_sizes = blocks
        .iter()
        .map(|block| {
            let of_block = estimate.rows_range(block.clone()).into_owned();
            let covariance = sub_matrix(&inverse, block);
            squared_size(&of_block, &covariance)
        })
        .collect();
    let count = scale.len();
    let is_impossible = |(one, block): (&&Hypothesis, &Range<usize>)| {
        block.clone().enumerate().any(|(parameter, k)| {
            let std = inverse[(k, k)].max(0.0).sqrt() * scale[k];
            let bound = one.bound(parameter);
            bound.excludes(estimate[k] * scale[k], std, BY_CHANCE)
        })
    };
    let impossible = (0..set.len())
        .filter(|&place| is_impossible((&set[place], &blocks[place])))
        .collect();
    Fit {
        impossible,
        members: Vec::new(),
        is_redundant: is_redundant(&information, &blocks),
        log_likelihood,
        score: log_likelihood,
        levels,
        drift: drift.to_vec(),
        estimate: DVector::from_fn(count, |k, _| estimate[k] * scale[k]),
        covariance: DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] * scale[i] * scale[j]),
        blocks,
        gaps,
        ranks,
        squared_sizes,
    }
}

/// xᵀ V⁻¹ x over the directions that V has.
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

/// Whether a member adds no direction to the others.
fn is_redundant(information: &DMatrix<f64>, blocks: &[Range<usize>]) -> bool {
    if blocks.len() < 2 {
        return false;
    }
    let all: Vec<usize> = (0..information.nrows()).collect();
    let whole = scaled_rank(information, &all);
    blocks.iter().any(|block| {
        let others: Vec<usize> = all.iter().copied().filter(|k| !block.contains(k)).collect();
        scaled_rank(information, &others) == whole
    })
}

/// Rank of some rows and columns, each scaled to unit information.
pub(crate) fn scaled_rank(information: &DMatrix<f64>, of: &[usize]) -> usize {
    if of.is_empty() {
        return 0;
    }
    let scale = |k: usize| 1.0 / information[(k, k)].max(LEAST_INFORMATION).sqrt();
    let scaled = DMatrix::from_fn(of.len(), of.len(), |i, j| {
        information[(of[i], of[j])] * scale(of[i]) * scale(of[j])
    });
    let eigen = scaled.symmetric_eigenvalues();
    eigen.iter().filter(|value| **value > LEAST_ADDED).count()
}
