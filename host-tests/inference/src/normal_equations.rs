//! Normal equations by frequency bin: sums of all products between columns and records.
//!
//! Per bin: `G = Σ X Xᵀ`, `h = Σ X y`, `e = Σ y²`. A change of noise or of the set of columns is then small dense algebra;
//! rows are processed again only for new columns.

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::gaps;
use crate::hypothesis::{Hypothesis, Term};
use crate::linear::{dot, pseudo_inverse};
use crate::noise::{NoiseBasis, NoiseLevels};
use crate::observations::Observations;
use crate::transform::Transform;
use crate::work::count_columns;

/// Source of columns: they are formed one after the other and not stored.
pub trait Columns: Sync {
    /// Number of columns.
    fn count(&self) -> usize;
    /// One column on all rows of the record.
    fn column(&self, place: usize) -> Vec<f64>;
}

/// The sums, with the spectra for further columns.
pub struct NormalEquations {
    /// Bins and noise terms.
    pub basis: NoiseBasis,
    /// Transforms of rows.
    pub transform: Transform,
    /// Packed lower triangle of G, per bin.
    gram: Vec<Vec<f64>>,
    /// h, per record and bin.
    moments: Vec<Vec<Vec<f64>>>,
    /// e, per record and bin.
    energy: Vec<Vec<f64>>,
    /// Columns' coefficients, each scaled to unit power.
    spectra: Vec<Vec<f32>>,
    /// Scale of each column: 0 where it is empty.
    scale: Vec<f64>,
    /// Records' coefficients.
    records: Vec<Vec<f64>>,
    /// Nuisance parameters: of each record's gaps, followed by constants of several records, all with flat priors. Their
    /// columns precede all others.
    gaps: Vec<Hypothesis>,
    slow: usize,
    /// Number of columns of gaps and constants.
    leading: usize,
}

/// First column number of the nuisance parameters.
const SLOW: usize = usize::MAX / 2;

/// Coefficients multiplied at once, within the cache.
const CHUNK: usize = 512;

impl NormalEquations {
    /// Sums over the rows of `records` and `columns`.
    ///
    /// # Inputs
    /// `levels`: noise for the projection of ends; another noise later costs efficiency, never a bias.
    pub fn new(
        observations: Observations,
        records: &[Vec<f64>],
        columns: &impl Columns,
        levels: NoiseLevels,
    ) -> Self {
        Self::with_constants(observations, records, columns, levels, &[])
    }

    /// Sums with constants of unknown sizes as nuisance parameters.
    ///
    /// # Inputs
    /// `constants`: share of each in each record.
    pub fn with_constants(
        observations: Observations,
        records: &[Vec<f64>],
        columns: &impl Columns,
        levels: NoiseLevels,
        constants: &[Vec<f64>],
    ) -> Self {
        let one = Constant(observations.record_rows);
        let free = (!constants.is_empty()).then(|| (&one, constant_on(constants)));
        Self::beside(observations, records, columns, levels, free)
    }

    /// Sums with columns of unknown sizes as nuisance parameters.
    ///
    /// # Inputs
    /// `free`: the columns, and parameters with flat priors, whose terms refer to these columns.
    pub fn with_free(
        observations: Observations,
        records: &[Vec<f64>],
        columns: &impl Columns,
        levels: NoiseLevels,
        free: (&impl Columns, Hypothesis),
    ) -> Self {
        Self::beside(observations, records, columns, levels, Some(free))
    }

    fn beside(
        observations: Observations,
        records: &[Vec<f64>],
        columns: &impl Columns,
        levels: NoiseLevels,
        free: Option<(&impl Columns, Hypothesis)>,
    ) -> Self {
        let (transform, basis) = Transform::taking_out(observations, levels, gaps::ends);
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
        let slow = transform.slow();
        let mut gaps: Vec<Hypothesis> = (0..records.len())
            .map(|record| free_on(record, slow.len()))
            .collect();
        let mut leading: Vec<(Vec<f32>, f64)> = slow.iter().map(|one| scaled(one)).collect();
        if let Some((columns, mut parameters)) = free {
            for term in &mut parameters.terms {
                term.column += SLOW + slow.len();
            }
            leading.extend(spectra_of(columns, &transform));
            gaps.push(parameters);
        }
        let mut equations = Self {
            gram: vec![Vec::new(); bins],
            moments: vec![vec![Vec::new(); bins]; records.len()],
            energy,
            spectra: Vec::new(),
            scale: Vec::new(),
            records,
            basis,
            gaps,
            slow: slow.len(),
            leading: leading.len(),
            transform,
        };
        equations.push(leading);
        equations.add(columns);
        equations
    }

    /// Appends columns.
    pub fn add(&mut self, columns: &impl Columns) {
        let transformed = spectra_of(columns, &self.transform);
        self.transform.release();
        self.push(transformed);
    }

    /// Appends spectra, each with its scale.
    fn push(&mut self, transformed: Vec<(Vec<f32>, f64)>) {
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

    /// Removes all columns from `count` on.
    pub fn truncate(&mut self, count: usize) {
        let count = self.leading + count;
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
        self.spectra.len() - self.leading
    }

    /// Nuisance parameters of each record's gaps, followed by constants of several records, if any.
    pub fn gaps(&self) -> &[Hypothesis] {
        &self.gaps
    }

    /// Stored coefficients of a column, and the factor to its own unit.
    pub(crate) fn kept(&self, column: usize) -> (&[f32], f64) {
        let place = self.place(column);
        (&self.spectra[place], 1.0 / self.scale[place])
    }

    /// Storage place of a column.
    fn place(&self, column: usize) -> usize {
        if column >= SLOW {
            column - SLOW
        } else {
            column + self.leading
        }
    }

    /// Noise terms with the remaining number of observations in each bin, gaps integrated out under a noise.
    pub fn basis_beside_gaps(&self, levels: NoiseLevels) -> NoiseBasis {
        let mut basis = self.basis.clone();
        let weights: Vec<f64> = basis.binned(levels).iter().map(|s| 1.0 / s).collect();
        let gram = |bin: usize| {
            DMatrix::from_fn(self.slow, self.slow, |a, b| {
                weights[bin] * self.product(bin, SLOW + a, SLOW + b)
            })
        };
        let zero = DMatrix::zeros(self.slow, self.slow);
        let inverse = pseudo_inverse(&(0..basis.bins.len()).fold(zero, |sum, bin| sum + gram(bin)));
        let taken = (0..basis.bins.len()).map(|bin| (&inverse * gram(bin)).trace());
        basis.take_out_of_bins(taken);
        basis
    }

    /// Number of records.
    pub fn record_count(&self) -> usize {
        self.records.len()
    }

    /// Σ of the product of two columns in a bin, in the columns' own scale times [`NormalEquations::scale`] of each.
    pub fn product(&self, bin: usize, a: usize, b: usize) -> f64 {
        let (a, b) = (self.place(a), self.place(b));
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        self.gram[bin][high * (high + 1) / 2 + low]
    }

    /// Σ of the product of a column and a record in a bin, the column scaled by [`NormalEquations::scale`].
    pub fn moment(&self, record: usize, bin: usize, column: usize) -> f64 {
        self.moments[record][bin][self.place(column)]
    }

    /// Σ of the squared record in each bin.
    pub fn energy(&self, record: usize) -> &[f64] {
        &self.energy[record]
    }

    /// A record's coefficients.
    pub fn record(&self, record: usize) -> &[f64] {
        &self.records[record]
    }

    /// Factor of a column to unit power; 0 where it has none.
    pub fn scale(&self, column: usize) -> f64 {
        self.scale[self.place(column)]
    }

    /// A record's coefficients less a sum of columns, given as (column, size in the column's own unit).
    pub fn residual_spectrum(&self, record: usize, sizes: &[(usize, f64)]) -> Vec<f64> {
        let mut left = self.records[record].clone();
        for &(column, size) in sizes {
            let place = self.place(column);
            if self.scale[place] > 0.0 {
                let scaled = size / self.scale[place];
                for (value, part) in left.iter_mut().zip(&self.spectra[place]) {
                    *value -= scaled * f64::from(*part);
                }
            }
        }
        left
    }
}

/// Nuisance parameters of the gaps and ends of one record.
fn free_on(record: usize, count: usize) -> Hypothesis {
    let each = (0..count).map(|place| Term {
        parameter: place,
        record,
        column: SLOW + place,
        coefficient: 1.0,
    });
    Hypothesis::of_terms(count, each.collect())
}

/// A column of ones.
struct Constant(usize);

impl Columns for Constant {
    fn count(&self) -> usize {
        1
    }

    fn column(&self, _: usize) -> Vec<f64> {
        vec![1.0; self.0]
    }
}

/// Constants of several records as nuisance parameters, on column 0.
fn constant_on(constants: &[Vec<f64>]) -> Hypothesis {
    let each = constants
        .iter()
        .enumerate()
        .flat_map(|(parameter, shares)| {
            shares
                .iter()
                .enumerate()
                .map(move |(record, &coefficient)| Term {
                    parameter,
                    record,
                    column: 0,
                    coefficient,
                })
        });
    Hypothesis::of_terms(constants.len(), each.collect())
}

/// Columns at unit power, each with its scale.
fn spectra_of(columns: &impl Columns, transform: &Transform) -> Vec<(Vec<f32>, f64)> {
    count_columns(columns.count());
    (0..columns.count())
        .into_par_iter()
        .map(|place| scaled(&transform.spectrum(&columns.column(place))))
        .collect()
}

/// A column at unit power with its scale, 0 where it is empty.
fn scaled(spectrum: &[f64]) -> (Vec<f32>, f64) {
    let power: f64 = spectrum.iter().map(|c| c * c).sum();
    let scale = if power.is_finite() && power > LEAST_POWER {
        1.0 / power.sqrt()
    } else {
        0.0
    };
    (spectrum.iter().map(|c| (c * scale) as f32).collect(), scale)
}

/// Power below which a column is empty.
const LEAST_POWER: f64 = 1e-290;

/// Rows `from..` of the packed triangle of products, and the moments of their columns, in one bin.
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
