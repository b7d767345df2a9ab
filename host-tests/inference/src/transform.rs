//! Transforms of the seen rows of a record, with the nuisance parameters of gaps and ends projected out.

use crate::dct::Dct;
use crate::free_rows::{FreeNumber, FreeRows};
use crate::gaps;
use crate::noise::{NoiseBasis, NoiseLevels};
use crate::observations::{Observations, Span};

/// Transforms of the spans of an [`Observations`], with the nuisance parameters of gaps and ends projected out.
pub struct Transform {
    observations: Observations,
    dct: Vec<Dct>,
    /// Nuisance parameters of each span.
    free: Vec<FreeRows>,
    /// 1/S of each coefficient, for the projection.
    weights: Vec<f64>,
}

impl Transform {
    /// Plans the transforms for a known noise.
    ///
    /// # Inputs
    /// `levels`: noise of the projection of gaps and ends.
    ///
    /// # Returns
    /// The transforms, and the noise terms with the remaining number of observations in each bin.
    pub fn with_basis(observations: Observations, levels: NoiseLevels) -> (Self, NoiseBasis) {
        Self::taking_out(observations, levels, |span| {
            let slow = gaps::slow(span).into_iter();
            gaps::ends(span).into_iter().chain(slow).collect()
        })
    }

    /// Plans the transforms with the nuisance parameters `free_in` a span.
    pub(crate) fn taking_out(
        observations: Observations,
        levels: NoiseLevels,
        free_in: impl Fn(&Span) -> Vec<FreeNumber>,
    ) -> (Self, NoiseBasis) {
        let mut basis = NoiseBasis::new(&observations);
        let weights = basis.weights(levels);
        let (mut dct, mut free) = (Vec::new(), Vec::new());
        let mut first = 0;
        for span in &observations.spans {
            let rows = span.rows.len();
            let plan = dct
                .iter()
                .zip(&observations.spans)
                .find(|(_, other)| other.rows.len() == rows)
                .map_or_else(|| Dct::new(rows), |(plan, _): (&Dct, _)| plan.clone());
            let of_span = &weights[first..first + rows];
            let spectrum_of = |one: &FreeNumber| gaps::spectrum(one, rows);
            let of_gaps = FreeRows::new(free_in(span), spectrum_of, of_span, &plan);
            let taken = of_gaps.leverage(of_span, &plan);
            basis.take_out(first..first + rows, |k| taken(k - first));
            drop(taken);
            first += rows;
            free.push(of_gaps);
            dct.push(plan);
        }
        let transform = Self {
            observations,
            dct,
            free,
            weights,
        };
        (transform, basis)
    }

    /// Coefficients of a record or column, nuisance parameters projected out.
    pub fn spectrum(&self, rows: &[f64]) -> Vec<f64> {
        let mut all = Vec::new();
        for (place, span) in self.observations.spans.iter().enumerate() {
            let mut values = span.bridge(rows);
            self.dct[place].forward(&mut values);
            self.take_out(place, all.len(), &mut values);
            if all.is_empty() {
                all = values;
            } else {
                all.extend(values);
            }
        }
        all
    }

    /// Coefficients of the slow nuisance parameters of a single span, gaps' ends projected out.
    pub(crate) fn slow(&self) -> Vec<Vec<f64>> {
        let mut slow: Vec<Vec<f64>> = match self.observations.spans.as_slice() {
            [span] => gaps::slow(span)
                .iter()
                .map(|one| gaps::spectrum(one, span.rows.len()))
                .collect(),
            _ => Vec::new(),
        };
        for one in &mut slow {
            self.take_out(0, 0, one);
        }
        slow
    }

    /// Projects the nuisance parameters of the span at `place`, whose coefficients begin at `first`, out of its `values`.
    fn take_out(&self, place: usize, first: usize, values: &mut [f64]) {
        let weights = &self.weights[first..first + values.len()];
        self.free[place].take_out(values, weights, &self.dct[place]);
    }

    /// Rows of a record or column whitened by the root of the noise of each coefficient \[σ\].
    ///
    /// # Inputs
    /// `roots`: roots of the noise power of every coefficient.
    pub fn whitened(&self, rows: &[f64], roots: &[f64]) -> Vec<f64> {
        let mut spectrum = self.spectrum(rows);
        let pairs = spectrum.iter_mut().zip(roots);
        pairs.for_each(|(value, root)| *value /= root);
        self.rows_of(&spectrum)
    }

    /// Transforms coefficients back to rows; rows outside all spans are 0.
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

    /// Frees the buffers of the transforms.
    pub fn release(&self) {
        self.dct.iter().for_each(Dct::release);
    }

    /// Spans of the seen rows.
    pub fn observations(&self) -> &Observations {
        &self.observations
    }
}
