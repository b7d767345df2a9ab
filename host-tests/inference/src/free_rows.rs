//! Projection of nuisance parameters out of a span: impulses and boxes over its rows, of unknown size.
//!
//! With E their shapes, S the noise: y − E (EᵀS⁻¹E)⁻¹ EᵀS⁻¹ y (generalised least squares). Few are stored as spectra. For
//! many, as where a recorder lost scattered rows, spectra would take gigabytes, and their products minutes: they stay on
//! their rows. S⁻¹ between two rows of a DCT-II is c(i − j) + c(i + j + 1), c the cosine sum of 1/S over n: one transform
//! instead of a product for each pair.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use realfft::RealFftPlanner;

use crate::dct::Dct;
use crate::linear::{invert, pseudo_inverse};

/// A nuisance parameter: an impulse in a row, a box over some rows, or both.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeNumber {
    /// Row of the impulse, counted from the span's begin.
    pub impulse: Option<usize>,
    /// Rows of the box, counted from the span's begin, and its height.
    pub across: Option<(Range<usize>, f64)>,
}

/// Number of nuisance parameters above which rows cost less than spectra: two transforms against two products of each.
const FEW: usize = 24;

/// Nuisance parameters of a span under one noise, prepared for projection.
pub struct FreeRows {
    /// The shapes E.
    shapes: Shapes,
    /// (EᵀS⁻¹E)⁻¹.
    inverse: DMatrix<f64>,
}

enum Shapes {
    /// Spectra, in single precision to save memory.
    Spectra(Vec<Vec<f32>>),
    /// Nuisance parameters on their rows.
    Rows(Vec<FreeNumber>),
}

impl FreeRows {
    /// Prepares the projection of `numbers` out of spectra of `dct`.
    ///
    /// # Inputs
    /// `spectrum_of`: coefficients of one of them; `weights`: 1/S of each coefficient.
    pub fn new(
        numbers: Vec<FreeNumber>,
        spectrum_of: impl Fn(&FreeNumber) -> Vec<f64>,
        weights: &[f64],
        dct: &Dct,
    ) -> Self {
        if numbers.len() <= FEW {
            let single = |one: &FreeNumber| spectrum_of(one).iter().map(|c| *c as f32).collect();
            return Self::of_spectra(numbers.iter().map(single).collect(), weights);
        }
        Self::of_rows(numbers, weights, dct)
    }

    fn of_spectra(spectra: Vec<Vec<f32>>, weights: &[f64]) -> Self {
        Self {
            inverse: pseudo_inverse(&gram(&spectra, weights)),
            shapes: Shapes::Spectra(spectra),
        }
    }

    fn of_rows(numbers: Vec<FreeNumber>, weights: &[f64], dct: &Dct) -> Self {
        let rows = weights.len();
        let mut halves: Vec<f64> = weights.iter().map(|weight| weight / rows as f64).collect();
        halves[0] *= 0.5;
        halves.push(0.0);
        let between = cosine_sums(&halves);
        let count = numbers.len();
        let mut information = DMatrix::zeros(count, count);
        for (a, one) in numbers.iter().enumerate() {
            for (b, other) in numbers[..=a].iter().enumerate() {
                if let (Some(i), Some(j)) = (one.impulse, other.impulse) {
                    let sum = between[i.abs_diff(j)] + between[folded(i + j + 1, rows)];
                    information[(a, b)] = sum;
                    information[(b, a)] = sum;
                }
            }
        }
        for (a, one) in numbers.iter().enumerate() {
            if one.across.is_none() {
                continue;
            }
            let mut weighed = scattered(std::slice::from_ref(one), &[1.0], rows);
            through(&mut weighed, weights, dct);
            for (b, other) in numbers.iter().enumerate() {
                let sum = other.gather(&weighed);
                information[(a, b)] = sum;
                information[(b, a)] = sum;
            }
        }
        Self {
            inverse: invert(&information).0,
            shapes: Shapes::Rows(numbers),
        }
    }

    /// Projects them out of the coefficients `values`.
    pub fn take_out(&self, values: &mut [f64], weights: &[f64], dct: &Dct) {
        match &self.shapes {
            Shapes::Spectra(spectra) => {
                let groups = spectra.chunks(SIDE_BY_SIDE);
                let score = groups.flat_map(|group| scores(group, values, weights));
                let sizes = &self.inverse * DVector::from_iterator(spectra.len(), score);
                // A block of values stays in the cache for all shapes.
                for (block, values) in values.chunks_mut(BLOCK).enumerate() {
                    for (shape, size) in spectra.iter().zip(sizes.iter()) {
                        for (value, part) in values.iter_mut().zip(&shape[block * BLOCK..]) {
                            *value -= size * f64::from(*part);
                        }
                    }
                }
            }
            Shapes::Rows(numbers) => {
                let mut weighed: Vec<f64> =
                    values.iter().zip(weights).map(|(a, b)| a * b).collect();
                dct.inverse(&mut weighed);
                let score = numbers.iter().map(|one| one.gather(&weighed));
                let sizes = &self.inverse * DVector::from_iterator(numbers.len(), score);
                let mut taken = scattered(numbers, sizes.as_slice(), values.len());
                dct.forward(&mut taken);
                for (value, part) in values.iter_mut().zip(&taken) {
                    *value -= part;
                }
            }
        }
    }

    /// Leverage: share of a coefficient's power removed, the diagonal of E (EᵀS⁻¹E)⁻¹ Eᵀ S⁻¹.
    ///
    /// # Returns
    /// The share of coefficient k.
    pub fn leverage<'a>(&'a self, weights: &'a [f64], dct: &Dct) -> Box<dyn Fn(usize) -> f64 + 'a> {
        match &self.shapes {
            Shapes::Spectra(spectra) => Box::new(|k| {
                let at = spectra.iter().map(|shape| f64::from(shape[k]));
                let at = DVector::from_iterator(spectra.len(), at);
                at.dot(&(&self.inverse * &at)) * weights[k]
            }),
            Shapes::Rows(numbers) => {
                let squares = self.squares_of_rows(numbers, weights.len(), dct);
                Box::new(move |k| squares[k] * weights[k])
            }
        }
    }

    /// Diagonal of E (EᵀS⁻¹E)⁻¹ Eᵀ: impulses by one cosine sum over their distances, boxes by a transform each.
    fn squares_of_rows(&self, numbers: &[FreeNumber], rows: usize, dct: &Dct) -> Vec<f64> {
        let mut by_distance = vec![0.0; rows + 1];
        for (a, one) in numbers.iter().enumerate() {
            for (b, other) in numbers.iter().enumerate() {
                if let (Some(i), Some(j)) = (one.impulse, other.impulse) {
                    let part = self.inverse[(a, b)] / rows as f64;
                    by_distance[i.abs_diff(j)] += part;
                    by_distance[folded(i + j + 1, rows)] += part;
                }
            }
        }
        let mut squares = cosine_sums(&by_distance);
        squares.truncate(rows);
        squares[0] *= 0.5;
        let only = |keep: fn(&FreeNumber) -> FreeNumber| -> Vec<FreeNumber> {
            numbers.iter().map(keep).collect()
        };
        let impulses = only(|one| FreeNumber {
            across: None,
            ..one.clone()
        });
        let boxes = only(|one| FreeNumber {
            impulse: None,
            ..one.clone()
        });
        for (a, one) in boxes.iter().enumerate() {
            if one.across.is_none() {
                continue;
            }
            let mut own = scattered(std::slice::from_ref(one), &[1.0], rows);
            dct.forward(&mut own);
            let column = self.inverse.column(a);
            for (others, factor) in [(&impulses, 2.0), (&boxes, 1.0)] {
                let mut beside = scattered(others, column.as_slice(), rows);
                dct.forward(&mut beside);
                let pairs = squares.iter_mut().zip(&own).zip(&beside);
                pairs.for_each(|((square, own), other)| *square += factor * own * other);
            }
        }
        squares
    }
}

impl FreeNumber {
    /// Dot product of its shape with rows.
    fn gather(&self, rows: &[f64]) -> f64 {
        let impulse = self.impulse.map_or(0.0, |row| rows[row]);
        let across = self.across.as_ref();
        impulse
            + across.map_or(0.0, |(over, height)| {
                height * rows[over.clone()].iter().sum::<f64>()
            })
    }
}

/// Sum of shapes of given sizes, on rows.
fn scattered(numbers: &[FreeNumber], sizes: &[f64], rows: usize) -> Vec<f64> {
    let mut sum = vec![0.0; rows];
    for (one, size) in numbers.iter().zip(sizes) {
        if let Some(row) = one.impulse {
            sum[row] += size;
        }
        if let Some((over, height)) = &one.across {
            sum[over.clone()]
                .iter_mut()
                .for_each(|value| *value += size * height);
        }
    }
    sum
}

/// Filters rows by 1/S.
fn through(rows: &mut [f64], weights: &[f64], dct: &Dct) {
    dct.forward(rows);
    rows.iter_mut()
        .zip(weights)
        .for_each(|(value, weight)| *value *= weight);
    dct.inverse(rows);
}

/// Reflects a place on the circle of 2n into 0 to n.
fn folded(place: usize, rows: usize) -> usize {
    place.min(2 * rows - place)
}

/// Σ_d h(d) cos(πkd/n) of d from 0 to n, for k from 0 to n.
fn cosine_sums(h: &[f64]) -> Vec<f64> {
    let rows = h.len() - 1;
    let mut around = vec![0.0; 2 * rows];
    around[0] = h[0];
    around[rows] = h[rows];
    for place in 1..rows {
        around[place] = 0.5 * h[place];
        around[2 * rows - place] = 0.5 * h[place];
    }
    let forward = RealFftPlanner::new().plan_fft_forward(2 * rows);
    let mut spectrum = forward.make_output_vec();
    forward
        .process(&mut around, &mut spectrum)
        .expect("lengths as planned");
    spectrum.iter().map(|value| value.re).collect()
}

/// Number of shapes summed in parallel: each sum is unchanged to the last bit, and additions do not wait for one another.
const SIDE_BY_SIDE: usize = 4;

/// Values of a block of a subtraction.
const BLOCK: usize = 2048;

/// EᵀS⁻¹ y of at most `SIDE_BY_SIDE` shapes.
fn scores(group: &[Vec<f32>], values: &[f64], weights: &[f64]) -> Vec<f64> {
    match group.len() {
        1 => scores_of::<1>(group, values, weights).to_vec(),
        2 => scores_of::<2>(group, values, weights).to_vec(),
        3 => scores_of::<3>(group, values, weights).to_vec(),
        _ => scores_of::<SIDE_BY_SIDE>(group, values, weights).to_vec(),
    }
}

/// EᵀS⁻¹ y of `N` shapes.
fn scores_of<const N: usize>(group: &[Vec<f32>], values: &[f64], weights: &[f64]) -> [f64; N] {
    let rows = values.len().min(weights.len());
    let (values, weights) = (&values[..rows], &weights[..rows]);
    let shapes: [&[f32]; N] = std::array::from_fn(|place| &group[place][..rows]);
    let mut sums = [0.0; N];
    for row in 0..rows {
        for (sum, shape) in sums.iter_mut().zip(shapes) {
            *sum += f64::from(shape[row]) * values[row] * weights[row];
        }
    }
    sums
}

/// EᵀS⁻¹E of spectra.
fn gram(spectra: &[Vec<f32>], weights: &[f64]) -> DMatrix<f64> {
    let count = spectra.len();
    let mut gram = DMatrix::zeros(count, count);
    for (a, one) in spectra.iter().enumerate() {
        let one: Vec<f64> = one.iter().map(|value| f64::from(*value)).collect();
        let groups = spectra[..=a].chunks(SIDE_BY_SIDE);
        for (b, sum) in groups
            .flat_map(|group| scores(group, &one, weights))
            .enumerate()
        {
            gram[(a, b)] = sum;
            gram[(b, a)] = sum;
        }
    }
    gram
}

#[cfg(test)]
mod tests {
    use super::{FreeNumber, FreeRows, scattered};
    use crate::dct::Dct;

    #[test]
    fn rows_and_spectra_take_the_same_out() {
        const ROWS: usize = 300;
        let dct = Dct::new(ROWS);
        // Angle random walk and white noise of angle: neighbouring rows are strongly correlated.
        let weights: Vec<f64> = (0..ROWS)
            .map(|k| {
                let sine = (std::f64::consts::PI * k as f64 / (2 * ROWS) as f64).sin();
                1.0 / (0.03 + 4.0 * sine * sine)
            })
            .collect();
        let impulse = |row: usize| FreeNumber {
            impulse: Some(row),
            across: None,
        };
        let mut numbers: Vec<FreeNumber> = [0, 3, 4, 90, 91, 92, 200, 299].map(impulse).to_vec();
        numbers.push(FreeNumber {
            impulse: Some(120),
            across: Some((120..160, -1.0 / 40.0)),
        });
        numbers.push(FreeNumber {
            impulse: None,
            across: Some((120..160, 1.0)),
        });
        let spectrum_of = |one: &FreeNumber| {
            let mut rows = scattered(std::slice::from_ref(one), &[1.0], ROWS);
            dct.forward(&mut rows);
            rows
        };
        let single = |one: &FreeNumber| spectrum_of(one).iter().map(|c| *c as f32).collect();
        let by_spectra = FreeRows::of_spectra(numbers.iter().map(single).collect(), &weights);
        let by_rows = FreeRows::of_rows(numbers, &weights, &dct);
        let values: Vec<f64> = (0..ROWS).map(|k| ((k * k) as f64 * 0.37).sin()).collect();
        let [mut one, mut other] = [values.clone(), values];
        by_spectra.take_out(&mut one, &weights, &dct);
        by_rows.take_out(&mut other, &weights, &dct);
        // Single precision of the spectra, amplified by an inverse of condition some thousand.
        for (a, b) in one.iter().zip(&other) {
            assert!((a - b).abs() < 1e-4, "{a} {b}");
        }
        let shares = [&by_spectra, &by_rows].map(|free| -> Vec<f64> {
            let leverage = free.leverage(&weights, &dct);
            (0..ROWS).map(leverage).collect()
        });
        for (a, b) in shares[0].iter().zip(&shares[1]) {
            assert!((a - b).abs() < 1e-4, "{a} {b}");
        }
        let sum: f64 = shares[1].iter().sum();
        assert!((sum - 10.0).abs() < 1e-6, "{sum}");
    }
}
