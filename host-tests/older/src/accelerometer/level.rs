//! How noisy the accelerometers are before anything is fitted.
//!
//! Enters: the residual \[m/s per row\] or the model. Leaves: the noise from which a fit starts, and what the model
//! declares of it, both as θ of noise.rs: white noise of the force is a random walk of the velocity.

use std::ops::Range;

use super::felt::Felt;
use crate::noise::{Declared, Noise};
use crate::split::{Split, intersect};
use crate::streams::Triad;
use rlg_model::Model;

/// White noise of each accelerometer as the quietest regime shows it between neighbouring rows.
pub fn quiet_noise(felt: &Felt, residual: &Triad, split: &Split) -> [Noise; 3] {
    [0, 1, 2].map(|axis: usize| {
        let level = |rows: &[Range<usize>]| {
            let mut steps: Vec<f64> = rows
                .iter()
                .flat_map(|rows| residual[axis][rows.clone()].windows(2))
                .map(|pair| (pair[1] - pair[0]).abs())
                .collect();
            steps.sort_by(f64::total_cmp);
            // Median of |difference| of two normals: 0.6745 √2 σ.
            steps
                .get(steps.len() / 2)
                .map(|median| (median / 0.954).powi(2))
        };
        let levels = split.regimes.iter().filter_map(|regime| {
            level(&intersect(
                std::slice::from_ref(&regime.rows),
                &split.fitted,
            ))
        });
        let white = levels
            .filter(|level| *level > 0.0)
            .fold(f64::INFINITY, f64::min);
        let white = if white.is_finite() {
            white
        } else {
            f64::MIN_POSITIVE.sqrt()
        };
        start_noise(white, felt.rows.rate_hz)
    })
}

/// Where the noise fit starts: white force noise; everything else small, growing only if the data pull it.
pub fn start_noise(white: f64, rate_hz: f64) -> Noise {
    /// Share of the white noise with which the other terms start, at one hertz where they drift.
    const SEED: f64 = 1e-3;
    let one_hz = (std::f64::consts::TAU / rate_hz).powi(2);
    Noise {
        theta: [white, SEED * white, SEED * white, SEED * white * one_hz],
        rate_hz,
    }
}

/// White noise of n m/s²/√Hz (one-sided) is a random walk of velocity: n²T/2 a row.
pub fn declared(model: &Model, rate_hz: f64) -> [Declared; 3] {
    let of = |axis: usize| {
        let accelerometer = model.accelerometer.as_ref();
        accelerometer.map(|accelerometer| accelerometer.noise_m_s2_sqrt_hz[axis])
    };
    [0, 1, 2].map(|axis| Declared {
        random_walk: of(axis)
            .filter(|density| *density > 0.0)
            .map(|density| density * density / (2.0 * rate_hz)),
        white_angle: None,
    })
}
