//! Searches slow effects given the Earth's rotation, whose azimuth is a nuisance parameter of the search.
//!
//! A small rotation of the azimuth adds a constant rate towards the east, which is free in every fit. Without it a shape
//! with a mean, such as a warming, would be fitted beside a constant that holds part of it.

use rlg_inference::TooFewRows;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use rlg_catalogue::entries::CATALOGUE;
use rlg_catalogue::signals;
use rlg_signal::partition::Use;
use rlg_signal::still::AtRest;
use rlg_signal::streams::{Triad, add_triad};

use super::kinds::{BIAS, KINDS};
use crate::alignment::case_motion::estimate;
use crate::rows::data::Data;
use crate::search::passes;
use crate::search::structure::{Found, effect_rad};
use crate::settings::{Scope, Settings};

/// Searches, and aligns the Earth's rotation to the constant part of the result, until it converges: effects of temperature
/// must not rotate it.
pub(super) fn settle(
    data: &mut Data,
    rest: &mut AtRest,
    settings: &Settings,
    progress: &dyn Fn(&str),
) -> Result<Found, TooFewRows> {
    const MOST_TURNS: usize = 5;
    let others = CATALOGUE.iter().map(|entry| entry.kind);
    let others = others.filter(|kind| !KINDS.contains(kind));
    let left_out: Vec<&str> = settings.left_out.iter().copied().chain(others).collect();
    let plan = &settings.plan;
    let scope = Scope {
        plan,
        left_out: &left_out,
    };
    let motion = estimate(
        data,
        &Triad::default(),
        &[],
        &[],
        signals::Path::default(),
        plan,
    );
    data.set_known(&motion.signals);
    let mut left_rad = data.residual_rad.clone();
    add_triad(&mut left_rad, &data.known_rad(&motion.signals), -1.0);
    let constant = constant_rad_s(data, rest, &left_rad);
    lay(data, rest, constant);
    let mut turn = 1;
    loop {
        let found = passes::find(data, scope, progress)?;
        let left_rad = without_effects(&found, |kind| kind != BIAS);
        let constant = constant_rad_s(data, rest, &left_rad);
        let change = rest.nearest_earth_rad_s(constant) - rest.earth_rad_s;
        let seconds = data.streams.rows as f64 / data.streams.rate_hz;
        let white = found.fit.levels.iter().map(|levels| levels.white);
        let white_rad2 = white.fold(f64::INFINITY, f64::min) * data.streams.rate_hz;
        if change.norm() < plan.rest.settled * (white_rad2 / seconds).sqrt() || turn == MOST_TURNS {
            return Ok(found);
        }
        lay(data, rest, constant);
        turn += 1;
    }
}

/// Residual less the effects whose kind `is_out` \[rad\].
pub(super) fn without_effects(found: &Found, is_out: impl Fn(&str) -> bool) -> Triad {
    let mut left_rad = found.residual_rad.clone();
    for (place, &member) in found.fit.members.iter().enumerate() {
        if is_out(found.candidates[member].kind) {
            add_triad(&mut left_rad, &effect_rad(found, &found.fit, place), -1.0);
        }
    }
    left_rad
}

/// Mean rate of a residual in the body, the Earth's rotation included \[rad/s\].
fn constant_rad_s(data: &Data, rest: &AtRest, left_rad: &Triad) -> Vector3<f64> {
    let seen = data.rows_of(&[Use::Fit]);
    let count = seen.iter().filter(|&&seen| seen).count().max(1) as f64;
    let sensed = Vector3::from_fn(|gyro, _| {
        let pairs = left_rad[gyro].iter().zip(&seen);
        let sum: f64 = pairs
            .filter(|(_, seen)| **seen)
            .map(|(value, _)| value)
            .sum();
        sum / count * data.streams.rate_hz * (1.0 - data.model.gyro.scale_error[gyro])
    });
    body_from_sensing(data) * sensed + rest.earth_rad_s
}

pub(super) fn body_from_sensing(data: &Data) -> Matrix3<f64> {
    data.sensing_from_body
        .try_inverse()
        .unwrap_or_else(Matrix3::identity)
}

/// Aligns the Earth's rotation to a constant rate of the gyros.
fn lay(data: &mut Data, rest: &mut AtRest, constant_rad_s: Vector3<f64>) {
    let nearest = rest.nearest_earth_rad_s(constant_rad_s);
    let change = data.sensing_from_body * (nearest - rest.earth_rad_s);
    let (rows, rate_hz) = (data.streams.rows, data.streams.rate_hz);
    for gyro in 0..3 {
        let scale = 1.0 - data.model.gyro.scale_error[gyro];
        let change_rad = change[gyro] / scale / rate_hz;
        let values = data.residual_rad[gyro].iter_mut();
        values.for_each(|value| *value -= change_rad);
    }
    rest.earth_rad_s = nearest;
    // A wholly unknown direction has no linearisation: its intervals hold that.
    let azimuth = rest.taken_for_the_earths();
    let azimuth = azimuth.into_iter().filter(|_| rest.up.is_some());
    let free = azimuth.map(|direction| {
        let sensed = data.sensing_from_body * direction;
        let of_gyro = |gyro: usize| sensed[gyro] / (1.0 - data.model.gyro.scale_error[gyro]);
        (0..3).map(of_gyro).collect()
    });
    data.free_constants = free.collect();
    let turns = |axis: usize| vec![nearest[axis] / rate_hz; rows];
    data.reference_rad = Arc::new([0, 1, 2].map(turns));
}
