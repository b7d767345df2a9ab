//! Gravity in body axes, and its unknowns.
//!
//! f = g body_from_start(t) exp(t ω×) up, with ω the rate of the vertical in an inertial reference: Ω sin φ about the
//! vertical, which is known, and a level part, which is fitted together with the initial level. These four parameters are
//! not distinguishable from accelerometer errors at rest. They belong to the mounting, not to the unit, and are never
//! reported.

use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use rlg_recording::Site;
use rlg_signal::axes::Triad;
use strapdown::earth::ROTATION_RAD_S;

use crate::carried::Carried;
use crate::readings::{Piece, Readings};

/// Number of fitted parameters of the vertical.
pub const UNKNOWNS: usize = 4;

/// Vertical of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Vertical {
    /// Upward unit vector at the start, body axes.
    pub up: Vector3<f64>,
    /// Rotation rate of the vertical in the axes of the start \[rad/s\].
    pub turning_rad_s: Vector3<f64>,
    gravity_m_s2: f64,
}

impl Vertical {
    /// Estimates the vertical as the mean specific force over the rows `used` of one recording, rotated back to its start.
    ///
    /// # Returns
    /// `None` if that mean differs from the site's gravity by more than a share `far`: the force is then not that of a unit
    /// rotated at this site.
    pub fn new(
        rows: &Readings,
        carried: &Carried,
        (site, earth_in_reference): (Site, bool),
        used: &[Range<usize>],
        far: f64,
    ) -> Option<Self> {
        let mut sum = Vector3::zeros();
        let mut count = 0.0;
        for row in used.iter().flat_map(Clone::clone) {
            for (body, means) in carried.body_from_start.iter().enumerate() {
                let felt = rows.sensed_m_s[body][row] * rows.rate_hz;
                sum += felt * Vector3::from_fn(|start, _| means[start][row]);
            }
            count += 1.0;
        }
        let mean: Vector3<f64> = sum / f64::max(count, 1.0);
        if (mean.norm() / site.gravity_m_s2 - 1.0).abs() > far {
            return None;
        }
        let up = mean.normalize();
        let earth_rad_s = if earth_in_reference {
            ROTATION_RAD_S * site.latitude_rad.sin()
        } else {
            0.0
        };
        Some(Self {
            up,
            turning_rad_s: earth_rad_s * up,
            gravity_m_s2: site.gravity_m_s2,
        })
    }

    /// Two horizontal axes at the start.
    fn level(&self) -> [Vector3<f64>; 2] {
        let least = self.up.iamin();
        let first = self.up.cross(&Vector3::ith(least, 1.0)).normalize();
        [first, self.up.cross(&first)]
    }

    /// Specific force at the body's origin on the rows of its recording \[m/s²\].
    pub fn force_m_s2(&self, readings: &Readings, piece: &Piece, carried: &Carried) -> Triad {
        carried.in_body(
            readings,
            piece,
            self.gravity_m_s2 * self.up,
            self.turning_rad_s,
        )
    }

    /// Derivative of that force by each unknown \[m/s² per rad, per rad/s\].
    pub fn columns(
        &self,
        readings: &Readings,
        piece: &Piece,
        carried: &Carried,
    ) -> [Triad; UNKNOWNS] {
        let [first, second] = self.level().map(|axis| {
            let along = self.gravity_m_s2 * axis;
            carried.in_body(readings, piece, along, self.turning_rad_s)
        });
        let drifting = |tilt: &Triad| {
            let mut tilt = tilt.clone();
            for values in &mut tilt {
                for (row, value) in piece.rows.clone().zip(values) {
                    *value *= readings.since_start_s(piece, row);
                }
            }
            tilt
        };
        let drifts = [drifting(&first), drifting(&second)];
        let [first_drift, second_drift] = drifts;
        [first, second, first_drift, second_drift]
    }

    /// Vertical corrected by the fitted unknowns.
    pub fn moved(&self, unknowns: [f64; UNKNOWNS]) -> Self {
        let [first, second] = self.level();
        let [tilt_first, tilt_second, drift_first, drift_second] = unknowns;
        let towards = |a: f64, b: f64| self.up.cross(&(a * first + b * second));
        // up × (towards) rotates up towards it.
        let rotation = UnitQuaternion::from_scaled_axis(towards(tilt_first, tilt_second));
        let drift = towards(drift_first, drift_second);
        Self {
            up: rotation * self.up,
            turning_rad_s: rotation * (self.turning_rad_s + drift),
            ..self.clone()
        }
    }
}
