//! Data interface of the search: per record its noise terms by bin, its energy, and its products with columns.
//!
//! Data of any kind are records of one likelihood; log-likelihoods of independent data add ([`JointLikelihood`]). Modelled
//! on `bilby/core/likelihood.py` (Ashton et al. 2019), whose joint and zero likelihoods serve the same ends.

use std::ops::Range;

use crate::hypothesis::{Hypothesis, Term};
use crate::noise::NoiseBasis;
use crate::normal_equations::NormalEquations;

/// Gaussian data with noise of unknown levels, as sums by frequency bin.
///
/// A column is identified by its place among those of its record's part: the same place denotes different columns in records
/// of different parts.
pub trait Likelihood: Sync {
    /// Number of records.
    fn record_count(&self) -> usize;

    /// Bins of a record, with counts and the power of each noise term \[the record's unit squared\].
    fn basis(&self, record: usize) -> &NoiseBasis;

    /// Σ of the squared record in each of its bins \[the record's unit squared\].
    fn energy(&self, record: usize) -> &[f64];

    /// Σ of the product of a record and a column in a bin, the column at unit power.
    fn moment(&self, record: usize, bin: usize, column: usize) -> f64;

    /// Σ of the product of two columns of a record's part in a bin, both at unit power.
    fn product(&self, record: usize, bin: usize, a: usize, b: usize) -> f64;

    /// Factor of a column of a record's part to unit power; 0 where it has none.
    fn scale(&self, record: usize, column: usize) -> f64;

    /// Nuisance parameters with flat priors, fitted with every set: by record those of its gaps; behind them constants of
    /// several records.
    fn free(&self) -> &[Hypothesis];

    /// Drift groups: records of one unit at one time, which drift together or not at all; ascending, all records.
    fn sisters(&self) -> Vec<Range<usize>>;
}

impl Likelihood for NormalEquations {
    fn record_count(&self) -> usize {
        NormalEquations::record_count(self)
    }

    fn basis(&self, _: usize) -> &NoiseBasis {
        &self.basis
    }

    fn energy(&self, record: usize) -> &[f64] {
        NormalEquations::energy(self, record)
    }

    fn moment(&self, record: usize, bin: usize, column: usize) -> f64 {
        NormalEquations::moment(self, record, bin, column)
    }

    fn product(&self, _: usize, bin: usize, a: usize, b: usize) -> f64 {
        NormalEquations::product(self, bin, a, b)
    }

    fn scale(&self, _: usize, column: usize) -> f64 {
        NormalEquations::scale(self, column)
    }

    fn free(&self) -> &[Hypothesis] {
        self.gaps()
    }

    fn sisters(&self) -> Vec<Range<usize>> {
        std::iter::once(0..NormalEquations::record_count(self)).collect()
    }
}

/// Independent data under common hypotheses: their log-likelihoods add. Records are numbered through all parts, in their
/// order.
pub struct JointLikelihood<'a, L> {
    parts: Vec<&'a L>,
    /// Part and place in it of each record.
    place: Vec<(usize, usize)>,
    free: Vec<Hypothesis>,
    sisters: Vec<Range<usize>>,
}

impl<'a, L: Likelihood> JointLikelihood<'a, L> {
    /// Joins parts.
    pub fn new(parts: Vec<&'a L>) -> Self {
        let (mut place, mut sisters) = (Vec::new(), Vec::new());
        let (mut of_records, mut of_several) = (Vec::new(), Vec::new());
        for (part, likelihood) in parts.iter().enumerate() {
            let first = place.len();
            let records = likelihood.record_count();
            place.extend((0..records).map(|record| (part, record)));
            let own = likelihood.sisters().into_iter();
            sisters.extend(own.map(|records| first + records.start..first + records.end));
            let moved = likelihood.free().iter().map(|one| behind(one, first));
            let mut moved: Vec<Hypothesis> = moved.collect();
            of_several.extend(moved.split_off(records.min(moved.len())));
            of_records.extend(moved);
        }
        of_records.extend(of_several);
        Self {
            parts,
            place,
            free: of_records,
            sisters,
        }
    }

    fn part(&self, record: usize) -> (&L, usize) {
        let (part, own) = self.place[record];
        (self.parts[part], own)
    }
}

/// Renumbers a part's hypothesis to records behind `first` others.
pub fn behind(hypothesis: &Hypothesis, first: usize) -> Hypothesis {
    let mut moved = hypothesis.clone();
    let terms = moved.terms.iter_mut().map(|Term { record, .. }| record);
    let fixed = moved.fixed.iter_mut().map(|one| &mut one.record);
    terms.chain(fixed).for_each(|record| *record += first);
    moved
}

impl<L: Likelihood> Likelihood for JointLikelihood<'_, L> {
    fn record_count(&self) -> usize {
        self.place.len()
    }

    fn basis(&self, record: usize) -> &NoiseBasis {
        let (part, own) = self.part(record);
        part.basis(own)
    }

    fn energy(&self, record: usize) -> &[f64] {
        let (part, own) = self.part(record);
        part.energy(own)
    }

    fn moment(&self, record: usize, bin: usize, column: usize) -> f64 {
        let (part, own) = self.part(record);
        part.moment(own, bin, column)
    }

    fn product(&self, record: usize, bin: usize, a: usize, b: usize) -> f64 {
        let (part, own) = self.part(record);
        part.product(own, bin, a, b)
    }

    fn scale(&self, record: usize, column: usize) -> f64 {
        let (part, own) = self.part(record);
        part.scale(own, column)
    }

    fn free(&self) -> &[Hypothesis] {
        &self.free
    }

    fn sisters(&self) -> Vec<Range<usize>> {
        self.sisters.clone()
    }
}

/// No data: every log-likelihood is 0, and the posterior of a search is its prior.
pub struct ZeroLikelihood {
    records: usize,
    basis: NoiseBasis,
}

impl ZeroLikelihood {
    /// A likelihood of `records` records without rows.
    pub fn new(records: usize) -> Self {
        Self {
            records,
            basis: NoiseBasis::empty(),
        }
    }
}

impl Likelihood for ZeroLikelihood {
    fn record_count(&self) -> usize {
        self.records
    }

    fn basis(&self, _: usize) -> &NoiseBasis {
        &self.basis
    }

    fn energy(&self, _: usize) -> &[f64] {
        &[]
    }

    fn moment(&self, _: usize, _: usize, _: usize) -> f64 {
        0.0
    }

    fn product(&self, _: usize, _: usize, _: usize, _: usize) -> f64 {
        0.0
    }

    fn scale(&self, _: usize, _: usize) -> f64 {
        0.0
    }

    fn free(&self) -> &[Hypothesis] {
        &[]
    }

    fn sisters(&self) -> Vec<Range<usize>> {
        std::iter::once(0..self.records).collect()
    }
}
