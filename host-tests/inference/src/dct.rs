//! The orthonormal DCT-II, in which stationary noise with free ends is diagonal.
//!
//! After Makhoul ("A fast cosine transform in one and two dimensions", IEEE Trans. ASSP 28, 1980): one Fourier transform of
//! the reordered real values, by `realfft`. O(n log n) at any length, and half the work of a complex transform.

use std::f64::consts::PI;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use realfft::num_complex::Complex64;
use realfft::{RealFftPlanner, RealToComplex};

use crate::work::count_transform;

/// Transforms of one length.
#[derive(Clone)]
pub struct Dct {
    plan: Arc<Plan>,
}

/// Plans in use.
static PLANS: Mutex<Vec<Weak<Plan>>> = Mutex::new(Vec::new());

struct Plan {
    rows: usize,
    /// Common to both directions: at a length with a large prime factor a plan takes megabytes.
    fourier: Arc<dyn RealToComplex<f64>>,
    /// exp(−iπk/2n), k up to n/2.
    turns: Vec<Complex64>,
    /// Idle buffers for reuse: new ones of megabytes would be cleared by the system each time.
    idle: Mutex<Vec<Buffers>>,
}

/// Working memory of one transform.
struct Buffers {
    reordered: Vec<f64>,
    spectrum: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

impl Dct {
    /// Plans transforms of `rows` values, or shares a plan in use: its turns cost as much as several transforms.
    pub fn new(rows: usize) -> Self {
        // A plan is whole or absent: a panic leaves no partial one.
        let mut plans = PLANS.lock().unwrap_or_else(PoisonError::into_inner);
        plans.retain(|held| held.strong_count() > 0);
        let mut known = plans.iter().filter_map(Weak::upgrade);
        if let Some(plan) = known.find(|plan| plan.rows == rows) {
            return Self { plan };
        }
        let fresh = Self::planned(rows);
        plans.push(Arc::downgrade(&fresh.plan));
        fresh
    }

    fn planned(rows: usize) -> Self {
        let turns = (0..=rows / 2).map(|k| {
            let angle = -PI * k as f64 / (2 * rows) as f64;
            Complex64::from_polar(1.0, angle)
        });
        Self {
            plan: Arc::new(Plan {
                rows,
                fourier: RealFftPlanner::new().plan_fft_forward(rows),
                turns: turns.collect(),
                idle: Mutex::default(),
            }),
        }
    }

    /// Transforms `values` in place: coefficient k is `√(2/n) Σ y_i cos(π (i + ½) k / n)`, the first one `√(1/n) Σ y_i`.
    ///
    /// # Panics
    /// `values` is not as long as planned.
    pub fn forward(&self, values: &mut [f64]) {
        let plan = &*self.plan;
        let rows = plan.rows;
        assert_eq!(values.len(), rows, "values are as long as planned");
        let mut buffers = plan.buffers();
        for (row, value) in values.iter().enumerate() {
            buffers.reordered[reordered(row, rows)] = *value;
        }
        plan.transform(&mut buffers);
        let scale = (2.0 / rows as f64).sqrt();
        for (k, (value, turn)) in buffers.spectrum.iter().zip(&plan.turns).enumerate() {
            let turned = value * turn * scale;
            if k > 0 {
                values[rows - k] = -turned.im;
            }
            values[k] = turned.re;
        }
        values[0] *= 0.5_f64.sqrt();
        plan.give_back(buffers);
    }

    /// Inverts [`Dct::forward`].
    ///
    /// The real values of a spectrum V are the Hartley transform of Re V − Im V over n, equal to Re F − Im F of its Fourier
    /// transform F.
    ///
    /// # Panics
    /// `values` is not as long as planned.
    pub fn inverse(&self, values: &mut [f64]) {
        let plan = &*self.plan;
        let rows = plan.rows;
        assert_eq!(values.len(), rows, "values are as long as planned");
        let mut buffers = plan.buffers();
        let scale = (0.5 / rows as f64).sqrt();
        buffers.reordered[0] = values[0] / (rows as f64).sqrt();
        for (k, turn) in plan.turns.iter().enumerate().skip(1) {
            let value = Complex64::new(values[k], -values[rows - k]) * turn.conj() * scale;
            buffers.reordered[rows - k] = value.re + value.im;
            buffers.reordered[k] = value.re - value.im;
        }
        plan.transform(&mut buffers);
        for (row, value) in values.iter_mut().enumerate() {
            let place = reordered(row, rows);
            *value = if place <= rows / 2 {
                let of_place = buffers.spectrum[place];
                of_place.re - of_place.im
            } else {
                let mirrored = buffers.spectrum[rows - place];
                mirrored.re + mirrored.im
            };
        }
        plan.give_back(buffers);
    }

    /// Frees the idle buffers.
    pub fn release(&self) {
        self.plan
            .idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clear();
    }
}

impl Plan {
    fn transform(&self, buffers: &mut Buffers) {
        let Buffers {
            reordered,
            spectrum,
            scratch,
        } = buffers;
        count_transform();
        self.fourier
            .process_with_scratch(reordered, spectrum, scratch)
            .expect("lengths as planned");
    }

    fn buffers(&self) -> Buffers {
        let idle = self
            .idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop();
        idle.unwrap_or_else(|| Buffers {
            reordered: vec![0.0; self.rows],
            spectrum: vec![Complex64::default(); self.rows / 2 + 1],
            scratch: self.fourier.make_scratch_vec(),
        })
    }

    fn give_back(&self, buffers: Buffers) {
        self.idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(buffers);
    }
}

/// Place of a row for the Fourier transform: even rows ascending, then odd ones descending.
fn reordered(row: usize, rows: usize) -> usize {
    if row.is_multiple_of(2) {
        row / 2
    } else {
        rows - 1 - row / 2
    }
}

/// cos(π (first + i · stride) / 2n) of i from 0 to `count`, n being `rows`: basis functions of the transform, along rows or
/// along coefficients.
pub fn cosines(rows: usize, first: usize, stride: usize, count: usize) -> Vec<f64> {
    turned(rows, first, stride, count, |a, b| a.re * b.re - a.im * b.im)
}

/// sin(π k / 2n) of k from 0 to n (exclusive), n being `rows`.
pub fn sines(rows: usize) -> Vec<f64> {
    turned(rows, 0, 1, rows, |a, b| a.re * b.im + a.im * b.re)
}

/// `part` of the products of two points on the unit circle whose angles add up to π (first + i · stride) / 2n: one in a
/// block and one in a table, so that few trigonometric functions are evaluated.
fn turned(
    rows: usize,
    first: usize,
    stride: usize,
    count: usize,
    part: impl Fn(Complex64, Complex64) -> f64,
) -> Vec<f64> {
    /// Angles in the table.
    const BLOCK: usize = 256;
    // Whole numbers are reduced to one circle without rounding.
    let point = |place: usize| {
        let angle = PI * (place % (4 * rows)) as f64 / (2 * rows) as f64;
        Complex64::from_polar(1.0, angle)
    };
    let table: Vec<Complex64> = (0..BLOCK).map(|place| point(place * stride)).collect();
    let mut parts = Vec::with_capacity(count);
    while parts.len() < count {
        let start = point(first + parts.len() * stride);
        let rest = count - parts.len();
        parts.extend(table.iter().take(rest).map(|turn| part(start, *turn)));
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::{Dct, cosines, sines};

    #[test]
    fn a_cosine_of_the_basis_has_one_coefficient_of_unit_size_and_comes_back() {
        for rows in [7_usize, 30, 64] {
            let dct = Dct::new(rows);
            for k in 0..rows {
                let norm = if k == 0 { 1.0 } else { 2.0 } / rows as f64;
                let cosine = |row: usize| {
                    let phase = std::f64::consts::PI * (row as f64 + 0.5) * k as f64 / rows as f64;
                    norm.sqrt() * phase.cos()
                };
                let wave: Vec<f64> = (0..rows).map(cosine).collect();
                let mut values = wave.clone();
                dct.forward(&mut values);
                for (other, value) in values.iter().enumerate() {
                    let expected = if other == k { 1.0 } else { 0.0 };
                    assert!((value - expected).abs() < 1e-12, "{rows} {k} {other}");
                }
                dct.inverse(&mut values);
                for (value, wave) in values.iter().zip(&wave) {
                    assert!((value - wave).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn waves_are_cosines_along_rows_and_along_coefficients() {
        let rows = 1001;
        let exact = |row: usize, k: usize| {
            (std::f64::consts::PI * (row as f64 + 0.5) * k as f64 / rows as f64).cos()
        };
        let along_rows = cosines(rows, 7, 14, rows);
        let along_coefficients = cosines(rows, 0, 2 * 998 + 1, rows);
        for place in 0..rows {
            assert!((along_rows[place] - exact(place, 7)).abs() < 1e-12);
            assert!((along_coefficients[place] - exact(998, place)).abs() < 1e-12);
            let sine = (std::f64::consts::PI * place as f64 / (2 * rows) as f64).sin();
            assert!((sines(rows)[place] - sine).abs() <= 1e-15 * sine);
        }
    }
}
