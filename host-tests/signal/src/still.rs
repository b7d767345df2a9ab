//! Earth's rotation sensed by a unit at rest, without any other motion reference.
//!
//! Enters: sensed increments \[rad\] and specific force \[m/s²\] of the rows to fit on, the site. Leaves: the Earth's
//! rotation along the body axes \[rad/s\]. Its magnitude is known, and by accelerometers and latitude its part along the
//! vertical, Ω sin φ; the azimuth is not, so the level part, Ω cos φ, is aligned with the gyros' level part
//! (gyrocompassing). One number is thus estimated from the gyros (two without accelerometers or latitude): a bias along it
//! is observable only as an error of the magnitude.
//!
//! Source: Groves 2013, sec. 5.6. Rotation and gravity: WGS-84. Not here: polar motion, tides, a site that turns.

use nalgebra::Vector3;
use std::ops::Range;
pub use strapdown::earth::ROTATION_RAD_S;

use super::axes::Triad;
use super::installation::body_from_sensing;
use rlg_model::Model;
use rlg_recording::Site;

/// A unit at rest on the Earth.
#[derive(Debug, Clone, PartialEq)]
pub struct AtRest {
    /// The Earth's rotation along the body axes \[rad/s\].
    pub earth_rad_s: Vector3<f64>,
    /// Mean rate of the gyros over the fitted rows \[rad/s\].
    pub mean_rad_s: Vector3<f64>,
    /// Upward unit vector in the body, from the accelerometers; `None` without a site.
    pub up: Option<Vector3<f64>>,
    /// Mean specific force over the site's gravity \[1\].
    pub force_over_gravity: Option<f64>,
    /// The site's latitude \[rad\]; `None` where the recording names no site.
    pub latitude_rad: Option<f64>,
}

impl AtRest {
    /// Fits on the usable rows of `fitted` only; `shown_rad` as computed by [`shown_rad`].
    pub fn new(
        shown_rad: &Triad,
        force_m_s2: Option<&Triad>,
        usable: &[bool],
        fitted: Range<usize>,
        rate_hz: f64,
        site: Option<Site>,
    ) -> Self {
        let rows: Vec<usize> = fitted.filter(|&row| usable[row]).collect();
        let mean = |triad: &Triad| {
            Vector3::from_fn(|axis, _| {
                let sum: f64 = rows.iter().map(|&row| triad[axis][row]).sum();
                sum / rows.len().max(1) as f64
            })
        };
        let force = force_m_s2.map(mean);
        let rest = Self {
            earth_rad_s: Vector3::zeros(),
            mean_rad_s: mean(shown_rad) * rate_hz,
            up: force
                .filter(|_| site.is_some())
                .and_then(|force| force.try_normalize(f64::MIN_POSITIVE)),
            force_over_gravity: force
                .zip(site)
                .map(|(force, site)| force.norm() / site.gravity_m_s2),
            latitude_rad: site.map(|site| site.latitude_rad),
        };
        Self {
            earth_rad_s: rest.nearest_earth_rad_s(rest.mean_rad_s),
            ..rest
        }
    }

    /// Computes the Earth's rotation in the body, within its constraints, nearest to a mean rate of the gyros \[rad/s\].
    pub fn nearest_earth_rad_s(&self, mean_rad_s: Vector3<f64>) -> Vector3<f64> {
        let along = |direction: Vector3<f64>| {
            direction
                .try_normalize(f64::MIN_POSITIVE)
                .unwrap_or_default()
        };
        ROTATION_RAD_S
            * match self.up.zip(self.latitude_rad) {
                Some((up, latitude_rad)) => {
                    let (sin, cos) = latitude_rad.sin_cos();
                    sin * up + cos * along(mean_rad_s - up * up.dot(&mean_rad_s))
                }
                None => along(mean_rad_s),
            }
    }

    /// Directions in the body along which a bias is not distinguishable from the Earth's rotation: east by gyrocompassing,
    /// or both directions across the rotation where the vertical is unknown.
    pub fn taken_for_the_earths(&self) -> Vec<Vector3<f64>> {
        let across = |other: Vector3<f64>| self.earth_rad_s.cross(&other);
        let unit = |direction: Vector3<f64>| direction.try_normalize(f64::MIN_POSITIVE);
        let directions = match self.up {
            Some(up) => vec![unit(across(up))],
            None => {
                let first = unit(across(Vector3::ith(self.earth_rad_s.iamin(), 1.0)));
                vec![first, first.and_then(|first| unit(across(first)))]
            }
        };
        directions.into_iter().flatten().collect()
    }
}

/// Computes the case's increments from the gyros \[rad\]: Eq. (7) on the sensed increments less the dither's. A net swing of
/// a block over the averaging time would count as the Earth's rotation otherwise.
pub fn shown_rad(
    sensed_rad: &Triad,
    pickoff_rad: Option<&Triad>,
    model: &Model,
    rate_hz: f64,
) -> Triad {
    let body_from_sensing = body_from_sensing(&model.gyro.installation_rad);
    let gain = |axis: usize| model.pickoff_gain(axis);
    let along_sensing = |row: usize| {
        Vector3::from_fn(|axis, _| {
            let swung = pickoff_rad.map_or(0.0, |angle| angle[axis][row + 1] - angle[axis][row]);
            let one_less_scale = 1.0 - model.gyro.scale_error[axis];
            let bias_rad = model.gyro.bias_rad_s[axis] / rate_hz / one_less_scale;
            (sensed_rad[axis][row] - gain(axis) * swung) * one_less_scale - bias_rad
        })
    };
    let mut shown: Triad = Default::default();
    for row in 0..sensed_rad[0].len() {
        let case = body_from_sensing * along_sensing(row);
        for (values, value) in shown.iter_mut().zip(case.iter()) {
            values.push(*value);
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;
    use rlg_model::{Dither, Gyro, Installation, MotionSource};

    #[test]
    fn the_vertical_part_is_known_and_the_level_part_lies_where_the_gyros_show_theirs() {
        let site = Site {
            latitude_rad: 0.6,
            gravity_m_s2: 9.8,
        };
        let rows = 100;
        let force: Triad = [vec![9.8; rows], vec![0.0; rows], vec![0.0; rows]];
        // 50 rows a second; the vertical part is a tenth too large, the level part half of its true value.
        let rate = ROTATION_RAD_S / 50.0;
        let (sin, cos) = 0.6_f64.sin_cos();
        let sensed = [1.1 * sin, 0.3 * cos, -0.4 * cos].map(|part| vec![part * rate; rows]);
        let rest = AtRest::new(
            &sensed,
            Some(&force),
            &vec![true; rows],
            0..rows,
            50.0,
            Some(site),
        );
        let expected = ROTATION_RAD_S * Vector3::new(sin, 0.6 * cos, -0.8 * cos);
        assert!((rest.earth_rad_s - expected).norm() < 1e-12 * ROTATION_RAD_S);
        let usable = vec![true; rows];
        let without = AtRest::new(&sensed, None, &usable, 0..rows, 50.0, Some(site));
        // A vertical without a latitude adds no information.
        let nowhere = AtRest::new(&sensed, Some(&force), &usable, 0..rows, 50.0, None);
        assert_eq!(nowhere.earth_rad_s, without.earth_rad_s);
        assert_eq!(nowhere.up, None);
        assert!((without.earth_rad_s.norm() / ROTATION_RAD_S - 1.0).abs() < 1e-12);
        // East is level and perpendicular to the gyros' mean rate; without a vertical two directions are unobservable.
        let east = rest.taken_for_the_earths();
        assert_eq!(east.len(), 1);
        assert!(east[0].x.abs() < 1e-12 && (0.6 * east[0].y - 0.8 * east[0].z).abs() < 1e-12);
        let lost = without.taken_for_the_earths();
        assert_eq!(lost.len(), 2);
        assert!(
            lost.iter()
                .all(|one| one.dot(&without.earth_rad_s).abs() < 1e-16)
        );
    }

    #[test]
    fn a_block_that_ends_its_swing_elsewhere_is_not_taken_for_rotation() {
        const RATE_HZ: f64 = 100.0;
        let model = Model {
            motion: MotionSource::Static,
            earth_rate_in_reference: false,
            gyro: Gyro {
                pulse_weight_rad: [1e-6; 3],
                bias_rad_s: [1e-5, 0.0, -2e-5],
                scale_error: [0.01, 0.0, 0.0],
                angle_random_walk_rad_sqrt_s: None,
                rate_random_walk_rad_s_sqrt_s: None,
                flicker_rad_s: None,
                installation_rad: Installation::from_array([1e-3, 0.0, 0.0, 0.0, 0.0, 2e-3]),
            },
            dither: Some(Dither {
                pickoff_gain: [1.0, 1.1, 0.9],
                pickoff_noise_rad: [0.0; 3],
            }),
            reference: None,
            accelerometer: None,
            effects: Vec::new(),
        };
        let case_rad = Vector3::new(3e-7, -5e-7, 6e-7);
        let along = body_from_sensing(&model.gyro.installation_rad)
            .try_inverse()
            .expect("small angles")
            * case_rad;
        // A quarter of a swing in 50 rows.
        let pickoff_rad: Triad = [0.0, 1.0, 2.0].map(|axis| {
            (0..=50)
                .map(|row| 1e-3 * (0.03 * f64::from(row) + axis).sin())
                .collect()
        });
        let sensed_rad: Triad = [0, 1, 2].map(|axis: usize| {
            let one_less_scale = 1.0 - model.gyro.scale_error[axis];
            let bias_rad = model.gyro.bias_rad_s[axis] / RATE_HZ / one_less_scale;
            let gain = model
                .dither
                .as_ref()
                .map_or(0.0, |dither| dither.pickoff_gain[axis]);
            let swings = pickoff_rad[axis]
                .windows(2)
                .map(|pair| gain * (pair[1] - pair[0]));
            swings
                .map(|swung| (along[axis] + bias_rad) / one_less_scale + swung)
                .collect()
        });
        let shown = shown_rad(&sensed_rad, Some(&pickoff_rad), &model, RATE_HZ);
        for axis in 0..3 {
            assert!(
                shown[axis]
                    .iter()
                    .all(|value| (value - case_rad[axis]).abs() < 1e-18),
                "{axis}"
            );
        }
    }
}
