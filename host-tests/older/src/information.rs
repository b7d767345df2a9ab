//! What the data say about the parameters: Fisher information and its companions.
//!
//! Enters: for each axis the whitened inner products of residual, joints and columns. Leaves:
//! [`Information`] over all parameters of all hypotheses, with the joints fitted away, on which selection,
//! fitting and identifiability are small dense linear algebra.
//!
//! A nonlinear effect f(p) is linearised at p0 as J p + (f(p0) − J p0). The last part, its offset, stands behind the
//! parameters with a coefficient that is fixed at 1 in every set that has the effect.
//!
//! With F the information and g the projection of the residual, a set A of parameters gains
//! ln L = ½ gᵀ F⁻¹ g over "nothing" (generalised least squares; diagnosis road, steps 5 and 6).

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

use super::portion::Bins;
use super::regressor::{Regressor, gram};
pub use rlg_diagnosis::least_squares::{fit_away, scaled_inverse, stable_inverse};

/// Information about all parameters.
#[derive(Clone)]
pub struct Information {
    /// Fisher information, parameters × parameters.
    pub fisher: DMatrix<f64>,
    /// Σ column · residual / S.
    pub right: DVector<f64>,
    /// Σ residual² / S.
    pub power: f64,
    /// Number of parameters; the offsets stand behind them.
    pub parameters: usize,
    /// The parameters each offset belongs to.
    pub offsets: Vec<Range<usize>>,
    /// How many of the parameters, at their end, are of the mounting: nothing is known of them before.
    pub of_mounting: usize,
    /// Drifting noise, one entry an axis that has any.
    pub drifts: Vec<Drift>,
}

/// How well the level of drifting noise is known on one axis, and what of the parameters lies in it.
#[derive(Clone)]
pub struct Drift {
    /// Whittle information on ln of its level: half the degrees of freedom in which it makes up S.
    pub knowledge: f64,
    /// (parameter, its part of the Fisher information there).
    pub powers: Vec<(usize, f64)>,
}

impl Information {
    /// Nothing known about `parameters` parameters.
    pub fn empty(parameters: usize) -> Self {
        Self::with_offsets(parameters, Vec::new())
    }

    /// The same with room for offsets of nonlinear effects.
    pub fn with_offsets(parameters: usize, offsets: Vec<Range<usize>>) -> Self {
        let size = parameters + offsets.len();
        Self {
            fisher: DMatrix::zeros(size, size),
            right: DVector::zeros(size),
            power: 0.0,
            parameters,
            offsets,
            of_mounting: 0,
            drifts: Vec::new(),
        }
    }

    /// The sum of what `add` says of each axis, beginning with `nothing`.
    pub fn of_axes(nothing: Self, add: impl Fn(usize, &mut Self) + Sync) -> Self {
        let parts: Vec<Self> = (0..3_usize)
            .into_par_iter()
            .map(|axis| {
                let mut part = nothing.clone();
                add(axis, &mut part);
                part
            })
            .collect();
        let mut total = nothing;
        for part in parts {
            total.fisher += part.fisher;
            total.right += part.right;
            total.power += part.power;
            total.drifts.extend(part.drifts);
        }
        total
    }

    /// Degrees of freedom from which the noise under a pattern of parameters is known: a likelihood ratio then has
    /// Fisher's law, and χ² only where there are very many. Two over the variance of ln S, averaged over the pattern.
    pub fn noise_degrees(&self, pattern: &[(usize, f64)]) -> f64 {
        if self.drifts.is_empty() {
            return f64::INFINITY;
        }
        let shares = self.shares_in_drift(pattern);
        let variance: f64 = shares
            .map(|(knowledge, share)| share * share / knowledge)
            .sum();
        2.0 / variance
    }

    /// The part of a pattern's power that lies in drifting noise, over all axes.
    pub fn share_in_drift(&self, pattern: &[(usize, f64)]) -> f64 {
        let shares = self.shares_in_drift(pattern);
        shares.map(|(_, share)| share).sum()
    }

    /// Axis by axis: how well the drift is known, and the part of the pattern's whole power that lies in it.
    fn shares_in_drift(&self, pattern: &[(usize, f64)]) -> impl Iterator<Item = (f64, f64)> {
        let whole: f64 = pattern
            .iter()
            .map(|(index, value)| value * value * self.fisher[(*index, *index)])
            .sum();
        self.drifts.iter().map(move |drift| {
            let powers = drift.powers.iter().filter_map(|(index, power)| {
                let (_, value) = pattern.iter().find(|(known, _)| known == index)?;
                Some(value * value * power)
            });
            (drift.knowledge, powers.sum::<f64>() / whole)
        })
    }

    /// What the offsets of the effects in `set` explain by themselves, and what they leave of `right`.
    fn offset(&self, set: &[usize]) -> (f64, DVector<f64>) {
        let active: Vec<usize> = (0..self.offsets.len())
            .filter(|&k| set.contains(&self.offsets[k].start))
            .map(|k| self.parameters + k)
            .collect();
        let explained = active.iter().map(|&a| {
            let shared: f64 = active.iter().map(|&b| self.fisher[(a, b)]).sum();
            self.right[a] - 0.5 * shared
        });
        let right = DVector::from_fn(set.len(), |row, _| {
            let taken: f64 = active.iter().map(|&a| self.fisher[(set[row], a)]).sum();
            self.right[set[row]] - taken
        });
        (explained.sum(), right)
    }

    /// Adds what one axis says. `columns` are (parameter index, column); joints are free, nuisances as wide as they are.
    pub fn add_axis(
        &mut self,
        joints: &[Regressor],
        nuisances: &[Nuisance],
        residual: &Bins,
        columns: &[(usize, &Regressor)],
        weights: &[f64],
    ) {
        let aside: Vec<&Regressor> = aside(joints, nuisances).collect();
        let columns_alone = columns.iter().map(|(_, column)| *column);
        let all: Vec<&Regressor> = aside.iter().copied().chain(columns_alone).collect();
        let gram = gram(&all, residual, weights);
        // What is left of everything once the jumps at the joints and the nuisances are fitted away.
        let (first, rest) = (aside.len(), columns.len() + 1);
        let inverse = inverse_aside(gram.view((0, 0), (first, first)).into_owned(), joints.len());
        let against_aside = gram.view((first, 0), (rest, first));
        let left = gram.view((first, first), (rest, rest))
            - against_aside * inverse * against_aside.transpose();
        self.power += left[(rest - 1, rest - 1)];
        for (a, (index_a, _)) in columns.iter().enumerate() {
            self.right[*index_a] += left[(rest - 1, a)];
            for (b, (index_b, _)) in columns.iter().enumerate().take(a + 1) {
                self.fisher[(*index_a, *index_b)] += left[(a, b)];
                if index_a != index_b {
                    self.fisher[(*index_b, *index_a)] += left[(a, b)];
                }
            }
        }
    }

    /// Fisher information about `asked` and what the data say of it, whatever `aside` is under priors of the given widths.
    pub fn whatever(
        &self,
        asked: &[usize],
        aside: &[usize],
        prior: &dyn Fn(usize) -> f64,
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let block = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |a, b| {
                self.fisher[(rows[a], columns[b])]
            })
        };
        let right =
            |indices: &[usize]| DVector::from_fn(indices.len(), |a, _| self.right[indices[a]]);
        let mut of_aside = block(aside, aside);
        for (place, &index) in aside.iter().enumerate() {
            of_aside[(place, place)] += prior(index).powi(-2);
        }
        let through = block(asked, aside) * of_aside.try_inverse()?;
        let fisher = block(asked, asked) - &through * block(aside, asked);
        Some((fisher, right(asked) - through * right(aside)))
    }

    /// Solves for a set of parameters under zero-mean priors of the given widths.
    pub fn solve(&self, set: &[usize], prior: &dyn Fn(usize) -> f64) -> Solution {
        let count = set.len();
        if count == 0 {
            return Solution {
                values: DVector::zeros(0),
                covariance: DMatrix::zeros(0, 0),
                log_likelihood_gain: 0.0,
                log_evidence: 0.0,
                degrees: 0.0,
            };
        }
        // In units of the prior width everything is of order one and the matrix well scaled.
        let widths: Vec<f64> = set.iter().map(|&index| prior(index)).collect();
        let scaled = DMatrix::from_fn(count, count, |a, b| {
            self.fisher[(set[a], set[b])] * widths[a] * widths[b] + if a == b { 1.0 } else { 0.0 }
        });
        let (explained, right) = self.offset(set);
        let right = DVector::from_fn(count, |a, _| right[a] * widths[a]);
        let root = scaled.symmetric_eigen();
        let eigenvalues = root.eigenvalues.map(|value| value.max(1.0));
        let rotated = root.eigenvectors.transpose() * right;
        let solution = DVector::from_fn(count, |k, _| rotated[k] / eigenvalues[k]);
        let covariance = {
            let half =
                &root.eigenvectors * DMatrix::from_diagonal(&eigenvalues.map(|v| v.sqrt().recip()));
            let scaled = &half * half.transpose();
            DMatrix::from_fn(count, count, |a, b| scaled[(a, b)] * widths[a] * widths[b])
        };
        let log_likelihood_gain = explained
            + 0.5
                * rotated
                    .iter()
                    .zip(solution.iter())
                    .map(|(g, x)| g * x)
                    .sum::<f64>();
        let volume: f64 = eigenvalues.iter().map(|value| value.ln()).sum();
        let values = &root.eigenvectors * solution;
        Solution {
            // What has no column here is nothing, not what rounding leaves of nothing.
            values: DVector::from_fn(count, |a, _| {
                let known = self.fisher[(set[a], set[a])] != 0.0;
                if known { values[a] * widths[a] } else { 0.0 }
            }),
            covariance,
            log_likelihood_gain,
            log_evidence: log_likelihood_gain - 0.5 * volume,
            degrees: eigenvalues.iter().map(|value| 1.0 - 1.0 / value).sum(),
        }
    }
}

/// A column that is no parameter, of a size that is known to be about one.
pub struct Nuisance(Regressor);

impl Nuisance {
    /// Takes over the column, in units of the width of its size's distribution.
    pub fn of_unit_width(column: Regressor) -> Self {
        Self(column)
    }
}

/// The columns that are fitted away on an axis: the joints, then the nuisances.
pub fn aside<'a>(
    joints: &'a [Regressor],
    nuisances: &'a [Nuisance],
) -> impl Iterator<Item = &'a Regressor> {
    joints
        .iter()
        .chain(nuisances.iter().map(|Nuisance(column)| column))
}

/// Inverse of the information about the columns aside, the first `joints` of which are free.
pub fn inverse_aside(mut fisher: DMatrix<f64>, joints: usize) -> DMatrix<f64> {
    for place in joints..fisher.nrows() {
        fisher[(place, place)] += 1.0;
    }
    scaled_inverse(&fisher)
}

/// A joint fit.
pub struct Solution {
    /// Parameters, in the order of the set.
    pub values: DVector<f64>,
    /// Their covariance; directions the data do not fix keep the width of the prior.
    pub covariance: DMatrix<f64>,
    /// ln L over "nothing".
    pub log_likelihood_gain: f64,
    /// ln of the evidence over "nothing" (Laplace, exact for linear effects).
    pub log_evidence: f64,
    /// Directions the data fix better than the prior.
    pub degrees: f64,
}
