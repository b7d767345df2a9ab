//! Predicts the covariance that a programme will give: the Cramér–Rao bound of its motion under the model's noise.
//!
//! From moves and the noise of a row it gives the covariance of the six K \[s⁴\], with bias, scale, installation and
//! delay fitted beside them, as [`super::super::rates`] fits them against a rate reference.
//!
//! The motion is sampled more slowly than the gyros; white noise of angle is raised so that its power stays.
//! Out of scope: noise that drifts (flicker, rate random walk), which no model states.

use nalgebra::DMatrix;

use super::limits::Limits;
use super::moves::Move;
use crate::estimate::estimate;
use crate::unknowns::{COEFFICIENTS, Unknowns};
use rlg_diagnosis::noise_spectrum::Noise;
use rlg_diagnosis::portion::Portion;
use rlg_diagnosis::regressor::{Regressor, regressors};
use rlg_older::information::Information;
use rlg_older::scene::tilt_senses;
use rlg_signal::streams::Triad;

/// Rows a second for each hertz of the fastest move: the column has twice its frequency, and is then flat to a
/// thousandth over a row.
const ROWS_PER_CYCLE: f64 = 40.0;

/// The covariance; `None` for a programme too short to transform.
pub fn covariance(moves: &[Move], limits: &Limits, noise: &[Noise; 3]) -> Option<DMatrix<f64>> {
    let rate_hz = (ROWS_PER_CYCLE * limits.greatest_frequency_hz).min(limits.rate_hz);
    let (mut rate, mut acceleration): (Triad, Triad) = Default::default();
    for one in moves {
        let rows = (one.duration_s * rate_hz).round() as usize;
        for row in 0..rows {
            let (omega, alpha) = one.at((row as f64 + 0.5) / rate_hz);
            for axis in 0..3 {
                rate[axis].push(omega[axis]);
                acceleration[axis].push(alpha[axis]);
            }
        }
    }
    let rows = rate[0].len();
    let portion = Portion::new(std::iter::once(0..rows).collect(), rate_hz)?;
    let joints = regressors(&portion.joints());
    let unknowns = Unknowns::of(1);
    let mut information = Information::empty(unknowns.count());
    let nothing = vec![0.0; rows];
    for (axis, noise) in noise.iter().enumerate() {
        let slower = Noise {
            theta: [
                noise.theta[0] * noise.rate_hz / rate_hz,
                noise.theta[1] * rate_hz / noise.rate_hz,
                0.0,
                0.0,
            ],
            rate_hz,
        };
        let columns: Vec<(usize, Vec<f64>)> = unknowns
            .fitted()
            .filter_map(|index| {
                let column = column(&unknowns, index, axis, &rate, &acceleration)?;
                Some((index, column.iter().map(|value| value / rate_hz).collect()))
            })
            .collect();
        let columns: Vec<(usize, Regressor)> = columns
            .iter()
            .map(|(index, values)| (*index, Regressor::new(&portion.transform(values))))
            .collect();
        let columns: Vec<(usize, &Regressor)> = columns
            .iter()
            .map(|(index, column)| (*index, column))
            .collect();
        information.add_axis(
            &joints,
            &[],
            &portion.transform(&nothing),
            &columns,
            &slower.weights(&portion),
        );
    }
    let set: Vec<usize> = unknowns.fitted().collect();
    let covariance = estimate(&unknowns, &information, &set).covariance;
    debug_assert_eq!(covariance.nrows(), COEFFICIENTS);
    Some(covariance)
}

/// Rate that a unit of an unknown adds to a gyro (contract's table of effects).
fn column(
    unknowns: &Unknowns,
    index: usize,
    axis: usize,
    rate: &Triad,
    acceleration: &Triad,
) -> Option<Vec<f64>> {
    let unknown = unknowns.get(index);
    let shape = rlg_older::hypotheses::CATALOGUE[unknown.effect]
        .card()
        .shape;
    let second = shape.second(unknown.parameter, axis)?;
    match unknown.kind() {
        "axis_flexure" => {
            let (k, sign) = tilt_senses(axis, second);
            let product = rate[k].iter().zip(&acceleration[second]);
            Some(
                product
                    .map(|(omega, alpha)| -sign * omega * alpha)
                    .collect(),
            )
        }
        "gyro_bias" => Some(vec![1.0; rate[axis].len()]),
        "gyro_scale" => Some(rate[axis].clone()),
        "gyro_delay" => Some(acceleration[axis].iter().map(|alpha| -alpha).collect()),
        "installation" => {
            let (k, sign) = tilt_senses(axis, second);
            Some(rate[k].iter().map(|omega| sign * omega).collect())
        }
        _ => None,
    }
}
