//! How well a fit predicts rows: log score, and goodness of fit by frequency.

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

/// Power of a residual over its noise, in a band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandPower {
    /// Squared coefficients over their noise, summed: χ² of `freedom` degrees.
    pub chi_squared: f64,
    /// Effective number of coefficients.
    pub freedom: f64,
}

/// Sums χ² over bins whose frequency \[cycles per row\] is within `band`.
pub fn band_power(
    basis: &NoiseBasis,
    spectrum: &[f64],
    levels: NoiseLevels,
    band: std::ops::Range<f64>,
) -> BandPower {
    let powers = basis.binned(levels);
    let mut sum = BandPower {
        chi_squared: 0.0,
        freedom: 0.0,
    };
    for (place, bin) in basis.bins.iter().enumerate() {
        if band.contains(&basis.frequency[place]) {
            let energy: f64 = spectrum[bin.clone()].iter().map(|c| c * c).sum();
            sum.chi_squared += energy / powers[place];
            sum.freedom += basis.counts[place];
        }
    }
    sum
}
