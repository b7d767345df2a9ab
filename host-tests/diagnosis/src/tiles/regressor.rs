//! Column of a fit in bins, and the whitened inner products (Gram matrix) of many.
//!
//! Enters: a column's bins, f64. Leaves: [`Regressor`], the same in single precision in units of its largest value, and
//! [`gram`], sums in double precision over the bins that the columns reach.
//!
//! A catalogue's columns are most of a diagnosis's memory. Single precision moves each bin by 6e-8 of itself: the residual
//! that it leaves of an effect of matched-filter SNR 1e5 has an SNR of 0.006. The residual of the data stays f64.

use nalgebra::DMatrix;
use rayon::prelude::*;
use realfft::num_complex::{Complex32, Complex64};

use super::portion::{Bins, lanes};

/// Bins per step of the sums: with a hundred columns, a block stays in the second-level cache.
const BLOCK_BINS: usize = 512;

/// Bins per task; fixed, so that the order of sums does not depend on the number of threads.
const TASK_BINS: usize = 8 * BLOCK_BINS;

/// Share of a column's whitened power omitted beyond its reach: a tenth of the share that `stable_inverse` takes for zero.
const BEYOND_REACH: f64 = 1e-13;

/// Column in single precision, see the module's page.
pub struct Regressor {
    scale: f64,
    bins: Vec<Complex32>,
}

impl Regressor {
    /// Converts a column.
    pub fn new(bins: &[Complex64]) -> Self {
        let largest = bins.iter().fold(0.0, |most: f64, bin| {
            most.max(bin.re.abs()).max(bin.im.abs())
        });
        let scale = if largest > 0.0 { largest } else { 1.0 };
        let narrow =
            |bin: &Complex64| Complex32::new((bin.re / scale) as f32, (bin.im / scale) as f32);
        Self {
            scale,
            bins: bins.iter().map(narrow).collect(),
        }
    }

    /// One bin.
    pub fn at(&self, bin: usize) -> Complex64 {
        let Complex32 { re, im } = self.bins[bin];
        Complex64::new(f64::from(re), f64::from(im)) * self.scale
    }

    /// Adds `size` times the column.
    pub fn add_to(&self, bins: &mut [Complex64], size: f64) {
        let size = size * self.scale;
        for (sum, bin) in bins.iter_mut().zip(&self.bins) {
            sum.re += f64::from(bin.re) * size;
            sum.im += f64::from(bin.im) * size;
        }
    }

    /// Σ Re(conj(a)·b) · weight over the bins of `other`.
    pub fn inner(&self, other: &[Complex64], weights: &[f64]) -> f64 {
        let (own, weights) = (&self.bins[..other.len()], &weights[..other.len()]);
        let sum = lanes(other.len(), |bin| {
            let (a, b) = (own[bin], other[bin]);
            (f64::from(a.re) * b.re + f64::from(a.im) * b.im) * weights[bin]
        });
        self.scale * sum
    }

    /// Σ |a|² · weight.
    pub fn power(&self, weights: &[f64]) -> f64 {
        let bins = &self.bins[..weights.len()];
        let sum = lanes(bins.len(), |bin| {
            f64::from(bins[bin].norm_sqr()) * weights[bin]
        });
        self.scale * self.scale * sum
    }

    /// Number of low bins that hold all but [`BEYOND_REACH`] of its whitened power.
    fn reach(&self, weights: &[f64]) -> usize {
        let bins = &self.bins[..weights.len()];
        let power = |bin: usize| f64::from(bins[bin].norm_sqr()) * weights[bin];
        reach(bins.len(), power, BEYOND_REACH)
    }
}

/// Number of low bins that hold all but a share `beyond` of the power.
pub fn reach(bins: usize, power: impl Fn(usize) -> f64, beyond: f64) -> usize {
    let least = beyond * lanes(bins, &power);
    let mut left = 0.0;
    (0..bins)
        .rev()
        .find(|&bin| {
            left += power(bin);
            left > least
        })
        .map_or(0, |bin| bin + 1)
}

/// Whitened inner products of all regressors with each other and, in the last row and column, with `residual`.
pub fn gram(regressors: &[&Regressor], residual: &[Complex64], weights: &[f64]) -> DMatrix<f64> {
    let count = regressors.len();
    let tasks = tasks(regressors, weights);
    let parts: Vec<(Vec<usize>, DMatrix<f64>)> = tasks
        .par_iter()
        .map(|(bins, active)| {
            let mut sum = DMatrix::zeros(active.len() + 1, active.len() + 1);
            for block in blocks(bins) {
                let mut whitened = whiten(regressors, active, &block, weights);
                let root = |bin: usize| weights[bin].sqrt();
                let last = block.clone().flat_map(|bin| {
                    let value = residual[bin] * root(bin);
                    [value.re, value.im]
                });
                whitened.extend(last);
                let whitened = DMatrix::from_vec(2 * block.len(), active.len() + 1, whitened);
                add_squares(&mut sum, &whitened);
            }
            (active.clone(), sum)
        })
        .collect();
    let mut gram: DMatrix<f64> = DMatrix::zeros(count + 1, count + 1);
    for (active, part) in parts {
        let places: Vec<usize> = active.iter().copied().chain([count]).collect();
        for (a, &to_a) in places.iter().enumerate() {
            for (b, &to_b) in places.iter().enumerate() {
                gram[(to_a, to_b)] += part[(a, b)];
            }
        }
    }
    let scale = |place: usize| regressors.get(place).map_or(1.0, |one| one.scale);
    DMatrix::from_fn(count + 1, count + 1, |a, b| {
        // The lower half only: both are the same sum, in another order.
        gram[(a.max(b), a.min(b))] * scale(a) * scale(b)
    })
}

/// Adds the lower half of whitenedᵀ whitened, in groups of columns on and below the diagonal.
fn add_squares(sum: &mut DMatrix<f64>, whitened: &DMatrix<f64>) {
    /// Few enough to save nearly half of the work, enough for products of matrices to run at full speed.
    const GROUP: usize = 32;
    let transposed = whitened.transpose();
    let count = whitened.ncols();
    for first in (0..count).step_by(GROUP) {
        let columns = GROUP.min(count - first);
        let rows = count - first;
        sum.view_mut((first, first), (rows, columns)).gemm(
            1.0,
            &transposed.rows(first, rows),
            &whitened.columns(first, columns),
            1.0,
        );
    }
}

/// Leverage of each bin: share of its freedom that a fit of the regressors takes, |bᵀ half|² with half · halfᵀ the inverse
/// of their Gram matrix.
pub fn leverage(regressors: &[&Regressor], half: &DMatrix<f64>, weights: &[f64]) -> Vec<f64> {
    let tasks = tasks(regressors, weights);
    let parts: Vec<Vec<f64>> = tasks
        .par_iter()
        .map(|(bins, active)| {
            let rows = DMatrix::from_fn(active.len(), half.ncols(), |a, direction| {
                half[(active[a], direction)] * regressors[active[a]].scale
            });
            let mut taken = Vec::with_capacity(bins.len());
            for block in blocks(bins) {
                let whitened = whiten(regressors, active, &block, weights);
                let whitened = DMatrix::from_vec(2 * block.len(), active.len(), whitened);
                let shares = whitened * &rows;
                let mut squares = vec![0.0; 2 * block.len()];
                for direction in shares.column_iter() {
                    for (sum, share) in squares.iter_mut().zip(direction.iter()) {
                        *sum += share * share;
                    }
                }
                taken.extend(squares.chunks(2).map(|pair| pair[0] + pair[1]));
            }
            taken
        })
        .collect();
    parts.concat()
}

/// Runs of bins with the regressors that reach into them.
type Task = (std::ops::Range<usize>, Vec<usize>);

fn tasks(regressors: &[&Regressor], weights: &[f64]) -> Vec<Task> {
    let reaches: Vec<usize> = regressors
        .par_iter()
        .map(|regressor| regressor.reach(weights))
        .collect();
    (0..weights.len())
        .step_by(TASK_BINS)
        .map(|first| {
            let active = (0..regressors.len()).filter(|&place| reaches[place] > first);
            (
                first..(first + TASK_BINS).min(weights.len()),
                active.collect(),
            )
        })
        .collect()
}

fn blocks(bins: &std::ops::Range<usize>) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
    let end = bins.end;
    bins.clone()
        .step_by(BLOCK_BINS)
        .map(move |first| first..(first + BLOCK_BINS).min(end))
}

/// The active regressors over √S in their own units, column by column, real and imaginary parts in turn.
fn whiten(
    regressors: &[&Regressor],
    active: &[usize],
    block: &std::ops::Range<usize>,
    weights: &[f64],
) -> Vec<f64> {
    let roots: Vec<f64> = weights[block.clone()].iter().map(|w| w.sqrt()).collect();
    let mut whitened = Vec::with_capacity(2 * block.len() * (active.len() + 1));
    for &place in active {
        let bins = regressors[place].bins[block.clone()].iter();
        whitened.extend(
            bins.zip(&roots)
                .flat_map(|(bin, root)| [f64::from(bin.re) * root, f64::from(bin.im) * root]),
        );
    }
    whitened
}

/// Regressors of several columns.
pub fn regressors(columns: &[Bins]) -> Vec<Regressor> {
    columns.iter().map(|bins| Regressor::new(bins)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tiles::portion::inner;

    /// 20 000 bins of a decaying column, of a constant one, and of another signal.
    fn columns() -> [Bins; 3] {
        let bins = |of: &dyn Fn(f64) -> (f64, f64)| {
            (0..20_000)
                .map(|k| {
                    let (re, im) = of(f64::from(k));
                    Complex64::new(re, im)
                })
                .collect()
        };
        [
            bins(&|k| {
                let fall = 3e-9 * (-k / 300.0).exp();
                (fall * (k * 0.37).sin(), fall)
            }),
            bins(&|k| ((k * 0.11).cos(), (k * 0.07).sin())),
            bins(&|k| (1e6 * (k * 0.37).sin(), -4e5 * (k * 0.05).cos())),
        ]
    }

    #[test]
    fn sums_in_blocks_are_the_plain_sums() {
        let columns = columns();
        let weights: Vec<f64> = (0..20_000).map(|k| 1.0 / (1.0 + f64::from(k))).collect();
        let made = regressors(&columns[..2]);
        let gram = gram(&made.iter().collect::<Vec<_>>(), &columns[2], &weights);
        for a in 0..3 {
            for b in 0..3 {
                let plain = inner(&columns[a], &columns[b], &weights);
                let size = (gram[(a, a)] * gram[(b, b)]).sqrt();
                // Single precision of the columns: 6e-8 a bin.
                assert!((gram[(a, b)] - plain).abs() < 1e-7 * size, "{a} {b}");
            }
        }
    }

    #[test]
    fn a_bins_freedom_adds_up_to_the_number_of_columns() {
        let columns = columns();
        let weights = vec![0.3; 20_000];
        let made = regressors(&columns);
        let made: Vec<&Regressor> = made.iter().collect();
        let gram = gram(&made, &vec![Complex64::default(); 20_000], &weights);
        let gram = gram.view((0, 0), (3, 3)).into_owned();
        let half = gram
            .cholesky()
            .expect("independent")
            .l()
            .try_inverse()
            .expect("regular")
            .transpose();
        let total: f64 = leverage(&made, &half, &weights).iter().sum();
        assert!((total - 3.0).abs() < 1e-6, "{total}");
    }
}
