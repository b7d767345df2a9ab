//! Steps of a gyro's bias and constants over a window, at any instant.
//!
//! Enters: the bench, and what is left of each gyro's residual after everything else. Leaves: the best step on each
//! gyro with its likelihood ratio and chance; for a window that is known roughly, its edges.
//!
//! Both have their power at low frequency, where their bins are a closed form of the instant: scanned on a grid, then
//! refined. A free constant and a free jump at every joint stand beside them.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use realfft::num_complex::Complex64;
use std::f64::consts::{SQRT_2, TAU};
use std::ops::Range;

use super::empirical::{Form, Term};
use super::events::{Event, event};
use super::information::stable_inverse;
use super::portion::{Bins, inner};
use super::workbench::Workbench;

/// A step's power above this frequency is lost in white angle noise.
const BAND_HZ: f64 = 40.0;

/// Spacing of the first scan \[s\]; the statistic is smooth over a few tenths of a second.
const GRID_S: f64 = 0.25;

/// Spacing after refinement \[s\].
const FINE_S: f64 = 0.01;

/// The best step on each gyro.
pub fn steps(bench: &Workbench, left: &[Bins; 3]) -> Vec<Event> {
    let scan = Scan::new(bench);
    let streams = &bench.scene().streams;
    let trials = 3.0 * bench.portion.seconds() / GRID_S;
    (0..3_usize)
        .into_par_iter()
        .filter_map(|axis| {
            let gyro = scan.on(axis, &left[axis]);
            let best = |from_s: f64, to_s: f64, spacing_s: f64| {
                let count = ((to_s - from_s) / spacing_s).floor().max(0.0) as usize;
                (0..=count)
                    .map(|k| from_s + k as f64 * spacing_s)
                    .map(|time_s| (time_s, gyro.ratio(&scan.step(streams.row_at(time_s)))))
                    .max_by(|a, b| a.1.total_cmp(&b.1))
            };
            let (coarse_s, _) = best(streams.start_s + 1.0, streams.end_s() - 1.0, GRID_S)?;
            let (time_s, ratio) = best(coarse_s - GRID_S, coarse_s + GRID_S, FINE_S)?;
            let form = Form::Step { time_s };
            Some(event(Term { axis, form }, ratio, trials))
        })
        .collect()
}

/// Rows of the constant on one gyro that explains most of what is `left`, no edge further than `within_rows` from
/// `rows`; one that lasts until its recording ends is a step, and does.
pub fn refined(
    bench: &Workbench,
    axis: usize,
    left: &Bins,
    rows: Range<usize>,
    within_rows: usize,
) -> Range<usize> {
    /// Rounds of one edge after the other: they hardly depend on each other.
    const ROUNDS: usize = 2;
    let scan = Scan::new(bench);
    let gyro = scan.on(axis, left);
    let streams = &bench.scene().streams;
    let fine = ((FINE_S * streams.rate_hz).round() as usize).max(1);
    let within = |row: usize| row.saturating_sub(within_rows)..=row + within_rows;
    let starts = within(rows.start).step_by(fine);
    let is_step = rows.end == streams.end_of_recording(rows.start);
    let ends = if is_step {
        rows.end..=rows.end
    } else {
        within(rows.end)
    }
    .step_by(fine);
    let ratio = |rows: Range<usize>| gyro.ratio(&scan.window(rows));
    let mut best = rows;
    for _ in 0..ROUNDS {
        let end = best.end;
        let start = starts.clone().filter(|start| *start < end);
        let start = start.max_by(|a, b| ratio(*a..end).total_cmp(&ratio(*b..end)));
        best.start = start.unwrap_or(best.start);
        let start = best.start;
        let end = ends.clone().filter(|end| *end > start);
        let end = end.max_by(|a, b| ratio(start..*a).total_cmp(&ratio(start..*b)));
        best.end = end.unwrap_or(best.end);
    }
    best
}

/// Low bins of the portion's rows, as the scan needs them.
struct Scan<'a> {
    bench: &'a Workbench<'a>,
    shape: StepShape,
    /// Where each stretch begins in the joined series, to turn rows into places.
    begins: Vec<(usize, Range<usize>)>,
    /// A constant and the joints.
    nuisance: Vec<Bins>,
}

impl<'a> Scan<'a> {
    fn new(bench: &'a Workbench<'a>) -> Self {
        let portion = &bench.portion;
        let bins = (1..portion.bins())
            .take_while(|&bin| portion.frequency_hz(bin) < BAND_HZ)
            .count()
            + 1;
        let mut first = 0;
        let begins: Vec<(usize, Range<usize>)> = portion
            .ranges
            .iter()
            .map(|range| {
                let begin = first;
                first += range.len();
                (begin, range.clone())
            })
            .collect();
        let shape = StepShape::new(portion.rows(), bins);
        let nuisance = std::iter::once(shape.bins(0))
            .chain(
                begins
                    .iter()
                    .map(|(begin, _)| impulse_bins(portion.rows(), *begin, bins)),
            )
            .collect();
        Self {
            bench,
            shape,
            begins,
            nuisance,
        }
    }

    fn place(&self, row: usize) -> usize {
        self.begins
            .iter()
            .find(|(_, range)| row < range.end)
            .map_or(self.bench.portion.rows(), |(begin, range)| {
                begin + row.saturating_sub(range.start)
            })
    }

    /// A step lasts until its recording ends.
    fn step(&self, row: usize) -> Bins {
        self.window(row..self.bench.scene().streams.end_of_recording(row))
    }

    fn window(&self, rows: Range<usize>) -> Bins {
        let mut window = self.shape.bins(self.place(rows.start));
        let end = self.place(rows.end);
        if end < self.bench.portion.rows() {
            let beyond = self.shape.bins(end);
            let pairs = window.iter_mut().zip(beyond);
            pairs.for_each(|(window, beyond)| *window -= beyond);
        }
        window
    }

    fn on<'s>(&'s self, axis: usize, left: &'s Bins) -> OnGyro<'s> {
        let bins = self.nuisance[0].len();
        let weights = self.bench.noise[axis].weights(&self.bench.portion)[..bins].to_vec();
        let product = |a: &[Complex64], b: &[Complex64]| inner(a, b, &weights);
        let scale: Vec<f64> = self
            .nuisance
            .iter()
            .map(|column| product(column, column).sqrt().recip())
            .collect();
        let gram = DMatrix::from_fn(scale.len(), scale.len(), |a, b| {
            product(&self.nuisance[a], &self.nuisance[b]) * scale[a] * scale[b]
        });
        let inverse = stable_inverse(&gram);
        let residual = &left[..bins];
        let against = DVector::from_fn(scale.len(), |a, _| {
            product(&self.nuisance[a], residual) * scale[a]
        });
        OnGyro {
            nuisance: &self.nuisance,
            fitted: &inverse * against,
            residual,
            weights,
            scale,
            inverse,
        }
    }
}

/// One gyro's residual beside its constant and joints.
struct OnGyro<'s> {
    nuisance: &'s [Bins],
    residual: &'s [Complex64],
    weights: Vec<f64>,
    scale: Vec<f64>,
    inverse: DMatrix<f64>,
    fitted: DVector<f64>,
}

impl OnGyro<'_> {
    /// 2 Δ ln L of a column.
    fn ratio(&self, column: &Bins) -> f64 {
        /// Less of it than this beside constant and joints says nothing.
        const OWN_SHARE: f64 = 1e-3;
        let product = |a: &[Complex64], b: &[Complex64]| inner(a, b, &self.weights);
        let cross = DVector::from_fn(self.scale.len(), |a, _| {
            product(&self.nuisance[a], column) * self.scale[a]
        });
        let own = product(column, column);
        let free = own - cross.dot(&(&self.inverse * &cross));
        if free <= OWN_SHARE * own {
            return 0.0;
        }
        (product(column, self.residual) - cross.dot(&self.fitted)).powi(2) / free
    }
}

/// Low bins of a series that is 1 from a place on, in closed form.
struct StepShape {
    rows: usize,
    /// √2/((1 − e^(−2πi bin/rows)) √rows) of each bin but the lowest.
    sums: Bins,
}

impl StepShape {
    fn new(rows: usize, bins: usize) -> Self {
        let scale = (2.0 / rows as f64).sqrt();
        let sum = |bin: usize| {
            let turn = Complex64::cis(-TAU * bin as f64 / rows as f64);
            scale / (Complex64::new(1.0, 0.0) - turn)
        };
        Self {
            rows,
            sums: (1..bins).map(sum).collect(),
        }
    }

    fn bins(&self, place: usize) -> Bins {
        let mean = (self.rows - place) as f64 / (self.rows as f64).sqrt();
        // One turn a bin; over a few thousand bins the product stays exact to 1e-12.
        let turn = Complex64::cis(-TAU * place as f64 / self.rows as f64);
        let mut from = Complex64::new(1.0, 0.0);
        let rest = self.sums.iter().map(|sum| {
            from *= turn;
            (from - 1.0) * sum
        });
        std::iter::once(Complex64::new(mean, 0.0))
            .chain(rest)
            .collect()
    }
}

/// Low bins of a series that is 1 at `place` alone.
fn impulse_bins(rows: usize, place: usize, bins: usize) -> Bins {
    let scale = 1.0 / (rows as f64).sqrt();
    (0..bins)
        .map(|bin| {
            let weight = if bin == 0 { scale } else { scale * SQRT_2 };
            Complex64::from_polar(weight, -TAU * (bin * place) as f64 / rows as f64)
        })
        .collect()
}
