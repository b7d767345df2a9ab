//! Temperature and its derivative from a least-squares fit to the last samples of a thermometer.
//!
//! The samples \[s, K\] of the last `SPAN_S`, three at least, give T \[K\] and dT/dt \[K/s\] at an instant: least squares
//! with a parabola, which has no lag for constant curvature. A difference over the span is as noisy and lags by half of it:
//! 18 % too much for a unit that warms with a time constant of 30 s. At the span's end the fit's noise is 3 σ/√n of T and
//! √192 σ/(h √n) of dT/dt, for n samples in h.

use nalgebra::{DMatrix, DVector};

/// Span of the fit \[s\]: a unit's temperature changes within minutes.
const SPAN_S: f64 = 10.0;

/// Shortest span for a fitted curvature \[s\]: with samples of 5 mK at 10 Hz the derivative's noise is 8 mK/s, equal to the
/// lag of a straight line for a unit that warms by 10 K with 30 s.
const CURVED_FROM_S: f64 = 2.0;

/// Least number of fitted samples, if there are as many.
const FEWEST: usize = 3;

/// Shortest time between fits \[s\].
const REFIT_S: f64 = 0.05;

/// Current fit: T = T₀ + r (t − t₀) + c (t − t₀)².
#[derive(Debug, Clone, Copy, Default)]
pub struct Warming {
    /// t₀, time of the last fitted sample \[s\].
    fitted_s: Option<f64>,
    /// T₀, r, c \[K, K/s, K/s²\].
    coefficients: [f64; 3],
    /// Limit of the extrapolation \[s\]: until the next sample is due. If the thermometer stops, the last values hold.
    reach_s: f64,
}

impl Warming {
    /// Fits anew, if `known` \[s, K\], in the order of time, ends at least `REFIT_S` after the last fit.
    pub fn take(&mut self, known: &[(f64, f64)]) {
        let Some(&(last_s, last_k)) = known.last() else {
            return;
        };
        if self
            .fitted_s
            .is_some_and(|fitted_s| last_s < fitted_s + REFIT_S)
        {
            return;
        }
        let first = known.partition_point(|(time_s, _)| *time_s < last_s - SPAN_S);
        let recent = &known[first.min(known.len().saturating_sub(FEWEST))..];
        let span_s = last_s - recent[0].0;
        let most = if span_s < CURVED_FROM_S { 2 } else { 3 };
        let count = most.min(recent.len());
        let powers = DMatrix::from_fn(recent.len(), count, |row, power| {
            (recent[row].0 - last_s).powi(power as i32)
        });
        let values = DVector::from_iterator(recent.len(), recent.iter().map(|one| one.1 - last_k));
        // Samples at one instant determine no derivative.
        let normal = powers.tr_mul(&powers).cholesky();
        let fit = normal.map(|normal| normal.solve(&powers.tr_mul(&values)));
        self.coefficients = [last_k, 0.0, 0.0];
        for (sum, term) in self
            .coefficients
            .iter_mut()
            .zip(fit.iter().flat_map(|fit| fit.iter()))
        {
            *sum += term;
        }
        self.fitted_s = Some(last_s);
        let intervals = recent.len().saturating_sub(1).max(1);
        self.reach_s = REFIT_S.max(span_s / intervals as f64);
    }

    /// T \[K\] and dT/dt \[K/s\] at an instant; 0 before the first sample.
    pub fn at(&self, time_s: f64) -> [f64; 2] {
        let [value, rate, curvature] = self.coefficients;
        let after_s = (time_s - self.fitted_s.unwrap_or(time_s)).min(self.reach_s);
        [
            value + (rate + curvature * after_s) * after_s,
            rate + 2.0 * curvature * after_s,
        ]
    }
}
