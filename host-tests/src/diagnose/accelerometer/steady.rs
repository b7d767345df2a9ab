//! The same size in every regime, or no name (diagnosis road, step 7), for the accelerometers.
//!
//! Enters: the chosen effects, what they leave \[m/s per row\], the noise, the regimes. Leaves: amplitudes by regime
//! and the chance of their scatter. As for the gyros (invariance.rs), on the accelerometers' rows.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::felt::Felt;
use crate::diagnose::declare::REGRESSOR_FIDELITY;
use crate::diagnose::invariance::{Amplitude, Verdict};
use crate::diagnose::noise::Noise;
use crate::diagnose::portion::{Portion, inner};
use crate::diagnose::split::{Regime, intersect};
use crate::diagnose::streams::Triad;

/// An effect with less than this matched-filter SNR in a regime says nothing about itself there.
const LEAST_SNR: f64 = 3.0;

/// A regime with less than this share of the effect's power elsewhere shows only errors of the regressor.
const LEAST_SHARE: f64 = 1e-2;

/// What imperfect regressors and the covariance of the joint fit leave.
const SYSTEMATIC: f64 = 10.0 * REGRESSOR_FIDELITY;

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
    let strongest = measured
        .iter()
        .map(|(density, _)| *density)
        .fold(0.0, f64::max);
    let amplitudes: Vec<Amplitude> = measured
        .into_iter()
        .filter(|(density, _)| *density > LEAST_SHARE * strongest)
        .map(|(_, amplitude)| amplitude)
        .collect();
    let scatter: f64 = amplitudes
        .iter()
        .map(|a| (a.value - 1.0).powi(2) / (a.std * a.std + SYSTEMATIC * SYSTEMATIC))
        .sum();
    let degrees = (amplitudes.len() as f64 - 1.0).max(1.0);
    let p_value = if amplitudes.len() < 2 {
        1.0
    } else {
        ChiSquared::new(degrees).map_or(1.0, |law| law.sf(scatter))
    };
    Verdict {
        amplitudes,
        p_value,
    }
}
