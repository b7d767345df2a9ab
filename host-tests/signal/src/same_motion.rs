//! Tests if gyros and reference show a common motion, before it is used as an explanation.
//!
//! Enter: increments of both on the same rows \[rad\]. Leaves: [`Apart`], where the gyros move and do not follow the
//! reference.
//!
//! # Measures
//! Each compares the best delay of two recorders with the record's own lags beyond any delay (circular shifts, a surrogate
//! test: Theiler et al., Physica D 58, 1992). A common motion exceeds chance in all three, or one of them is large:
//! - **coherence**: the sum of singular values of the 3 × 3 correlation of the rates, over the root of both powers. One
//!   orthogonal map and one scale: the strongest part of the motion decides it.
//! - **share**: of the gyros' power, explained by a real 3 × 3 map in each octave of frequency (a multiple coherence), for any
//!   axes, signs, scales and filters. Quarters of an octave have equal weight, against the dominance of two or three
//!   frequencies of a steep spectrum.
//! - **likelihood**: by one orthogonal map for all octaves, − ln(1 − share) of each, summed over its lines: octaves with a clear
//!   common motion have the weight, and one map explains less by chance than a map an octave.
//!
//! The reference is scaled to the gyros' power over all quarters and not amplified much in one, against an explanation by its
//! noise.
//!
//! # Assumptions
//! A quarter counts only where gyros and reference move: the gyros' power exceeds any gyro's noise, or both exceed the noise
//! of their quietest quarter, white of rate or of angle; and below the band limit of the reference's rows. Without motion
//! there is no information.

use rlg_plan::SameMotionPlan;
use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::{Matrix3, RowVector3};
use realfft::num_complex::Complex64;

use crate::axes::Triad;
use crate::transforms;

/// Gyros and reference without a common motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Apart {
    /// Largest share of the gyros' power explained by the reference at any delay \[1\].
    pub share: f64,
    /// Largest share of the surrogate lags \[1\].
    pub by_chance: f64,
    /// Lag of `by_chance`: delay of the gyros behind the reference \[s\].
    pub at_lag_s: f64,
}

/// A quarter of an octave.
struct Quarter {
    bins: Range<usize>,
    /// Power of three gyros, and of three axes of the reference.
    gyros: f64,
    reference: f64,
    /// Power of the differences of white noise of 1 rad² a line.
    differenced: f64,
}

/// Spectra of the three axes of both sides.
struct Spectra {
    gyros: [Vec<Complex64>; 3],
    reference: [Vec<Complex64>; 3],
}

/// A measure at the best delay of two recorders, and beyond any delay.
#[derive(Clone, Copy)]
struct Best {
    within: f64,
    beyond: f64,
    /// Lag of the latter \[s\].
    at_lag_s: f64,
}

/// Lags at equal steps, negative ones in the second half.
#[derive(Clone, Copy)]
struct Lags {
    count: usize,
    step_s: f64,
}

/// Rows a second of both sides, and samples of the reference in them \[Hz\].
#[derive(Debug, Clone, Copy)]
pub struct Clocks {
    /// Rows.
    pub rate_hz: f64,
    /// Samples of the reference.
    pub reference_hz: f64,
}

/// Compares both sides on the rows that are `seen`; `None` for a common motion or no motion at all.
///
/// # Inputs
/// Increments of the gyros and of the reference \[rad\].
pub fn apart(
    (gyros_rad, reference_rad): (&Triad, &Triad),
    seen: &[bool],
    clocks: Clocks,
    plan: &SameMotionPlan,
) -> Option<Apart> {
    let Clocks {
        rate_hz,
        reference_hz,
    } = clocks;
    let block = seen.len().div_ceil(plan.most_rows).max(1);
    let rows = seen.len() / block;
    let period_s = block as f64 / rate_hz;
    let is_seen: Vec<bool> = seen
        .chunks_exact(block)
        .map(|rows| rows.iter().all(|seen| *seen))
        .collect();
    let [gyros, reference] = [gyros_rad, reference_rad]
        .map(|of| [0, 1, 2].map(|axis: usize| block_sums(&of[axis], block)));
    // Held: a plan in use is shared.
    let _plan = transforms::forward(rows);
    let spectra = Spectra {
        gyros: gyros.each_ref().map(|sums| spectrum(sums, &is_seen)),
        reference: reference.each_ref().map(|sums| spectrum(sums, &is_seen)),
    };
    let shown = plan.of_reference_rate * reference_hz * rows as f64 * period_s;
    let top = (rows / 2).min(shown as usize);
    // Increments of a random walk have the variance N² h, as has each line of their spectrum, times their number and the
    // mean square of the window.
    let count = WINDOW_MEAN_SQUARE * is_seen.iter().filter(|seen| **seen).count() as f64;
    let walk = 3.0 * plan.most_walk_rad_sqrt_s.powi(2) * period_s * count;
    let octaves = spectra.octaves((top, rows), walk, plan);
    let power = |of: fn(&Quarter) -> f64| octaves.iter().flatten().map(of).sum::<f64>();
    let [of_gyros, of_reference] = [power(|one| one.gyros), power(|one| one.reference)];
    if of_reference <= 0.0 {
        return None;
    }
    let scale = of_gyros / of_reference;
    let last = octaves.iter().flatten().map(|one| one.bins.end).max()?;
    // The lines of an octave decorrelate over a lag of half its period: step of a quarter of that, at most.
    let count = (8 * last).next_power_of_two();
    let lags = Lags {
        count,
        step_s: rows as f64 * period_s / count as f64,
    };
    let _plan = transforms::inverse(count);
    let (share, over_all) = spectra.share(&octaves, scale, lags, plan);
    if share.within >= plan.explained {
        return None;
    }
    let likelihood = spectra.likelihood(&octaves, over_all, (scale, lags), plan);
    let coherence = coherence((&gyros, &reference), &is_seen, period_s, plan);
    let exceeds_chance = coherence.within > coherence.beyond
        && share.within > plan.share_over_chance * share.beyond
        && likelihood.within > plan.likelihood_over_chance * likelihood.beyond;
    (coherence.within < plan.coherent && !exceeds_chance).then_some(Apart {
        share: share.within,
        by_chance: share.beyond,
        at_lag_s: share.at_lag_s,
    })
}

/// Mean square of the window of [`spectrum`].
const WINDOW_MEAN_SQUARE: f64 = 35.0 / 128.0;

fn block_sums(increments_rad: &[f64], block: usize) -> Vec<f64> {
    let blocks = increments_rad.chunks_exact(block);
    blocks.map(|rows| rows.iter().sum()).collect()
}

impl Lags {
    /// Lag \[s\]: delay of the gyros.
    fn at(&self, lag: usize) -> f64 {
        let back = if lag > self.count / 2 { self.count } else { 0 };
        (lag as f64 - back as f64) * self.step_s
    }

    /// Largest values within and beyond the delay of two recorders.
    ///
    /// # Inputs
    /// `most_s`: largest lag of the surrogates.
    fn best(&self, values: &[f64], most_s: f64, plan: &SameMotionPlan) -> Best {
        let mut best = Best {
            within: 0.0,
            beyond: 0.0,
            at_lag_s: 0.0,
        };
        for (lag, &value) in values.iter().enumerate() {
            let lag_s = self.at(lag);
            if lag_s.abs() <= plan.most_delay_s {
                best.within = best.within.max(value);
            } else if lag_s.abs() >= plan.beyond_delay * plan.most_delay_s
                && lag_s.abs() <= most_s
                && value > best.beyond
            {
                (best.beyond, best.at_lag_s) = (value, lag_s);
            }
        }
        best
    }
}

/// Computes the coherence of both sides' rates, averaged to the smoothness of a motion.
fn coherence(
    (gyros, reference): (&[Vec<f64>; 3], &[Vec<f64>; 3]),
    is_seen: &[bool],
    period_s: f64,
    plan: &SameMotionPlan,
) -> Best {
    let block = ((plan.averaged_s / period_s) as usize).max(1);
    let sums = |of: &Vec<f64>| {
        let seen = of.iter().zip(is_seen);
        let seen: Vec<f64> = seen
            .map(|(sum, seen)| if *seen { *sum } else { 0.0 })
            .collect();
        block_sums(&seen, block)
    };
    let [gyros, reference] = [gyros, reference].map(|of| of.each_ref().map(sums));
    let rows = gyros[0].len();
    let lags = Lags {
        count: (2 * rows).next_power_of_two(),
        step_s: block as f64 * period_s,
    };
    let transform = |sums: &Vec<f64>| {
        let mut record = sums.clone();
        record.resize(lags.count, 0.0);
        transformed(record)
    };
    let power = |of: &[Vec<f64>; 3]| -> f64 { of.iter().flatten().map(|sum| sum * sum).sum() };
    let over = lags.count as f64 * (power(&gyros) * power(&reference)).sqrt();
    let _plan = transforms::forward(lags.count);
    let [gyros, reference] = [gyros, reference].map(|of| of.each_ref().map(transform));
    let by_lag = correlations(lags.count, |gyro, axis, spectrum| {
        let both = gyros[gyro].iter().zip(&reference[axis]);
        for (product, (gyro, reference)) in spectrum.iter_mut().zip(both) {
            *product = gyro * reference.conj();
        }
    });
    let coherent = |lag: usize| matrix(&by_lag, lag).singular_values().sum() / over;
    let values: Vec<f64> = (0..lags.count).map(coherent).collect();
    lags.best(&values, 0.5 * rows as f64 * lags.step_s, plan)
}

/// Correlations of each gyro with each axis of the reference, at every lag.
type Correlations = [[Vec<f64>; 3]; 3];

/// Transforms the products that `products` writes for each gyro and axis.
fn correlations(lags: usize, products: impl Fn(usize, usize, &mut [Complex64])) -> Correlations {
    let back = transforms::inverse(lags);
    [0, 1, 2].map(|gyro| {
        [0, 1, 2].map(|axis| {
            let mut spectrum = back.make_input_vec();
            products(gyro, axis, &mut spectrum);
            // The first and the last line of a real signal are real.
            spectrum[0].im = 0.0;
            spectrum[lags / 2].im = 0.0;
            let mut by_lag = back.make_output_vec();
            if back.process(&mut spectrum, &mut by_lag).is_err() {
                unreachable!("both buffers are as long as planned");
            }
            by_lag
        })
    })
}

/// Correlation at one lag: row of a gyro, column of an axis.
fn matrix(by_lag: &Correlations, lag: usize) -> Matrix3<f64> {
    Matrix3::from_fn(|gyro, axis| by_lag[gyro][axis][lag])
}

/// Computes the spectrum of the differences of block sums under the fourth power of a sine, with differences at unseen rows set
/// to zero: a slow turn or a strong line would leak into all others at the cuts of the record.
fn spectrum(sums: &[f64], is_seen: &[bool]) -> Vec<Complex64> {
    let mut record = vec![0.0; sums.len()];
    for (row, difference) in record.iter_mut().enumerate().skip(1) {
        if is_seen[row - 1] && is_seen[row] {
            let window = (PI * row as f64 / sums.len() as f64).sin().powi(4);
            *difference = window * (sums[row] - sums[row - 1]);
        }
    }
    transformed(record)
}

/// Fourier transform of a real record.
fn transformed(mut record: Vec<f64>) -> Vec<Complex64> {
    let fourier = transforms::forward(record.len());
    let mut spectrum = fourier.make_output_vec();
    if fourier.process(&mut record, &mut spectrum).is_err() {
        unreachable!("both buffers are as long as planned");
    }
    spectrum
}

impl Quarter {
    fn new(spectra: &Spectra, bins: Range<usize>, rows: usize) -> Self {
        let power = |of: &[Vec<Complex64>; 3]| -> f64 {
            let lines = of.iter().flat_map(|axis| &axis[bins.clone()]);
            lines.map(|line| line.norm_sqr()).sum()
        };
        let middle = 0.5 * (bins.start + bins.end) as f64;
        let turned = 2.0 * (PI * middle / rows as f64).sin();
        Self {
            gyros: power(&spectra.gyros),
            reference: power(&spectra.reference),
            differenced: turned * turned,
            bins,
        }
    }

    /// Power of the reference, or a share of the gyros' if that is more.
    fn not_amplified(&self, scale: f64, alike: f64) -> f64 {
        self.reference.max(alike * self.gyros / scale)
    }

    /// Power by line.
    fn a_line(&self, of: fn(&Self) -> f64) -> f64 {
        of(self) / self.bins.len() as f64
    }
}

/// Noise of one side, each level that of its quietest quarter: white of rate and of angle, by line.
struct Floor {
    rate: f64,
    angle: f64,
}

impl Floor {
    fn of<'a>(
        quarters: impl Iterator<Item = &'a Quarter> + Clone,
        of: fn(&Quarter) -> f64,
    ) -> Self {
        let least = |power: i32| {
            let level = |one: &Quarter| one.a_line(of) / one.differenced.powi(power);
            quarters.clone().map(level).fold(f64::INFINITY, f64::min)
        };
        Self {
            rate: least(1),
            angle: least(2),
        }
    }

    fn at(&self, differenced: f64) -> f64 {
        (self.rate * differenced).max(self.angle * differenced * differenced)
    }
}

impl Spectra {
    /// Octaves below the line `top`, the highest first, with their quarters in motion.
    fn octaves(
        &self,
        (top, rows): (usize, usize),
        walk: f64,
        plan: &SameMotionPlan,
    ) -> Vec<Vec<Quarter>> {
        let quarters = |top: usize| -> Vec<Quarter> {
            let width = (top / 8).max(1);
            let all = (top / 2 + 1..top + 1).step_by(width).take(4);
            all.map(|first| first..(first + width).min(rows / 2 + 1))
                .map(|bins| Quarter::new(self, bins, rows))
                .collect()
        };
        let tops = std::iter::successors(Some(top), |top| Some(top / 2));
        let octaves: Vec<Vec<Quarter>> = tops
            .take_while(|top| top / 2 >= plan.least_bins)
            .map(quarters)
            .collect();
        let of_noise = |one: &&Quarter| one.bins.len() >= plan.noise_bins;
        let wide = || octaves.iter().flatten().filter(of_noise);
        let floor = |of: fn(&Quarter) -> f64| Floor::of(wide(), of);
        let [of_gyros, of_reference] = [floor(|one| one.gyros), floor(|one| one.reference)];
        let moves = |one: &Quarter| {
            let own = one.a_line(|one| one.gyros);
            let reference = one.a_line(|one| one.reference);
            own > plan.over_walk * walk * one.differenced
                || (own > plan.over_walk * of_gyros.at(one.differenced)
                    && reference > plan.over_walk * of_reference.at(one.differenced))
        };
        let moving = octaves.into_iter().map(|mut octave| {
            octave.retain(moves);
            octave
        });
        moving.filter(|octave| !octave.is_empty()).collect()
    }

    /// Effective number of lines of the gyros' power: the square of its sum over the sum of its squares.
    fn lines(&self, quarters: &[Quarter]) -> f64 {
        let (mut sum, mut squares) = (0.0, 0.0);
        for quarter in quarters {
            for bin in quarter.bins.clone() {
                let power = self.gyros.iter().map(|axis| axis[bin].norm_sqr());
                let power = power.sum::<f64>() / quarter.gyros;
                sum += power;
                squares += power * power;
            }
        }
        sum * sum / squares
    }

    /// Correlates an octave at every lag, each quarter of both sides having the power 1 and a weak one of the reference less.
    fn of_octave(&self, quarters: &[Quarter], scale: f64, lags: Lags, alike: f64) -> Correlations {
        correlations(lags.count, |gyro, axis, spectrum| {
            for quarter in quarters {
                let weight = 0.5 / (quarter.gyros * quarter.not_amplified(scale, alike)).sqrt();
                for bin in quarter.bins.clone() {
                    let product = self.gyros[gyro][bin] * self.reference[axis][bin].conj();
                    spectrum[bin] = product * weight;
                }
            }
        })
    }

    /// Computes the share of the gyros' power that a map of each octave explains, and the correlation over all octaves at
    /// every lag.
    ///
    /// # Inputs
    /// `scale`: ratio of the powers of gyros and reference, over all quarters in motion.
    fn share(
        &self,
        octaves: &[Vec<Quarter>],
        scale: f64,
        lags: Lags,
        plan: &SameMotionPlan,
    ) -> (Best, Vec<Matrix3<f64>>) {
        let quarters = octaves.iter().map(Vec::len).sum::<usize>() as f64;
        let mut share = vec![0.0; lags.count];
        let mut over_all = vec![Matrix3::zeros(); lags.count];
        for octave in octaves {
            let by_lag = self.of_octave(octave, scale, lags, plan.alike);
            let inverse = self.inverse(octave, scale, plan.alike);
            for lag in 0..lags.count {
                let correlation = matrix(&by_lag, lag);
                over_all[lag] += correlation;
                let of_gyro = |gyro: usize| {
                    let row: RowVector3<f64> = correlation.row(gyro).into();
                    (row * inverse * row.transpose())[(0, 0)]
                };
                share[lag] += (0..3).map(of_gyro).sum::<f64>() / quarters;
            }
        }
        (lags.best(&share, f64::INFINITY, plan), over_all)
    }

    /// Computes the log-likelihood by line of one orthogonal map for all octaves.
    ///
    /// # Inputs
    /// `over_all`: correlation over all octaves at every lag.
    fn likelihood(
        &self,
        octaves: &[Vec<Quarter>],
        mut over_all: Vec<Matrix3<f64>>,
        (scale, lags): (f64, Lags),
        plan: &SameMotionPlan,
    ) -> Best {
        for map in &mut over_all {
            let parts = map.svd(true, true);
            *map = match (parts.u, parts.v_t) {
                (Some(u), Some(v_t)) => u * v_t,
                _ => Matrix3::zeros(),
            };
        }
        // Correlated once more: kept for all octaves they would take hundreds of megabytes.
        let mut likelihood = vec![0.0; lags.count];
        for octave in octaves {
            let by_lag = self.of_octave(octave, scale, lags, plan.alike);
            let count = octave.len() as f64;
            let lines = count.min(self.lines(octave));
            for (lag, map) in over_all.iter().enumerate() {
                let explained = (map.dot(&matrix(&by_lag, lag)) / count)
                    .clamp(0.0, 1.0)
                    .powi(2);
                likelihood[lag] -= lines * (-(1.0 - plan.least_left) * explained).ln_1p();
            }
        }
        lags.best(&likelihood, f64::INFINITY, plan)
    }

    /// Inverse power of the reference's axes in an octave, with a ridge.
    fn inverse(&self, quarters: &[Quarter], scale: f64, alike: f64) -> Matrix3<f64> {
        let own = Matrix3::from_fn(|a, b| -> f64 {
            let of_quarter = |quarter: &Quarter| -> f64 {
                let product =
                    |bin: usize| (self.reference[a][bin].conj() * self.reference[b][bin]).re;
                let sum: f64 = quarter.bins.clone().map(product).sum();
                sum / quarter.not_amplified(scale, alike)
            };
            quarters.iter().map(of_quarter).sum()
        });
        let ridge = Matrix3::identity() * (alike * quarters.len() as f64 / 3.0);
        let Some(inverse) = (own + ridge).try_inverse() else {
            unreachable!("a ridge has an inverse");
        };
        inverse
    }
}
