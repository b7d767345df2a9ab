//! The attitude along a recording, at any time.
//!
//! Enters: increments of the body \[rad\], one a row, and rate \[rad/s\] with three derivatives at the rows'
//! middles. Leaves: the attitude against its own beginning ("start" frame) at any place, counted in rows and
//! fractions of rows; vectors of the rows carried into the start frame and summed up to given places. Beside a
//! reference that sums up increments the start frame turns with the body: all is summed up in the body's own axes.
//!
//! A row turns the body by Δθ + ω×α T³/12 + (ω×s − α×j) T⁵/480 (Magnus, second term; α, j, s the derivatives of
//! ω): for a cone of Ω that is right to (ΩT)⁴/840 of the cone's own drift, so that rows at 100 Hz serve for
//! motion of 10 Hz. Within a row the angle goes by the same Taylor series, which is exact for the row's end.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::iter;

use super::samples::Shown;
use crate::streams::Triad;

/// In which axes angles are summed up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Axes {
    /// In those where the path begins.
    Start,
    /// In the body's own.
    Body,
}

/// See the page above.
pub struct Path {
    start_s: f64,
    rate_hz: f64,
    increments_rad: Triad,
    /// ω, α, j, s \[rad/s, /s², /s³, /s⁴\].
    derivatives: [Triad; 4],
    boundaries: Boundaries,
}

/// What a perfect reference reads at row boundaries.
enum Boundaries {
    /// Start frame from body.
    Attitudes(Vec<UnitQuaternion<f64>>),
    /// The integral of the rate in the body's axes \[rad\].
    Sums(Vec<Vector3<f64>>),
}

impl Path {
    /// Integrates.
    pub fn new(
        start_s: f64,
        rate_hz: f64,
        increments_rad: Triad,
        derivatives: [Triad; 4],
        axes: Axes,
    ) -> Self {
        let rows = increments_rad[0].len();
        let mut path = Self {
            start_s,
            rate_hz,
            increments_rad,
            derivatives,
            boundaries: Boundaries::Sums(Vec::new()),
        };
        path.boundaries = match axes {
            Axes::Start => {
                let mut now = UnitQuaternion::identity();
                let turned = (0..rows).map(|row| {
                    let turn = path.increment(row) + path.coning(row);
                    now *= UnitQuaternion::from_scaled_axis(turn);
                    // Rounding of a million products would leave the unit sphere.
                    now.renormalize_fast();
                    now
                });
                Boundaries::Attitudes(
                    iter::once(UnitQuaternion::identity())
                        .chain(turned)
                        .collect(),
                )
            }
            Axes::Body => {
                let mut sum_rad = Vector3::zeros();
                let summed = (0..rows).map(|row| {
                    sum_rad += path.increment(row);
                    sum_rad
                });
                Boundaries::Sums(iter::once(Vector3::zeros()).chain(summed).collect())
            }
        };
        path
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.increments_rad[0].len()
    }

    /// A time as a place in rows.
    pub fn place(&self, time_s: f64) -> f64 {
        let place = (time_s - self.start_s) * self.rate_hz;
        /// Stamps are rounded: closer to a row's edge than this is the edge.
        const ROUNDED: f64 = 1e-6;
        if (place - place.round()).abs() < ROUNDED {
            place.round()
        } else {
            place
        }
    }

    /// Whether the path reaches a place.
    pub fn reaches(&self, place: f64) -> bool {
        (0.0..=self.rows() as f64).contains(&place)
    }

    /// The attitude at a place inside; none where angles are summed up in the body's axes.
    pub fn at(&self, place: f64) -> UnitQuaternion<f64> {
        match self.shown(place) {
            Shown::Attitude(start_from_body) => start_from_body,
            Shown::Sum(_) => UnitQuaternion::identity(),
        }
    }

    /// What a perfect reference reads at a place inside.
    pub fn shown(&self, place: f64) -> Shown {
        let row = (place.floor() as usize).min(self.rows());
        let share = place - row as f64;
        let inside = share > 0.0 && row < self.rows();
        match &self.boundaries {
            Boundaries::Attitudes(start_from_body) if inside => {
                let turn = self.part(row, share) + self.coning(row) * share;
                Shown::Attitude(start_from_body[row] * UnitQuaternion::from_scaled_axis(turn))
            }
            Boundaries::Attitudes(start_from_body) => Shown::Attitude(start_from_body[row]),
            Boundaries::Sums(sum_rad) if inside => Shown::Sum(sum_rad[row] + self.part(row, share)),
            Boundaries::Sums(sum_rad) => Shown::Sum(sum_rad[row]),
        }
    }

    /// In which axes angles are summed up.
    pub fn axes(&self) -> Axes {
        match self.boundaries {
            Boundaries::Attitudes(_) => Axes::Start,
            Boundaries::Sums(_) => Axes::Body,
        }
    }

    /// The attitude where a row begins.
    pub fn boundary(&self, row: usize) -> UnitQuaternion<f64> {
        self.at(row.min(self.rows()) as f64)
    }

    /// The attitude at a row's middle.
    pub fn middle(&self, row: usize) -> UnitQuaternion<f64> {
        let sum = self.boundary(row).into_inner() + self.boundary(row + 1).into_inner();
        UnitQuaternion::from_quaternion(sum)
    }

    /// Σ of the rows' vectors up to each place, a row cut by a place counting by its share. Places rise.
    pub fn summed(
        &self,
        places: &[f64],
        mut of_row: impl FnMut(usize) -> Vector3<f64>,
    ) -> Vec<Vector3<f64>> {
        let mut row = 0;
        let mut sum = Vector3::zeros();
        places
            .iter()
            .map(|&place| {
                let last = (place.floor() as usize).min(self.rows());
                while row < last {
                    sum += of_row(row);
                    row += 1;
                }
                let share = place - last as f64;
                if share > 0.0 && last < self.rows() {
                    sum + of_row(last) * share
                } else {
                    sum
                }
            })
            .collect()
    }

    /// The body's increment over a row \[rad\].
    pub fn increment(&self, row: usize) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.increments_rad[axis][row])
    }

    /// Nothing where no derivatives were given.
    fn derivative(&self, order: usize, row: usize) -> Vector3<f64> {
        if self.derivatives[order][0].is_empty() {
            return Vector3::zeros();
        }
        Vector3::from_fn(|axis, _| self.derivatives[order][axis][row])
    }

    fn coning(&self, row: usize) -> Vector3<f64> {
        let [rate, acceleration, jerk, snap] =
            [0, 1, 2, 3].map(|order| self.derivative(order, row));
        let period_s = 1.0 / self.rate_hz;
        rate.cross(&acceleration) * (period_s.powi(3) / 12.0)
            + (rate.cross(&snap) - acceleration.cross(&jerk)) * (period_s.powi(5) / 480.0)
    }

    /// The angle over the first `share` of a row: ∫ ω + α τ + j τ²/2 + s τ³/6, scaled to end at the increment.
    fn part(&self, row: usize, share: f64) -> Vector3<f64> {
        let half_s = 0.5 / self.rate_hz;
        let tau_s = (2.0 * share - 1.0) * half_s;
        let [acceleration, jerk, snap] = [1, 2, 3].map(|order| self.derivative(order, row));
        self.increment(row) * share
            + acceleration * (0.5 * (tau_s.powi(2) - half_s.powi(2)))
            + jerk * ((tau_s.powi(3) + half_s.powi(3)) / 6.0 - share * half_s.powi(3) / 3.0)
            + snap * ((tau_s.powi(4) - half_s.powi(4)) / 24.0)
    }

    /// Rotation at a row's middle.
    pub fn start_from_body(&self, row: usize) -> Matrix3<f64> {
        *self.middle(row).to_rotation_matrix().matrix()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A cone of half-angle A at Ω: the attitude is known in closed form, q = exp(A (0, cos Ωt, sin Ωt)).
    fn cone(
        rate_hz: f64,
        frequency_hz: f64,
        rows: usize,
    ) -> (Path, impl Fn(f64) -> UnitQuaternion<f64>) {
        let (angle, omega) = (0.02, TAU * frequency_hz);
        let at = move |time_s: f64| {
            let (sin, cos) = (omega * time_s).sin_cos();
            UnitQuaternion::from_scaled_axis(Vector3::new(0.0, angle * cos, angle * sin))
        };
        // ω = (−2Ω sin²(A/2), −Ω sin A sin Ωt, Ω sin A cos Ωt) in the body frame of that attitude.
        let body_rate = move |time_s: f64, order: i32| {
            let phase = omega * time_s + f64::from(order) * TAU / 4.0;
            let scale = omega.powi(order + 1) * f64::sin(angle);
            let along = if order == 0 {
                -2.0 * omega * f64::sin(angle / 2.0).powi(2)
            } else {
                0.0
            };
            Vector3::new(along, -scale * phase.sin(), scale * phase.cos())
        };
        let fine = 200;
        let mut increments: Triad = Default::default();
        let mut derivatives: [Triad; 4] = Default::default();
        for row in 0..rows {
            let middle_s = (row as f64 + 0.5) / rate_hz;
            let mut sum = Vector3::zeros();
            for step in 0..fine {
                let time_s = (row as f64 + (step as f64 + 0.5) / f64::from(fine)) / rate_hz;
                sum += body_rate(time_s, 0) / (rate_hz * f64::from(fine));
            }
            for axis in 0..3 {
                increments[axis].push(sum[axis]);
                for (order, derivative) in (0..).zip(&mut derivatives) {
                    derivative[axis].push(body_rate(middle_s, order)[axis]);
                }
            }
        }
        let path = Path::new(0.0, rate_hz, increments, derivatives, Axes::Start);
        (path, at)
    }

    #[test]
    fn a_cone_of_a_tenth_of_the_rate_is_followed_at_rows() {
        let (path, at) = cone(100.0, 10.0, 1000);
        let start = at(0.0);
        for place in [1.0, 10.0, 500.0, 1000.0] {
            let apart = (start * path.at(place)).angle_to(&at(place / 100.0));
            // The series leaves (ΩT)⁴/840 of the cone's drift ΩA²/2, and (ΩT)⁵/3840 of A inside a row; the
            // midpoint sums of this test themselves leave (ΩT)²/24/200² of A.
            let omega_t: f64 = TAU * 0.1;
            let drift = 0.5 * 0.02_f64.powi(2) * omega_t * place * omega_t.powi(4) / 840.0;
            let inside = 0.02 * omega_t.powi(5) / 3840.0;
            assert!(apart < 2.0 * (drift + inside) + 1e-7, "{place}: {apart:e}");
        }
    }
}
