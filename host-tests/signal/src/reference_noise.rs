//! How much of the declared reference noise is in the recording.
//!
//! The reference is m = motion + n, the residual e = gyro noise − n. So E\[m* e\] = −S_n at every frequency, whatever the
//! motion: motion adds variance only. Least squares of −Re(m* e) on the declared spectra, each cell with the variance
//! of its neighbourhood, and a prior about the declaration. A cell's own power must not weigh it: where m is noise, small
//! products have small powers, and the sum would come out low by one part in the number of frames.

use nalgebra::{DMatrix, DVector};

use crate::frames::Frames;

/// What the recording says of one declared term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredShare {
    /// Power over the declared power.
    pub share: f64,
    /// Its standard deviation.
    pub std: f64,
}

/// Bounds of a share: a term that vanishes keeps the columns finite, a larger one is no declaration of this reference.
const SHARE_RANGE: [f64; 2] = [0.02, 50.0];

/// Frequencies from zero that the window's leakage of slow motion spoils.
const SPOILT: usize = 3;

/// Equivalent number of independent half-overlapped Hann frames, per frame.
const INDEPENDENT_FRAMES: f64 = 0.95;

/// Bins over which a Hann window spreads one cell.
const HANN_WIDTH: f64 = 1.5;

/// Measures the share of each declared term on one axis.
///
/// # Inputs
/// `reference`, `residual` \[rad\] by row; `declared`: power of each declared term by DCT-II coefficient;
/// `residual_noise`: power of the residual's noise alike; `seen`: rows whose residual may be looked at;
/// `prior_std`: standard deviation of a share before looking \[1\].
///
/// # Returns
/// A share for each declared term; 1 ± `prior_std` where the rows are too few to say.
pub fn measure(
    reference: &[f64],
    residual: &[f64],
    declared: &[Vec<f64>],
    residual_noise: &[f64],
    seen: &[bool],
    rate_hz: f64,
    prior_std: f64,
) -> Vec<MeasuredShare> {
    let as_declared = vec![
        MeasuredShare {
            share: 1.0,
            std: prior_std
        };
        declared.len()
    ];
    let Some(frames) = Frames::new(reference.len(), rate_hz) else {
        return as_declared;
    };
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
        return as_declared;
    }
    let scale = 1.0 / (number * frames.window_power);
    product.iter_mut().for_each(|value| *value *= scale);
    power.iter_mut().for_each(|value| *value *= scale);
    let smooth = background(&power);
    let noise = frames.resample(residual_noise);
    let terms: Vec<Vec<f64>> = declared.iter().map(|term| frames.resample(term)).collect();
    let size = terms.len();
    let mut normal = DMatrix::identity(size, size) / (prior_std * prior_std);
    let mut right = DVector::from_element(size, 1.0 / (prior_std * prior_std));
    for k in SPOILT..count - 1 {
        // Where m is noise, m and e are one variable: (P_m S_e + |E m* e|²)/2 is P_m S_e then.
        let variance = (smooth[k] * noise[k]).max(f64::MIN_POSITIVE) * HANN_WIDTH;
        let weight = number * INDEPENDENT_FRAMES / variance;
        if !weight.is_finite() {
            continue;
        }
        for a in 0..size {
            right[a] += weight * terms[a][k] * product[k];
            for b in 0..size {
                normal[(a, b)] += weight * terms[a][k] * terms[b][k];
            }
        }
    }
    let Some(inverse) = normal.try_inverse() else {
        return as_declared;
    };
    let shares = &inverse * right;
    (0..size)
        .map(|k| MeasuredShare {
            share: shares[k].clamp(SHARE_RANGE[0], SHARE_RANGE[1]),
            std: inverse[(k, k)].max(0.0).sqrt(),
        })
        .collect()
}

/// Power of each cell's neighbourhood, or its own where a line of motion stands out.
fn background(power: &[f64]) -> Vec<f64> {
    const NEIGHBOURS: usize = 12;
    const STANDS_OUT: f64 = 4.0;
    let count = power.len();
    (0..count)
        .map(|k| {
            let around = k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(count);
            let mut sorted = power[around].to_vec();
            sorted.sort_by(f64::total_cmp);
            let median = sorted[sorted.len() / 2];
            let own = power[k.saturating_sub(1)..(k + 2).min(count)]
                .iter()
                .copied()
                .fold(0.0, f64::max);
            if own > STANDS_OUT * median {
                own
            } else {
                median
            }
        })
        .collect()
}
