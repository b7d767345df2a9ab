//! What blocks of a record say of groups of numbers, by their sums alone.

use nalgebra::{DMatrix, DVector};
use rlg_inference::linear::invert;

/// Sums of one block.
#[derive(Clone)]
pub(crate) struct Sums {
    pub(crate) gram: DMatrix<f64>,
    pub(crate) moments: DVector<f64>,
    pub(crate) energy: f64,
}

/// Sums of all blocks over all parameters.
#[derive(Clone)]
pub struct BlockSums {
    pub(crate) each: Vec<Sums>,
    total: Sums,
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

impl BlockSums {
    /// Of one or more.
    pub(crate) fn new(each: Vec<Sums>) -> Self {
        Self {
            total: total(&each),
            each,
        }
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.total.gram.nrows()
    }

    /// Adds the effect of some numbers.
    pub(crate) fn add(&mut self, own: &[usize], values: &DVector<f64>) {
        for block in self.each.iter_mut().chain([&mut self.total]) {
            let columns = block.gram.select_columns(own);
            let with = &columns * values;
            let moments = DVector::from_fn(own.len(), |k, _| block.moments[own[k]]);
            let own_with = DVector::from_fn(own.len(), |k, _| with[own[k]]);
            block.energy += 2.0 * values.dot(&moments) + values.dot(&own_with);
            block.moments += with;
        }
    }

    /// What blocks say of `own` beside `base`.
    pub fn statistic(&self, base: &[usize], own: &[usize]) -> Statistic {
        self.statistic_beyond(base, own, |_| true)
    }

    /// The same; blocks are asked only where all of them together make it `worth` that.
    pub fn statistic_beyond(
        &self,
        base: &[usize],
        own: &[usize],
        is_worth: impl Fn(&Statistic) -> bool,
    ) -> Statistic {
        let all: Vec<usize> = base.iter().chain(own).copied().collect();
        let whole = Part::of(&self.total, &all);
        let (covariance, estimate) = whole.solve();
        let first = base.len();
        let of_own = covariance
            .view((first, first), (own.len(), own.len()))
            .into_owned();
        let values = estimate.rows(first, own.len()).into_owned();
        let together = Statistic {
            squared_size: values.dot(&(invert(&of_own).0 * &values)),
            design_effect: 1.0,
            count: own.len(),
        };
        if !is_worth(&together) {
            return together;
        }
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
            design_effect: mean.exp().max(1.0),
            ..together
        }
    }

    /// Information of each of `own` alone beside `base`.
    pub fn information(&self, base: &[usize], own: &[usize]) -> Vec<f64> {
        let of = |k: &usize| {
            let all: Vec<usize> = base.iter().chain([k]).copied().collect();
            let (covariance, _) = Part::of(&self.total, &all).solve();
            1.0 / covariance[(base.len(), base.len())]
        };
        own.iter().map(of).collect()
    }

    /// Information of `own` together beside `base`.
    pub fn information_of(&self, base: &[usize], own: &[usize]) -> DMatrix<f64> {
        let all: Vec<usize> = base.iter().chain(own).copied().collect();
        let (covariance, _) = Part::of(&self.total, &all).solve();
        let first = base.len();
        invert(
            &covariance
                .view((first, first), (own.len(), own.len()))
                .into_owned(),
        )
        .0
    }

    /// Power that a set leaves of each block.
    pub fn left(&self, set: &[usize]) -> Vec<f64> {
        let (_, estimate) = Part::of(&self.total, set).solve();
        let of = |block: &Sums| {
            let own = Part::of(block, set);
            block.energy - 2.0 * estimate.dot(&own.moments) + estimate.dot(&(&own.gram * &estimate))
        };
        self.each.iter().map(of).collect()
    }

    /// Jackknife variance of each parameter.
    fn between_blocks(&self, whole: &Part, all: &[usize]) -> Vec<f64> {
        let estimates: Vec<DVector<f64>> = self
            .each
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
            self.each
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
