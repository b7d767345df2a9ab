//! Noise levels before any effect is found, and in the terms of the report.

use rlg_inference::search::DriftPrior;
use rlg_inference::transform::Transform;
use rlg_inference::{Drift, NoiseLevels, Observations};
use rlg_model::Gyro;
use rlg_signal::quantiles::median;

use crate::tiles::noise_spectrum::Noise;
use rlg_signal::streams::{Triad, each_axis};

/// Fits noise levels to a residual as noise alone.
pub fn first_levels(residual_rad: &Triad, observations: &Observations) -> Vec<NoiseLevels> {
    // Ends and gaps are first projected out under flat noise, then under the noise of the first fit.
    let flat = NoiseLevels {
        white: 1.0,
        ..NoiseLevels::default()
    };
    let first = levels_under(flat, residual_rad, observations);
    levels_under(NoiseLevels::mean(&first), residual_rad, observations)
}

/// The same, with ends and gaps projected out under a known noise.
fn levels_under(
    known: NoiseLevels,
    residual_rad: &Triad,
    observations: &Observations,
) -> Vec<NoiseLevels> {
    let (transform, basis) = Transform::with_basis(observations.clone(), known);
    each_axis(|axis| {
        let spectrum = transform.spectrum(&residual_rad[axis]);
        let sum = |bin: &std::ops::Range<usize>| {
            let power: f64 = spectrum[bin.clone()].iter().map(|c| c * c).sum();
            power.max(f64::MIN_POSITIVE)
        };
        let power: Vec<f64> = basis.bins.iter().map(sum).collect();
        let density: Vec<f64> = power
            .iter()
            .zip(&basis.counts)
            .map(|(p, count)| p / count)
            .collect();
        let white = 0.5 * median(density.iter().copied()).unwrap_or(0.0);
        let ratios = density
            .iter()
            .zip(&basis.power[1])
            .map(|(p, lambda)| p / lambda);
        let start = NoiseLevels {
            white,
            angle: 0.5 * median(ratios).unwrap_or(0.0),
            flicker: white,
            walk: white,
        };
        basis.fit(&power, start, [true; 4])
    })
    .to_vec()
}

/// Reads each gyro's drift from the declaration of a model: a random walk if K is above 0, else flicker if B is, else none.
///
/// A declaration states the terms, not their levels, which are fitted all the same. Of K and B a key that is absent beside
/// the other counts as 0; if both are absent, drift is unknown.
pub fn drift_prior(gyro: &Gyro) -> DriftPrior {
    if gyro.rate_random_walk_rad_s_sqrt_s.is_none() && gyro.flicker_rad_s.is_none() {
        return DriftPrior::Unknown;
    }
    let walk_rad_s_sqrt_s = gyro.rate_random_walk_rad_s_sqrt_s.unwrap_or_default();
    let flicker_rad_s = gyro.flicker_rad_s.unwrap_or_default();
    let drift = each_axis(|axis| {
        if walk_rad_s_sqrt_s[axis] > 0.0 {
            Drift::Walk
        } else if flicker_rad_s[axis] > 0.0 {
            Drift::Flicker
        } else {
            Drift::None
        }
    });
    DriftPrior::Declared(drift.to_vec())
}

/// Joins the drift priors of the recordings.
pub(crate) fn joint_drift(each: impl Iterator<Item = DriftPrior>) -> DriftPrior {
    let mut declared = Vec::new();
    for drift in each {
        match drift {
            DriftPrior::Declared(drift) => declared.extend(drift),
            DriftPrior::Unknown => return DriftPrior::Unknown,
        }
    }
    DriftPrior::Declared(declared)
}

/// Levels per row as the report's θ at `rate_hz`.
pub fn reported(levels: NoiseLevels, rows: usize, rate_hz: f64) -> Noise {
    let record = rows as f64;
    Noise {
        theta: [
            levels.white,
            levels.angle,
            levels.flicker * rate_hz / record,
            levels.walk * (std::f64::consts::PI / record).powi(2),
        ],
        rate_hz,
    }
}

#[cfg(test)]
mod tests {
    use rlg_inference::Drift;
    use rlg_inference::search::DriftPrior;
    use rlg_model::Gyro;

    use super::drift_prior;

    #[test]
    fn a_declared_drift_is_the_strongest_term_of_each_gyro_and_an_absent_one_is_unknown() {
        let mut gyro = Gyro::default();
        assert_eq!(drift_prior(&gyro), DriftPrior::Unknown);
        gyro.flicker_rad_s = Some([0.0, 1e-9, 1e-9]);
        let declared = |drift: [Drift; 3]| DriftPrior::Declared(drift.to_vec());
        let flicker = [Drift::None, Drift::Flicker, Drift::Flicker];
        assert_eq!(drift_prior(&gyro), declared(flicker));
        gyro.rate_random_walk_rad_s_sqrt_s = Some([0.0, 0.0, 1e-10]);
        let both = [Drift::None, Drift::Flicker, Drift::Walk];
        assert_eq!(drift_prior(&gyro), declared(both));
        gyro.flicker_rad_s = None;
        gyro.rate_random_walk_rad_s_sqrt_s = Some([0.0; 3]);
        assert_eq!(drift_prior(&gyro), declared([Drift::None; 3]));
    }
}
