//! Aligns a unit at rest: coarse levelling by gravity, gyrocompassing by the Earth's rotation.
//!
//! It takes the increments of a unit at rest on the Earth, which may rock meanwhile if it ends as it began. It gives
//! the [`Alignment`]: the attitude on the Earth, the same at the interval's beginning and end.
//!
//! The body is tracked by its own gyros. Over the interval of length T the mean turn ω = Φ/T against inertial space is
//! the Earth's, and the velocity increments, turned back by ωt to the body's attitude at the beginning, add up to the
//! reaction to gravity, f. Then down = −f/|f|, north = the part of ω that is across down, east = down × north. Groves
//! 2013, section 5.6.1 and 5.6.2.
//!
//! Errors by the sensors' biases b: tilt about east b_N/g, about north −b_E/g; heading −b_E/(Ω cos L) from the east
//! gyro and + tan L b_E/g from the east accelerometer (`tests/initial_alignment.rs`).
//!
//! Out of scope: fine alignment, and alignment while the unit travels. Noise is averaged over the
//! interval: angle random walk N leaves N/√T/(Ω cos L) in heading.

use std::fmt;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::attitude::EulerAngles;
use crate::mechanisation::Increment;

/// Result of aligning on an interval of rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alignment {
    /// Attitude at the interval's beginning, and so at its end.
    pub ned_from_body: UnitQuaternion<f64>,
    /// Mean rate against inertial space, body frame at the beginning \[rad/s\].
    pub rate_rad_s: Vector3<f64>,
    /// Mean specific force, same frame \[m/s²\].
    pub specific_force_m_s2: Vector3<f64>,
    /// Length of the interval \[s\].
    pub duration_s: f64,
}

/// Reason that an interval cannot be aligned on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AlignmentError {
    /// No increments, or no time in them.
    Empty,
    /// A mean specific force \[m/s²\] that is no gravity.
    NoGravity(f64),
    /// A mean rate across the vertical \[rad/s\] too small to determine north.
    NoNorth(f64),
}

impl fmt::Display for AlignmentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "there are no increments to align on"),
            Self::NoGravity(force_m_s2) => {
                write!(
                    f,
                    "the mean specific force is {force_m_s2:.3} m/s², no gravity"
                )
            }
            Self::NoNorth(rate_rad_s) => write!(
                f,
                "the mean rate across the vertical is {rate_rad_s:.1e} rad/s, too small to tell north"
            ),
        }
    }
}

impl std::error::Error for AlignmentError {}

/// Less than this \[m/s²\] is a unit in free fall or one without accelerometers.
const LEAST_FORCE_M_S2: f64 = 1.0;

/// Less than this across the vertical \[rad/s\] does not determine north: a hundredth of the Earth's rate, the poles'
/// last half degree, or a recording in which the Earth stands still.
const LEAST_RATE_RAD_S: f64 = 7.3e-7;

/// Aligns on an interval of rest.
pub fn align(interval: &[Increment]) -> Result<Alignment, AlignmentError> {
    let mean = Mean::of(interval)?;
    let across = mean.rate_rad_s - mean.down * mean.rate_rad_s.dot(&mean.down);
    let across_rad_s = across.norm();
    if across_rad_s.is_nan() || across_rad_s < LEAST_RATE_RAD_S {
        return Err(AlignmentError::NoNorth(across_rad_s));
    }
    let north = across / across_rad_s;
    let ned_from_body = Matrix3::from_rows(&[
        north.transpose(),
        mean.down.cross(&north).transpose(),
        mean.down.transpose(),
    ]);
    let rotation = Rotation3::from_matrix_unchecked(ned_from_body);
    Ok(mean.alignment(UnitQuaternion::from_rotation_matrix(&rotation)))
}

/// Levels on an interval of rest, the heading known from elsewhere: for an interval too short, or a latitude too high,
/// to determine north by the Earth's rotation.
pub fn level(interval: &[Increment], heading_rad: f64) -> Result<Alignment, AlignmentError> {
    let mean = Mean::of(interval)?;
    let angles = EulerAngles {
        roll_rad: mean.down.y.atan2(mean.down.z),
        pitch_rad: (-mean.down.x).atan2(mean.down.y.hypot(mean.down.z)),
        heading_rad,
    };
    Ok(mean.alignment(angles.attitude()))
}

/// Mean rate and force of an interval's increments, in the body frame at its beginning.
struct Mean {
    rate_rad_s: Vector3<f64>,
    specific_force_m_s2: Vector3<f64>,
    down: Vector3<f64>,
    duration_s: f64,
}

impl Mean {
    fn of(interval: &[Increment]) -> Result<Self, AlignmentError> {
        let duration_s: f64 = interval.iter().map(|increment| increment.period_s).sum();
        if duration_s.is_nan() || duration_s <= 0.0 {
            return Err(AlignmentError::Empty);
        }
        let mut start_from_body = UnitQuaternion::identity();
        for increment in interval {
            start_from_body *= UnitQuaternion::from_scaled_axis(increment.rotation_rad);
            start_from_body.renormalize_fast();
        }
        let rate_rad_s = start_from_body.scaled_axis() / duration_s;

        let mut start_from_body = UnitQuaternion::identity();
        let mut elapsed_s = 0.0;
        let mut felt_m_s = Vector3::zeros();
        for increment in interval {
            // the increment stands at its period's beginning, its mean half a period later
            let middle_s = elapsed_s + 0.5 * increment.period_s;
            let back = UnitQuaternion::from_scaled_axis(-rate_rad_s * middle_s);
            felt_m_s += back * (start_from_body * increment.velocity_m_s);
            start_from_body *= UnitQuaternion::from_scaled_axis(increment.rotation_rad);
            start_from_body.renormalize_fast();
            elapsed_s += increment.period_s;
        }
        let specific_force_m_s2 = felt_m_s / duration_s;
        let force_m_s2 = specific_force_m_s2.norm();
        if force_m_s2.is_nan() || force_m_s2 < LEAST_FORCE_M_S2 {
            return Err(AlignmentError::NoGravity(force_m_s2));
        }
        Ok(Self {
            rate_rad_s,
            specific_force_m_s2,
            down: -specific_force_m_s2 / force_m_s2,
            duration_s,
        })
    }

    fn alignment(&self, ned_from_body: UnitQuaternion<f64>) -> Alignment {
        Alignment {
            ned_from_body,
            rate_rad_s: self.rate_rad_s,
            specific_force_m_s2: self.specific_force_m_s2,
            duration_s: self.duration_s,
        }
    }
}
