//! Estimates the power of the reference's noise in the recording.
//!
//! The reference is m = motion + n, the residual e = gyro noise − n. So E\[m* e\] = −S_n at every frequency, for any motion:
//! motion adds variance only. Weighted least squares of −Re(m* e) on the spectra of the noise's terms, each term at least 0,
//! each cell with the variance of its neighbourhood. Weights by a cell's own power would bias the estimate: where m is
//! noise, small products have small powers, and the sum would be low by one part in the number of frames.
//!
//! A term absent from the model has a flat prior. A declared term has a log-normal prior about its declaration, outweighed
//! by contradicting data.

use nalgebra::{DMatrix, DVector};
use rlg_plan::{FramePlan, ReferenceNoisePlan};

use crate::frames::Frames;
use crate::quantiles::median;

/// Prior of one term of the reference's noise.
#[derive(Debug, Clone)]
pub struct NoiseTerm {
    /// Power by DCT-II coefficient at a share of 1 \[rad²\].
    pub shape: Vec<f64>,
    /// The model declares a share of 1; otherwise the prior of the share is flat.
    pub is_declared: bool,
}

/// Posterior estimate of one term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredShare {
    /// Power over that of the term's shape.
    pub share: f64,
    /// Its standard deviation; infinite for an undeclared term without data.
    pub std: f64,
}

/// Equivalent number of independent half-overlapped Hann frames, per frame.
const INDEPENDENT_FRAMES: f64 = 0.95;

/// Bins over which a Hann window spreads one cell.
const HANN_WIDTH: f64 = 1.5;

/// Estimates the share of each term on one axis (maximum a posteriori).
///
/// # Inputs
/// `reference`, `residual` \[rad\] by row; `residual_noise`: power of the residual's noise by DCT-II coefficient \[rad²\];
/// `seen`: rows whose residual may be used; `declared_std`: prior standard deviation of the logarithm of a declared share
/// \[1\].
///
/// # Returns
/// A share for each term; the prior one where the rows are too few.
pub fn measure(
    (reference, residual): (&[f64], &[f64]),
    terms: &[NoiseTerm],
    residual_noise: &[f64],
    seen: &[bool],
    rate_hz: f64,
    declared_std: f64,
    (plan, frames): (&ReferenceNoisePlan, &FramePlan),
) -> Vec<MeasuredShare> {
    let before = |term: &NoiseTerm| MeasuredShare {
        share: f64::from(u8::from(term.is_declared)),
        std: if term.is_declared {
            declared_std
        } else {
            f64::INFINITY
        },
    };
    let both = (reference, residual);
    let Some(sums) = Frames::new(reference.len(), rate_hz, frames)
        .and_then(|frames| Sums::new(&frames, both, terms, residual_noise, seen, plan))
    else {
        return terms.iter().map(before).collect();
    };
    let is_declared: Vec<bool> = terms.iter().map(|term| term.is_declared).collect();
    let shares = sums.most_probable(&is_declared, declared_std);
    let precision = sums.precision(&shares, &is_declared, declared_std);
    let variance = precision.try_inverse();
    (0..terms.len())
        .map(|k| MeasuredShare {
            share: shares[k] / sums.scale[k],
            std: match &variance {
                Some(variance) => variance[(k, k)].max(0.0).sqrt() / sums.scale[k],
                None => before(&terms[k]).std,
            },
        })
        .collect()
}

/// Normal equations of the shares, each share in units of its conditional standard deviation given the others.
struct Sums {
    information: DMatrix<f64>,
    score: DVector<f64>,
    scale: Vec<f64>,
    /// Least share of a declared term.
    least_declared: f64,
}

impl Sums {
    /// Sums over the fully seen frames; `None` where they are fewer than two.
    fn new(
        frames: &Frames,
        (reference, residual): (&[f64], &[f64]),
        terms: &[NoiseTerm],
        residual_noise: &[f64],
        seen: &[bool],
        plan: &ReferenceNoisePlan,
    ) -> Option<Self> {
        let whole = (0..)
            .map(|frame| frame * frames.hop())
            .take_while(|first| first + frames.length <= reference.len())
            .filter(|&first| seen[first..first + frames.length].iter().all(|&seen| seen));
        let count = frames.frequencies();
        let (mut product, mut power, mut number) = (vec![0.0; count], vec![0.0; count], 0.0);
        for first in whole {
            let m = frames.transform(reference, first);
            let e = frames.transform(residual, first);
            for k in 0..count {
                product[k] -= (m[k].conj() * e[k]).re;
                power[k] += m[k].norm_sqr();
            }
            number += 1.0;
        }
        if number < 2.0 {
            return None;
        }
        let scale = 1.0 / (number * frames.window_power);
        product.iter_mut().for_each(|value| *value *= scale);
        power.iter_mut().for_each(|value| *value *= scale);
        let smooth = background(&power, plan);
        let noise = frames.resample(residual_noise);
        let shapes: Vec<Vec<f64>> = terms
            .iter()
            .map(|term| frames.resample(&term.shape))
            .collect();
        let size = shapes.len();
        let mut information = DMatrix::<f64>::zeros(size, size);
        let mut score = DVector::<f64>::zeros(size);
        for k in plan.leaked..count - 1 {
            // If m is noise, m and e are one variable: (P_m S_e + |E m* e|²)/2 is P_m S_e then.
            let variance = (smooth[k] * noise[k]).max(f64::MIN_POSITIVE) * HANN_WIDTH;
            let weight = number * INDEPENDENT_FRAMES / variance;
            if !weight.is_finite() {
                continue;
            }
            for a in 0..size {
                score[a] += weight * shapes[a][k] * product[k];
                for b in 0..size {
                    information[(a, b)] += weight * shapes[a][k] * shapes[b][k];
                }
            }
        }
        let scale: Vec<f64> = (0..size)
            .map(|k| f64::sqrt(information[(k, k)]))
            .map(|scale| if scale > 0.0 { scale } else { 1.0 })
            .collect();
        Some(Self {
            information: DMatrix::from_fn(size, size, |a, b| {
                information[(a, b)] / (scale[a] * scale[b])
            }),
            score: DVector::from_fn(size, |a, _| score[a] / scale[a]),
            scale,
            least_declared: plan.least_declared,
        })
    }

    /// Scaled shares of the largest posterior: log-normal priors by Newton steps, the others at least 0.
    fn most_probable(&self, is_declared: &[bool], declared_std: f64) -> Vec<f64> {
        const STEPS: usize = 60;
        const SETTLED: f64 = 1e-6;
        const MOST_STEP: f64 = 2.0;
        let mut shares = self.scale.clone();
        for (share, is_declared) in shares.iter_mut().zip(is_declared) {
            if !is_declared {
                *share = 0.0;
            }
        }
        for _ in 0..STEPS {
            let precision = self.precision(&shares, is_declared, declared_std);
            let mut right = self.score.clone();
            for k in (0..shares.len()).filter(|&k| is_declared[k]) {
                // Slope of ½ ln²(s)/σ² in the share itself, at the present one.
                let of_prior = precision[(k, k)] - self.information[(k, k)];
                right[k] += of_prior * shares[k] * (1.0 - (shares[k] / self.scale[k]).ln());
            }
            let target = non_negative(&precision, &right);
            let mut change: f64 = 0.0;
            for k in 0..shares.len() {
                let next = if is_declared[k] {
                    let bounded = target[k].clamp(shares[k] / MOST_STEP, shares[k] * MOST_STEP);
                    bounded.max(self.least_declared * self.scale[k])
                } else {
                    target[k]
                };
                change = change.max((next - shares[k]).abs() / (1.0 + shares[k]));
                shares[k] = next;
            }
            if change < SETTLED {
                break;
            }
        }
        shares
    }

    /// Posterior precision of the scaled shares: information of data and priors.
    fn precision(&self, shares: &[f64], is_declared: &[bool], declared_std: f64) -> DMatrix<f64> {
        let mut precision = self.information.clone();
        for k in (0..shares.len()).filter(|&k| is_declared[k]) {
            precision[(k, k)] += 1.0 / (declared_std * shares[k]).powi(2);
        }
        precision
    }
}

/// Minimises ½ xᵀ A x − bᵀ x over x ≥ 0: the best of all subsets with a non-negative solution (non-negative least squares).
fn non_negative(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    let size = b.len();
    let mut best = DVector::zeros(size);
    let mut least = 0.0;
    for subset in 1_usize..1 << size {
        let members: Vec<usize> = (0..size).filter(|term| subset >> term & 1 == 1).collect();
        let matrix = DMatrix::from_fn(members.len(), members.len(), |i, j| {
            a[(members[i], members[j])]
        });
        let right = DVector::from_fn(members.len(), |i, _| b[members[i]]);
        let Some(cholesky) = matrix.cholesky() else {
            continue;
        };
        let solved = cholesky.solve(&right);
        let value = -0.5 * right.dot(&solved);
        if value < least && solved.iter().all(|&value| value >= 0.0) {
            least = value;
            best.fill(0.0);
            for (&term, &value) in members.iter().zip(solved.iter()) {
                best[term] = value;
            }
        }
    }
    best
}

/// Median power of each cell's neighbourhood, or the largest of its three nearest cells at a spectral line of motion.
fn background(power: &[f64], plan: &ReferenceNoisePlan) -> Vec<f64> {
    let count = power.len();
    let beside = plan.neighbours;
    (0..count)
        .map(|k| {
            let around = k.saturating_sub(beside)..(k + beside + 1).min(count);
            let median = median(power[around].iter().copied()).unwrap_or(0.0);
            let own = power[k.saturating_sub(1)..(k + 2).min(count)]
                .iter()
                .copied()
                .fold(0.0, f64::max);
            if own > plan.stands_out * median {
                own
            } else {
                median
            }
        })
        .collect()
}
