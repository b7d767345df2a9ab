//! Attitude integrated from the gyros' increments, at any time, and body vectors of their rows transformed by it.
//!
//! For a reference of summed increments the gyros' are summed, too, without rotation: over the same time both are the
//! integral of the body's rate in its own axes, whatever the motion within a row. An attitude integrated from the
//! reference's increments would miss cones too fast for its rate.
//!
//! A row turns the body by Δθ + Δθ × (7 (Δθ₊₁ − Δθ₋₁) − (Δθ₊₂ − Δθ₋₂))/120, a coning correction that equals (β − sin β)/2 to
//! the order β⁵ for a cone of phase β a row. Within a row the angle is a cubic with fourth-order tangents.

use nalgebra::{UnitQuaternion, Vector3};
use rlg_signal::attitude_samples::{Shown, SlowSample};

/// Kind of a reference's data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reads {
    /// Attitudes.
    Attitudes,
    /// Sums of increments in the body's axes.
    Sums,
}

impl Reads {
    /// Returns the kind of samples.
    pub fn of(samples: &[SlowSample]) -> Self {
        match samples.first().map(|sample| sample.shown) {
            Some(Shown::Sum(_)) => Self::Sums,
            _ => Self::Attitudes,
        }
    }
}

/// Attitude of the body relative to its initial one ("start" frame).
pub struct GyroMotion {
    reads: Reads,
    start_s: f64,
    rate_hz: f64,
    increments_rad: Vec<Vector3<f64>>,
    /// Rotation from body to start frame at row boundaries, one more than rows.
    boundaries: Vec<UnitQuaternion<f64>>,
    /// Rotation from body to start frame at row middles.
    middles: Vec<UnitQuaternion<f64>>,
    /// Sum of the increments at row boundaries \[rad\].
    sums_rad: Vec<Vector3<f64>>,
}

/// A time on the record, by row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Row.
    pub row: usize,
    /// Elapsed share of the row, 0 to 1.
    pub share: f64,
}

impl GyroMotion {
    /// Integrates increments of the body \[rad\], the first row beginning at `start_s`.
    ///
    /// # Inputs
    /// `reads`: kind of the reference's data.
    pub fn new(
        (start_s, rate_hz): (f64, f64),
        increments_rad: Vec<Vector3<f64>>,
        reads: Reads,
    ) -> Self {
        let rows = increments_rad.len();
        let mut now = UnitQuaternion::identity();
        let mut sum = Vector3::zeros();
        let mut boundaries = Vec::with_capacity(rows + 1);
        let mut middles = Vec::with_capacity(rows);
        let mut sums_rad = Vec::with_capacity(rows + 1);
        boundaries.push(now);
        sums_rad.push(sum);
        for row in 0..rows {
            let turn = increments_rad[row] + coning(&increments_rad, row);
            middles.push(now * UnitQuaternion::from_scaled_axis(0.5 * turn));
            now *= UnitQuaternion::from_scaled_axis(turn);
            now.renormalize_fast();
            sum += increments_rad[row];
            boundaries.push(now);
            sums_rad.push(sum);
        }
        Self {
            reads,
            start_s,
            rate_hz,
            increments_rad,
            boundaries,
            middles,
            sums_rad,
        }
    }

    /// Increments of the body by row \[rad\].
    pub fn increments_rad(&self) -> &[Vector3<f64>] {
        &self.increments_rad
    }

    /// Increments of the body by row \[rad\], without the attitude.
    pub fn into_increments_rad(self) -> Vec<Vector3<f64>> {
        self.increments_rad
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.increments_rad.len()
    }

    /// Rows per second \[Hz\].
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Start of the first row and end of the last one \[s\].
    pub fn span_s(&self) -> [f64; 2] {
        let end_s = self.start_s + self.rows() as f64 / self.rate_hz;
        [self.start_s, end_s]
    }

    /// Returns the place of a time; `None` outside the record.
    pub fn place(&self, time_s: f64) -> Option<Place> {
        let rows = (time_s - self.start_s) * self.rate_hz;
        if !(0.0..=self.rows() as f64).contains(&rows) {
            return None;
        }
        let row = (rows as usize).min(self.rows() - 1);
        Some(Place {
            row,
            share: rows - row as f64,
        })
    }

    /// Rotation from body to start frame at a place.
    pub fn at(&self, place: Place) -> UnitQuaternion<f64> {
        let Place { row, share } = place;
        let part = self.angle_within(place) + coning(&self.increments_rad, row) * share;
        self.boundaries[row] * UnitQuaternion::from_scaled_axis(part)
    }

    /// Error-free value of the reference at a place.
    pub fn shown(&self, place: Place) -> Shown {
        match self.reads {
            Reads::Attitudes => Shown::Attitude(self.at(place)),
            Reads::Sums => Shown::Sum(self.sums_rad[place.row] + self.angle_within(place)),
        }
    }

    /// Rotation from body to the frame in which errors accumulate: the start frame for attitudes, the body frame for sums.
    pub fn frame_from_body(&self, place: Place) -> UnitQuaternion<f64> {
        match self.reads {
            Reads::Attitudes => self.at(place),
            Reads::Sums => UnitQuaternion::identity(),
        }
    }

    /// Rotation from body to the start frame in the middle of a row.
    pub fn in_row(&self, row: usize) -> UnitQuaternion<f64> {
        self.middles[row]
    }

    /// Cumulative sum over rows of a vector fixed in space, at row boundaries: unrotated for attitudes, in body axes for
    /// sums.
    pub fn fixed_sum(&self, of_row: Vector3<f64>) -> Vec<Vector3<f64>> {
        let mut sum = Vector3::zeros();
        let sums = self.middles.iter().map(|start_from_body| {
            sum += match self.reads {
                Reads::Attitudes => of_row,
                Reads::Sums => start_from_body.inverse() * of_row,
            };
            sum
        });
        std::iter::once(Vector3::zeros()).chain(sums).collect()
    }

    /// Mean rate over the row of a place \[rad/s\].
    pub fn rate_rad_s(&self, place: Place) -> Vector3<f64> {
        self.increments_rad[place.row] * self.rate_hz
    }

    /// Angle since the beginning of a place's row \[rad\].
    fn angle_within(&self, Place { row, share }: Place) -> Vector3<f64> {
        let (from, to) = (self.tangent(row), self.tangent(row + 1));
        let whole = self.increments_rad[row];
        let (two, three) = (share * share, share * share * share);
        whole * (3.0 * two - 2.0 * three) + from * (three - 2.0 * two + share) + to * (three - two)
    }

    /// Rate at a row boundary \[rad per row\].
    fn tangent(&self, boundary: usize) -> Vector3<f64> {
        let sums = &self.sums_rad;
        let last = sums.len() - 1;
        if boundary == 0 || boundary == last {
            return self.increments_rad[boundary.min(last - 1)];
        }
        let near = sums[boundary + 1] - sums[boundary - 1];
        if boundary < 2 || boundary + 2 > last {
            return 0.5 * near;
        }
        (8.0 * near - (sums[boundary + 2] - sums[boundary - 2])) / 12.0
    }

    fn turned(&self, start_from_body: &UnitQuaternion<f64>, body: Vector3<f64>) -> Vector3<f64> {
        match self.reads {
            Reads::Attitudes => start_from_body * body,
            Reads::Sums => body,
        }
    }

    /// Cumulative sum over rows of a body vector in the frame in which errors accumulate, at row boundaries.
    pub fn carried_sum(&self, of_row: impl Fn(usize) -> Vector3<f64>) -> Vec<Vector3<f64>> {
        let mut sum = Vector3::zeros();
        let sums = self
            .middles
            .iter()
            .enumerate()
            .map(|(row, start_from_body)| {
                sum += self.turned(start_from_body, of_row(row));
                sum
            });
        std::iter::once(Vector3::zeros()).chain(sums).collect()
    }

    /// Transforms a body vector at row boundaries to the frame in which errors accumulate.
    pub fn carried(&self, at_boundary: impl Fn(usize) -> Vector3<f64>) -> Vec<Vector3<f64>> {
        let boundaries = self.boundaries.iter().enumerate();
        boundaries
            .map(|(boundary, start_from_body)| self.turned(start_from_body, at_boundary(boundary)))
            .collect()
    }
}

/// Coning correction of a row \[rad\], exact to the fifth order of a cone's phase per row.
fn coning(increments_rad: &[Vector3<f64>], row: usize) -> Vector3<f64> {
    let last = increments_rad.len() - 1;
    let change = |rows: usize| {
        increments_rad[(row + rows).min(last)] - increments_rad[row.saturating_sub(rows)]
    };
    increments_rad[row].cross(&((7.0 * change(1) - change(2)) / 120.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The attitude of a cone of 0.1 rad at 3 Hz has a closed form.
    #[test]
    fn a_cone_is_integrated_and_interpolated_to_its_closed_form() {
        let (rate_hz, angle, hz) = (100.0, 0.1_f64, 3.0);
        let attitude = |t: f64| {
            let phase = std::f64::consts::TAU * hz * t;
            let axis = Vector3::new(phase.cos(), phase.sin(), 0.0);
            UnitQuaternion::from_scaled_axis(axis * angle)
        };
        // Fine steps of the exact attitude, summed up: the integral of the body's rate.
        let fine = 200;
        let increments = (0..200).map(|row| {
            (0..fine)
                .map(|k| {
                    let t = |k: usize| (row as f64 + k as f64 / f64::from(fine as u32)) / rate_hz;
                    (attitude(t(k)).inverse() * attitude(t(k + 1))).scaled_axis()
                })
                .sum()
        });
        let motion = GyroMotion::new((0.0, rate_hz), increments.collect(), Reads::Attitudes);
        let place = motion.place(1.4327).expect("inside");
        let exact = attitude(0.0).inverse() * attitude(1.4327);
        let error = (motion.at(place).inverse() * exact).angle();
        assert!(error < 1e-6, "{error:e} rad");
    }
}
