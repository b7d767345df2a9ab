//! Frequency and amplitudes of a line of largest likelihood, from windowed spectra of three channels.

use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

use realfft::RealToComplex;
use realfft::num_complex::Complex64;

use crate::axes::Triad;
use crate::quantiles::median;
use crate::stops::runs;
use crate::transforms;

/// A line of the gyros.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnLine {
    /// Frequency and its standard deviation \[Hz\].
    pub hz: [f64; 2],
    /// Increment of each row: the real part of this times e^(iφ), φ = 2π hz t in the middle of the row, t from the first row's
    /// begin \[rad\].
    pub amplitude_rad: [Complex64; 3],
    /// Standard deviation of either part \[rad\].
    pub std_rad: f64,
    /// 2 Δ ln L.
    pub gain: f64,
    /// True where the motion hides on both sides which has it.
    pub is_hidden: bool,
}

impl OwnLine {
    /// Its increments on every row of each gyro \[rad\].
    pub fn rows_rad(&self, rows: usize, rate_hz: f64) -> Triad {
        let turn = |row: usize| Complex64::cis(phase_rad(self.hz[0] / rate_hz, row));
        self.amplitude_rad
            .map(|amplitude| (0..rows).map(|row| (amplitude * turn(row)).re).collect())
    }
}

/// Phase in the middle of a row of a line at a share of the row rate \[rad\].
pub(crate) fn phase_rad(share: f64, row: usize) -> f64 {
    TAU * (share * (row as f64 + 0.5)).fract()
}

/// Spectra of three channels.
pub(crate) type Spectra = [Vec<Complex64>; 3];

/// Power of three channels by bin.
pub(crate) fn powers(spectra: &Spectra, bins: &Range<usize>) -> Vec<f64> {
    let power = |bin: usize| spectra.iter().map(|axis| axis[bin].norm_sqr()).sum();
    bins.clone().map(power).collect()
}

/// Median power of some bins; 0 without one.
pub(crate) fn median_power(powers: &[f64]) -> f64 {
    median(powers.iter().copied()).unwrap_or(0.0)
}

/// Sum of e^(2πi f k) over `count` values of k about 0, f in turns.
fn dirichlet(turns: f64, count: usize) -> f64 {
    match (PI * turns).sin() {
        0.0 => count as f64,
        sine => (PI * turns * count as f64).sin() / sine,
    }
}

/// Hann's window over the rows that are seen.
pub(crate) struct Window {
    weights: Vec<f64>,
    /// Runs of these rows.
    runs: Vec<Range<usize>>,
    fourier: Arc<dyn RealToComplex<f64>>,
}

impl Window {
    pub(crate) fn new(seen: &[bool]) -> Self {
        let rows = seen.len() as f64;
        let weight = |(row, seen): (usize, &bool)| match seen {
            true => 0.5 - 0.5 * (TAU * (row as f64 + 0.5) / rows).cos(),
            false => 0.0,
        };
        Self {
            weights: seen.iter().enumerate().map(weight).collect(),
            runs: runs(seen),
            fourier: transforms::forward(seen.len()),
        }
    }

    /// Spectrum without the mean of the rows that are seen: a gross bias would leak through the rows that are not.
    pub(crate) fn spectrum(&self, values: &[f64]) -> Vec<Complex64> {
        let fourier = &self.fourier;
        let mut record = fourier.make_input_vec();
        let weighed = values.iter().zip(&self.weights);
        let sum: f64 = weighed.map(|(value, weight)| value * weight).sum();
        let mean = sum / self.weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        for ((slot, value), weight) in record.iter_mut().zip(values).zip(&self.weights) {
            *slot = (value - mean) * weight;
        }
        let mut spectrum = fourier.make_output_vec();
        if fourier.process(&mut record, &mut spectrum).is_err() {
            unreachable!("both buffers are as long as planned");
        }
        spectrum
    }

    /// Spectrum, in some bins, of the windowed e^(iφ) at a share of the row rate: Hann's window is a constant and two turns,
    /// so that each run of rows is a sum of three geometric series.
    fn of_line(&self, share: f64, bins: &Range<usize>) -> Vec<Complex64> {
        let rows = self.weights.len() as f64;
        let one = |bin: usize| -> Complex64 {
            let away = share * rows - bin as f64;
            let series = [(0.5, 0.0), (-0.25, 1.0), (-0.25, -1.0)].map(|(weight, aside)| {
                let turns = (away + aside) / rows;
                let begin = Complex64::cis(PI * (share + aside / rows));
                let of_run = |run: &Range<usize>| {
                    let (first, last) = (run.start as f64, run.end as f64 - 1.0);
                    Complex64::cis(PI * turns * (first + last)) * dirichlet(turns, run.len())
                };
                begin * weight * self.runs.iter().map(of_run).sum::<Complex64>()
            });
            series.into_iter().sum()
        };
        bins.clone().map(one).collect()
    }

    /// Fits a line about a place of a residual, whose bins count from `first`.
    ///
    /// # Returns
    /// The line, and the share of the peak's power that it explains.
    pub(crate) fn fit(
        &self,
        left: &Spectra,
        at: usize,
        first: usize,
        rate_hz: f64,
    ) -> (OwnLine, f64) {
        /// Bins on either side of the peak: Hann's window has two.
        const ASIDE: usize = 3;
        /// Variance of an amplitude under Hann's window over that of neighbours without correlation: N Σw⁴/(Σw²)².
        const HANN: f64 = 35.0 / 18.0;
        /// Golden sections: to 1e-6 of a bin.
        const SECTIONS: usize = 32;
        let rows = self.weights.len() as f64;
        let count = left[0].len();
        let own = at.saturating_sub(ASIDE)..(at + ASIDE + 1).min(count);
        let bins = own.start + first..own.end + first;
        // The likelihood is that of the power of three channels: their median is 2.67 times the mean of one.
        let noise = median_power(&powers(left, &(0..count))) / 2.674 * HANN;
        let at_share = |share: f64| {
            let line = self.of_line(share, &bins);
            let energy: f64 = line.iter().map(|value| value.norm_sqr()).sum();
            let along = [0, 1, 2].map(|axis: usize| -> Complex64 {
                let pairs = line.iter().zip(&left[axis][own.clone()]);
                pairs.map(|(line, value)| line.conj() * value).sum()
            });
            (along, energy)
        };
        let log_likelihood = |bin: f64| {
            let (along, energy) = at_share(bin / rows);
            along.iter().map(|one| one.norm_sqr()).sum::<f64>() / energy / noise
        };
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut from, mut to) = ((first + at) as f64 - 1.0, (first + at) as f64 + 1.0);
        for _ in 0..SECTIONS {
            let [low, high] = [to - golden * (to - from), from + golden * (to - from)];
            match log_likelihood(low) > log_likelihood(high) {
                true => to = high,
                false => from = low,
            }
        }
        let bin = 0.5 * (from + to);
        const STEP: f64 = 0.05;
        let best = log_likelihood(bin);
        let beside = log_likelihood(bin - STEP) + log_likelihood(bin + STEP);
        let curvature = (2.0 * best - beside) / (STEP * STEP);
        let (along, energy) = at_share(bin / rows);
        let power: f64 = powers(left, &own).iter().sum();
        let line = OwnLine {
            hz: [bin, curvature.max(f64::MIN_POSITIVE).sqrt().recip()]
                .map(|bin| bin * rate_hz / rows),
            // Half of a cosine's power is at the negative frequency.
            amplitude_rad: along.map(|one| 2.0 * one / energy),
            std_rad: (2.0 * noise / energy).sqrt(),
            gain: 2.0 * best,
            is_hidden: false,
        };
        (line, best * noise / power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spectrum_of_a_line_is_that_of_its_windowed_rows() {
        const ROWS: usize = 600;
        let seen: Vec<bool> = (0..ROWS)
            .map(|row| row % 97 > 4 && !(200..260).contains(&row))
            .collect();
        let window = Window::new(&seen);
        for share in [20.3 / 600.0, 20.0 / 600.0] {
            let bins = 17..24;
            let series = window.of_line(share, &bins);
            for (bin, of_series) in bins.zip(series) {
                let back = bin as f64 / ROWS as f64;
                let turn = |row: usize| phase_rad(share, row) - TAU * back * row as f64;
                let each = (0..ROWS).map(|row| Complex64::cis(turn(row)) * window.weights[row]);
                let of_rows: Complex64 = each.sum();
                assert!(
                    (of_rows - of_series).norm() < 1e-9,
                    "{bin}: {of_rows} {of_series}"
                );
            }
        }
    }
}
