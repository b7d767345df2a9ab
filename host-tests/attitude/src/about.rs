//! Rows about an alignment, and the columns of what moves it.

use nalgebra::{Matrix3, Vector3};
use rlg_signal::attitude_samples::AttitudeSample;
use rlg_signal::axes::Triad;

use crate::alignment::{Alignment, COUNT, PAIRS};
use crate::conditioned::conditioned;
use crate::gyro_motion::GyroMotion;
use crate::increments::{Increments, ReferenceClock, Stamps};

/// What the gyros sensed.
pub struct Gyros {
    /// When the first row begins \[s\].
    pub start_s: f64,
    /// Rows a second \[Hz\].
    pub rate_hz: f64,
    /// Increments that the gyros sensed, in the case's axes by the model, less what the model's other effects add \[rad\].
    pub sensed_rad: Vec<Vector3<f64>>,
    /// Unmeasured rows before each row boundary.
    pub lost_before: Vec<usize>,
}

/// Rows and motion about an alignment.
pub struct About {
    /// Attitude of the gyros' own.
    pub motion: GyroMotion,
    /// Rows.
    pub increments: Increments,
    /// Motion in the gyros' axes that columns are made of \[rad\].
    pub conditioned_rad: Triad,
    /// Rate of change of what the gyros sensed, where a low pass was undone \[rad by row and second\].
    growth_rad_s: Option<Vec<Vector3<f64>>>,
    body_from_sensed: Matrix3<f64>,
    clock: ReferenceClock,
}

impl About {
    /// Forms rows about an alignment; `None` where fewer than two stamps lie within the gyros' record.
    pub fn new(
        gyros: &Gyros,
        samples: &[AttitudeSample],
        known: &Stamps,
        alignment: &Alignment,
    ) -> Option<Self> {
        let body_from_sensed = alignment.sensed_from_body.try_inverse()?;
        let bias_rad = alignment.bias_rad_s / gyros.rate_hz;
        let mut unbiased: Vec<Vector3<f64>> =
            gyros.sensed_rad.iter().map(|row| row - bias_rad).collect();
        let growth_rad_s = alignment.low_pass_s.map(|low_pass_s| {
            let growth = growth(&unbiased, gyros.rate_hz);
            for (row, growth) in unbiased.iter_mut().zip(&growth) {
                *row += low_pass_s.component_mul(growth);
            }
            growth
        });
        let body = unbiased.iter().map(|row| body_from_sensed * row).collect();
        let motion = GyroMotion::new(gyros.start_s, gyros.rate_hz, body);
        let times = |sample: &AttitudeSample| sample.time_s;
        let clock = ReferenceClock {
            delay_s: alignment.delay_s,
            rate: alignment.clock_rate,
            middle_s: 0.5 * (samples.first().map(times)? + samples.last().map(times)?),
        };
        let increments = Increments::new(&motion, samples, known, &clock, &gyros.lost_before)?;
        Some(Self {
            conditioned_rad: conditioned(&unbiased, gyros.rate_hz),
            motion,
            increments,
            growth_rad_s,
            body_from_sensed,
            clock,
        })
    }

    /// The column of increments that the gyros would sense besides \[rad by row\].
    pub fn carried(&self, sensed_rad: impl Fn(usize) -> Vector3<f64>) -> Triad {
        let sums = self
            .motion
            .carried_sum(|row| -(self.body_from_sensed * sensed_rad(row)));
        self.increments.carry(&sums)
    }

    /// Motion in the gyros' axes \[rad\].
    fn sensed(&self, row: usize) -> Vector3<f64> {
        let last = self.motion.rows() - 1;
        Vector3::from_fn(|axis, _| self.conditioned_rad[axis][row.min(last)])
    }

    /// The column of a filter on one gyro: half a variance times the second derivative of its rate, over a row; or a longer
    /// time constant of its low pass.
    fn filtered(&self, axis: usize, rate_hz: f64) -> Triad {
        let along = Vector3::ith(axis, 1.0);
        if let Some(growth_rad_s) = &self.growth_rad_s {
            return self.carried(|row| -along * growth_rad_s[row][axis]);
        }
        self.carried(|row| {
            let [before, now, after] =
                [row.saturating_sub(1), row, row + 1].map(|row| self.sensed(row)[axis]);
            along * (0.5 * rate_hz * rate_hz * (before - 2.0 * now + after))
        })
    }

    /// Columns of the registration, in the order of [`GROUPS`].
    pub fn columns(&self, rate_hz: f64) -> Vec<Triad> {
        let period_s = 1.0 / rate_hz;
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let mut columns: Vec<Triad> = Vec::with_capacity(COUNT);
        columns.extend(axes.map(|axis| self.carried(|_| axis * period_s)));
        columns.extend(axes.map(|axis| self.carried(|row| axis.cross(&self.sensed(row)))));
        let body = |row: usize| self.body_from_sensed * self.sensed(row);
        let rate =
            |boundary: usize| 0.5 * rate_hz * (body(boundary.saturating_sub(1)) + body(boundary));
        let [start_s, _] = self.motion.span_s();
        let late = self.motion.carried(|boundary| -rate(boundary));
        columns.push(self.increments.carry(&late));
        let since_middle =
            |boundary: usize| start_s + boundary as f64 * period_s - self.clock.middle_s;
        let drifted: Vec<Vector3<f64>> = late
            .iter()
            .enumerate()
            .map(|(boundary, late)| late * since_middle(boundary))
            .collect();
        columns.push(self.increments.carry(&drifted));
        columns.extend(axes.map(|axis| {
            let boundaries = 0..=self.motion.rows();
            let turned: Vec<Vector3<f64>> = boundaries
                .map(|boundary| axis * (-(boundary as f64) * period_s))
                .collect();
            self.increments.carry_in_navigation(&turned)
        }));
        columns.extend([0, 1, 2].map(|axis: usize| self.filtered(axis, rate_hz)));
        columns.extend(
            [0, 1, 2].map(|axis: usize| self.carried(|row| axes[axis] * self.sensed(row)[axis])),
        );
        columns.extend(PAIRS.map(|(a, b)| {
            self.carried(|row| axes[a] * self.sensed(row)[b] + axes[b] * self.sensed(row)[a])
        }));
        columns
    }
}

/// Rate of change of increments \[rad by row and second\], by central differences.
fn growth(increments_rad: &[Vector3<f64>], rate_hz: f64) -> Vec<Vector3<f64>> {
    let last = increments_rad.len() - 1;
    (0..=last)
        .map(|row| {
            let (from, to) = (row.saturating_sub(1), (row + 1).min(last));
            (increments_rad[to] - increments_rad[from]) * (rate_hz / (to - from) as f64)
        })
        .collect()
}
