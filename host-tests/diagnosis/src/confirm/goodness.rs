//! Tests the residual against the fitted noise, octave by octave (goodness of fit by χ²).
//!
//! A line fitted as drift leaves too little power below it; power of any kind beyond the terms of IEEE 952 leaves too much
//! somewhere. Either way the noise model is rejected, and the recording is not explained.

use rlg_inference::{NoiseBasis, NoiseLevels};
use rlg_plan::Plan;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Octave whose power departs from the fitted noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// Gyro.
    pub gyro: usize,
    /// Lower and upper edge, as a share of the row rate.
    pub band: [f64; 2],
    /// Power over that of the fitted noise.
    pub ratio: f64,
    /// Root mean square of the angle there \[rad\].
    pub angle_rms_rad: f64,
}

/// Octaves of a gyro whose power is too large or too small, by a p-value below the plan's, all octaves counted.
///
/// # Inputs
/// `residual`: coefficients of the residual.
pub fn misfits(
    basis: &NoiseBasis,
    residual: &[f64],
    levels: NoiseLevels,
    gyro: usize,
    plan: &Plan,
) -> Vec<Misfit> {
    let least = plan.judgement.misfit_first;
    let powers = basis.binned(levels);
    let rows = basis.coefficients();
    let mut octaves: Vec<(usize, f64, f64, f64)> = Vec::new();
    let levels = powers.iter().zip(&basis.power[1]);
    for ((bin, count), (power, lambda)) in basis.bins.iter().zip(&basis.counts).zip(levels) {
        let Some(octave) = (bin.start / least).checked_ilog2() else {
            continue;
        };
        let octave = octave as usize;
        octaves.resize(octaves.len().max(octave + 1), (0, 0.0, 0.0, 0.0));
        let energy: f64 = residual[bin.clone()].iter().map(|c| c * c).sum();
        let (end, sum, freedom, square) = &mut octaves[octave];
        *end = bin.end;
        *sum += energy / power;
        *square += energy / lambda / rows as f64;
        *freedom += count;
    }
    let tests = 6.0 * octaves.len() as f64;
    let share = |k: usize| 0.5 * k as f64 / rows as f64;
    let mut begin = least;
    let mut found = Vec::new();
    for (end, sum, freedom, square) in octaves {
        let band = [share(begin), share(end)];
        begin = end;
        let Ok(law) = ChiSquared::new(freedom) else {
            continue;
        };
        if tests * law.sf(sum).min(law.cdf(sum)) < plan.judgement.unexplained {
            found.push(Misfit {
                gyro,
                band,
                ratio: sum / freedom,
                angle_rms_rad: square.sqrt(),
            });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::misfits;
    use rlg_inference::{NoiseBasis, NoiseLevels, Observations};
    use rlg_plan::Plan;

    #[test]
    fn a_line_that_passes_for_drift_is_no_drift() {
        let rows = 4096;
        let basis = NoiseBasis::new(&Observations::bridged(&vec![true; rows]).expect("rows"));
        let plan = Plan::default();
        let white = NoiseLevels {
            white: 1.0,
            ..NoiseLevels::default()
        };
        let mut residual = vec![1.0; rows];
        assert_eq!(misfits(&basis, &residual, white, 0, &plan), []);
        residual[200] = 60.0;
        let start = NoiseLevels { walk: 1.0, ..white };
        let power =
            |bin: &std::ops::Range<usize>| residual[bin.clone()].iter().map(|c| c * c).sum::<f64>();
        let power: Vec<f64> = basis.bins.iter().map(power).collect();
        let fitted = basis.fit(&power, start, [true, true, false, true]);
        let found = misfits(&basis, &residual, fitted, 1, &plan);
        assert!(found.iter().any(|one| one.gyro == 1), "{fitted:?}");
    }
}
