//! Slope of an angle over time from its increments, with a standard deviation.
//!
//! Increments of one angle, in runs without a gap, give its slope per period \[unit of the increments\].
//!
//! # Model
//! An angle that is measured with white noise of variance R and has a random walk of variance q per period has increments
//! with variance q + 2R and covariance −R between neighbours: a moving average of first order. R is that of pulses, pickoff
//! and reference, q the angle random walk (IEEE 952); both are unknown. If R dominates, the generalised-least-squares slope
//! is that of a straight line through the angle; if q dominates, the difference of its ends. It is averaged over q/R with
//! the restricted likelihood (REML; Patterson and Thompson, Biometrika 58, 1971) and Jeffreys' prior of that ratio as
//! weight, so that the standard deviation contains the uncertainty of the noise.
//!
//! Sines diagonalise the covariance exactly. A long run is first reduced to the angle's means over blocks. They keep the
//! model (increments of a walk's means over M samples have variance q (2M² + 1)/(3M), covariance q (M² − 1)/(6M)) and the
//! slope's accuracy, and oscillations faster than a block do not count as noise.
//!
//! # Assumptions
//! The noise is Gaussian and stationary. A wandering bias (flicker, rate random walk) is part of the slope, not of its
//! standard deviation.

use std::f64::consts::PI;

use realfft::RealFftPlanner;

/// Blocks of a run, enough to estimate the noise levels to a few per cent.
const BLOCKS: usize = 512;

/// Least q/R, times N² (N periods): a walk that adds a hundredth to the slope's variance.
const LEAST_RATIO: f64 = 0.1;

/// Largest q/R: white angle noise is negligible.
const LARGEST_RATIO: f64 = 1e3;

/// Step of ln(q/R): a fraction of the least width of the likelihood.
const STEP: f64 = 0.4;

/// Slope of an angle per period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// Slope.
    pub value: f64,
    /// Standard deviation; `None` if the runs are too short to estimate their noise.
    pub std: Option<f64>,
}

/// Coefficient of a sine in one run.
struct Line {
    /// Coefficient of the increments.
    data: f64,
    /// Coefficient of a slope of 1 per period.
    unit: f64,
    /// Variance for R = 1, q = 0.
    white: f64,
    /// Variance for R = 0, q = 1.
    walk: f64,
}

impl Line {
    /// Variance at a ratio q/R, for a fixed sum of q and R.
    fn variance(&self, ratio: f64) -> f64 {
        (self.white + ratio * self.walk) / (1.0 + ratio)
    }
}

/// Slope and weight by generalised least squares at one ratio q/R.
struct Fit {
    slope: f64,
    variance: f64,
    log_weight: f64,
}

/// Estimates the slope from runs of increments, each without a gap; `None` without an increment.
pub fn slope<'a>(runs: impl IntoIterator<Item = &'a [f64]>) -> Option<Slope> {
    let mut lines = Vec::new();
    let (mut periods, mut sum) = (0, 0.0);
    // The planner caches its plans: most runs have one length.
    let mut planner = RealFftPlanner::new();
    for run in runs {
        periods += run.len();
        sum += run.iter().sum::<f64>();
        lines.extend(transform(run, &mut planner));
    }
    if periods == 0 {
        return None;
    }
    let least = LEAST_RATIO / (periods as f64).powi(2);
    let steps = ((LARGEST_RATIO / least).ln() / STEP).ceil() as usize;
    let ratios = (0..=steps).map(|step| least * (STEP * step as f64).exp());
    let fits: Vec<Fit> = ratios.filter_map(|ratio| fit(&lines, ratio)).collect();
    let most = fits
        .iter()
        .fold(f64::NEG_INFINITY, |most, fit| most.max(fit.log_weight));
    if !most.is_finite() {
        return Some(Slope {
            value: sum / periods as f64,
            std: None,
        });
    }
    let weights = || fits.iter().map(|fit| (fit, (fit.log_weight - most).exp()));
    let all: f64 = weights().map(|(_, weight)| weight).sum();
    let value = weights()
        .map(|(fit, weight)| weight * fit.slope)
        .sum::<f64>()
        / all;
    let variance = weights()
        .map(|(fit, weight)| weight * (fit.variance + (fit.slope - value).powi(2)))
        .sum::<f64>()
        / all;
    Some(Slope {
        value,
        std: Some(variance.sqrt()),
    })
}

/// Sine coefficients of the increments between the angle's means over blocks.
fn transform(increments: &[f64], planner: &mut RealFftPlanner<f64>) -> Vec<Line> {
    let readings = increments.len() + 1;
    let block = readings.div_ceil(BLOCKS);
    let mut means = vec![0.0; readings / block];
    let mut angle = 0.0;
    let angles = increments.iter().map(|increment| {
        angle += increment;
        angle
    });
    for (reading, angle) in std::iter::once(0.0).chain(angles).enumerate() {
        if let Some(mean) = means.get_mut(reading / block) {
            *mean += angle / block as f64;
        }
    }
    let steps: Vec<f64> = means.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() {
        return Vec::new();
    }
    let block = block as f64;
    let data = sines(&steps, planner);
    let units = sines(&vec![block; steps.len()], planner);
    let line = |(at, (data, unit))| {
        let cosine = (PI * f64::from(at) / (steps.len() + 1) as f64).cos();
        Line {
            data,
            unit,
            white: 2.0 * (1.0 - cosine) / block,
            walk: (2.0 * block * block + 1.0 + (block * block - 1.0) * cosine) / (3.0 * block),
        }
    };
    (1_u32..)
        .zip(data.into_iter().zip(units))
        .map(line)
        .collect()
}

/// Orthonormal sine transform (DST-I): the Fourier transform of the values and their mirror image with opposite sign.
fn sines(values: &[f64], planner: &mut RealFftPlanner<f64>) -> Vec<f64> {
    let length = 2 * (values.len() + 1);
    let fourier = planner.plan_fft_forward(length);
    let mut odd = fourier.make_input_vec();
    for (at, value) in (1..).zip(values) {
        odd[at] = *value;
        odd[length - at] = -value;
    }
    let mut spectrum = fourier.make_output_vec();
    if fourier.process(&mut odd, &mut spectrum).is_err() {
        unreachable!("both buffers are the plan's own");
    }
    let scale = -(1.0 / length as f64).sqrt();
    let lines = spectrum[1..=values.len()].iter();
    lines.map(|value| scale * value.im).collect()
}

/// Generalised least squares at a ratio q/R; `None` if the lines are too few for a variance.
fn fit(lines: &[Line], ratio: f64) -> Option<Fit> {
    // Slope, sum of q and R, and their ratio are estimated.
    let free = lines.len().checked_sub(3).filter(|free| *free > 0)? as f64;
    let (mut information, mut moment) = (0.0, 0.0);
    let (mut logarithms, mut shares, mut shares_squared) = (0.0, 0.0, 0.0);
    for line in lines {
        let variance = line.variance(ratio);
        information += line.unit * line.unit / variance;
        moment += line.unit * line.data / variance;
        logarithms += variance.ln();
        let share = ratio * line.walk / (line.white + ratio * line.walk);
        shares += share;
        shares_squared += share * share;
    }
    let slope = moment / information;
    let left = |line: &Line| (line.data - slope * line.unit).powi(2) / line.variance(ratio);
    let squares: f64 = lines.iter().map(left).sum();
    let count = lines.len() as f64;
    let jeffreys = shares_squared - shares * shares / count;
    (squares > 0.0 && jeffreys > 0.0).then(|| Fit {
        slope,
        variance: squares / free / information,
        log_weight: 0.5
            * (jeffreys.ln() - logarithms - information.ln() - (count - 1.0) * squares.ln()),
    })
}
