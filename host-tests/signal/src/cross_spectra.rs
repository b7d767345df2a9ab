//! Cross-spectra of gyros and reference over a whole record, summed in bands, and the map between them for given weights.

use rlg_plan::MapPlan;
use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use realfft::num_complex::Complex64;

use crate::transforms::{self, smooth_length};

/// Least eigenvalue of an inverted correlation matrix: below it two axes are collinear to rounding.
const LEAST_EIGENVALUE: f64 = 1e-9;

/// Weights or powers, one per gyro and band.
pub(crate) type Weights = [Vec<f64>; 3];

/// The delay of the largest explained power.
pub(crate) struct Best {
    pub(crate) lag: f64,
}

/// The map at a delay.
pub(crate) struct Fit {
    pub(crate) map: Matrix3<f64>,
    /// Mean residual power of a frequency, by gyro and band.
    left: Weights,
}

/// Spectra of both sides over the whole record.
pub(crate) struct Spectra {
    gyros: [Vec<Complex64>; 3],
    reference: [Vec<Complex64>; 3],
    padded: usize,
    bands: Vec<Range<usize>>,
    /// Co-spectra of the reference's axes, by band.
    reference_power: Vec<Matrix3<f64>>,
    gyro_power: [Vec<f64>; 3],
    /// Independent frequencies per frequency of the padded record.
    independent: f64,
}

impl Spectra {
    /// # Inputs
    /// `shift`: delay applied to the reference \[rows\]; `most`: padding for the largest delay \[rows\].
    pub(crate) fn new(
        gyros_rad: [&[f64]; 3],
        reference_rad: [&[f64]; 3],
        seen: &[bool],
        (shift, most): (isize, usize),
        plan: &MapPlan,
    ) -> Option<Self> {
        let rows = seen.len();
        let at = |row: usize| row.checked_add_signed(-shift).filter(|&at| at < rows);
        let used: Vec<Option<usize>> = (0..rows)
            .map(|row| at(row).filter(|&at| seen[row] && seen[at]))
            .collect();
        let count = used.iter().flatten().count();
        if count < plan.least_rows {
            return None;
        }
        let padded = smooth_length(rows + 2 * most + 2);
        let forward = transforms::forward(padded);
        let transform = |value: &dyn Fn(usize, usize) -> f64| {
            let both = || used.iter().enumerate();
            let known = both().filter_map(|(row, at)| at.map(|at| value(row, at)));
            let mean = known.sum::<f64>() / count as f64;
            let mut record = vec![0.0; padded];
            for (row, at) in both() {
                record[row] = at.map_or(0.0, |at| value(row, at) - mean);
            }
            let mut spectrum = forward.make_output_vec();
            forward
                .process(&mut record, &mut spectrum)
                .expect("lengths as planned");
            spectrum
        };
        let gyros = gyros_rad.map(|values| transform(&|row, _| values[row]));
        let reference = reference_rad.map(|values| transform(&|_, at| values[at]));
        let bands = bands(padded / 2, plan);
        let reference_power = bands
            .iter()
            .map(|band| {
                Matrix3::from_fn(|a, b| {
                    let of = |k: usize| (reference[a][k] * reference[b][k].conj()).re;
                    band.clone().map(of).sum()
                })
            })
            .collect();
        let gyro_power = [0, 1, 2].map(|gyro: usize| {
            let of = |band: &Range<usize>| band.clone().map(|k| gyros[gyro][k].norm_sqr()).sum();
            bands.iter().map(of).collect()
        });
        Some(Self {
            gyros,
            reference,
            padded,
            bands,
            reference_power,
            gyro_power,
            independent: count as f64 / padded as f64,
        })
    }

    /// Equal weights of all frequencies, normalised by each gyro's own power.
    pub(crate) fn even_weights(&self) -> Weights {
        [0, 1, 2].map(|gyro: usize| {
            let power: f64 = self.gyro_power[gyro].iter().sum();
            vec![if power > 0.0 { 1.0 / power } else { 0.0 }; self.bands.len()]
        })
    }

    /// Weights by the inverse residual power.
    pub(crate) fn weights(&self, fit: &Fit) -> Weights {
        /// Rounding error, as a share of a gyro's mean power.
        const ROUNDING: f64 = 1e-14;
        [0, 1, 2].map(|gyro: usize| {
            let power: f64 = self.gyro_power[gyro].iter().sum();
            let least = ROUNDING * power / self.padded as f64;
            let one_over = |left: &f64| match left.max(least) {
                left if left > 0.0 => 1.0 / left,
                _ => 0.0,
            };
            fit.left[gyro].iter().map(one_over).collect()
        })
    }

    /// Gram matrix of the reference for each gyro's weights.
    fn grams(&self, weights: &Weights) -> [Matrix3<f64>; 3] {
        [0, 1, 2].map(|gyro: usize| {
            let parts = self.reference_power.iter().zip(&weights[gyro]);
            parts.map(|(power, weight)| power * *weight).sum()
        })
    }

    /// Cross-power of gyro and reference in a band, the gyros advanced by `lag` rows.
    fn cross(&self, band: &Range<usize>, gyro: usize, lag: f64) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        let step = Complex64::from_polar(1.0, TAU * lag / self.padded as f64);
        let mut turn =
            Complex64::from_polar(1.0, TAU * lag * band.start as f64 / self.padded as f64);
        for k in band.clone() {
            let turned = self.gyros[gyro][k] * turn;
            for axis in 0..3 {
                sum[axis] += (turned * self.reference[axis][k].conj()).re;
            }
            turn *= step;
        }
        sum
    }

    pub(crate) fn fit(&self, weights: &Weights, lag: f64) -> Fit {
        let grams = self.grams(weights);
        let mut map = Matrix3::zeros();
        let mut left: Weights = Default::default();
        for gyro in 0..3 {
            let crosses: Vec<Vector3<f64>> = self
                .bands
                .iter()
                .map(|band| self.cross(band, gyro, lag))
                .collect();
            let sum: Vector3<f64> = crosses
                .iter()
                .zip(&weights[gyro])
                .map(|(cross, weight)| cross * *weight)
                .sum();
            let row = inverse(&grams[gyro]) * sum;
            map.set_row(gyro, &row.transpose());
            left[gyro] = (0..self.bands.len())
                .map(|b| {
                    let explained =
                        2.0 * row.dot(&crosses[b]) - row.dot(&(self.reference_power[b] * row));
                    let power = self.gyro_power[gyro][b] - explained;
                    power.max(0.0) / self.bands[b].len() as f64
                })
                .collect();
        }
        Fit { map, left }
    }

    /// Weighted cross-correlation of gyros and reference at lags between two, by gyro and axis, in steps of one over `fine`
    /// rows.
    fn correlations(
        &self,
        weights: &Weights,
        lags: (isize, isize),
        fine: usize,
    ) -> Vec<Matrix3<f64>> {
        let length = fine * self.padded;
        let backward = transforms::inverse(length);
        let (from, to) = lags;
        let mut all = vec![Matrix3::zeros(); (to - from + 1).max(0) as usize];
        for gyro in 0..3 {
            for axis in 0..3 {
                let mut product = backward.make_input_vec();
                for (band, weight) in self.bands.iter().zip(&weights[gyro]) {
                    for k in band.clone() {
                        product[k] = self.gyros[gyro][k] * self.reference[axis][k].conj() * *weight;
                    }
                }
                let mut record = backward.make_output_vec();
                backward
                    .process(&mut product, &mut record)
                    .expect("lengths as planned");
                for (place, lag) in (from..=to).enumerate() {
                    let at = lag.rem_euclid(length as isize) as usize;
                    // Positive and negative frequencies are summed; the Gram matrices hold one side.
                    all[place][(gyro, axis)] = 0.5 * record[at];
                }
            }
        }
        all
    }

    /// Delay within `most` rows of the largest explained power, interpolated by a parabola.
    pub(crate) fn best_lag(&self, weights: &Weights, most: usize) -> Option<Best> {
        let most = most as isize;
        let inverses = self.grams(weights).map(|gram| inverse(&gram));
        let correlations = self.correlations(weights, (-most, most), 1);
        let explained: Vec<f64> = correlations
            .iter()
            .map(|sums| power(sums, &inverses))
            .collect();
        let best = (0..explained.len()).max_by(|&a, &b| explained[a].total_cmp(&explained[b]))?;
        let mut lag = best as f64 - most as f64;
        if best > 0 && best + 1 < explained.len() {
            let (before, at, after) = (explained[best - 1], explained[best], explained[best + 1]);
            let bend = before - 2.0 * at + after;
            if bend < 0.0 {
                lag += (0.5 * (before - after) / bend).clamp(-0.5, 0.5);
            }
        }
        (explained[best] > 0.0).then_some(Best { lag })
    }

    /// Maps at all lags between two whose explained power is within a share of the largest.
    pub(crate) fn as_well(
        &self,
        weights: &Weights,
        lags: (isize, isize),
        share: f64,
    ) -> Vec<Matrix3<f64>> {
        /// Steps in a row: at a third of the row rate a step is a twelfth of a period.
        const FINE: isize = 4;
        let inverses = self.grams(weights).map(|gram| inverse(&gram));
        let lags = (FINE * lags.0, FINE * lags.1);
        let widest = (lags.0.min(-FINE), lags.1.max(FINE));
        let correlations = self.correlations(weights, widest, FINE as usize);
        let explained: Vec<f64> = correlations
            .iter()
            .map(|sums| power(sums, &inverses))
            .collect();
        let most = explained.iter().copied().fold(0.0, f64::max);
        (widest.0..=widest.1)
            .zip(correlations.iter().zip(&explained))
            .filter(|(lag, _)| (lags.0..=lags.1).contains(lag))
            .filter(|(_, (_, explained))| **explained >= (1.0 - share) * most)
            .map(|(_, (sums, _))| {
                let rows = [0, 1, 2]
                    .map(|gyro: usize| (inverses[gyro] * sums.row(gyro).transpose()).transpose());
                Matrix3::from_rows(&rows)
            })
            .collect()
    }

    /// Power by which a gyro's gain against its leading axis differs from the map, as a share, over coherent bands.
    pub(crate) fn uneven(&self, fit: &Fit, gyro: usize, lag: f64, coherent: f64) -> f64 {
        let axis = fit.map.row(gyro).transpose().iamax();
        let (mut differs, mut all) = (0.0, 0.0);
        for (b, band) in self.bands.iter().enumerate() {
            let power = self.reference_power[b][(axis, axis)];
            let cross: Complex64 = band
                .clone()
                .map(|k| {
                    let turn = TAU * lag * k as f64 / self.padded as f64;
                    let turned = self.gyros[gyro][k] * Complex64::from_polar(1.0, turn);
                    turned * self.reference[axis][k].conj()
                })
                .sum();
            let is_coherent = cross.norm_sqr() > coherent * power * self.gyro_power[gyro][b];
            if power > 0.0 && is_coherent {
                differs += (cross / power - fit.map[(gyro, axis)]).norm_sqr() * power;
                all += cross.norm_sqr() / power;
            }
        }
        if all > 0.0 { differs / all } else { 0.0 }
    }

    pub(crate) fn std(&self, weights: &Weights) -> Matrix3<f64> {
        let grams = self.grams(weights);
        let inverses = grams.map(|gram| inverse(&gram));
        Matrix3::from_fn(|gyro, axis| {
            let is_known = grams[gyro][(axis, axis)] > 0.0;
            // A complex frequency counts as two real samples.
            let variance = 0.5 * inverses[gyro][(axis, axis)] / self.independent;
            if is_known {
                variance.max(0.0).sqrt()
            } else {
                f64::INFINITY
            }
        })
    }

    /// Share of each axis in directions (eigenvectors of the Gram matrix) in which the reference's power does not exceed its
    /// noise, if the whole residual of the best gyro were noise of the reference: coefficients there are dominated by noise.
    ///
    /// # Inputs
    /// `kept`: least attenuation factor by noise \[1\].
    pub(crate) fn unseen(&self, fit: &Fit, weights: &Weights, kept: f64) -> [f64; 3] {
        let mut squares = [f64::INFINITY; 3];
        for (gyro, gram) in self.grams(weights).into_iter().enumerate() {
            let bands = self.bands.iter().zip(&weights[gyro]).zip(&fit.left[gyro]);
            let left: f64 = bands
                .map(|((band, weight), left)| weight * left * band.len() as f64)
                .sum();
            let noise = left / fit.map.row(gyro).norm_squared();
            let eigen = SymmetricEigen::new(gram);
            for (axis, square) in squares.iter_mut().enumerate() {
                let of_direction = |k: usize| {
                    let is_noise = eigen.eigenvalues[k] * (1.0 - kept) < noise;
                    f64::from(u8::from(is_noise)) * eigen.eigenvectors[(axis, k)].powi(2)
                };
                *square = square.min((0..3).map(of_direction).sum());
            }
        }
        squares.map(f64::sqrt)
    }

    /// Attenuation factor of each coefficient if the whole residual were noise of the reference (errors in variables).
    pub(crate) fn kept(&self, fit: &Fit, weights: &Weights) -> Matrix3<f64> {
        Matrix3::from_fn(|gyro, axis| {
            let square = fit.map[(gyro, axis)].powi(2);
            let (mut all, mut kept) = (0.0, 0.0);
            for (b, band) in self.bands.iter().enumerate() {
                let power = self.reference_power[b][(axis, axis)];
                let signal = square * power;
                let noise = fit.left[gyro][b] * band.len() as f64;
                let weighted = weights[gyro][b] * power;
                all += weighted;
                if signal > 0.0 {
                    kept += weighted * signal / (signal + noise);
                }
            }
            if all > 0.0 { kept / all } else { 0.0 }
        })
    }
}

/// Explained power of three gyros.
fn power(sums: &Matrix3<f64>, inverses: &[Matrix3<f64>; 3]) -> f64 {
    (0..3)
        .map(|gyro| {
            let row = sums.row(gyro).transpose();
            row.dot(&(inverses[gyro] * row))
        })
        .sum()
}

/// Bands of frequencies 1 to `last`.
fn bands(last: usize, plan: &MapPlan) -> Vec<Range<usize>> {
    let mut all = Vec::new();
    let mut from = 1;
    while from < last {
        let width = ((from as f64 * plan.band) as usize).max(plan.least_bins);
        let to = (from + width).min(last);
        all.push(from..to);
        from = to;
    }
    all
}

/// Inverse of a Gram matrix, regularised by a floor of its eigenvalues; 0 for an axis at rest.
fn inverse(gram: &Matrix3<f64>) -> Matrix3<f64> {
    let scale = gram
        .diagonal()
        .map(|own| if own > 0.0 { 1.0 / own.sqrt() } else { 0.0 });
    let scale = Matrix3::from_diagonal(&scale);
    let eigen = SymmetricEigen::new(scale * gram * scale);
    let values = eigen
        .eigenvalues
        .map(|value| 1.0 / value.max(LEAST_EIGENVALUE));
    let inverse =
        eigen.eigenvectors * Matrix3::from_diagonal(&values) * eigen.eigenvectors.transpose();
    scale * inverse * scale
}
