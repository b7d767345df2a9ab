//! Maximum-likelihood amplitude, phase and frequency of a line with a wandering phase.
//!
//! A line is Re(a exp(iθ)) with θ = 2π f t + Σ c_d P_d(2t/T − 1), P Legendre's polynomials: the first is a frequency, the
//! second its drift. A weighted residual is demodulated by the known phase and summed in blocks too short for a turn of any
//! polynomial; a few parameters remain.

use nalgebra::{DMatrix, DVector};
use realfft::num_complex::Complex64;

use crate::linear::pseudo_inverse;
use crate::periodogram::Weighed;

/// Number of blocks.
const BLOCKS: usize = 256;

/// Demodulated sums of several weighted residuals.
pub struct Baseband {
    /// Middle of each block, from −1 to 1.
    places: Vec<f64>,
    /// Sum of each record in each block.
    sums: Vec<Vec<Complex64>>,
    /// Fisher information on each record's amplitude in each block.
    weights: Vec<Vec<f64>>,
}

/// A fitted line.
#[derive(Debug, Clone)]
pub struct Course {
    /// Coefficients of Legendre's polynomials from the first on \[rad\], beyond the demodulated phase.
    pub polynomial: Vec<f64>,
    /// Covariance of the coefficients.
    pub covariance: DMatrix<f64>,
    /// Amplitude and phase in each record.
    pub amplitudes: Vec<Complex64>,
    /// Standard deviation of either part of each amplitude.
    pub stds: Vec<f64>,
    /// 2 Δ ln L in each record.
    pub gains: Vec<f64>,
}

impl Course {
    /// 2 Δ ln L in all records together.
    pub fn gain(&self) -> f64 {
        self.gains.iter().sum()
    }
}

/// Σ c_d P_d(x), d from 1 on.
pub fn legendre(coefficients: &[f64], x: f64) -> f64 {
    let (mut before, mut now) = (1.0, x);
    let mut sum = 0.0;
    for (place, coefficient) in coefficients.iter().enumerate() {
        sum += coefficient * now;
        let degree = (place + 1) as f64;
        let next = ((2.0 * degree + 1.0) * x * now - degree * before) / (degree + 1.0);
        (before, now) = (now, next);
    }
    sum
}

impl Baseband {
    /// Demodulates records and sums them in blocks.
    ///
    /// # Inputs
    /// `phase_rad`: phase at each row; `share`: the line's frequency as a share of the row rate.
    pub fn new(
        records: &[&Weighed],
        seen: &[bool],
        share: f64,
        phase_rad: impl Fn(usize) -> f64,
    ) -> Self {
        let rows = seen.len();
        let length = rows.div_ceil(BLOCKS);
        let mut places = Vec::new();
        let mut sums = vec![Vec::new(); records.len()];
        let mut weights = vec![Vec::new(); records.len()];
        for begin in (0..rows).step_by(length) {
            let mut each = vec![Complex64::ZERO; records.len()];
            let (mut count, mut middle) = (0.0, 0.0);
            for row in (begin..(begin + length).min(rows)).filter(|&row| seen[row]) {
                let turn = Complex64::cis(-phase_rad(row));
                for (sum, record) in each.iter_mut().zip(records) {
                    *sum += turn * record.rows[row];
                }
                count += 1.0;
                middle += row as f64 + 0.5;
            }
            if count == 0.0 {
                continue;
            }
            places.push(2.0 * middle / count / rows as f64 - 1.0);
            for (record, sum) in each.into_iter().enumerate() {
                sums[record].push(sum);
                weights[record].push(0.5 * count / records[record].noise(share));
            }
        }
        Self {
            places,
            sums,
            weights,
        }
    }

    /// Fits a course of a degree from the end of another (Gauss–Newton).
    pub fn fit(&self, degree: usize, from: &[f64]) -> Course {
        const MOST_STEPS: usize = 20;
        /// Step size at convergence \[rad\].
        const SETTLED: f64 = 1e-4;
        let mut polynomial = from.to_vec();
        polynomial.resize(degree, 0.0);
        let mut best = self.at(polynomial);
        let steps = if degree > 0 { MOST_STEPS } else { 0 };
        for _ in 0..steps {
            let step = &best.covariance * self.slope(&best);
            let mut share = 1.0;
            let next = loop {
                let pairs = best.polynomial.iter().zip(step.iter());
                let tried = self.at(pairs.map(|(c, step)| c + share * step).collect());
                if tried.gain() >= best.gain() {
                    break Some(tried);
                }
                share *= 0.5;
                if share < 1e-3 {
                    break None;
                }
            };
            let Some(next) = next else { break };
            best = next;
            if step.amax() < SETTLED {
                break;
            }
        }
        best
    }

    /// Fits courses of every degree up to `most`, and selects one by penalised likelihood, `price` in ln L per coefficient.
    pub fn fit_wandering(&self, most: usize, price: f64) -> Course {
        let worth = |course: &Course| 0.5 * course.gain() - price * course.polynomial.len() as f64;
        let mut best = self.fit(1, &[]);
        let mut last = best.clone();
        for degree in 2..=most {
            last = self.fit(degree, &last.polynomial);
            if worth(&last) > worth(&best) {
                best = last.clone();
            }
        }
        best
    }

    /// Amplitudes under a course.
    fn at(&self, polynomial: Vec<f64>) -> Course {
        let each = self.sums.iter().zip(&self.weights);
        let fitted = each.map(|(sums, weights)| {
            let pairs = sums.iter().zip(&self.places);
            let sum: Complex64 = pairs
                .map(|(sum, &x)| sum * Complex64::cis(-legendre(&polynomial, x)))
                .sum();
            let weight: f64 = weights.iter().sum();
            (sum / weight, weight.sqrt().recip(), sum.norm_sqr() / weight)
        });
        let (mut amplitudes, mut stds, mut gains) = (Vec::new(), Vec::new(), Vec::new());
        for (amplitude, std, gain) in fitted {
            amplitudes.push(amplitude);
            stds.push(std);
            gains.push(gain);
        }
        let covariance = pseudo_inverse(&self.information(&amplitudes, polynomial.len()));
        Course {
            polynomial,
            covariance,
            amplitudes,
            stds,
            gains,
        }
    }

    /// Polynomials in each block less their weighted means, which belong to the amplitudes' phases.
    fn shapes(&self, degree: usize, weights: &[f64]) -> Vec<Vec<f64>> {
        let total: f64 = weights.iter().sum();
        let unit = |place: usize| {
            let mut unit = vec![0.0; degree];
            unit[place] = 1.0;
            unit
        };
        let of = |place: usize| {
            let unit = unit(place);
            let mut values: Vec<f64> = self.places.iter().map(|&x| legendre(&unit, x)).collect();
            let pairs = values.iter().zip(weights);
            let mean = pairs.map(|(value, weight)| value * weight).sum::<f64>() / total;
            values.iter_mut().for_each(|value| *value -= mean);
            values
        };
        (0..degree).map(of).collect()
    }

    fn information(&self, amplitudes: &[Complex64], degree: usize) -> DMatrix<f64> {
        let mut information = DMatrix::zeros(degree, degree);
        for (amplitude, weights) in amplitudes.iter().zip(&self.weights) {
            let shapes = self.shapes(degree, weights);
            for (a, of_a) in shapes.iter().enumerate() {
                for (b, of_b) in shapes.iter().enumerate() {
                    let products = of_a.iter().zip(of_b).zip(weights);
                    let sum: f64 = products.map(|((a, b), weight)| a * b * weight).sum();
                    information[(a, b)] += amplitude.norm_sqr() * sum;
                }
            }
        }
        information
    }

    fn slope(&self, course: &Course) -> DVector<f64> {
        let degree = course.polynomial.len();
        let mut slope = DVector::zeros(degree);
        let records = self.sums.iter().zip(&self.weights).zip(&course.amplitudes);
        for ((sums, weights), amplitude) in records {
            let shapes = self.shapes(degree, weights);
            for (block, (sum, &x)) in sums.iter().zip(&self.places).enumerate() {
                let turned = sum * Complex64::cis(-legendre(&course.polynomial, x));
                let across = (amplitude.conj() * turned).im;
                for (slope, shape) in slope.iter_mut().zip(&shapes) {
                    *slope += across * shape[block];
                }
            }
        }
        slope
    }

    /// Share of a line's power in `pieces` of the record explained by one phase \[1\].
    pub fn coherence(&self, course: &Course, pieces: usize) -> f64 {
        let length = self.places.len().div_ceil(pieces).max(1);
        let (mut whole, mut parts) = (0.0, 0.0);
        for (sums, weights) in self.sums.iter().zip(&self.weights) {
            // Sums are weighted by the inverse noise power: their squares are signal over noise.
            let weight: f64 = weights.iter().sum();
            let turned: Vec<Complex64> = sums
                .iter()
                .zip(&self.places)
                .map(|(sum, &x)| sum * Complex64::cis(-legendre(&course.polynomial, x)))
                .collect();
            let each: Vec<Complex64> = turned
                .chunks(length)
                .map(|chunk| chunk.iter().sum())
                .collect();
            let sum: Complex64 = each.iter().sum();
            whole += sum.norm_sqr() / weight / each.len() as f64;
            parts += each.iter().map(|part| part.norm_sqr()).sum::<f64>() / weight;
        }
        whole / parts.max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::{Baseband, legendre};
    use crate::periodogram::Weighed;
    use crate::transform::Transform;
    use crate::{NoiseLevels, Observations};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use std::f64::consts::TAU;

    const ROWS: usize = 8000;
    const TURN: f64 = TAU * 0.0613;

    /// Pulls of amplitude and frequency of a line of amplitude 0.3 with a drifting phase, and the number of its
    /// coefficients.
    fn fitted(seed: u64, drift_rad: f64) -> ([f64; 2], usize) {
        let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let noise: Vec<f64> = StandardNormal.sample_iter(rng).take(ROWS).collect();
        let record: Vec<f64> = (0..ROWS)
            .map(|row| {
                let at = row as f64 + 0.5;
                let wander = legendre(&[0.0, drift_rad], 2.0 * at / ROWS as f64 - 1.0);
                noise[row] + 0.3 * (TURN * at + wander + 0.4).cos()
            })
            .collect();
        let seen: Vec<bool> = (0..ROWS).map(|row| row % 1000 < 800).collect();
        let levels = NoiseLevels {
            white: 1.0,
            ..NoiseLevels::default()
        };
        let observations = Observations::bridged(&seen).expect("rows enough");
        let (transform, basis) = Transform::with_basis(observations, levels);
        let weighed = Weighed::new(&record, &seen, (&transform, &basis), levels);
        // Demodulated by half a resolution too much.
        let off = 0.5 * TAU / ROWS as f64;
        let turned = |row: usize| (TURN + off) * (row as f64 + 0.5);
        let baseband = Baseband::new(&[&weighed], &seen, 0.0613, turned);
        let course = baseband.fit_wandering(6, 0.5 * (ROWS as f64).ln());
        let frequency = course.polynomial[0] + 0.5 * off * ROWS as f64;
        let pulls = [
            (course.amplitudes[0].norm() - 0.3) / course.stds[0],
            frequency / course.covariance[(0, 0)].sqrt(),
        ];
        (pulls, course.polynomial.len())
    }

    #[test]
    fn amplitude_and_frequency_lie_within_their_intervals_and_a_drift_is_followed_where_there_is_one()
     {
        for (first, drift_rad, degree) in [(0, 0.0, 1), (50, 1.5, 2)] {
            let each: Vec<_> = (first..first + 20)
                .map(|seed| fitted(seed, drift_rad))
                .collect();
            for part in 0..2 {
                let squares = each.iter().map(|(pulls, _)| pulls[part].powi(2));
                let rms = (squares.sum::<f64>() / 20.0).sqrt();
                // Four standard deviations of the root mean square of 20 normal numbers.
                assert!((0.37..1.63).contains(&rms), "{drift_rad} {part}: {rms}");
            }
            // A price of 4.5 in ln L is exceeded by chance for one coefficient in 370.
            let as_put_in = each.iter().filter(|(_, found)| *found == degree).count();
            assert!(as_put_in >= 18, "{drift_rad}: {as_put_in}");
        }
    }

    #[test]
    fn polynomials_are_those_of_legendre() {
        // P_4(x) = (35 x⁴ − 30 x² + 3)/8.
        let x = 0.3_f64;
        let expected = (35.0 * x.powi(4) - 30.0 * x * x + 3.0) / 8.0;
        assert!((legendre(&[0.0, 0.0, 0.0, 1.0], x) - expected).abs() < 1e-15);
    }
}
