//! Navigates on one experiment's increments: the errors of a system in the paper's curves.
//!
//! From a [`Run`] of rest, motion, rest and a triad's rotation vectors \[rad\] it gives [`Sins`]: errors of attitude
//! \[°\] about the body's x (pitch), y (roll), z (yaw) and of velocity \[m/s\] east and north, as means over a second.
//!
//! Errors are those due to the gyros: relative to the same navigator on the same accelerometers with perfect gyros. The
//! simulator's case is moved by its rates and forces, body frame; after random vibration it comes to rest degrees away from
//! its initial attitude, and with a velocity; both are true motion and not errors. Accelerometer errors are therefore not in
//! the curves.
//!
//! Levelled on the first segment, its heading known: gyrocompassing for a minute would add an error of its own to every
//! curve alike, and the paper's systems were aligned beforehand.

use nalgebra::{UnitQuaternion, Vector3};
use strapdown::{Increment, Solution};

use super::run::{Curve, Run};
use super::unit::{GRAVITY_M_S2, LATITUDE_RAD};
use crate::error::InputError;
use crate::navigate::{Place, Start, Trajectory, navigate};

/// Averaging window of the curves \[s\]: whole cycles of 15 Hz, dozens of the vibration's.
const WINDOW_S: f64 = 1.0;

/// A system's errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Sins {
    /// Pitch, roll, yaw \[°\].
    pub attitude_deg: [Curve; 3],
    /// East, north \[m/s\].
    pub velocity_m_s: [Curve; 2],
    /// Pitch, roll, yaw at rest after the motion \[°\].
    pub after_deg: [f64; 3],
    /// East and north, the signed value of largest magnitude before the motion ends \[m/s\].
    pub largest_m_s: [f64; 2],
}

/// The navigator of one experiment, with the trajectory of perfect gyros.
pub struct Bench<'a> {
    run: &'a Run,
    perfect: Trajectory,
}

impl<'a> Bench<'a> {
    /// Navigates on the true rotation.
    pub fn new(run: &'a Run) -> Result<Self, InputError> {
        // a tilt of the gyros' axes changes velocity increments by a negligible 1e-5 of sculling
        Ok(Self {
            perfect: trajectory(run, &run.truth_rad, &run.velocities_m_s)?,
            run,
        })
    }

    /// Navigates on a triad's rotation vectors.
    pub fn sins(&self, rotations_rad: &[[f64; 3]]) -> Result<Sins, InputError> {
        let trajectory = trajectory(self.run, rotations_rad, &self.run.velocities_m_s)?;
        let pairs = || trajectory.solutions.iter().zip(&self.perfect.solutions);
        let error_deg = |(own, perfect): (&Solution, &Solution)| -> Vector3<f64> {
            let turn: UnitQuaternion<f64> = perfect.ned_from_body.inverse() * own.ned_from_body;
            turn.scaled_axis().map(f64::to_degrees)
        };
        let attitude: Vec<Vector3<f64>> = pairs().map(error_deg).collect();
        let velocity: Vec<Vector3<f64>> = pairs()
            .map(|(own, perfect)| own.velocity_m_s - perfect.velocity_m_s)
            .collect();
        let curve = |values: &[Vector3<f64>], axis: usize| -> Curve {
            let count = (WINDOW_S / self.run.period_s).round() as usize;
            let part = |(index, part): (usize, &[Vector3<f64>])| {
                let middle = trajectory.first_period as f64 + (index as f64 + 0.5) * count as f64;
                let sum: f64 = part.iter().map(|value| value[axis]).sum();
                (middle * self.run.period_s, sum / count as f64)
            };
            values.chunks_exact(count).enumerate().map(part).collect()
        };
        let attitude_deg = [0, 1, 2].map(|axis| curve(&attitude, axis));
        // the navigator's axes are north, east, down
        let velocity_m_s = [1, 0].map(|axis| curve(&velocity, axis));
        let end_s = self.run.segments[1].end_s;
        let at_rest = |curve: &Curve| {
            let rest = || curve.iter().filter(|(time_s, _)| *time_s > end_s);
            rest().map(|(_, value)| value).sum::<f64>() / rest().count() as f64
        };
        let largest = |curve: &Curve| {
            let moving = curve.iter().filter(|(time_s, _)| *time_s < end_s);
            moving.fold(
                0.0_f64,
                |most, (_, v)| if v.abs() > most.abs() { *v } else { most },
            )
        };
        Ok(Sins {
            after_deg: [0, 1, 2].map(|axis| at_rest(&attitude_deg[axis])),
            largest_m_s: [0, 1].map(|axis| largest(&velocity_m_s[axis])),
            attitude_deg,
            velocity_m_s,
        })
    }
}

fn trajectory(
    run: &Run,
    rotations_rad: &[[f64; 3]],
    velocities_m_s: &[[f64; 3]],
) -> Result<Trajectory, InputError> {
    let pairs = rotations_rad.iter().zip(velocities_m_s);
    let increments: Vec<Increment> = pairs
        .map(|(rotation, velocity)| Increment {
            rotation_rad: Vector3::from(*rotation),
            velocity_m_s: Vector3::from(*velocity),
            period_s: run.period_s,
        })
        .collect();
    let place = Place {
        latitude_rad: LATITUDE_RAD,
        gravity_m_s2: Some(GRAVITY_M_S2),
    };
    let start = Start {
        // the first period only primes the chain
        periods: 1..run.periods(0, 0.0).end,
        // x to the north
        heading_rad: Some(0.0),
    };
    navigate(&increments, &place, &start, None)
        .map_err(|why| InputError::new("paper", format!("cannot be navigated: {why:?}")))
}
