//! Derivatives and delays of row values in the frequency domain.
//!
//! Finite differences of increments are wrong by percents near half the row rate; a spectrum is exact up to it. Ends are
//! reflected and tapered for a periodic record.

use std::f64::consts::{PI, TAU};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealToComplex};

use crate::transforms::{self, even_smooth_length};

/// Spectrum of a record of row means (or increments).
pub struct Spectrum {
    values: Vec<Complex64>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    /// Kept alive, so that the plan is shared with the next record of this length.
    _forward: Arc<dyn RealToComplex<f64>>,
    /// Attenuation of each frequency in a row's mean, none below [`LEAST_SINC`].
    means: OnceLock<Arc<[f64]>>,
    rows: usize,
    padded: usize,
    pad: usize,
    rate_hz: f64,
}

/// Attenuations of records of one padded length and row rate.
struct Attenuations {
    padded: usize,
    rate_hz: f64,
    held: Weak<[f64]>,
}

/// Attenuations in use.
static MEANS: Mutex<Vec<Attenuations>> = Mutex::new(Vec::new());

/// Attenuation of each frequency in a row's mean; a sine of each costs as much as a transform, so that they are shared while
/// in use.
fn attenuations(padded: usize, rate_hz: f64) -> Arc<[f64]> {
    let mut known = MEANS.lock().unwrap_or_else(PoisonError::into_inner);
    known.retain(|one| one.held.strong_count() > 0);
    let mut same = known
        .iter()
        .filter(|one| (one.padded, one.rate_hz) == (padded, rate_hz));
    if let Some(held) = same.find_map(|one| one.held.upgrade()) {
        return held;
    }
    let fresh: Arc<[f64]> = (0..=padded / 2)
        .map(|k| {
            let hz = k as f64 / padded as f64 * rate_hz;
            let angle = PI * hz / rate_hz;
            let sinc = if angle == 0.0 {
                1.0
            } else {
                angle.sin() / angle
            };
            sinc.max(LEAST_SINC)
        })
        .collect();
    known.push(Attenuations {
        padded,
        rate_hz,
        held: Arc::downgrade(&fresh),
    });
    fresh
}

/// Padding rows on either side.
const PAD_ROWS: usize = 2048;

/// Least inverted factor of the row mean: a smaller one would amplify noise needlessly.
const LEAST_SINC: f64 = 0.5;

impl Spectrum {
    /// Transforms `values` of rows at `rate_hz`.
    pub fn new(values: &[f64], rate_hz: f64) -> Self {
        let rows = values.len();
        let pad = PAD_ROWS.min(rows.saturating_sub(2));
        let padded = even_smooth_length(rows + 2 * pad);
        let mut record = vec![0.0; padded];
        for row in 0..pad {
            let taper = 0.5 - 0.5 * (PI * row as f64 / pad as f64).cos();
            record[row] = taper * (2.0 * values[0] - values[pad - row]);
            record[pad + rows + pad - 1 - row] =
                taper * (2.0 * values[rows - 1] - values[rows - 1 - (pad - row)]);
        }
        record[pad..pad + rows].copy_from_slice(values);
        let forward = transforms::forward(padded);
        let mut spectrum = forward.make_output_vec();
        forward
            .process(&mut record, &mut spectrum)
            .expect("lengths as planned");
        Self {
            values: spectrum,
            means: OnceLock::new(),
            inverse: transforms::inverse(padded),
            _forward: forward,
            rows,
            padded,
            pad,
            rate_hz,
        }
    }

    /// Filters the record by a linear system.
    ///
    /// # Inputs
    /// `response`: frequency response at a frequency \[Hz\] from 0 to half the row rate.
    pub fn through(&self, response: impl Fn(f64) -> Complex64) -> Vec<f64> {
        let filtered = self.values.iter().enumerate();
        self.rows_of(
            filtered
                .map(|(k, value)| value * response(self.frequency_hz(k)))
                .collect(),
        )
    }

    /// Filters a weighted sum of records of one length by a linear system.
    ///
    /// # Inputs
    /// `records`: each with its weight; `response`: as of [`Spectrum::through`].
    ///
    /// # Panics
    /// There is no record, or one has other rows.
    pub fn sum_through(records: &[(&Self, f64)], response: impl Fn(f64) -> Complex64) -> Vec<f64> {
        let (first, _) = records[0];
        let filtered = (0..first.values.len()).map(|k| {
            let each = records
                .iter()
                .map(|(record, weight)| record.values[k] * *weight);
            each.sum::<Complex64>() * response(first.frequency_hz(k))
        });
        first.rows_of(filtered.collect())
    }

    fn rows_of(&self, mut spectrum: Vec<Complex64>) -> Vec<f64> {
        spectrum[0].im = 0.0;
        let last = spectrum.len() - 1;
        spectrum[last].im = 0.0;
        let mut record = self.inverse.make_output_vec();
        self.inverse
            .process(&mut spectrum, &mut record)
            .expect("lengths as planned");
        let scale = 1.0 / self.padded as f64;
        record[self.pad..self.pad + self.rows]
            .iter()
            .map(|value| value * scale)
            .collect()
    }

    /// The n-th derivative of the row means \[per sⁿ\], as row means.
    pub fn mean_derivative(&self, order: i32) -> Vec<f64> {
        self.through(|hz| Complex64::new(0.0, TAU * hz).powi(order))
    }

    /// The n-th derivative at row middles \[per sⁿ\].
    pub fn middle_derivative(&self, order: i32) -> Vec<f64> {
        self.middle_derivative_behind(order, |_| Complex64::new(1.0, 0.0))
    }

    /// The n-th derivative at row middles after a linear system, given by its response at a frequency \[Hz\].
    pub fn middle_derivative_behind(
        &self,
        order: i32,
        response: impl Fn(f64) -> Complex64,
    ) -> Vec<f64> {
        let means = self
            .means
            .get_or_init(|| attenuations(self.padded, self.rate_hz));
        let both = self.values.iter().zip(means.iter()).enumerate();
        self.rows_of(
            both.map(|(k, (value, mean))| {
                let hz = self.frequency_hz(k);
                value * (response(hz) * Complex64::new(0.0, TAU * hz).powi(order) / mean)
            })
            .collect(),
        )
    }

    /// Delays the record by `delay_s`.
    pub fn delayed(&self, delay_s: f64) -> Vec<f64> {
        self.through(|hz| Complex64::from_polar(1.0, -TAU * hz * delay_s))
    }

    /// Power summed to the nearest of ascending frequencies \[Hz\].
    pub fn binned_power(&self, hz: &[f64]) -> Vec<f64> {
        let mut power = vec![0.0; hz.len()];
        for (k, value) in self.values.iter().enumerate() {
            let at = self.frequency_hz(k);
            let after = hz.partition_point(|other| *other <= at);
            let near = match after {
                0 => 0,
                _ if after == hz.len() => after - 1,
                _ if at - hz[after - 1] < hz[after] - at => after - 1,
                _ => after,
            };
            power[near] += value.norm_sqr();
        }
        power
    }

    /// Median frequency of the power of the n-th derivative \[Hz\]; 0 where nothing moves.
    pub fn median_hz(&self, order: i32) -> f64 {
        let power = |(k, value): (usize, &Complex64)| {
            value.norm_sqr() * (TAU * self.frequency_hz(k)).powi(2 * order)
        };
        let half = 0.5 * self.values.iter().enumerate().map(power).sum::<f64>();
        let mut below = 0.0;
        let reached = self.values.iter().enumerate().position(|one| {
            below += power(one);
            below >= half
        });
        self.frequency_hz(reached.unwrap_or(0))
    }

    fn frequency_hz(&self, k: usize) -> f64 {
        k as f64 / self.padded as f64 * self.rate_hz
    }
}

/// Computes row means from mid-row values.
///
/// By (δ/2)/asinh(δ/2) = 1 + δ²/24 − 17 δ⁴/5760 + 367 δ⁶/967680, δ the central difference; accurate to 0.7 % for a sine of
/// three tenths of the row rate.
pub fn row_means(at_middles: &[f64]) -> Vec<f64> {
    const SECOND: f64 = 1.0 / 24.0;
    const FOURTH: f64 = -17.0 / 5760.0;
    const SIXTH: f64 = 367.0 / 967_680.0;
    const WEIGHTS: [f64; 4] = [
        1.0 - 2.0 * SECOND + 6.0 * FOURTH - 20.0 * SIXTH,
        SECOND - 4.0 * FOURTH + 15.0 * SIXTH,
        FOURTH - 6.0 * SIXTH,
        SIXTH,
    ];
    let last = at_middles.len().saturating_sub(1);
    let pair = |row: usize, away: usize| {
        let before = at_middles[row.saturating_sub(away)];
        WEIGHTS[away] * (before + at_middles[(row + away).min(last)])
    };
    let mean = |row: usize| {
        let pairs = pair(row, 1) + pair(row, 2) + pair(row, 3);
        WEIGHTS[0] * at_middles[row] + pairs
    };
    let inside = at_middles.windows(7).map(|near| {
        let pairs = WEIGHTS[1] * (near[2] + near[4])
            + WEIGHTS[2] * (near[1] + near[5])
            + WEIGHTS[3] * (near[0] + near[6]);
        WEIGHTS[0] * near[3] + pairs
    });
    let rows = at_middles.len();
    let edge = 3.min(rows);
    let mut means = Vec::with_capacity(rows);
    means.extend((0..edge).map(mean));
    means.extend(inside);
    means.extend((means.len()..rows).map(mean));
    means
}

#[cfg(test)]
mod tests {
    use super::{Spectrum, row_means};
    use std::f64::consts::TAU;

    /// Row means of sin(2π f t) at 100 rows a second, with their middles.
    fn sine(hz: f64, rows: usize) -> (Vec<f64>, impl Fn(usize) -> f64) {
        let angle = move |row: f64| -(TAU * hz * row / 100.0).cos() / (TAU * hz) * 100.0;
        let means = (0..rows).map(|row| angle(row as f64 + 1.0) - angle(row as f64));
        (means.collect(), move |row| (row as f64 + 0.5) / 100.0)
    }

    #[test]
    fn derivatives_and_delays_of_a_sine_are_those_of_calculus() {
        for hz in [0.7, 7.0, 23.0] {
            let (means, middle_s) = sine(hz, 6000);
            let spectrum = Spectrum::new(&means, 100.0);
            let w = TAU * hz;
            let rate = spectrum.middle_derivative(0);
            let acceleration = spectrum.middle_derivative(1);
            let jerk = spectrum.mean_derivative(2);
            let delayed = spectrum.delayed(3e-3);
            let attenuation = (w / 200.0).sin() / (w / 200.0);
            for row in 500..5500 {
                let t = middle_s(row);
                assert!((rate[row] - (w * t).sin()).abs() < 2e-3, "{hz} {row}");
                assert!((acceleration[row] / w - (w * t).cos()).abs() < 2e-3);
                assert!((jerk[row] / w / w + attenuation * (w * t).sin()).abs() < 2e-3);
                let late = attenuation * (w * (t - 3e-3)).sin();
                assert!((delayed[row] - late).abs() < 2e-3);
            }
        }
    }

    #[test]
    fn means_over_rows_come_back_from_their_middles() {
        let (means, middle_s) = sine(20.0, 400);
        let middles: Vec<f64> = (0..400)
            .map(|row| (TAU * 20.0 * middle_s(row)).sin())
            .collect();
        for (row, value) in row_means(&middles).iter().enumerate().take(390).skip(10) {
            assert!((value - means[row]).abs() < 2e-3, "{value} {}", means[row]);
        }
    }
}
