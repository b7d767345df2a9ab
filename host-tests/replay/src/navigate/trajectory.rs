//! Aligns the unit at rest, then navigates by its increments; and compares the attitude with a reference.
//!
//! From increments per period in the body frame, the place and the periods of rest it makes a [`Trajectory`]: solutions
//! in north, east, down, one a period from the end of rest on.
//!
//! The reference's attitude starts from the same alignment and takes the reference's rotation vectors; where
//! they contain the Earth's rotation, that is taken out at the site. So the error is what the gyros of the
//! unit add, beyond alignment and beyond the motion itself, however large.

use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use strapdown::{
    Alignment, AlignmentError, EulerAngles, Increment, Navigator, Solution, VerticalChannel, align,
    earth, level,
};

/// Where the unit stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Geodetic latitude \[rad\].
    pub latitude_rad: f64,
    /// Gravity \[m/s²\]; absent: the ellipsoid's.
    pub gravity_m_s2: Option<f64>,
}

impl Place {
    /// Gravity there, downward \[m/s²\].
    pub fn gravity_m_s2(&self) -> f64 {
        self.gravity_m_s2
            .unwrap_or_else(|| earth::gravity_m_s2(self.latitude_rad, 0.0).z)
    }
}

/// Where a trajectory begins: the periods of rest, and the heading if it is given.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Periods of rest.
    pub periods: Range<usize>,
    /// Heading of the body's x axis \[rad\], where it is not to be found by gyrocompassing.
    pub heading_rad: Option<f64>,
}

/// A navigated trajectory with its alignment.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// The alignment.
    pub alignment: Alignment,
    /// Mean rate at rest less the Earth's, north, east, down \[rad/s\]. Gyrocompassing leaves no east.
    pub rate_residual_rad_s: Vector3<f64>,
    /// Mean specific force at rest less gravity \[m/s²\].
    pub force_residual_m_s2: f64,
    /// The first period navigated.
    pub first_period: usize,
    /// At the end of each period from the first one on.
    pub solutions: Vec<Solution>,
    /// The attitude's error against the reference at the same times, a turn about north, east, down \[rad\];
    /// NaN from the first period on that the reference did not measure.
    pub attitude_error_rad: Option<Vec<Vector3<f64>>>,
}

/// Why the unit cannot be navigated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NotAtRest {
    /// The alignment refused the interval.
    Alignment(AlignmentError),
    /// Mean rate less the Earth's \[rad/s\].
    Rate(f64),
    /// Mean specific force less gravity \[m/s²\].
    Force(f64),
}

/// Half the Earth's rate: more is a unit that turns, one whose biases the model lacks, or a recording made
/// without the Earth.
const LARGEST_RATE_RESIDUAL_RAD_S: f64 = 0.5 * earth::ROTATION_RAD_S;

/// 1 % of gravity: no accelerometer of a navigator is so wrong; another unit of force, or a moving table, is.
const LARGEST_FORCE_RESIDUAL_M_S2: f64 = 0.1;

/// Aligns and navigates; `reference_rad` are the reference's rotation vectors and whether the Earth's
/// rotation is in them.
pub fn navigate(
    increments: &[Increment],
    place: &Place,
    start: &Start,
    reference_rad: Option<(&[[f64; 3]], bool)>,
) -> Result<Trajectory, NotAtRest> {
    let rest = &increments[start.periods.clone()];
    let alignment = match start.heading_rad {
        Some(heading_rad) => level(rest, heading_rad),
        None => align(rest),
    }
    .map_err(NotAtRest::Alignment)?;
    let earth_rate = earth::earth_rate_rad_s(place.latitude_rad);
    let rate_residual_rad_s = alignment.ned_from_body * alignment.rate_rad_s - earth_rate;
    if rate_residual_rad_s.norm() > LARGEST_RATE_RESIDUAL_RAD_S {
        return Err(NotAtRest::Rate(rate_residual_rad_s.norm()));
    }
    let gravity_m_s2 = place.gravity_m_s2();
    let force_residual_m_s2 = alignment.specific_force_m_s2.norm() - gravity_m_s2;
    if force_residual_m_s2.abs() > LARGEST_FORCE_RESIDUAL_M_S2 {
        return Err(NotAtRest::Force(force_residual_m_s2));
    }

    let normal_m_s2 = earth::gravity_m_s2(place.latitude_rad, 0.0);
    let mut navigator = Navigator::new(Solution {
        ned_from_body: alignment.ned_from_body,
        velocity_m_s: Vector3::zeros(),
        latitude_rad: place.latitude_rad,
        longitude_rad: 0.0,
        height_m: 0.0,
    })
    .with_gravity_disturbance(Vector3::z() * gravity_m_s2 - normal_m_s2);
    let solutions: Vec<Solution> = increments[start.periods.end..]
        .iter()
        .map(|increment| *navigator.advance(increment, VerticalChannel::Aided(0.0)))
        .collect();
    let attitude_error_rad = reference_rad.map(|(rotations_rad, earth_in_it)| {
        let rotations_rad = rotations_rad.iter().skip(start.periods.end);
        let mut reference = alignment.ned_from_body;
        let pairs = rotations_rad
            .zip(&solutions)
            .zip(&increments[start.periods.end..]);
        pairs
            .map(|((rotation, solution), increment)| {
                reference *= UnitQuaternion::from_scaled_axis(Vector3::from(*rotation));
                if earth_in_it {
                    let turn_rad = -earth_rate * increment.period_s;
                    reference = UnitQuaternion::from_scaled_axis(turn_rad) * reference;
                }
                reference.renormalize_fast();
                (solution.ned_from_body * reference.inverse()).scaled_axis()
            })
            .collect()
    });
    Ok(Trajectory {
        alignment,
        rate_residual_rad_s,
        force_residual_m_s2,
        first_period: start.periods.end,
        solutions,
        attitude_error_rad,
    })
}

impl Trajectory {
    /// Roll, pitch and heading less those of the alignment \[rad\], one a period.
    pub fn attitude_change_rad(&self) -> impl Iterator<Item = [f64; 3]> {
        let begin = EulerAngles::of(&self.alignment.ned_from_body);
        self.solutions.iter().map(move |solution| {
            let now = solution.euler();
            let difference = strapdown::attitude::difference_rad;
            [
                difference(now.roll_rad, begin.roll_rad),
                difference(now.pitch_rad, begin.pitch_rad),
                difference(now.heading_rad, begin.heading_rad),
            ]
        })
    }
}
