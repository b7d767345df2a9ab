//! Estimates gross departures from the model by global regressions, before any linearisation: large errors first.
//!
//! The delay is estimated by cross-correlation over all lags at once, all gyros together, with low passes as alternatives;
//! at the best path each gyro is regressed on all three axes of the reference and a constant. A fit that explains more than
//! noise of the reference could is removed from the residual before its noise is estimated.

use rlg_plan::CoarsePlan;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealToComplex};
use rlg_catalogue::low_pass::{LowPass, grid};
use rlg_catalogue::signals::Path;
use rlg_inference::sums::sums;

use super::data::{Data, reached};
use rlg_signal::derivatives::Spectrum;
use rlg_signal::streams::{Triad, each_axis};
use rlg_signal::transforms;

/// Gross departures from the model.
pub struct Coarse {
    /// Delays, or a low pass common to all gyros.
    pub path: Path,
    /// By gyro, its coefficients on the axes of the reference after the path, beyond the model's \[1\]; 0 if not gross.
    pub sensed: [Vector3<f64>; 3],
    /// Residual without these departures \[rad\].
    pub clean_rad: Triad,
}

impl Coarse {
    /// True if any departure is gross.
    pub fn is_far(&self) -> bool {
        self.path != Path::default() || self.sensed != [Vector3::zeros(); 3]
    }
}

/// Estimates gross departures from the model in a residual, on the rows that are `seen`.
///
/// # Inputs
/// `residual_rad`: residual without the model's effects.
pub fn coarse(data: &Data, residual_rad: &Triad, seen: &[bool], plan: &CoarsePlan) -> Coarse {
    let streams = data.streams;
    if streams.at_rest.is_some() {
        return Coarse {
            path: Path::default(),
            sensed: [Vector3::zeros(); 3],
            clean_rad: about_the_mean(residual_rad, seen),
        };
    }
    let expected_rad = each_axis(|gyro| expected(data, gyro, &data.reference_rad));
    let sensed_rad: Triad = std::array::from_fn(|gyro| {
        let parts = residual_rad[gyro].iter().zip(&expected_rad[gyro]);
        parts.map(|(left, expected)| left + expected).collect()
    });
    let path = path_between(data, &sensed_rad, seen, plan);
    let behind: Triad = each_axis(|axis| {
        let values = &data.reference_rad[axis];
        path.along(axis, values, streams.rate_hz).into_owned()
    });
    let rows = reached(seen, path.longest_delay_s() * streams.rate_hz);
    let mut further = [Vector3::zeros(); 3];
    let clean_rad = std::array::from_fn(|gyro| {
        let expected = expected(data, gyro, &behind);
        let sensed = sensed_rad[gyro].iter().zip(&expected);
        let mut left: Vec<f64> = sensed.map(|(sensed, expected)| sensed - expected).collect();
        let fit = Regression::new(&left, &behind, &rows);
        // Noise of the reference alone explains no more than the fit's negative coefficient on the gyro's own axis.
        let by_noise = (-fit.coefficients[gyro]).clamp(0.0, 1.0);
        let explained = 1.0 - fit.left / fit.power.max(f64::MIN_POSITIVE);
        // A gyro that senses less than half of its axis is implausible: the axis is still, and only the reference's noise
        // varies.
        let is_noise = by_noise > plan.explained;
        if !is_noise && explained > by_noise + plan.explained * (1.0 - by_noise) {
            further[gyro] = fit.coefficients;
            fit.take_out(&mut left, &behind);
        } else {
            left.iter_mut().for_each(|value| *value -= fit.mean);
        }
        left
    });
    Coarse {
        path,
        sensed: further,
        clean_rad,
    }
}

/// Values minus their mean over the `seen` rows: a constant has no information on the noise.
fn about_the_mean(values: &Triad, seen: &[bool]) -> Triad {
    let count = seen.iter().filter(|&&seen| seen).count().max(1) as f64;
    each_axis(|axis| {
        let pairs = values[axis].iter().zip(seen);
        let sum: f64 = pairs
            .filter(|(_, seen)| **seen)
            .map(|(value, _)| value)
            .sum();
        values[axis]
            .iter()
            .map(|value| value - sum / count)
            .collect()
    })
}

/// Increments of a gyro predicted by the model from increments of the case \[rad\].
fn expected(data: &Data, gyro: usize, case: &Triad) -> Vec<f64> {
    let scale = 1.0 / (1.0 - data.model.gyro.scale_error[gyro]);
    let along: [f64; 3] = std::array::from_fn(|axis| data.sensing_from_body[(gyro, axis)] * scale);
    (0..data.streams.rows)
        .map(|row| (0..3).map(|axis| along[axis] * case[axis][row]).sum())
        .collect()
}

/// Least-squares regression of one gyro on three axes and a constant.
struct Regression {
    coefficients: Vector3<f64>,
    constant: f64,
    /// Mean of the fitted values.
    mean: f64,
    /// Mean square about the mean, before the fit (`power`) and after it (`left`).
    power: f64,
    left: f64,
}

impl Regression {
    fn new(values: &[f64], on: &Triad, rows: &[bool]) -> Self {
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
    fn left_of(&self, value: f64, on: &Triad, row: usize) -> f64 {
        let axes = Vector3::from_fn(|axis, _| on[axis][row]);
        value - self.constant - self.coefficients.dot(&axes)
    }

    /// Subtracts the fit from `values`.
    fn take_out(&self, values: &mut [f64], on: &Triad) {
        for (row, value) in values.iter_mut().enumerate() {
            *value = self.left_of(*value, on, row);
        }
    }
}

/// Sums over rows for the normal equations of a regression.
#[derive(Default)]
struct Moments {
    count: f64,
    value: f64,
    square: f64,
    axes: Vector3<f64>,
    products: Matrix3<f64>,
    with_value: Vector3<f64>,
}

impl Moments {
    fn regression(&self) -> Regression {
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

/// Selects the delays or the low pass that explain the gyros together; the direct path if none is better than it.
fn path_between(data: &Data, sensed_rad: &Triad, seen: &[bool], plan: &CoarsePlan) -> Path {
    let streams = data.streams;
    let each = streams.rows.div_ceil(plan.most_rows);
    let rate_hz = streams.rate_hz / each as f64;
    let summed = |triad: &Triad| each_axis(|axis| sums(&triad[axis], each));
    let rows: Vec<bool> = seen
        .chunks_exact(each)
        .map(|rows| rows.iter().all(|&seen| seen))
        .collect();
    let (sensed, case) = (summed(sensed_rad), summed(&data.reference_rad));
    let lags = Lags::new(
        &sensed,
        &case,
        &rows,
        (plan.longest_delay_s * rate_hz) as usize,
    );
    let behind = |path: Path, triad: &Triad| {
        each_axis(|axis| path.along(axis, &triad[axis], rate_hz).into_owned())
    };
    // The output of a path is not known at the record's ends.
    let away_from_ends = |away_s: f64| {
        let rows = reached(&rows, away_s * rate_hz);
        reached(&rows, -away_s * rate_hz)
    };
    let delayed = |delay_s: [f64; 3]| Path {
        delay_s,
        ..Path::default()
    };
    let compared = |path: Path, other: Path| {
        let inner = away_from_ends(most_away_s(&path).max(most_away_s(&other)));
        let by = |path: Path| Explained::by_rows(&sensed, &behind(path, &case), &inner, plan);
        (by(path), by(other))
    };
    let late = lags.best(&[0, 1, 2], plan.tie);
    let late = late.map(|lag| delayed([lag / rate_hz; 3]));
    let late = late.filter(|late| {
        let (by, without) = compared(*late, Path::default());
        by.is_better_than(&without, plan)
    });
    let late = late.unwrap_or_default();
    // One gyro may have a delay of its own.
    let apart = [0, 1, 2].map(|gyro| {
        let own = lags.best(&[gyro], plan.tie);
        own.map_or(late.delay_s[gyro], |lag| lag / rate_hz)
    });
    let (by_apart, by_late) = compared(delayed(apart), late);
    let late = delayed(
        [0, 1, 2].map(|gyro| match by_apart.halves_of(gyro, &by_late, plan) {
            true => apart[gyro],
            false => late.delay_s[gyro],
        }),
    );
    let spectra = |triad: &Triad| each_axis(|axis| Spectrum::new(&triad[axis], rate_hz));
    let (of_sensed, of_case) = (spectra(&sensed), spectra(&case));
    let gain = |low_pass: LowPass| -> Option<f64> {
        let settled_s = plan.settled_time_constants * low_pass.time_s;
        let inner = away_from_ends(most_away_s(&late) + settled_s);
        // A low pass also removes noise of the reference. After four more low passes on gyros and reference alike, it
        // removes an eighth of white noise and three eighths of white angle noise: less than half.
        let smooth = |hz: f64| low_pass.whole(hz).powi(4);
        let through = |of: &[Spectrum; 3], path: Path| {
            each_axis(|axis| of[axis].through(|hz| smooth(hz) * path.response(axis, hz)))
        };
        let sensed = through(&of_sensed, Path::default());
        let by = |path: Path| Explained::by_rows(&sensed, &through(&of_case, path), &inner, plan);
        let (filtered, late) = (by(of_low_pass(low_pass)), by(late));
        let is_better = filtered.log_likelihood > late.log_likelihood + plan.tie
            && filtered.halves(&by(Path::default()), plan);
        is_better.then_some(filtered.log_likelihood - late.log_likelihood)
    };
    // Octaves are too coarse a grid to distinguish a low pass from a delay.
    let finer = |one: LowPass| {
        [0.0, 0.25, 0.5, 0.75].map(|octaves: f64| LowPass {
            time_s: one.time_s * octaves.exp2(),
        })
    };
    grid(2.0 / rate_hz, plan.longest_low_pass_s)
        .into_iter()
        .flat_map(finer)
        .filter_map(|low_pass| Some((low_pass, gain(low_pass)?)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(late, |(low_pass, _)| of_low_pass(low_pass))
}

/// Largest absolute delay of a path \[s\].
fn most_away_s(path: &Path) -> f64 {
    let each = path.delay_s.iter();
    each.fold(0.0, |most, delay_s| delay_s.abs().max(most))
}

fn of_low_pass(low_pass: LowPass) -> Path {
    Path {
        low_pass: [Some(low_pass); 3],
        ..Path::default()
    }
}

/// Residuals of a regression of each gyro on the reference.
struct Explained {
    /// Mean square residual of each gyro.
    left: [f64; 3],
    /// Sums of squared residuals in each block of rows, by gyro.
    by_block: Vec<[f64; 3]>,
    /// Log-likelihood of white noise, up to a constant.
    log_likelihood: f64,
}

impl Explained {
    fn by_rows(sensed: &Triad, behind: &Triad, rows: &[bool], plan: &CoarsePlan) -> Self {
        let regressions: [Regression; 3] =
            std::array::from_fn(|gyro| Regression::new(&sensed[gyro], behind, rows));
        let count = rows.iter().filter(|&&row| row).count();
        let used: Vec<usize> = (0..rows.len()).filter(|&row| rows[row]).collect();
        let sum = |rows: &[usize], gyro: usize| {
            let left = |row: &usize| regressions[gyro].left_of(sensed[gyro][*row], behind, *row);
            rows.iter().map(|row| left(row).powi(2)).sum::<f64>()
        };
        let blocks = used.chunks(used.len().div_ceil(plan.blocks).max(1));
        Self {
            left: std::array::from_fn(|gyro| regressions[gyro].left),
            by_block: blocks
                .map(|rows| std::array::from_fn(|gyro| sum(rows, gyro)))
                .collect(),
            log_likelihood: log_likelihood(regressions.into_iter(), count as f64),
        }
    }

    /// True if its residual power on any gyro is less than half of another's.
    fn halves(&self, other: &Self, plan: &CoarsePlan) -> bool {
        (0..3).any(|gyro| self.halves_of(gyro, other, plan))
    }

    /// The same of one gyro.
    fn halves_of(&self, gyro: usize, other: &Self, plan: &CoarsePlan) -> bool {
        self.left[gyro] < (1.0 - plan.explained) * other.left[gyro]
    }

    /// True if it halves another's residual power, or lowers it consistently over the blocks (t-test), whatever the noise's
    /// colour.
    fn is_better_than(&self, other: &Self, plan: &CoarsePlan) -> bool {
        let gains: Vec<f64> = self
            .by_block
            .iter()
            .zip(&other.by_block)
            .map(|(own, other)| {
                let of_gyro = |gyro: usize| {
                    (other[gyro] - own[gyro]) / self.left[gyro].max(f64::MIN_POSITIVE)
                };
                (0..3).map(of_gyro).sum()
            })
            .collect();
        let count = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / count;
        let squares = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>();
        let std_of_mean = (squares / (count * (count - 1.0).max(1.0))).sqrt();
        self.halves(other, plan) || mean > plan.far_deviations * std_of_mean
    }
}

/// Profile log-likelihood of white noise of `count` rows, up to a constant.
fn log_likelihood(regressions: impl Iterator<Item = Regression>, count: f64) -> f64 {
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
struct Lags {
    most: usize,
    /// Sums of each gyro, by lag from −most on.
    moments: Vec<[Moments; 3]>,
}

impl Lags {
    fn new(sensed: &Triad, case: &Triad, rows: &[bool], most: usize) -> Self {
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
    fn best(&self, gyros: &[usize], tie: f64) -> Option<f64> {
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
