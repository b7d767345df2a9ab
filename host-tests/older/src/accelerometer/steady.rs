//! The same size in every regime, or no name (diagnosis road, step 7), for the accelerometers.
//!
//! Enters: the chosen effects, what they leave \[m/s per row\], the noise, the regimes. Leaves: amplitudes by regime
//! and the chance of their scatter. As for the gyros (invariance.rs), on the accelerometers' rows, joints and mean
//! not freed again in each.

use super::felt::Felt;
use crate::invariance::{Amplitude, LEAST_SNR, Verdict, verdict};
use crate::noise::Noise;
use crate::portion::{Portion, inner};
use crate::split::{Regime, intersect};
use crate::streams::Triad;

/// Tests one effect by its `prediction` in what all of them `left`.
pub fn test(
    felt: &Felt,
    noise: &[Noise; 3],
    prediction: &Triad,
    left: &Triad,
    fitted: &[std::ops::Range<usize>],
    regimes: &[Regime],
) -> Verdict {
    let measured: Vec<(f64, Amplitude)> = regimes
        .iter()
        .filter_map(|regime| {
            let rows = intersect(std::slice::from_ref(&regime.rows), fitted);
            let portion = Portion::new(rows, felt.rows.rate_hz)?;
            let (mut own, mut found) = (0.0, 0.0);
            for axis in 0..3 {
                let weights = noise[axis].weights(&portion);
                let effect = portion.transform(&prediction[axis]);
                let rest = portion.transform(&left[axis]);
                own += inner(&effect, &effect, &weights);
                found += inner(&effect, &rest, &weights);
            }
            let amplitude = (own > LEAST_SNR * LEAST_SNR).then(|| Amplitude {
                regime: regime.name.clone(),
                value: 1.0 + found / own,
                std: own.sqrt().recip(),
            })?;
            Some((own / portion.seconds(), amplitude))
        })
        .collect();
    verdict(measured)
}
