//! Cross-validation of an effect over a record: least squares on whitened rows with one contiguous block left out in turn.
//!
//! On Gaussian stationary noise the result equals that of the likelihood. On real noise a likelihood ratio is unreliable
//! where few rows carry it; these appear as blocks that disagree by more than the noise.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::linear::pseudo_inverse;

/// Sums of whitened rows over blocks, all records together.
pub struct BlockSums {
    blocks: Vec<Sums>,
    parameters: usize,
}

struct Sums {
    gram: DMatrix<f64>,
    moments: DVector<f64>,
}

/// Cross-validation of some parameters given the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockValidation {
    /// Gain by the parameters in the log score of each block predicted from the others; summed.
    pub gain: f64,
    /// Jackknife variance of the parameters over that of their likelihood (design effect): 1 where the likelihood is
    /// correct.
    pub design_effect: f64,
    /// Degrees of freedom of the jackknife variance: few where few blocks observe the parameters.
    pub freedom: f64,
}

impl BlockValidation {
    /// Design effect, or 1 if it exceeds 1 by chance at a significance level \[1\]: freedom times it follows a χ² law.
    pub fn significant_design_effect(&self, level: f64) -> f64 {
        let law = ChiSquared::new(self.freedom).ok();
        let is_chance = law.is_none_or(|law| law.sf(self.design_effect * self.freedom) > level);
        if is_chance { 1.0 } else { self.design_effect }
    }
}

impl BlockSums {
    /// Sums over `blocks` of rows.
    ///
    /// # Inputs
    /// `records`: whitened; `columns`: of each record and parameter, whitened alike; empty where a parameter has no effect.
    pub fn new(records: &[Vec<f64>], columns: &[Vec<Vec<f64>>], blocks: &[Range<usize>]) -> Self {
        let parameters = columns.first().map_or(0, Vec::len);
        let of_block = |rows: &Range<usize>| {
            let dot = |a: &[f64], b: &[f64]| -> f64 {
                if a.is_empty() || b.is_empty() {
                    return 0.0;
                }
                let pairs = a[rows.clone()].iter().zip(&b[rows.clone()]);
                pairs.map(|(a, b)| a * b).sum()
            };
            let mut gram = DMatrix::zeros(parameters, parameters);
            let mut moments = DVector::zeros(parameters);
            for (record, columns) in records.iter().zip(columns) {
                for a in 0..parameters {
                    moments[a] += dot(&columns[a], record);
                    for b in 0..=a {
                        let product = dot(&columns[a], &columns[b]);
                        gram[(a, b)] += product;
                        if a != b {
                            gram[(b, a)] += product;
                        }
                    }
                }
            }
            Sums { gram, moments }
        };
        Self {
            blocks: blocks.iter().map(of_block).collect(),
            parameters,
        }
    }

    /// Joins blocks of several records under the same parameters.
    pub fn join(parts: impl IntoIterator<Item = Self>) -> Self {
        let parts: Vec<Self> = parts.into_iter().collect();
        Self {
            parameters: parts.first().map_or(0, |part| part.parameters),
            blocks: parts.into_iter().flat_map(|part| part.blocks).collect(),
        }
    }

    /// Cross-validates the parameters in `own`, all others fitted as nuisance parameters.
    ///
    /// # Inputs
    /// `fixed`: parameters held at 1; those in `own` are 0 in the model without them.
    pub fn validate(&self, own: &[usize], fixed: &[usize]) -> BlockValidation {
        let free = |with: bool| -> Vec<usize> {
            (0..self.parameters)
                .filter(|k| !fixed.contains(k) && (with || !own.contains(k)))
                .collect()
        };
        let held = |with: bool| -> Vec<usize> {
            let is_there = |k: &usize| with || !own.contains(k);
            fixed.iter().copied().filter(is_there).collect()
        };
        let with = self.left_out(&free(true), &held(true));
        let without = self.left_out(&free(false), &held(false));
        let own_free: Vec<usize> = free(true)
            .iter()
            .enumerate()
            .filter(|(_, k)| own.contains(k))
            .map(|(place, _)| place)
            .collect();
        BlockValidation {
            gain: with.score - without.score,
            design_effect: with.design_effect(&own_free),
            freedom: self.freedom(own),
        }
    }

    /// Σ over the parameters of the effective number of blocks that observe one, by their information, less 1.
    fn freedom(&self, own: &[usize]) -> f64 {
        let of_parameter = |k: usize| {
            let informations = self.blocks.iter().map(|sums| sums.gram[(k, k)]);
            let (sum, square) = informations.fold((0.0, 0.0), |(sum, square), one| {
                (sum + one, square + one * one)
            });
            if square > 0.0 {
                sum * sum / square - 1.0
            } else {
                0.0
            }
        };
        own.iter().copied().map(of_parameter).sum()
    }

    /// Fits `free` parameters with each block left out, those in `held` at 1.
    fn left_out(&self, free: &[usize], held: &[usize]) -> LeftOut {
        let of = |sums: &Sums| -> (DMatrix<f64>, DVector<f64>) {
            let gram =
                DMatrix::from_fn(free.len(), free.len(), |a, b| sums.gram[(free[a], free[b])]);
            let moments = DVector::from_fn(free.len(), |a, _| {
                let by_held: f64 = held.iter().map(|&k| sums.gram[(free[a], k)]).sum();
                sums.moments[free[a]] - by_held
            });
            (gram, moments)
        };
        // −½ Σ (y − Σ held)², up to the y² common to every set.
        let of_held = |sums: &Sums| -> f64 {
            let products: f64 = held
                .iter()
                .map(|&a| held.iter().map(|&b| sums.gram[(a, b)]).sum::<f64>())
                .sum();
            let moments: f64 = held.iter().map(|&k| sums.moments[k]).sum();
            moments - 0.5 * products
        };
        let each: Vec<_> = self.blocks.iter().map(of).collect();
        let zero = (
            DMatrix::zeros(free.len(), free.len()),
            DVector::zeros(free.len()),
        );
        let (gram, moments) = each
            .iter()
            .fold(zero, |(gram, moments), (a, c)| (gram + a, moments + c));
        let whole = pseudo_inverse(&gram) * &moments;
        // A parameter observed in one block alone is undetermined without it: a prior of the size estimated from all keeps
        // it finite.
        let squared = whole.dot(&moments) / (free.len().max(1) as f64);
        let prior = &gram / squared.max(1.0);
        // The prior shrinks every estimate towards 0: blocks are compared with the estimate of all rows under the same
        // prior.
        let under_prior = pseudo_inverse(&(&gram + &prior));
        let whole = &under_prior * &moments;
        let variance = &under_prior * &gram * &under_prior;
        let mut score: f64 = self.blocks.iter().map(of_held).sum();
        let mut spread = DMatrix::zeros(free.len(), free.len());
        for (a, c) in &each {
            let estimate = pseudo_inverse(&(&gram - a + &prior)) * (&moments - c);
            score += estimate.dot(c) - 0.5 * estimate.dot(&(a * &estimate));
            let away = &estimate - &whole;
            spread += &away * away.transpose();
        }
        let count = each.len() as f64;
        LeftOut {
            score,
            jackknife: spread * ((count - 1.0) / count),
            variance,
        }
    }
}

/// Fits with each block left out (delete-one jackknife).
struct LeftOut {
    score: f64,
    jackknife: DMatrix<f64>,
    variance: DMatrix<f64>,
}

impl LeftOut {
    /// Geometric mean over some parameters of the jackknife variance over the likelihood's.
    fn design_effect(&self, own: &[usize]) -> f64 {
        let ratios = own
            .iter()
            .map(|&k| self.jackknife[(k, k)] / self.variance[(k, k)])
            .filter(|ratio| ratio.is_finite() && *ratio > 0.0);
        let (sum, count) = ratios.fold((0.0, 0.0), |(sum, count), ratio| {
            (sum + ratio.ln(), count + 1.0)
        });
        if count > 0.0 {
            f64::exp(sum / count)
        } else {
            1.0
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::BlockSums;

    const ROWS: usize = 4000;

    fn normals(seed: u64) -> Vec<f64> {
        let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        StandardNormal.sample_iter(rng).take(ROWS).collect()
    }

    /// Sums of one record on one column and on one without effect, with a held column of size 2.
    fn sums(size: impl Fn(usize) -> f64) -> BlockSums {
        let (column, other, noise) = (normals(1), normals(2), normals(3));
        let record = (0..ROWS)
            .map(|row| size(row) * column[row] + 2.0 * other[row] + noise[row])
            .collect();
        let held = other.iter().map(|value| 2.0 * value).collect();
        let blocks: Vec<_> = (0..20)
            .map(|block| 200 * block..200 * (block + 1))
            .collect();
        BlockSums::new(&[record], &[vec![column, held]], &blocks)
    }

    #[test]
    fn an_effect_of_all_rows_gains_what_its_likelihood_does_and_blocks_agree() {
        let found = sums(|_| 0.2).validate(&[0], &[1]);
        // ½ ρ² for ρ² = 0.04 · 4000, within three deviations of a squared size.
        assert!((found.gain - 80.0).abs() < 40.0, "{found:?}");
        assert!(found.design_effect < 2.0, "{found:?}");
        let nothing = sums(|_| 0.0).validate(&[0], &[1]);
        assert!(nothing.gain < 3.0, "{nothing:?}");
    }

    #[test]
    fn an_effect_of_few_rows_makes_blocks_disagree() {
        let found = sums(|row| if row < 200 { 2.0 } else { 0.0 }).validate(&[0], &[1]);
        assert!(found.design_effect > 10.0, "{found:?}");
    }

    /// Without a common prior, the shrinkage of each estimate would appear as a disagreement of the blocks.
    #[test]
    fn weak_effects_of_noise_make_blocks_disagree_no_more_than_strong_ones() {
        let mean_of = |size: f64| {
            let seeds = 10..40;
            let count = seeds.clone().count() as f64;
            let effects = seeds.map(|seed| {
                let column = normals(seed);
                let noise = normals(seed + 100);
                let pairs = column.iter().zip(noise);
                let record = pairs.map(|(column, noise)| size * column + noise).collect();
                let blocks: Vec<_> = (0..20)
                    .map(|block| 200 * block..200 * (block + 1))
                    .collect();
                let sums = BlockSums::new(&[record], &[vec![column]], &blocks);
                sums.validate(&[0], &[]).design_effect
            });
            effects.sum::<f64>() / count
        };
        // A variance of 19 degrees of freedom, averaged over thirty.
        let within = 4.0 * (2.0_f64 / 19.0 / 30.0).sqrt();
        // 2, 4 and 30 standard deviations.
        for size in [0.03, 0.06, 0.5] {
            let mean = mean_of(size);
            assert!((mean - 1.0).abs() < within, "{size}: {mean}");
        }
    }

    #[test]
    fn what_is_held_counts_with_its_owner() {
        let found = sums(|_| 0.2).validate(&[1], &[1]);
        assert!(found.gain > 1000.0, "{found:?}");
    }
}
