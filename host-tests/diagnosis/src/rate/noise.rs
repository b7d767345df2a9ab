//! Noise levels before anything is known, and in the terms of the report.

use rlg_inference::normal_equations::Transform;
use rlg_inference::{NoiseBasis, NoiseLevels, Observations};

use crate::noise::Noise;
use crate::streams::{Triad, each_axis};

/// Levels that explain a residual as noise alone.
pub fn first_levels(residual_rad: &Triad, observations: &Observations) -> Vec<NoiseLevels> {
    let basis = NoiseBasis::new(observations);
    // Ends and gaps weigh all frequencies alike where nothing is known.
    let flat = NoiseLevels {
        white: 1.0,
        ..NoiseLevels::default()
    };
    let transform = Transform::new(observations.clone(), &basis, flat);
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
        let white = 0.5 * median(&density);
        let ratios: Vec<f64> = density
            .iter()
            .zip(&basis.power[1])
            .map(|(p, lambda)| p / lambda)
            .collect();
        let start = NoiseLevels {
            white,
            angle: 0.5 * median(&ratios),
            flicker: white,
            walk: white,
        };
        basis.fit(&power, start, [true; 4])
    })
    .to_vec()
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
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
