//! How well a fit predicts rows: its log score.

use crate::noise::{NoiseBasis, NoiseLevels};

/// ln density of a record's residual under its noise, constants left out.
///
/// # Inputs
/// `spectrum`: coefficients of the residual on the rows that are scored.
pub fn log_score(basis: &NoiseBasis, spectrum: &[f64], levels: NoiseLevels) -> f64 {
    let powers = basis.binned(levels);
    let bins = basis.bins.iter().zip(&powers).zip(&basis.counts);
    -0.5 * bins
        .map(|((bin, power), count)| {
            let energy: f64 = spectrum[bin.clone()].iter().map(|c| c * c).sum();
            count * power.ln() + energy / power
        })
        .sum::<f64>()
}
