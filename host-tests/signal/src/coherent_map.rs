//! Measures how much of each axis of a reference each gyro reads: one 3 × 3 map at one common delay.
//!
//! Both sides have noise of unknown size. Frequencies are weighted by what the fit leaves in them, so those count in
//! which gyros and reference move together; what the reference's noise takes off a coefficient is estimated, and an
//! axis of the reference is judged only where it really moves. Increments are regressed, so a constant rate (a bias)
//! says nothing.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;

use crate::derivatives::fast_length;

/// Numbers of the measurement.
#[derive(Debug, Clone, Copy)]
pub struct MapPlan {
    /// Delays that are searched on either side \[s\]: the largest that two recorders of one experiment were seen to have.
    pub most_delay_s: f64,
    /// Delays up to which one is likelier than channels that are reversed or exchanged \[s\]: some periods of a slow
    /// instrument. At one frequency half a period's delay is a sign.
    pub likely_delay_s: f64,
    /// Share of the explained power that another delay may miss and still explain the recording as well \[1\].
    pub as_well: f64,
    /// Share of an axis that its own gyro shows below which other delays are looked at \[1\]: 0.3 rad of tilt leave more.
    pub own: f64,
    /// Relative width of a band \[1\], as the noise is binned elsewhere.
    pub band: f64,
    /// Least frequencies in a band: three coefficients are fitted, and some are needed to say what is left.
    pub least_bins: usize,
    /// Largest standard deviation of a coefficient that is judged, as a share of what its axis shows \[1\].
    pub known: f64,
    /// Least share of a coefficient that noise in the reference leaves \[1\]: below it the coefficient is the noise's.
    pub kept: f64,
    /// Least squared coherence of a band whose gain is compared with the others' \[1\].
    pub coherent: f64,
    /// Least rows for a regression.
    pub least_rows: usize,
}

impl Default for MapPlan {
    fn default() -> Self {
        Self {
            most_delay_s: 0.5,
            likely_delay_s: 0.05,
            as_well: 0.1,
            own: 0.9,
            band: 0.08,
            least_bins: 8,
            known: 0.05,
            kept: 0.8,
            coherent: 0.9,
            least_rows: 100,
        }
    }
}

/// What the gyros read of the reference.
#[derive(Debug, Clone)]
pub struct CoherentMap {
    /// Gyro i reads Σ `map[(i, j)]` times what the reference turns about j.
    pub map: Matrix3<f64>,
    /// Standard deviations; infinite where an axis does not move.
    pub std: Matrix3<f64>,
    /// Which axes of the reference move enough to be judged.
    pub moves: [bool; 3],
    /// How late the gyros are against the reference \[s\].
    pub delay_s: f64,
    /// By gyro: power by which its gain differs from the map over frequency, as a share of what it reads \[1\]: a factor
    /// is the same at all frequencies, a soft mount or a filter is not.
    pub uneven: [f64; 3],
    /// The map at every likely delay that explains the recording as well, where gyros do not follow their own axes.
    pub others: Vec<Matrix3<f64>>,
}

/// Passes of weighting: the weights of the last two differ by less than their own scatter.
const PASSES: usize = 4;

/// Least eigenvalue of a correlation matrix that is inverted: below it two axes turn as one to rounding.
const LEAST_EIGENVALUE: f64 = 1e-9;

/// Measures the map on the rows that are `seen`; `None` where they are too few or nothing moves.
pub fn measure(
    gyros_rad: [&[f64]; 3],
    reference_rad: [&[f64]; 3],
    seen: &[bool],
    rate_hz: f64,
    plan: &MapPlan,
) -> Option<CoherentMap> {
    let most = ((plan.most_delay_s * rate_hz).ceil() as usize).min(seen.len() / 4);
    let first = Spectra::new(gyros_rad, reference_rad, seen, (0, most), plan)?;
    let start = first.best_lag(&first.even_weights(), most)?;
    // The same rows on both sides: what one is not looked at in, the other is not either.
    let shift = start.lag.round() as isize;
    let spectra = match shift {
        0 => first,
        _ => Spectra::new(gyros_rad, reference_rad, seen, (shift, most), plan)?,
    };
    let mut lag = start.lag - shift as f64;
    let mut fit = spectra.fit(&spectra.even_weights(), lag);
    let mut weights = spectra.weights(&fit);
    for _ in 1..PASSES {
        // Only the first fit looked for a delay that noise at high frequencies may hide.
        lag = spectra.best_lag(&weights, most)?.lag;
        fit = spectra.fit(&weights, lag);
        weights = spectra.weights(&fit);
    }
    let std = spectra.std(&weights);
    let kept = spectra.kept(&fit, &weights);
    let moves = [0, 1, 2].map(|axis| {
        let size = fit.map.column(axis).norm();
        let strongest = fit.map.column(axis).iamax();
        size > 0.0
            && (0..3).all(|gyro| std[(gyro, axis)] < plan.known * size)
            && kept[(strongest, axis)] > plan.kept
    });
    let map = Matrix3::from_fn(|gyro, axis| {
        // The truth lies between the coefficient and what it would be if all noise were the reference's.
        fit.map[(gyro, axis)] / kept[(gyro, axis)].max(plan.kept).sqrt()
    });
    let is_led_otherwise = |axis: usize| {
        let column = fit.map.column(axis);
        moves[axis] && column[axis] < plan.own * column.norm()
    };
    let others = if (0..3).any(is_led_otherwise) {
        let likely = (plan.likely_delay_s * rate_hz).ceil() as isize;
        spectra.as_well(&weights, (-likely - shift, likely - shift), plan.as_well)
    } else {
        Vec::new()
    };
    Some(CoherentMap {
        map,
        std,
        moves,
        delay_s: (lag + shift as f64) / rate_hz,
        uneven: [0, 1, 2].map(|gyro| spectra.uneven(&fit, gyro, lag, plan.coherent)),
        others,
    })
}

/// Power of each band for one weight per gyro and band.
type Weights = [Vec<f64>; 3];

/// A delay with the power that it explains.
struct Best {
    lag: f64,
}

/// The map at a delay.
struct Fit {
    map: Matrix3<f64>,
    /// By gyro and band: mean power of a frequency that is left.
    left: Weights,
}

/// Spectra of both sides over the whole record.
struct Spectra {
    gyros: [Vec<Complex64>; 3],
    reference: [Vec<Complex64>; 3],
    padded: usize,
    bands: Vec<Range<usize>>,
    /// By band: real part of reference times reference.
    reference_power: Vec<Matrix3<f64>>,
    gyro_power: [Vec<f64>; 3],
    /// Independent frequencies per frequency of the padded record.
    independent: f64,
}

impl Spectra {
    /// # Inputs
    /// `shift`: rows by which the reference is taken later; `most`: rows that delays may reach beyond the ends.
    fn new(
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
        let padded = fast_length(rows + 2 * most + 2);
        let forward = RealFftPlanner::new().plan_fft_forward(padded);
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

    /// Every frequency alike, every gyro by its own power.
    fn even_weights(&self) -> Weights {
        [0, 1, 2].map(|gyro: usize| {
            let power: f64 = self.gyro_power[gyro].iter().sum();
            vec![if power > 0.0 { 1.0 / power } else { 0.0 }; self.bands.len()]
        })
    }

    /// One over the power that is left.
    fn weights(&self, fit: &Fit) -> Weights {
        /// Of a gyro's mean power: what rounding leaves.
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

    /// Σ weight × reference × reference of each gyro.
    fn grams(&self, weights: &Weights) -> [Matrix3<f64>; 3] {
        [0, 1, 2].map(|gyro: usize| {
            let parts = self.reference_power.iter().zip(&weights[gyro]);
            parts.map(|(power, weight)| power * *weight).sum()
        })
    }

    /// Σ weight × gyro × reference of a band, the gyros taken `lag` rows earlier.
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

    fn fit(&self, weights: &Weights, lag: f64) -> Fit {
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

    /// Weighted gyro times reference at lags between two, by gyro and axis, in steps of one over `fine` rows.
    fn correlations(
        &self,
        weights: &Weights,
        lags: (isize, isize),
        fine: usize,
    ) -> Vec<Matrix3<f64>> {
        let length = fine * self.padded;
        let backward = RealFftPlanner::new().plan_fft_inverse(length);
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

    /// The delay within `most` rows that explains most.
    fn best_lag(&self, weights: &Weights, most: usize) -> Option<Best> {
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

    /// The maps at all lags between two that explain as much, but for a share.
    fn as_well(&self, weights: &Weights, lags: (isize, isize), share: f64) -> Vec<Matrix3<f64>> {
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

    /// How far the gain of a gyro against its leading axis differs from the map, by bands in which both move together.
    fn uneven(&self, fit: &Fit, gyro: usize, lag: f64, coherent: f64) -> f64 {
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

    fn std(&self, weights: &Weights) -> Matrix3<f64> {
        let grams = self.grams(weights);
        let inverses = grams.map(|gram| inverse(&gram));
        Matrix3::from_fn(|gyro, axis| {
            let is_known = grams[gyro][(axis, axis)] > 0.0;
            // A frequency is two numbers.
            let variance = 0.5 * inverses[gyro][(axis, axis)] / self.independent;
            if is_known {
                variance.max(0.0).sqrt()
            } else {
                f64::INFINITY
            }
        })
    }

    /// Share of a coefficient that is left if all that the fit leaves were noise of the reference.
    fn kept(&self, fit: &Fit, weights: &Weights) -> Matrix3<f64> {
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

/// The inverse of a Gram matrix; 0 for an axis that stands still, large where two axes turn as one.
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
