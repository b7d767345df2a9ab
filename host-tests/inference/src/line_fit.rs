//! Least-squares fit of a line with its exact columns, for few turns and long gaps.
//!
//! [`crate::phase_course`] assumes orthogonal sine and cosine and ignores gap rows. For a line of some ten turns neither
//! holds: here the columns undergo the same transform as the records.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use realfft::num_complex::Complex64;

use crate::linear::{dot, pseudo_inverse};
use crate::phase_course::{Course, legendre};
use crate::transform::Transform;

/// Records of a line.
pub struct Shown<'a> {
    /// Coefficients of each record, including the line.
    pub spectra: &'a [Vec<f64>],
    /// 1/S of each coefficient.
    pub weights: &'a [&'a [f64]],
}

/// Normal equations of a record for a line's columns: cosine and sine of its phase times each polynomial from the constant
/// on.
struct Sums {
    gram: DMatrix<f64>,
    moments: DVector<f64>,
}

impl Shown<'_> {
    /// Fits amplitudes and the phase polynomials from the first on (Gauss–Newton).
    ///
    /// # Inputs
    /// `phase_rad`: initial phase at each of the record's `rows`; `degree`: number of phase polynomials, 0 for a known
    /// phase.
    pub fn fit(
        &self,
        transform: &Transform,
        rows: usize,
        degree: usize,
        phase_rad: impl Fn(usize) -> f64 + Sync,
    ) -> Course {
        const MOST_STEPS: usize = 4;
        /// Step size at convergence \[rad\].
        const SETTLED: f64 = 1e-4;
        let mut polynomial = vec![0.0; degree];
        let mut covariance = DMatrix::zeros(degree, degree);
        let mut sums = self.sums(transform, rows, &polynomial, &phase_rad);
        for _ in 0..if degree > 0 { MOST_STEPS } else { 0 } {
            let (step, of_step) = step(&sums, degree);
            covariance = of_step;
            for (coefficient, step) in polynomial.iter_mut().zip(step.iter()) {
                *coefficient += step;
            }
            sums = self.sums(transform, rows, &polynomial, &phase_rad);
            if step.amax() < SETTLED {
                break;
            }
        }
        let mut course = Course {
            polynomial,
            covariance,
            amplitudes: Vec::new(),
            stds: Vec::new(),
            gains: Vec::new(),
        };
        for one in &sums {
            let (amplitude, inverse) = amplitude(one);
            let parts = DVector::from_vec(vec![amplitude.re, -amplitude.im]);
            course.amplitudes.push(amplitude);
            course.stds.push((0.5 * inverse.trace()).max(0.0).sqrt());
            course.gains.push(parts.dot(&one.moments.rows(0, 2)));
        }
        course
    }

    fn sums(
        &self,
        transform: &Transform,
        rows: usize,
        polynomial: &[f64],
        phase_rad: &(impl Fn(usize) -> f64 + Sync),
    ) -> Vec<Sums> {
        let place = |row: usize| 2.0 * (row as f64 + 0.5) / rows as f64 - 1.0;
        let turns: Vec<Complex64> = (0..rows)
            .map(|row| Complex64::cis(phase_rad(row) + legendre(polynomial, place(row))))
            .collect();
        let columns: Vec<Vec<f64>> = (0..2 * (polynomial.len() + 1))
            .into_par_iter()
            .map(|column| {
                let mut unit = vec![0.0; column / 2];
                if let Some(last) = unit.last_mut() {
                    *last = 1.0;
                }
                let values: Vec<f64> = (0..rows)
                    .map(|row| {
                        let shape = if column < 2 {
                            1.0
                        } else {
                            legendre(&unit, place(row))
                        };
                        let turn = turns[row];
                        shape
                            * if column.is_multiple_of(2) {
                                turn.re
                            } else {
                                turn.im
                            }
                    })
                    .collect();
                transform.spectrum(&values)
            })
            .collect();
        let records = self.spectra.par_iter().zip(self.weights);
        let each = records.map(|(spectrum, weights)| {
            let weighed: Vec<Vec<f64>> = columns
                .iter()
                .map(|column| column.iter().zip(*weights).map(|(c, w)| c * w).collect())
                .collect();
            let count = columns.len();
            let mut gram = DMatrix::zeros(count, count);
            for a in 0..count {
                for b in 0..=a {
                    let sum = dot(&weighed[a], &columns[b]);
                    (gram[(a, b)], gram[(b, a)]) = (sum, sum);
                }
            }
            let moments = weighed.iter().map(|column| dot(column, spectrum));
            Sums {
                gram,
                moments: DVector::from_iterator(count, moments),
            }
        });
        each.collect()
    }
}

/// Amplitude of a record, and the covariance of its two parts.
fn amplitude(sums: &Sums) -> (Complex64, DMatrix<f64>) {
    let inverse = pseudo_inverse(&sums.gram.view((0, 0), (2, 2)).into_owned());
    let parts = &inverse * sums.moments.rows(0, 2);
    (Complex64::new(parts[0], -parts[1]), inverse)
}

/// One Gauss–Newton step of the polynomials with free amplitudes, and its covariance.
fn step(sums: &[Sums], degree: usize) -> (DVector<f64>, DMatrix<f64>) {
    let count = degree + 2 * sums.len();
    let mut information = DMatrix::zeros(count, count);
    let mut slope = DVector::zeros(count);
    for (record, one) in sums.iter().enumerate() {
        let (a, _) = amplitude(one);
        // Jacobian of the column sizes in the parameters: a change of phase is a quarter of a turn ahead.
        let mut of_numbers = DMatrix::zeros(one.moments.len(), count);
        for shape in 1..=degree {
            of_numbers[(2 * shape, shape - 1)] = -a.im;
            of_numbers[(2 * shape + 1, shape - 1)] = -a.re;
        }
        of_numbers[(0, degree + 2 * record)] = 1.0;
        of_numbers[(1, degree + 2 * record + 1)] = -1.0;
        let mut now = DVector::zeros(one.moments.len());
        (now[0], now[1]) = (a.re, -a.im);
        information += of_numbers.transpose() * &one.gram * &of_numbers;
        slope += of_numbers.transpose() * (&one.moments - &one.gram * now);
    }
    let inverse = pseudo_inverse(&information);
    let step = (&inverse * slope).rows(0, degree).into_owned();
    let covariance = inverse.view((0, 0), (degree, degree)).into_owned();
    (step, covariance)
}

#[cfg(test)]
mod tests {
    use super::Shown;
    use crate::transform::Transform;
    use crate::{NoiseLevels, Observations};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use std::f64::consts::TAU;

    #[test]
    fn a_line_of_ten_turns_beside_gaps_lies_within_its_intervals() {
        const ROWS: usize = 4000;
        const SEEDS: u64 = 20;
        let seen: Vec<bool> = (0..ROWS).map(|row| row % 500 < 400).collect();
        let levels = NoiseLevels {
            white: 1.0,
            ..NoiseLevels::default()
        };
        let observations = Observations::bridged(&seen).expect("rows enough");
        let (transform, basis) = Transform::with_basis(observations, levels);
        let weights = basis.weights(levels);
        let turn = TAU * 10.3 / ROWS as f64;
        let mut squares = [0.0; 2];
        for seed in 0..SEEDS {
            let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let noise: Vec<f64> = StandardNormal.sample_iter(rng).take(ROWS).collect();
            let record: Vec<f64> = (0..ROWS)
                .map(|row| noise[row] + 3.0 * (turn * (row as f64 + 0.5) + 0.3 * seed as f64).cos())
                .collect();
            let shown = Shown {
                spectra: &[transform.spectrum(&record)],
                weights: &[&weights],
            };
            let off = 0.1 * TAU / ROWS as f64;
            let begin = |row: usize| (turn + off) * (row as f64 + 0.5);
            let course = shown.fit(&transform, ROWS, 1, begin);
            let frequency = course.polynomial[0] + 0.5 * off * ROWS as f64;
            squares[0] += ((course.amplitudes[0].norm() - 3.0) / course.stds[0]).powi(2);
            squares[1] += frequency.powi(2) / course.covariance[(0, 0)];
        }
        for square in squares {
            // Four standard deviations of the root mean square of 20 normal numbers.
            let rms = (square / SEEDS as f64).sqrt();
            assert!((0.37..1.63).contains(&rms), "{squares:?}");
        }
    }
}
