//! Converts unit quaternions, body to north, east, down, to heading, pitch and roll \[rad\] and back.

use std::f64::consts::TAU;

use nalgebra::UnitQuaternion;

/// Heading, pitch and roll of the body against north, east, down \[rad\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EulerAngles {
    /// About x, −π to π.
    pub roll_rad: f64,
    /// About y, −π/2 to π/2; nose up is positive.
    pub pitch_rad: f64,
    /// About z from north over east, 0 to 2π.
    pub heading_rad: f64,
}

impl EulerAngles {
    /// Of a body with this attitude. At a pitch of ±90° heading and roll are one angle, given as either.
    pub fn of(ned_from_body: &UnitQuaternion<f64>) -> Self {
        let (roll_rad, pitch_rad, yaw_rad) = ned_from_body.euler_angles();
        Self {
            roll_rad,
            pitch_rad,
            heading_rad: yaw_rad.rem_euclid(TAU),
        }
    }

    /// `ned_from_body` of a body at these angles.
    pub fn attitude(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(self.roll_rad, self.pitch_rad, self.heading_rad)
    }
}

/// The difference of two angles, brought to −π..π \[rad\].
pub fn difference_rad(angle_rad: f64, from_rad: f64) -> f64 {
    let difference = (angle_rad - from_rad).rem_euclid(TAU);
    if difference > TAU / 2.0 {
        difference - TAU
    } else {
        difference
    }
}
