//! Predicted covariance of a programme: Cramér–Rao bound of its motion with the model's noise.
//!
//! From moves and the noise of a row, the covariance of the six K \[s⁴\] with bias, scale, installation and delay as
//! nuisance parameters, as in [`super::super::rates`] against a rate reference.
//!
//! The motion is sampled more slowly than by the gyros; white angle noise is scaled up so that its density is unchanged.
//! Out of scope: noise that drifts (flicker, rate random walk).

use nalgebra::{DMatrix, Matrix3};
use rlg_catalogue::Signals;
use rlg_catalogue::experiment::information;
use rlg_catalogue::moves::{Move, increments_rad};
use rlg_catalogue::signals::Inputs;
use rlg_plan::Plan;

use super::limits::Limits;
use crate::columns::DesignColumns;
use crate::estimate::estimate;
use crate::noise::DeclaredNoise;
use crate::unknowns::{COEFFICIENTS, Unknowns};

/// Covariance of a programme; `None` if too short to transform.
pub fn covariance(
    moves: &[Move],
    limits: &Limits,
    noise: &[DeclaredNoise; 3],
    plan: &Plan,
) -> Option<DMatrix<f64>> {
    let own = &plan.calibration;
    let rate_hz = (own.programme.rows_per_cycle * limits.greatest_frequency_hz).min(limits.rate_hz);
    let (motion, inputs) = ((increments_rad(moves, rate_hz), None), Inputs::default());
    let signals = Signals::of_known(
        motion,
        inputs,
        rate_hz,
        [0.0; 3],
        Matrix3::identity(),
        &plan.catalogue,
    );
    let unknowns = Unknowns::of(1);
    let columns = DesignColumns::new(&signals, &Unknowns::fitted_kinds(false));
    let levels = noise.map(|noise| noise.read_at(rate_hz, limits.rate_hz));
    let made = columns.made_of(&signals).columns;
    let information = information(&signals, made, &[columns.hypothesis()], &levels)?;
    let set: Vec<usize> = unknowns.fitted().collect();
    let covariance = estimate(&unknowns, &information, &set, &own.prior).covariance;
    debug_assert_eq!(covariance.nrows(), COEFFICIENTS);
    Some(covariance)
}
