//! Predicts the covariance that a programme will give: the Cramér–Rao bound of its motion under the model's noise.
//!
//! From moves and the noise of a row it gives the covariance of the six K \[s⁴\], with bias, scale, installation and
//! delay fitted beside them, as [`super::super::rates`] fits them against a rate reference.
//!
//! The motion is sampled more slowly than the gyros; white noise of angle is raised so that its power stays.
//! Out of scope: noise that drifts (flicker, rate random walk).

use nalgebra::{DMatrix, Matrix3};
use rlg_catalogue::signals::Inputs;
use rlg_diagnosis::noise_levels::mean;
use rlg_inference::{Information, NormalEquations, Observations};
use rlg_signal::axes::Triad;
use rlg_signal::derivatives::row_means;

use super::limits::Limits;
use super::moves::Move;
use crate::columns::{DesignColumns, signals_of};
use crate::estimate::estimate;
use crate::noise::DeclaredNoise;
use crate::unknowns::{COEFFICIENTS, Unknowns};

/// Rows a second for each hertz of the fastest move: the column has twice its frequency, and is then flat to a
/// thousandth over a row.
const ROWS_PER_CYCLE: f64 = 40.0;

/// The covariance; `None` for a programme too short to transform.
pub fn covariance(
    moves: &[Move],
    limits: &Limits,
    noise: &[DeclaredNoise; 3],
) -> Option<DMatrix<f64>> {
    let rate_hz = (ROWS_PER_CYCLE * limits.greatest_frequency_hz).min(limits.rate_hz);
    let case_rad = case_rad(moves, rate_hz);
    let rows = case_rad[0].len();
    let observations = Observations::bridged(&vec![true; rows])?.to_fast_length();
    let (motion, inputs) = ((case_rad, None), Inputs::default());
    let signals = signals_of(motion, inputs, rate_hz, [0.0; 3], Matrix3::identity());
    let unknowns = Unknowns::of(1);
    let columns = DesignColumns::new(&signals, &Unknowns::fitted_kinds(false));
    let levels = noise.map(|noise| noise.read_at(rate_hz, limits.rate_hz));
    let nothing = [0, 1, 2].map(|_| vec![0.0; rows]);
    let of_motion = columns.made_of(&signals);
    let equations = NormalEquations::new(observations, &nothing, &of_motion, mean(&levels));
    let information = Information::of(&equations, &[columns.hypothesis()], &levels);
    let set: Vec<usize> = unknowns.fitted().collect();
    let covariance = estimate(&unknowns, &information, &set).covariance;
    debug_assert_eq!(covariance.nrows(), COEFFICIENTS);
    Some(covariance)
}

/// Increments of the case by row \[rad\].
fn case_rad(moves: &[Move], rate_hz: f64) -> Triad {
    let mut rate_rad_s = Triad::default();
    for one in moves {
        let rows = (one.duration_s * rate_hz).round() as usize;
        for row in 0..rows {
            let (omega, _) = one.at((row as f64 + 0.5) / rate_hz);
            for (axis, omega) in omega.into_iter().enumerate() {
                rate_rad_s[axis].push(omega);
            }
        }
    }
    rate_rad_s.map(|at_middles| {
        let means = row_means(&at_middles).into_iter();
        means.map(|mean| mean / rate_hz).collect()
    })
}
