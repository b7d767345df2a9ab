//! Sums over frequency bins of all products between columns and records.
//!
//! Per bin: `G = Σ X Xᵀ`, `h = Σ X y`, `e = Σ y²`. A change of noise or of the set of columns is then small dense
//! algebra; rows are passed over again only for new columns.

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::dct::{Dct, cosines};
use crate::noise::{NoiseBasis, NoiseLevels};
use crate::observations::Observations;

/// Where columns come from: they are formed one after the other and not kept.
pub trait Columns: Sync {
    /// Number of columns.
    fn count(&self) -> usize;
    /// One column on all rows of the record.
    fn column(&self, place: usize) -> Vec<f64>;
}

/// Transforms of the spans of an [`Observations`], with the rows at which differenced noise is not stationary taken out.
pub struct Transform {
    observations: Observations,
    dct: Vec<Dct>,
    /// Spectra of unit impulses at the edges of each span: in single precision, for they are many.
    edges: Vec<Vec<Vec<f32>>>,
    /// 1/S of each coefficient, for taking the edges out.
    weights: Vec<f64>,
    /// Inverse of EᵀS⁻¹E of each span.
    solve: Vec<DMatrix<f64>>,
}

impl Transform {
    /// Plans the transforms.
    ///
    /// # Inputs
    /// `levels`: noise under which the edges are taken out; another noise later costs efficiency, never a bias.
    pub fn new(observations: Observations, basis: &NoiseBasis, levels: NoiseLevels) -> Self {
        let weights: Vec<f64> = basis
            .by_coefficient(levels)
            .into_iter()
            .map(|power| 1.0 / power)
            .collect();
        let (mut dct, mut edges, mut solve) = (Vec::new(), Vec::new(), Vec::new());
        let mut first = 0;
        for span in &observations.spans {
            let rows = span.rows.len();
            let plan = dct
                .iter()
                .zip(&observations.spans)
                .find(|(_, other)| other.rows.len() == rows)
                .map_or_else(|| Dct::new(rows), |(plan, _): (&Dct, _)| plan.clone());
            let impulses: Vec<Vec<f32>> = span
                .edges()
                .into_iter()
                .map(|edge| impulse(rows, edge))
                .collect();
            let of_span = &weights[first..first + rows];
            let information = DMatrix::from_fn(impulses.len(), impulses.len(), |a, b| {
                let products = impulses[a].iter().zip(&impulses[b]).zip(of_span);
                products
                    .map(|((a, b), weight)| f64::from(*a) * f64::from(*b) * weight)
                    .sum()
            });
            let inverse = information
                .clone()
                .try_inverse()
                .unwrap_or_else(|| DMatrix::zeros(impulses.len(), impulses.len()));
            solve.push(inverse);
            edges.push(impulses);
            dct.push(plan);
            first += rows;
        }
        Self {
            observations,
            dct,
            edges,
            weights,
            solve,
        }
    }

    /// Coefficients of a record or column on all rows, edges taken out.
    pub fn spectrum(&self, rows: &[f64]) -> Vec<f64> {
        let mut all = Vec::new();
        for (place, span) in self.observations.spans.iter().enumerate() {
            let mut values = span.bridge(rows);
            self.dct[place].forward(&mut values);
            let weights = &self.weights[all.len()..all.len() + values.len()];
            let impulses = &self.edges[place];
            let score = nalgebra::DVector::from_iterator(
                impulses.len(),
                impulses.iter().map(|impulse| {
                    let products = impulse.iter().zip(&values).zip(weights);
                    products
                        .map(|((a, b), weight)| f64::from(*a) * b * weight)
                        .sum::<f64>()
                }),
            );
            let sizes = &self.solve[place] * score;
            for (impulse, size) in impulses.iter().zip(sizes.iter()) {
                for (value, part) in values.iter_mut().zip(impulse) {
                    *value -= size * f64::from(*part);
                }
            }
            if all.is_empty() {
                all = values;
            } else {
                all.extend(values);
            }
        }
        all
    }

    /// Puts coefficients back on rows; rows outside all spans are 0.
    pub fn rows_of(&self, spectrum: &[f64]) -> Vec<f64> {
        let mut rows = vec![0.0; self.observations.record_rows];
        let mut first = 0;
        for (span, dct) in self.observations.spans.iter().zip(&self.dct) {
            let mut values = spectrum[first..first + span.rows.len()].to_vec();
            dct.inverse(&mut values);
            rows[span.rows.clone()].copy_from_slice(&values);
            first += span.rows.len();
        }
        rows
    }

    /// Frees what the transforms keep for the next.
    pub fn release(&self) {
        self.dct.iter().for_each(Dct::release);
    }

    /// Which rows are seen.
    pub fn observations(&self) -> &Observations {
        &self.observations
    }
}

/// Coefficients of 1 in row `edge` of a span of `rows`.
fn impulse(rows: usize, edge: usize) -> Vec<f32> {
    let scale = (2.0 / rows as f64).sqrt();
    let waves = cosines(rows, 0, 2 * edge + 1, rows);
    let mut impulse: Vec<f32> = waves.iter().map(|wave| (scale * wave) as f32).collect();
    impulse[0] = (1.0 / rows as f64).sqrt() as f32;
    impulse
}

/// The sums, with what is needed to add columns.
pub struct NormalEquations {
    /// Bins and noise terms.
    pub basis: NoiseBasis,
    /// Transforms of rows.
    pub transform: Transform,
    /// Per bin the packed lower triangle of G.
    gram: Vec<Vec<f64>>,
    /// Per record and bin, h.
    moments: Vec<Vec<Vec<f64>>>,
    /// Per record and bin, e.
    energy: Vec<Vec<f64>>,
    /// Columns' coefficients, each scaled to unit power.
    spectra: Vec<Vec<f32>>,
    /// Scale of each column: 0 where it is empty.
    scale: Vec<f64>,
    /// Records' coefficients.
    records: Vec<Vec<f64>>,
}

/// Coefficients that are multiplied at once, to stay within the cache.
const CHUNK: usize = 512;

impl NormalEquations {
    /// Passes over the rows of `records` and `columns`.
    ///
    /// # Inputs
    /// `levels`: the noise under which gaps and ends are taken out.
    pub fn new(
        observations: Observations,
        records: &[Vec<f64>],
        columns: &impl Columns,
        levels: NoiseLevels,
    ) -> Self {
        let basis = NoiseBasis::new(&observations);
        let transform = Transform::new(observations, &basis, levels);
        let records: Vec<Vec<f64>> = records
            .par_iter()
            .map(|record| transform.spectrum(record))
            .collect();
        let energy = records
            .iter()
            .map(|record| {
                let sum =
                    |bin: &std::ops::Range<usize>| record[bin.clone()].iter().map(|c| c * c).sum();
                basis.bins.iter().map(sum).collect()
            })
            .collect();
        let bins = basis.bins.len();
        let mut equations = Self {
            gram: vec![Vec::new(); bins],
            moments: vec![vec![Vec::new(); bins]; records.len()],
            energy,
            spectra: Vec::new(),
            scale: Vec::new(),
            records,
            basis,
            transform,
        };
        equations.add(columns);
        equations
    }

    /// Adds columns behind those that are there.
    pub fn add(&mut self, columns: &impl Columns) {
        let transformed: Vec<(Vec<f32>, f64)> = (0..columns.count())
            .into_par_iter()
            .map(|place| {
                let spectrum = self.transform.spectrum(&columns.column(place));
                let power: f64 = spectrum.iter().map(|c| c * c).sum();
                let scale = if power.is_finite() && power > LEAST_POWER {
                    1.0 / power.sqrt()
                } else {
                    0.0
                };
                (spectrum.iter().map(|c| (c * scale) as f32).collect(), scale)
            })
            .collect();
        self.transform.release();
        let before = self.spectra.len();
        for (spectrum, scale) in transformed {
            self.spectra.push(spectrum);
            self.scale.push(scale);
        }
        let (spectra, records) = (&self.spectra, &self.records);
        let sums: Vec<(Vec<f64>, Vec<Vec<f64>>)> = self
            .basis
            .bins
            .par_iter()
            .map(|bin| products(spectra, records, before, bin.clone()))
            .collect();
        for (bin, (gram, moments)) in sums.into_iter().enumerate() {
            self.gram[bin].extend(gram);
            for (record, moments) in moments.into_iter().enumerate() {
                self.moments[record][bin].extend(moments);
            }
        }
    }

    /// Forgets all columns from `count` on.
    pub fn truncate(&mut self, count: usize) {
        self.spectra.truncate(count);
        self.scale.truncate(count);
        for gram in &mut self.gram {
            gram.truncate(count * (count + 1) / 2);
        }
        for moments in self.moments.iter_mut().flatten() {
            moments.truncate(count);
        }
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.spectra.len()
    }

    /// Number of records.
    pub fn record_count(&self) -> usize {
        self.records.len()
    }

    /// Σ of the product of two columns in a bin, in the columns' own scale times [`NormalEquations::scale`] of each.
    pub fn product(&self, bin: usize, a: usize, b: usize) -> f64 {
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        self.gram[bin][high * (high + 1) / 2 + low]
    }

    /// Σ of the product of a column and a record in a bin, the column scaled by [`NormalEquations::scale`].
    pub fn moment(&self, record: usize, bin: usize, column: usize) -> f64 {
        self.moments[record][bin][column]
    }

    /// Σ of the squared record in each bin.
    pub fn energy(&self, record: usize) -> &[f64] {
        &self.energy[record]
    }

    /// A record's coefficients.
    pub fn record(&self, record: usize) -> &[f64] {
        &self.records[record]
    }

    /// Factor that brings a column to unit power; 0 where it has none.
    pub fn scale(&self, column: usize) -> f64 {
        self.scale[column]
    }

    /// A record's coefficients less a sum of columns, given as (column, size in the column's own unit).
    pub fn residual_spectrum(&self, record: usize, sizes: &[(usize, f64)]) -> Vec<f64> {
        let mut left = self.records[record].clone();
        for &(column, size) in sizes {
            if self.scale[column] > 0.0 {
                let scaled = size / self.scale[column];
                for (value, part) in left.iter_mut().zip(&self.spectra[column]) {
                    *value -= scaled * f64::from(*part);
                }
            }
        }
        left
    }
}

/// Power below which a column is empty.
const LEAST_POWER: f64 = 1e-290;

/// Rows `from..` of the packed triangle of products, and the moments of those columns, in one bin.
fn products(
    spectra: &[Vec<f32>],
    records: &[Vec<f64>],
    from: usize,
    bin: std::ops::Range<usize>,
) -> (Vec<f64>, Vec<Vec<f64>>) {
    let count = spectra.len();
    let size = count * (count + 1) / 2 - from * (from + 1) / 2;
    let mut gram = vec![0.0; size];
    let mut moments = vec![vec![0.0; count - from]; records.len()];
    let mut block = vec![0.0; count * CHUNK];
    let mut begin = bin.start;
    while begin < bin.end {
        let end = (begin + CHUNK).min(bin.end);
        let length = end - begin;
        for (column, spectrum) in spectra.iter().enumerate() {
            let wide = &mut block[column * CHUNK..column * CHUNK + length];
            for (wide, value) in wide.iter_mut().zip(&spectrum[begin..end]) {
                *wide = f64::from(*value);
            }
        }
        let column = |place: usize| &block[place * CHUNK..place * CHUNK + length];
        let mut at = 0;
        for a in from..count {
            for b in 0..=a {
                gram[at] += dot(column(a), column(b));
                at += 1;
            }
            for (record, moments) in records.iter().zip(&mut moments) {
                moments[a - from] += dot(column(a), &record[begin..end]);
            }
        }
        begin = end;
    }
    (gram, moments)
}

/// Σ a b, in eight sums side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_eight, b_eight) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a_eight
        .remainder()
        .iter()
        .zip(b_eight.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in a_eight.zip(b_eight) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}
