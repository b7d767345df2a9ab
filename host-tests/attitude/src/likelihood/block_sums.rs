//! Statistics of parameter groups from the normal equations of a record's blocks.

use nalgebra::{DMatrix, DVector};
use rlg_inference::linear::invert;
use rlg_plan::AttitudeBlockPlan;

/// Normal equations of one block: Gram matrix, moment vector and energy of the rows.
#[derive(Clone)]
pub(crate) struct Sums {
    pub(crate) gram: DMatrix<f64>,
    pub(crate) moments: DVector<f64>,
    pub(crate) energy: f64,
}

/// Normal equations of all blocks over all parameters.
#[derive(Clone)]
pub struct BlockSums {
    pub(crate) each: Vec<Sums>,
    total: Sums,
    /// Prior degrees of freedom of a design effect.
    believed_degrees: f64,
}

/// Wald statistic of a parameter group given others, with its design effect.
#[derive(Debug, Clone, Copy)]
pub struct Statistic {
    /// Wald statistic under the likelihood's covariance.
    pub squared_size: f64,
    /// Design effect: jackknife variance between blocks over the likelihood's variance, at least 1.
    pub design_effect: f64,
    /// Degrees of freedom of the design effect: low if few blocks carry the information, infinite if it is known.
    pub degrees: f64,
    /// Number of parameters of the group.
    pub count: usize,
}

impl Statistic {
    /// Gain in log evidence under a g-prior of the best width, less the price (multiplicity penalty) of a search through
    /// `groups`.
    ///
    /// # Inputs
    /// `is_deflated`: divide the statistic by the design effect.
    pub fn gain(&self, groups: usize, is_deflated: bool, plan: &AttitudeBlockPlan) -> f64 {
        self.gained(is_deflated) + log_chance(groups, plan)
    }

    /// Gain with the design effect taken as known, to compare groups on the same rows, which share the scatter of the
    /// blocks.
    pub fn compared(&self, groups: usize, plan: &AttitudeBlockPlan) -> f64 {
        Self {
            degrees: f64::INFINITY,
            ..*self
        }
        .gain(groups, true, plan)
    }

    /// Comparable gain with at most the winner's design effect: two groups are compared on these rows only.
    pub fn compared_with(&self, winner: &Self, groups: usize, plan: &AttitudeBlockPlan) -> f64 {
        Self {
            design_effect: self.design_effect.min(winner.design_effect),
            ..*self
        }
        .compared(groups, plan)
    }

    /// Gain without the price of the search.
    pub fn gained(&self, is_deflated: bool) -> f64 {
        let deflated = if is_deflated { self.design_effect } else { 1.0 };
        let squared = self.squared_size / deflated;
        let count = self.count as f64;
        if squared <= count {
            return 0.0;
        }
        // Student's t of the parameters, under the g-prior of the best width.
        let gained = match is_deflated && self.degrees.is_finite() {
            true => {
                let all = self.degrees + count;
                all * ((squared - count) / all).ln_1p()
            }
            false => squared - count,
        };
        0.5 * (gained - count * (squared / count).ln())
    }
}

/// Log prior probability of one of `groups`.
pub fn log_chance(groups: usize, plan: &AttitudeBlockPlan) -> f64 {
    (plan.any_chance / groups as f64).ln()
}

/// Gain of a parameter group in leave-one-block-out cross-validation.
#[derive(Debug, Clone, Copy)]
pub struct Predicted {
    /// Gain in log likelihood.
    pub log_likelihood: f64,
    /// Share of the residual power that is predicted \[1\].
    pub share: f64,
}

/// Estimates of some parameters with their covariance.
#[derive(Clone)]
pub struct Estimates {
    /// Values.
    pub values: Vec<f64>,
    /// Covariance: by parameter the larger of the likelihood's and the jackknife variance; correlations of the likelihood.
    pub covariance: DMatrix<f64>,
}

impl BlockSums {
    /// Adds up one block or more.
    pub(crate) fn new(each: Vec<Sums>, plan: &AttitudeBlockPlan) -> Self {
        Self {
            total: total(&each),
            each,
            believed_degrees: plan.believed_degrees,
        }
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.total.gram.nrows()
    }

    /// Adds the effect of parameter values to the data.
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

    /// Computes the Wald statistic of `own` given `base`, with its design effect.
    pub fn statistic(&self, base: &[usize], own: &[usize]) -> Statistic {
        self.statistic_beyond(base, own, |_| true)
    }

    /// Wald statistic whose jackknife is computed only if the statistic of all blocks together passes `is_worth`.
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
            degrees: f64::INFINITY,
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
            degrees: self.degrees(&covariance, &all, first),
            ..together
        }
    }

    /// Degrees of freedom of a design effect: those of its prior, and the effective number of blocks less one, (Σ I)² / Σ I²
    /// − 1, by their information I on the parameters after the `first` (Kish, Survey Sampling, 1965).
    fn degrees(&self, covariance: &DMatrix<f64>, all: &[usize], first: usize) -> f64 {
        let own = covariance.rows(first, all.len() - first);
        let of_own = covariance.view((first, first), (own.nrows(), own.nrows()));
        let information = invert(&of_own.into_owned()).0;
        let shares = self.each.iter().map(|block| {
            let gram = Part::of(block, all).gram;
            (&information * own * gram * own.transpose()).trace()
        });
        let [sum, squares] = shares.fold([0.0, 0.0], |[sum, squares], share| {
            [sum + share, squares + share * share]
        });
        self.believed_degrees + (sum * sum / squares - 1.0).max(0.0)
    }

    /// Degrees of freedom of the design effect of `own` given `base`.
    pub fn degrees_of(&self, base: &[usize], own: &[usize]) -> f64 {
        let all: Vec<usize> = base.iter().chain(own).copied().collect();
        let (covariance, _) = Part::of(&self.total, &all).solve();
        self.degrees(&covariance, &all, base.len())
    }

    /// Information on each of `own` alone, given `base`.
    pub fn information(&self, base: &[usize], own: &[usize]) -> Vec<f64> {
        let of = |k: &usize| {
            let all: Vec<usize> = base.iter().chain([k]).copied().collect();
            let (covariance, _) = Part::of(&self.total, &all).solve();
            1.0 / covariance[(base.len(), base.len())]
        };
        own.iter().map(of).collect()
    }

    /// Joint information matrix of `own`, given `base`.
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

    /// Residual energy of each block after the fit of a set.
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

    /// Leave-one-block-out cross-validation of `own` given `base`: gain in log likelihood, and share of the residual power.
    pub fn predicted(&self, base: &[usize], own: &[usize]) -> Predicted {
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
        let gained = without - left(&all);
        Predicted {
            log_likelihood: 0.5 * gained,
            share: gained / without,
        }
    }

    /// Estimate and covariance of a set of parameters under the likelihood.
    pub(crate) fn fit(&self, set: &[usize]) -> (DVector<f64>, DMatrix<f64>) {
        let (covariance, estimate) = Part::of(&self.total, set).solve();
        (estimate, covariance)
    }

    /// Estimates a set of parameters.
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

/// Normal equations of a subset of parameters.
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

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::{BlockSums, Statistic, Sums};

    /// Blocks of one parameter, by the information of each.
    fn blocks(information: &[f64]) -> BlockSums {
        let of = |information: &f64| Sums {
            gram: DMatrix::from_element(1, 1, *information),
            moments: DVector::from_element(1, *information),
            energy: 2.0 * information,
        };
        BlockSums::new(information.iter().map(of).collect(), &Default::default())
    }

    #[test]
    fn degrees_count_the_blocks_that_carry_the_information() {
        let all_alike = blocks(&[4.0; 20]).degrees_of(&[], &[0]);
        let mut loud = [1e-6; 20];
        loud[3] = 4.0;
        let one = blocks(&loud).degrees_of(&[], &[0]);
        assert!((all_alike - one - 19.0).abs() < 1e-3, "{all_alike} {one}");
    }

    #[test]
    fn few_degrees_gain_less_and_many_as_much_as_known_noise() {
        let gained = |squared_size: f64, degrees: f64| {
            let statistic = Statistic {
                squared_size,
                design_effect: 1.0,
                degrees,
                count: 3,
            };
            statistic.gained(true)
        };
        assert_eq!(gained(3.0, 10.0), 0.0);
        assert!(gained(60.0, 10.0) < 0.5 * gained(60.0, f64::INFINITY));
        let nearly = gained(60.0, 1e7) / gained(60.0, f64::INFINITY);
        assert!((nearly - 1.0).abs() < 1e-4, "{nearly}");
    }

    #[test]
    fn blocks_predict_each_other_where_they_agree() {
        let predicted = blocks(&[4.0; 20]).predicted(&[], &[0]);
        // The estimate of each block is 1, which explains half of an energy of 2.
        assert!((predicted.share - 0.5).abs() < 1e-12, "{predicted:?}");
        assert!(
            (predicted.log_likelihood - 40.0).abs() < 1e-9,
            "{predicted:?}"
        );
    }
}
