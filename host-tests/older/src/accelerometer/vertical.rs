//! Gravity in the body, and what is not known of it.
//!
//! Enters: [`Carried`], the site's gravity, the vertical at the start in body axes and how it turns there. Leaves:
//! predicted specific force (upwards, \[m/s²\]) and the columns of the four numbers that no accelerometer tells from
//! itself at rest: the start's tilt \[rad\] about two level axes and its rate of change \[rad/s\] (the Earth, whose
//! azimuth is not known, and the reference's own drift).
//!
//! f = g body_from_start(t) exp(t ω×) up, ω what turns the ground under a reference that counts inertial angles:
//! Ω sin φ about the vertical, which is known, and a level part, which is fitted.
//!
//! Fitted and never reported: they belong to the mounting, not to the unit.

use nalgebra::{UnitQuaternion, Vector3};
use strapdown::earth::ROTATION_RAD_S;

use super::carried::Carried;
use super::rows::Rows;
use crate::streams::Triad;
use rlg_recording::Site;

/// How many numbers of the vertical are fitted.
pub const UNKNOWNS: usize = 4;

/// The vertical.
#[derive(Debug, Clone, PartialEq)]
pub struct Vertical {
    /// Upwards at the start, body axes, unit length.
    pub up: Vector3<f64>,
    /// What turns it in the start's axes \[rad/s\].
    pub turning_rad_s: Vector3<f64>,
    gravity_m_s2: f64,
}

impl Vertical {
    /// From the mean of the felt force over `rows_used`, turned back to the start. `None` where that is no
    /// gravity: the force was not that of a unit carried about at this site.
    pub fn new(
        rows: &Rows,
        carried: &Carried,
        site: Site,
        earth_in_reference: bool,
        rows_used: &[std::ops::Range<usize>],
    ) -> Option<Self> {
        /// A mean this far from gravity is another force, or another attitude.
        const FAR: f64 = 0.1;
        let mut sum = Vector3::zeros();
        let mut count = 0.0;
        for row in rows_used.iter().flat_map(Clone::clone) {
            for (body, means) in carried.body_from_start.iter().enumerate() {
                let felt = rows.sensed_m_s[body][row] * rows.rate_hz;
                sum += felt * Vector3::from_fn(|start, _| means[start][row]);
            }
            count += 1.0;
        }
        let mean: Vector3<f64> = sum / f64::max(count, 1.0);
        if (mean.norm() / site.gravity_m_s2 - 1.0).abs() > FAR {
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

    /// Two level axes at the start.
    fn level(&self) -> [Vector3<f64>; 2] {
        let least = self.up.iamin();
        let first = self.up.cross(&Vector3::ith(least, 1.0)).normalize();
        [first, self.up.cross(&first)]
    }

    /// Specific force at the body's origin \[m/s²\].
    pub fn force_m_s2(&self, rows: &Rows, carried: &Carried) -> Triad {
        carried.in_body(rows, self.gravity_m_s2 * self.up, self.turning_rad_s)
    }

    /// How that force changes with each unknown \[m/s² per rad, per rad/s\].
    pub fn columns(&self, rows: &Rows, carried: &Carried) -> Vec<Triad> {
        let tilts = self
            .level()
            .map(|axis| carried.in_body(rows, self.gravity_m_s2 * axis, self.turning_rad_s));
        let drifting = |tilt: &Triad| {
            let mut tilt = tilt.clone();
            for values in &mut tilt {
                for (row, value) in values.iter_mut().enumerate() {
                    *value *= rows.middle_s(row) - rows.start_s;
                }
            }
            tilt
        };
        let drifts = [drifting(&tilts[0]), drifting(&tilts[1])];
        let columns: Vec<Triad> = tilts.into_iter().chain(drifts).collect();
        debug_assert_eq!(columns.len(), UNKNOWNS);
        columns
    }

    /// The vertical with the fitted unknowns taken over.
    pub fn moved(&self, unknowns: &[f64]) -> Self {
        let [first, second] = self.level();
        let by = |a: f64, b: f64| a * first + b * second;
        // up × (towards) turns up towards it.
        let turn = self.up.cross(&by(unknowns[0], unknowns[1]));
        let rotation = UnitQuaternion::from_scaled_axis(turn);
        let drift = match unknowns {
            [_, _, a, b] => self.up.cross(&by(*a, *b)),
            _ => Vector3::zeros(),
        };
        Self {
            up: rotation * self.up,
            turning_rad_s: rotation * (self.turning_rad_s + drift),
            ..self.clone()
        }
    }
}
