//! Validation of the fit on held-out rows (diagnosis road, step 9).
//!
//! Enters: the residual before and after \[rad per row\], the noise, the held-out rows, the locations. Leaves: for each gyro
//! the drift, the power over the noise and the p-value of whiteness, before and after.
//!
//! Power is taken in the located times and bands; too narrow a band (the power of n bins scatters by 1/√n) is widened
//! upwards until it holds enough bins.

use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};
use std::ops::Range;

use super::least_squares::fit_away;
use super::locate::Location;
use super::noise_spectrum::Noise;
use super::portion::{Portion, inner};
use super::regimes::intersect;
use super::regressor::regressors;
use rlg_plan::HeldOutPlan;
use rlg_signal::streams::Triad;

/// Figures of one gyro.
#[derive(Debug, Clone, Copy)]
pub struct Figures {
    /// Mean rate over the validated rows \[rad/s\], by generalised least squares.
    pub drift_rad_s: f64,
    /// Its standard deviation \[rad/s\].
    pub drift_std_rad_s: f64,
    /// Power over the noise in the located bands and times (1 = noise alone).
    pub normalised_power: f64,
    /// The same over all held-out rows.
    pub normalised_power_all: f64,
    /// p-value of whiteness of the residual over the noise (Kolmogorov–Smirnov test of the cumulative periodogram).
    pub white_p_value: f64,
}

/// Figures before and after on one gyro.
#[derive(Debug, Clone)]
pub struct Validation {
    /// Gyro.
    pub axis: usize,
    /// Validated band \[Hz\].
    pub band_hz: (f64, f64),
    /// Without the effects.
    pub before: Figures,
    /// With them.
    pub after: Figures,
}

/// Validates every gyro on the held-out rows, in the band in which they count. `None` if no rows are held out.
pub fn validate(
    before_rad: &Triad,
    after_rad: &Triad,
    noise: &[Noise; 3],
    (held_out, counts_hz): (&[Range<usize>], [f64; 2]),
    locations: &[Location],
    rate_hz: f64,
    plan: &HeldOutPlan,
) -> Vec<Validation> {
    let Some(everything) = Portion::new(held_out.to_vec(), rate_hz, plan) else {
        return Vec::new();
    };
    let everything = everything.within(counts_hz);
    (0..3_usize)
        .into_par_iter()
        .map(|axis| {
            let here: Vec<&Location> = locations
                .iter()
                .filter(|location| location.axis == axis)
                .collect();
            let times: Vec<Range<usize>> =
                here.iter().map(|location| location.rows.clone()).collect();
            let located = (!times.is_empty())
                .then(|| Portion::new(union(intersect(held_out, &times)), rate_hz, plan))
                .flatten()
                .map(|portion| portion.within(counts_hz));
            let low_hz = here
                .iter()
                .map(|location| location.band_hz.0)
                .fold(f64::INFINITY, f64::min);
            let high_hz = here
                .iter()
                .map(|location| location.band_hz.1)
                .fold(0.0, f64::max);
            let judged = located.as_ref().unwrap_or(&everything);
            let (low_hz, high_hz) = if located.is_some() {
                (low_hz, high_hz)
            } else {
                (0.0, rate_hz / 2.0)
            };
            let counted = judged.counted();
            let first = ((low_hz * judged.seconds()).floor() as usize).max(counted.start);
            let last = ((high_hz * judged.seconds()).ceil() as usize)
                .max(first + plan.least_bins)
                .min(counted.end);
            let first = first
                .min(last.saturating_sub(plan.least_bins))
                .max(counted.start);
            let figures = |values: &[f64]| Figures {
                normalised_power_all: power(
                    &everything,
                    values,
                    &noise[axis],
                    everything.counted(),
                )
                .0,
                ..judge(judged, values, &noise[axis], first..last)
            };
            Validation {
                axis,
                band_hz: (
                    judged.frequency_hz(first),
                    judged.frequency_hz(last.max(first + 1) - 1),
                ),
                before: figures(&before_rad[axis]),
                after: figures(&after_rad[axis]),
            }
        })
        .collect()
}

fn union(mut ranges: Vec<Range<usize>>) -> Vec<Range<usize>> {
    ranges.sort_by_key(|range| range.start);
    let mut joined: Vec<Range<usize>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
            _ => joined.push(range),
        }
    }
    joined
}

fn judge(portion: &Portion, values: &[f64], noise: &Noise, bins: Range<usize>) -> Figures {
    let weights = noise.weights(portion);
    let joints = regressors(&portion.joints());
    let residual = portion.transform(values);
    let period_s = portion.seconds() / portion.rows() as f64;
    let constant = portion.transform(&vec![period_s; values.len()]);
    let mut constant_left = constant.clone();
    fit_away(&mut constant_left, &joints, &weights);
    let own = inner(&constant, &constant_left, &weights);
    let found = inner(&constant_left, &residual, &weights);
    let (normalised_power, ratios) = power(portion, values, noise, bins);
    Figures {
        drift_rad_s: found / own,
        drift_std_rad_s: own.sqrt().recip(),
        normalised_power,
        normalised_power_all: 0.0,
        white_p_value: white_chance(&ratios),
    }
}

/// Power over noise in some bins, joints projected out, and the ratio in each bin.
fn power(portion: &Portion, values: &[f64], noise: &Noise, bins: Range<usize>) -> (f64, Vec<f64>) {
    let weights = noise.weights(portion);
    let joints = regressors(&portion.joints());
    let mut residual = portion.transform(values);
    let scale: Vec<f64> = joints
        .iter()
        .map(|joint| joint.power(&weights).sqrt().recip())
        .collect();
    fit_away(&mut residual, &joints, &weights);
    // Each joint takes one degree of freedom out of all bins together, most of it at low frequency, where its noise is
    // least; counted in the bins concerned.
    let taken: f64 = bins
        .clone()
        .map(|bin| {
            joints
                .iter()
                .zip(&scale)
                .map(|(joint, s)| joint.at(bin).norm_sqr() * s * s)
                .sum::<f64>()
                * weights[bin]
        })
        .sum();
    let ratios: Vec<f64> = bins
        .clone()
        .map(|bin| residual[bin].norm_sqr() * weights[bin])
        .collect();
    let degrees: f64 = bins.map(|bin| portion.degrees(bin)).sum();
    (
        ratios.iter().sum::<f64>() / (degrees - taken).max(1.0),
        ratios,
    )
}

/// p-value of the largest distance between the cumulative periodogram and a straight line.
pub fn white_chance(ratios: &[f64]) -> f64 {
    let total: f64 = ratios.iter().sum();
    let count = ratios.len() as f64;
    let mut sum = 0.0;
    let mut distance: f64 = 0.0;
    for (place, ratio) in ratios.iter().enumerate() {
        sum += ratio / total;
        distance = distance.max((sum - (place + 1) as f64 / count).abs());
    }
    // Kolmogorov's distribution, with Stephens' correction for finite counts.
    let root = count.sqrt();
    let x = (root + 0.12 + 0.11 / root) * distance;
    let series: f64 = (1..=100)
        .map(|k| {
            let sign = if k % 2 == 1 { 1.0 } else { -1.0 };
            2.0 * sign * (-2.0 * f64::from(k * k) * x * x).exp()
        })
        .sum();
    series.clamp(0.0, 1.0)
}

/// Two-sided p-value of a drift.
pub fn drift_chance(figures: &Figures) -> f64 {
    2.0 * Normal::standard().sf((figures.drift_rad_s / figures.drift_std_rad_s).abs())
}
