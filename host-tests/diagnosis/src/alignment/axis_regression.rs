//! Regression of a gyro on the three axes of the reference: on some rows, or at every lag from cross-correlations.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealToComplex};
use rlg_signal::streams::Triad;
use rlg_signal::transforms;

/// Least-squares regression of one gyro on three axes and a constant.
pub(crate) struct Regression {
    pub(crate) coefficients: Vector3<f64>,
    constant: f64,
    /// Mean of the fitted values.
    pub(crate) mean: f64,
    /// Mean square about the mean, before the fit (`power`) and after it (`left`).
    pub(crate) power: f64,
    pub(crate) left: f64,
}

impl Regression {
    pub(crate) fn new(values: &[f64], on: &Triad, rows: &[bool]) -> Self {
        let mut sums = Moments::default();
        for row in (0..values.len()).filter(|&row| rows[row]) {
            let axes = Vector3::from_fn(|axis, _| on[axis][row]);
            sums.count += 1.0;
            sums.value += values[row];
            sums.square += values[row] * values[row];
            sums.axes += axes;
            sums.products += axes * axes.transpose();
            sums.with_value += axes * values[row];
        }
        sums.regression()
    }

    /// Residual of a value in a row.
    pub(crate) fn left_of(&self, value: f64, on: &Triad, row: usize) -> f64 {
        let axes = Vector3::from_fn(|axis, _| on[axis][row]);
        value - self.constant - self.coefficients.dot(&axes)
    }

    /// Subtracts the fit from `values`.
    pub(crate) fn take_out(&self, values: &mut [f64], on: &Triad) {
        for (row, value) in values.iter_mut().enumerate() {
            *value = self.left_of(*value, on, row);
        }
    }
}

/// Sums over rows for the normal equations of a regression.
#[derive(Default)]
pub(crate) struct Moments {
    pub(crate) count: f64,
    pub(crate) value: f64,
    pub(crate) square: f64,
    pub(crate) axes: Vector3<f64>,
    pub(crate) products: Matrix3<f64>,
    pub(crate) with_value: Vector3<f64>,
}

impl Moments {
    pub(crate) fn regression(&self) -> Regression {
        /// Share of the total power below which a direction of the reference is left out \[1\].
        const LEAST_POWER: f64 = 1e-10;
        let count = self.count.max(1.0);
        let mean = self.value / count;
        let power = (self.square / count - mean * mean).max(0.0);
        let means = self.axes / count;
        let covariance = self.products / count - means * means.transpose();
        let with_value = self.with_value / count - means * mean;
        let least = LEAST_POWER * covariance.trace();
        let coefficients = covariance
            .pseudo_inverse(least.max(f64::MIN_POSITIVE))
            .map_or_else(|_| Vector3::zeros(), |inverse| inverse * with_value);
        Regression {
            constant: mean - coefficients.dot(&means),
            left: (power - coefficients.dot(&with_value)).max(0.0),
            coefficients,
            mean,
            power,
        }
    }
}

/// Profile log-likelihood of white noise of `count` rows, up to a constant.
pub(crate) fn log_likelihood(regressions: impl Iterator<Item = Regression>, count: f64) -> f64 {
    let of_gyro = |one: Regression| {
        if one.power > 0.0 {
            (one.left / one.power).max(f64::EPSILON).ln()
        } else {
            0.0
        }
    };
    -0.5 * count * regressions.map(of_gyro).sum::<f64>()
}

/// Regressions at every lag, from cross-correlations.
pub(crate) struct Lags {
    most: usize,
    /// Sums of each gyro, by lag from −most on.
    moments: Vec<[Moments; 3]>,
}

impl Lags {
    pub(crate) fn new(sensed: &Triad, case: &Triad, rows: &[bool], most: usize) -> Self {
        let most = most.min(rows.len() / 4);
        let correlate = Correlator::new(rows.len() + most);
        let is_used = |row: usize| f64::from(u8::from(rows[row]));
        let of_rows = |value: &dyn Fn(usize) -> f64| {
            let values: Vec<f64> = (0..rows.len())
                .map(|row| is_used(row) * value(row))
                .collect();
            correlate.spectrum(&values)
        };
        let ones = of_rows(&|_| 1.0);
        let gyros: Vec<_> = sensed.iter().map(|s| of_rows(&|row| s[row])).collect();
        let squares: Vec<_> = sensed
            .iter()
            .map(|s| of_rows(&|row| s[row] * s[row]))
            .collect();
        let axes: Vec<_> = case.iter().map(|m| of_rows(&|row| m[row])).collect();
        let at_lags = |a: &[Complex64], b: &[Complex64]| correlate.lags(a, b, most);
        let count = at_lags(&ones, &ones);
        let of_axes: Vec<Vec<f64>> = axes.iter().map(|axis| at_lags(&ones, axis)).collect();
        let mut products: Vec<Vec<f64>> = Vec::new();
        for a in 0..3 {
            for b in 0..=a {
                let both = of_rows(&|row| case[a][row] * case[b][row]);
                products.push(at_lags(&ones, &both));
            }
        }
        let product = |a: usize, b: usize, lag: usize| {
            let (high, low) = (a.max(b), a.min(b));
            products[high * (high + 1) / 2 + low][lag]
        };
        let of_gyros = |of: &dyn Fn(usize) -> Vec<f64>| [0, 1, 2].map(of);
        let values = of_gyros(&|gyro| at_lags(&gyros[gyro], &ones));
        let squared = of_gyros(&|gyro| at_lags(&squares[gyro], &ones));
        let with = [0, 1, 2].map(|axis| of_gyros(&|gyro| at_lags(&gyros[gyro], &axes[axis])));
        let moments = (0..=2 * most)
            .map(|lag| {
                std::array::from_fn(|gyro| Moments {
                    count: count[lag],
                    value: values[gyro][lag],
                    square: squared[gyro][lag],
                    axes: Vector3::from_fn(|axis, _| of_axes[axis][lag]),
                    products: Matrix3::from_fn(|a, b| product(a, b, lag)),
                    with_value: Vector3::from_fn(|axis, _| with[axis][gyro][lag]),
                })
            })
            .collect();
        Self { most, moments }
    }

    /// Log-likelihood of white noise with some gyros `lag` rows late, and the number of rows; `None` beyond the lags.
    fn at(&self, gyros: &[usize], lag: isize) -> Option<(f64, f64)> {
        let place = lag.checked_add_unsigned(self.most)?;
        let moments = self.moments.get(usize::try_from(place).ok()?)?;
        let count = moments[0].count;
        let regressions = gyros.iter().map(|&gyro| moments[gyro].regression());
        Some((log_likelihood(regressions, count), count))
    }

    /// Maximum-likelihood lag \[rows\], of the maxima within `tie` of the largest the nearest to zero.
    pub(crate) fn best(&self, gyros: &[usize], tie: f64) -> Option<f64> {
        let most = self.most as isize;
        let all: Vec<(isize, f64)> = (-most..=most)
            .filter_map(|lag| Some((lag, self.at(gyros, lag)?.0)))
            .collect();
        let largest = all
            .iter()
            .map(|one| one.1)
            .fold(f64::NEG_INFINITY, f64::max);
        let is_top = |place: usize| {
            let value = |place: Option<usize>| {
                place
                    .and_then(|place| all.get(place))
                    .map_or(f64::NEG_INFINITY, |one| one.1)
            };
            all[place].1 >= value(place.checked_sub(1)) && all[place].1 >= value(Some(place + 1))
        };
        let lag = (0..all.len())
            .filter(|&place| all[place].1 > largest - tie && is_top(place))
            .map(|place| all[place].0)
            .min_by_key(|lag| lag.unsigned_abs())?;
        // Near the best lag the residual power grows with the square of the distance.
        let left = |lag: isize| {
            let (log_likelihood, count) = self.at(gyros, lag)?;
            let values = gyros.len() as f64 * count;
            Some((-2.0 * (log_likelihood - largest) / values).exp())
        };
        let between = match (left(lag - 1), left(lag), left(lag + 1)) {
            (Some(before), Some(here), Some(after)) => {
                let bend = before - 2.0 * here + after;
                if bend > 0.0 {
                    0.5 * (before - after) / bend
                } else {
                    0.0
                }
            }
            _ => 0.0,
        };
        Some(lag as f64 + between.clamp(-0.5, 0.5))
    }
}

/// Cross-correlations of records of one length.
struct Correlator {
    length: usize,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
}

impl Correlator {
    fn new(least: usize) -> Self {
        let length = least.next_power_of_two();
        Self {
            length,
            forward: transforms::forward(length),
            inverse: transforms::inverse(length),
        }
    }

    fn spectrum(&self, values: &[f64]) -> Vec<Complex64> {
        let forward = &self.forward;
        let mut record = values.to_vec();
        record.resize(self.length, 0.0);
        let mut spectrum = forward.make_output_vec();
        forward
            .process(&mut record, &mut spectrum)
            .expect("lengths as planned");
        spectrum
    }

    /// Computes Σ a(t) b(t − lag) for lags from −most to most.
    fn lags(&self, a: &[Complex64], b: &[Complex64], most: usize) -> Vec<f64> {
        let inverse = &self.inverse;
        let mut product: Vec<Complex64> = a.iter().zip(b).map(|(a, b)| a * b.conj()).collect();
        product[0].im = 0.0;
        if let Some(last) = product.last_mut() {
            last.im = 0.0;
        }
        let mut record = inverse.make_output_vec();
        inverse
            .process(&mut product, &mut record)
            .expect("lengths as planned");
        let scale = 1.0 / self.length as f64;
        (0..=2 * most)
            .map(|place| {
                let at = (self.length + place - most) % self.length;
                record[at] * scale
            })
            .collect()
    }
}
