//! Alignment at rest, strapdown navigation by increments, and comparison of the attitude with a reference.
//!
//! From increments per period in the body frame, the place and the periods of rest: a [`Trajectory`] of solutions in north,
//! east, down, one a period from the end of rest on.
//!
//! The reference's attitude starts from the same alignment and integrates the reference's rotation vectors; the Earth's
//! rotation, if contained in them, is removed at the site. So the error is that of the unit's gyros alone, not of alignment
//! or motion.

use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use strapdown::{
    Alignment, AlignmentError, EulerAngles, Increment, Navigator, Solution, VerticalChannel, align,
    earth, level,
};

/// Site of the unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Geodetic latitude \[rad\].
    pub latitude_rad: f64,
    /// Gravity \[m/s²\]; `None`: the ellipsoid's.
    pub gravity_m_s2: Option<f64>,
}

impl Place {
    /// Gravity at the site, downward \[m/s²\].
    pub fn gravity_m_s2(&self) -> f64 {
        self.gravity_m_s2
            .unwrap_or_else(|| earth::gravity_m_s2(self.latitude_rad, 0.0).z)
    }
}

/// Start of a trajectory: the periods of rest, and the heading if given.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Periods of rest.
    pub periods: Range<usize>,
    /// Heading of the body's x axis \[rad\]; `None`: by gyrocompassing.
    pub heading_rad: Option<f64>,
}

/// Navigated trajectory with its alignment.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// The alignment.
    pub alignment: Alignment,
    /// Mean rate at rest less the Earth's, north, east, down \[rad/s\]; the east component is zero after gyrocompassing.
    pub rate_residual_rad_s: Vector3<f64>,
    /// Mean specific force at rest less gravity \[m/s²\].
    pub force_residual_m_s2: f64,
    /// The first period navigated.
    pub first_period: usize,
    /// Solution at the end of each period from the first one on.
    pub solutions: Vec<Solution>,
    /// Attitude error against the reference at the same times, a rotation about north, east, down \[rad\]; NaN from the
    /// first period on that the reference did not measure.
    pub attitude_error_rad: Option<Vec<Vector3<f64>>>,
}

/// Reason why the unit cannot be navigated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NotAtRest {
    /// The alignment rejected the interval.
    Alignment(AlignmentError),
    /// Mean rate less the Earth's \[rad/s\].
    Rate(f64),
    /// Mean specific force less gravity \[m/s²\].
    Force(f64),
}

/// Half the Earth's rate: more is a rotating unit, biases missing in the model, or a recording made without the Earth.
const LARGEST_RATE_RESIDUAL_RAD_S: f64 = 0.5 * earth::ROTATION_RAD_S;

/// 1 % of gravity: more is no accelerometer error of a navigator, but another unit of force, or a moving table.
const LARGEST_FORCE_RESIDUAL_M_S2: f64 = 0.1;

/// Aligns and navigates; `reference_rad`: the reference's rotation vectors, and true if they contain the Earth's rotation.
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
