//! Whether blocks of a record agree on a group of numbers: real noise is neither Gaussian nor stationary, and a likelihood
//! ratio lies where few rows carry it.
//!
//! Rows are whitened and reduced to the frequencies that are looked at, what free rows hold is projected out, and
//! contiguous blocks keep their sums. (inference.md, B6.)

use nalgebra::{DMatrix, DVector};
use rlg_inference::Dct;
use rlg_inference::linear::invert;
use rlg_signal::axes::Triad;

use crate::equations::Band;
use crate::increments::Increments;
use crate::noise::{Alike, Levels, NoiseTerms};

/// Sums of one block.
#[derive(Clone)]
struct Sums {
    gram: DMatrix<f64>,
    moments: DVector<f64>,
    energy: f64,
}

/// Sums of all blocks over all parameters.
pub struct Blocks<'a> {
    sums: Vec<Sums>,
    total: Sums,
    /// Whitened columns and record by block, for columns that come later.
    white: Vec<(DMatrix<f64>, DVector<f64>)>,
    whitener: Whitener<'a>,
}

/// What blocks say of a group of numbers beside others.
#[derive(Debug, Clone, Copy, Default)]
pub struct Statistic {
    /// Squared size in standard deviations of the likelihood.
    pub squared_size: f64,
    /// Variance between blocks over that of the likelihood, at least 1.
    pub design_effect: f64,
    /// Numbers.
    pub count: usize,
}

impl Statistic {
    /// Gain in log evidence with a prior of the best width, less the price of a search through `groups`.
    ///
    /// # Inputs
    /// `is_deflated`: by what blocks disagree.
    pub fn gain(&self, groups: usize, is_deflated: bool) -> f64 {
        self.gained(is_deflated) + log_chance(groups)
    }

    /// The gain, deflated no more than that of a winner on the same rows: whether both explain as much is a matter of these.
    pub fn gain_beside(&self, winner: &Self, groups: usize) -> f64 {
        let design_effect = self.design_effect.min(winner.design_effect);
        Self {
            design_effect,
            ..*self
        }
        .gain(groups, true)
    }

    /// The same without a price.
    pub fn gained(&self, is_deflated: bool) -> f64 {
        let deflated = if is_deflated { self.design_effect } else { 1.0 };
        let squared = self.squared_size / deflated;
        let count = self.count as f64;
        if squared > count {
            0.5 * (squared - count - count * (squared / count).ln())
        } else {
            0.0
        }
    }
}

/// Log of the chance beforehand that one of `groups` is there.
pub fn log_chance(groups: usize) -> f64 {
    /// That any of them is.
    const PRIOR: f64 = 0.3;
    (PRIOR / groups as f64).ln()
}

/// Estimates of some parameters with their covariance.
pub struct Estimates {
    /// Values.
    pub values: Vec<f64>,
    /// Covariance: the larger of the likelihood's and of the blocks', by parameter; correlations of the likelihood.
    pub covariance: DMatrix<f64>,
}

/// Time of a block \[s\], and least number of blocks.
const BLOCK_S: f64 = 6.0;
const LEAST_BLOCKS: usize = 15;

/// Least whitened rows of a block.
const LEAST_ROWS: usize = 4;

impl<'a> Blocks<'a> {
    /// Whitens rows and columns.
    ///
    /// # Inputs
    /// `rows_rad`: without outliers; `precisions`: of a prior about 0 on each parameter, once `moved` by what rows are linear
    /// about.
    pub fn new(
        (band, terms, levels): (&'a Band, &NoiseTerms, &Levels),
        increments: &Increments,
        rows_rad: &Triad,
        columns: &mut dyn Iterator<Item = Triad>,
        (precisions, moved): (&[f64], &[f64]),
    ) -> Self {
        let whitener = Whitener::new(band, terms, levels, &increments.free);
        let record = whitener.whiten(rows_rad);
        let columns: Vec<Triad> = columns.map(|column| whitener.whiten(&column)).collect();
        let span_s = increments.period_s * increments.rows() as f64;
        let count = ((span_s / BLOCK_S) as usize)
            .max(LEAST_BLOCKS)
            .min(band.cut / LEAST_ROWS);
        let ranges = (0..count).map(|block| rows_of(block, count, band.cut));
        let white: Vec<(DMatrix<f64>, DVector<f64>)> = ranges
            .map(|range| {
                let record = DVector::from_vec(within(&record, &range));
                (matrix(&columns, &range), record)
            })
            .collect();
        // Parameters are what they are in all, not beyond what the rows are linear about.
        let moved = DVector::from_column_slice(moved);
        let share = 1.0 / count as f64;
        let prior = precisions.iter().map(|precision| precision * share);
        let prior = DMatrix::from_diagonal(&DVector::from_iterator(precisions.len(), prior));
        let sums = white.iter().map(|(rows, record)| {
            let gram = rows.tr_mul(rows);
            let moments = rows.tr_mul(record);
            Sums {
                energy: record.dot(record)
                    + 2.0 * moved.dot(&moments)
                    + moved.dot(&(&gram * &moved)),
                moments: moments + &gram * &moved,
                gram: gram + &prior,
            }
        });
        let sums: Vec<Sums> = sums.collect();
        Self {
            total: total(&sums),
            sums,
            white,
            whitener,
        }
    }

    /// The same with more columns at the end, without a prior on them.
    ///
    /// # Inputs
    /// `moved`: what the rows are linear about, of the first parameters.
    pub fn with(&self, columns: impl Iterator<Item = Triad>, moved: &[f64]) -> Self {
        let columns: Vec<Triad> = columns
            .map(|column| self.whitener.whiten(&column))
            .collect();
        let cut = self.whitener.band.cut;
        let count = self.sums.len();
        let mut sums = Vec::with_capacity(count);
        let mut white = Vec::with_capacity(count);
        for (block, (old, (rows, record))) in self.sums.iter().zip(&self.white).enumerate() {
            let range = rows_of(block, count, cut);
            let more = matrix(&columns, &range);
            let across = rows.tr_mul(&more);
            let first = old.gram.nrows();
            let all = first + columns.len();
            let mut gram = DMatrix::zeros(all, all);
            gram.view_mut((0, 0), (first, first)).copy_from(&old.gram);
            gram.view_mut((0, first), (first, columns.len()))
                .copy_from(&across);
            gram.view_mut((first, 0), (columns.len(), first))
                .copy_from(&across.transpose());
            gram.view_mut((first, first), (columns.len(), columns.len()))
                .copy_from(&more.tr_mul(&more));
            let mut moments = old.moments.clone().resize_vertically(all, 0.0);
            let beyond = DVector::from_fn(first, |k, _| moved.get(k).copied().unwrap_or(0.0));
            let own = more.tr_mul(record) + across.tr_mul(&beyond);
            moments.rows_mut(first, columns.len()).copy_from(&own);
            sums.push(Sums {
                gram,
                moments,
                energy: old.energy,
            });
            let mut wide = rows.clone().resize_horizontally(all, 0.0);
            wide.columns_mut(first, columns.len()).copy_from(&more);
            white.push((wide, record.clone()));
        }
        Self {
            total: total(&sums),
            sums,
            white,
            whitener: self.whitener.clone(),
        }
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.total.gram.nrows()
    }

    /// What blocks say of `own` beside `base`.
    pub fn statistic(&self, base: &[usize], own: &[usize]) -> Statistic {
        let all: Vec<usize> = base.iter().chain(own).copied().collect();
        let whole = Part::of(&self.total, &all);
        let (covariance, estimate) = whole.solve();
        let first = base.len();
        let of_own = covariance
            .view((first, first), (own.len(), own.len()))
            .into_owned();
        let values = estimate.rows(first, own.len()).into_owned();
        let squared_size = values.dot(&(invert(&of_own).0 * &values));
        let variances = self.between_blocks(&whole, &all);
        let ratios = (0..own.len()).map(|k| {
            let ratio = variances[first + k] / of_own[(k, k)];
            if ratio.is_finite() && ratio > 0.0 {
                ratio.ln()
            } else {
                0.0
            }
        });
        let mean = ratios.sum::<f64>() / own.len() as f64;
        Statistic {
            squared_size,
            design_effect: mean.exp().max(1.0),
            count: own.len(),
        }
    }

    /// Jackknife variance of each parameter.
    fn between_blocks(&self, whole: &Part, all: &[usize]) -> Vec<f64> {
        let estimates: Vec<DVector<f64>> = self
            .sums
            .iter()
            .map(|block| whole.without(&Part::of(block, all)).solve().1)
            .collect();
        let count = estimates.len() as f64;
        (0..all.len())
            .map(|k| {
                let mean = estimates.iter().map(|one| one[k]).sum::<f64>() / count;
                let squares = estimates.iter().map(|one| (one[k] - mean).powi(2));
                squares.sum::<f64>() * (count - 1.0) / count
            })
            .collect()
    }

    /// Share of what blocks leave that `own` takes away, predicted by the other blocks.
    pub fn share(&self, base: &[usize], own: &[usize]) -> f64 {
        let all: Vec<usize> = base.iter().chain(own).copied().collect();
        let left = |set: &[usize]| -> f64 {
            let whole = Part::of(&self.total, set);
            self.sums
                .iter()
                .map(|block| {
                    let own = Part::of(block, set);
                    let estimate = whole.without(&own).solve().1;
                    block.energy - 2.0 * estimate.dot(&own.moments)
                        + estimate.dot(&(&own.gram * &estimate))
                })
                .sum()
        };
        let without = left(base);
        (without - left(&all)) / without
    }

    /// Estimates of a set.
    pub fn estimates(&self, set: &[usize]) -> Estimates {
        let whole = Part::of(&self.total, set);
        let (covariance, estimate) = whole.solve();
        let variances = self.between_blocks(&whole, set);
        let grown: Vec<f64> = (0..set.len())
            .map(|k| (variances[k] / covariance[(k, k)]).max(1.0).sqrt())
            .collect();
        Estimates {
            covariance: DMatrix::from_fn(set.len(), set.len(), |a, b| {
                covariance[(a, b)] * grown[a] * grown[b]
            }),
            values: estimate.iter().copied().collect(),
        }
    }
}

/// The sums of some parameters.
struct Part {
    gram: DMatrix<f64>,
    moments: DVector<f64>,
}

impl Part {
    fn of(sums: &Sums, set: &[usize]) -> Self {
        Self {
            gram: DMatrix::from_fn(set.len(), set.len(), |a, b| sums.gram[(set[a], set[b])]),
            moments: DVector::from_fn(set.len(), |a, _| sums.moments[set[a]]),
        }
    }

    fn without(&self, other: &Self) -> Self {
        Self {
            gram: &self.gram - &other.gram,
            moments: &self.moments - &other.moments,
        }
    }

    fn solve(&self) -> (DMatrix<f64>, DVector<f64>) {
        let covariance = invert(&self.gram).0;
        let estimate = &covariance * &self.moments;
        (covariance, estimate)
    }
}

fn total(sums: &[Sums]) -> Sums {
    sums[1..].iter().fold(sums[0].clone(), |total, block| Sums {
        gram: total.gram + &block.gram,
        moments: total.moments + &block.moments,
        energy: total.energy + block.energy,
    })
}

/// Whitened rows of one of `count` blocks.
fn rows_of(block: usize, count: usize, cut: usize) -> std::ops::Range<usize> {
    block * cut / count..(block + 1) * cut / count
}

/// Rows of all axes within a range.
fn within(values: &Triad, range: &std::ops::Range<usize>) -> Vec<f64> {
    let axes = values.iter();
    axes.flat_map(|values| values[range.clone()].iter().copied())
        .collect()
}

fn matrix(columns: &[Triad], range: &std::ops::Range<usize>) -> DMatrix<f64> {
    let values = columns.iter().flat_map(|column| within(column, range));
    DMatrix::from_iterator(3 * range.len(), columns.len(), values)
}

/// Divides by the noise, keeps the frequencies that are looked at, and projects free rows out.
#[derive(Clone)]
struct Whitener<'a> {
    band: &'a Band,
    inverse: Dct,
    alike: Alike,
    /// By group of records that have one noise.
    groups: Vec<OfGroup>,
}

/// What divides records of one noise.
#[derive(Clone)]
struct OfGroup {
    weights: Vec<f64>,
    /// Whitened free rows, one axis.
    free: Vec<Vec<f64>>,
    of_free: DMatrix<f64>,
}

impl<'a> Whitener<'a> {
    fn new(band: &'a Band, terms: &NoiseTerms, levels: &Levels, free: &[usize]) -> Self {
        let inverse = Dct::new(band.cut);
        let of_group = |axes: &&[usize]| {
            let powers = terms.of_coefficients(levels.of(axes[0]));
            let powers = powers[..band.cut].iter();
            let weights: Vec<f64> = powers.map(|power| 1.0 / power.sqrt()).collect();
            let rows: Vec<Vec<f64>> = free
                .iter()
                .map(|&row| weighted(&inverse, &weights, band.of_row(row)))
                .collect();
            let gram = DMatrix::from_fn(rows.len(), rows.len(), |a, b| dot(&rows[a], &rows[b]));
            OfGroup {
                weights,
                of_free: invert(&gram).0,
                free: rows,
            }
        };
        Self {
            groups: terms.alike.iter().map(of_group).collect(),
            alike: terms.alike,
            inverse,
            band,
        }
    }

    fn whiten(&self, values: &Triad) -> Triad {
        let mut all = Triad::default();
        for (axes, group) in self.alike.iter().zip(&self.groups) {
            for &axis in *axes {
                let spectrum = self.band.spectrum(&values[axis]);
                let mut white = weighted(&self.inverse, &group.weights, spectrum);
                let along = group.free.iter().map(|free| dot(free, &white));
                let along = DVector::from_iterator(group.free.len(), along);
                let sizes = &group.of_free * along;
                for (free, size) in group.free.iter().zip(sizes.iter()) {
                    rlg_signal::axes::add(&mut white, free, -size);
                }
                all[axis] = white;
            }
        }
        all
    }
}

fn weighted(inverse: &Dct, weights: &[f64], mut spectrum: Vec<f64>) -> Vec<f64> {
    for (value, weight) in spectrum.iter_mut().zip(weights) {
        *value *= weight;
    }
    inverse.inverse(&mut spectrum);
    spectrum
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
