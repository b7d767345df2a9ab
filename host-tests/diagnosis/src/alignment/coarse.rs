//! Estimates gross departures from the model by global regressions, before any linearisation: large errors first.
//!
//! The delay is estimated by cross-correlation over all lags at once, all gyros together, with low passes as alternatives;
//! at the best path each gyro is regressed on all three axes of the reference and a constant. A fit that explains more than
//! noise of the reference could is removed from the residual before its noise is estimated.

use rlg_plan::Plan;

use nalgebra::Vector3;
use rlg_catalogue::signals::Path;
use rlg_signal::streams::{Triad, each_axis};

use super::axis_regression::Regression;
use super::coarse_path::path_between;
use crate::rows::data::{Data, reached};

/// Gross departures from the model.
pub struct Coarse {
    /// Delays, or a low pass common to all gyros.
    pub path: Path,
    /// By gyro, its coefficients on the axes of the reference after the path, beyond the model's \[1\]; 0 if not gross.
    pub sensed: [Vector3<f64>; 3],
    /// Residual without these departures \[rad\].
    pub clean_rad: Triad,
}

impl Coarse {
    /// True if any departure is gross.
    pub fn is_far(&self) -> bool {
        self.path != Path::default() || self.sensed != [Vector3::zeros(); 3]
    }
}

/// Estimates gross departures from the model in a residual, on the rows that are `seen`.
///
/// # Inputs
/// `residual_rad`: residual without the model's effects.
pub fn coarse(data: &Data, residual_rad: &Triad, seen: &[bool], plan: &Plan) -> Coarse {
    let streams = data.streams;
    if streams.at_rest.is_some() {
        return Coarse {
            path: Path::default(),
            sensed: [Vector3::zeros(); 3],
            clean_rad: about_the_mean(residual_rad, seen),
        };
    }
    let expected_rad = each_axis(|gyro| expected(data, gyro, &data.reference_rad));
    let sensed_rad: Triad = std::array::from_fn(|gyro| {
        let parts = residual_rad[gyro].iter().zip(&expected_rad[gyro]);
        parts.map(|(left, expected)| left + expected).collect()
    });
    let path = path_between(
        data,
        &sensed_rad,
        seen,
        (&plan.rates.coarse, &plan.catalogue.grids),
    );
    let least = plan.rates.coarse.explained;
    let behind: Triad = each_axis(|axis| {
        let values = &data.reference_rad[axis];
        path.along(axis, values, streams.rate_hz).into_owned()
    });
    let rows = reached(seen, path.longest_delay_s() * streams.rate_hz);
    let mut further = [Vector3::zeros(); 3];
    let clean_rad = std::array::from_fn(|gyro| {
        let expected = expected(data, gyro, &behind);
        let sensed = sensed_rad[gyro].iter().zip(&expected);
        let mut left: Vec<f64> = sensed.map(|(sensed, expected)| sensed - expected).collect();
        let fit = Regression::new(&left, &behind, &rows);
        // Noise of the reference alone explains no more than the fit's negative coefficient on the gyro's own axis.
        let by_noise = (-fit.coefficients[gyro]).clamp(0.0, 1.0);
        let explained = 1.0 - fit.left / fit.power.max(f64::MIN_POSITIVE);
        // A gyro that senses less than half of its axis is implausible: the axis is still, and only the reference's noise
        // varies.
        let is_noise = by_noise > least;
        if !is_noise && explained > by_noise + least * (1.0 - by_noise) {
            further[gyro] = fit.coefficients;
            fit.take_out(&mut left, &behind);
        } else {
            left.iter_mut().for_each(|value| *value -= fit.mean);
        }
        left
    });
    Coarse {
        path,
        sensed: further,
        clean_rad,
    }
}

/// Values minus their mean over the `seen` rows: a constant has no information on the noise.
fn about_the_mean(values: &Triad, seen: &[bool]) -> Triad {
    let count = seen.iter().filter(|&&seen| seen).count().max(1) as f64;
    each_axis(|axis| {
        let pairs = values[axis].iter().zip(seen);
        let sum: f64 = pairs
            .filter(|(_, seen)| **seen)
            .map(|(value, _)| value)
            .sum();
        values[axis]
            .iter()
            .map(|value| value - sum / count)
            .collect()
    })
}

/// Increments of a gyro predicted by the model from increments of the case \[rad\].
fn expected(data: &Data, gyro: usize, case: &Triad) -> Vec<f64> {
    let scale = 1.0 / (1.0 - data.model.gyro.scale_error[gyro]);
    let along: [f64; 3] = std::array::from_fn(|axis| data.sensing_from_body[(gyro, axis)] * scale);
    (0..data.streams.rows)
        .map(|row| (0..3).map(|axis| along[axis] * case[axis][row]).sum())
        .collect()
}
