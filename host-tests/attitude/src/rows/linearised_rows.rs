//! Likelihood rows linearised about an alignment, and the columns of its parameters.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use rlg_plan::AttitudePlan;
use rlg_signal::attitude_samples::SlowSample;
use rlg_signal::axes::Triad;

use crate::likelihood::noise::Alike;
use crate::rows::alignment::{Alignment, COUNT, PAIRS, parameter_at};
use crate::rows::conditioned::conditioned;
use crate::rows::dither::Dither;
use crate::rows::earth::Slow;
use crate::rows::gyro_motion::{GyroMotion, Reads};
use crate::rows::increments::{Increments, ReferenceClock, Stamps};

/// Gyro data of a recording.
#[derive(Clone)]
pub struct Gyros {
    /// Start time of the first row \[s\].
    pub start_s: f64,
    /// Row rate \[Hz\].
    pub rate_hz: f64,
    /// Sensed increments in the case's axes by the model, less the model's other effects \[rad\].
    pub sensed_rad: Vec<Vector3<f64>>,
    /// Variance of each gyro's white noise in a row \[rad²\].
    pub white_noise_rad2: [f64; 3],
    /// Cumulative number of unmeasured rows at each row boundary.
    pub lost_before: Vec<usize>,
    /// Angle random walk of gyros and reference as declared by the model \[rad/√s\].
    pub declared_walk_rad_sqrt_s: Option<f64>,
    /// Kind of the reference's data.
    pub reads: Reads,
    /// Thresholds.
    pub plan: AttitudePlan,
    /// Dithers, already subtracted from the sensed increments; `None` for gyros without any.
    pub dither: Option<Arc<Dither>>,
}

impl Gyros {
    /// Increments about an axis \[rad\].
    pub(crate) fn along(&self, axis: usize) -> Vec<f64> {
        self.sensed_rad.iter().map(|row| row[axis]).collect()
    }

    /// Replaces the increments about an axis \[rad\].
    pub(crate) fn set_along(&mut self, axis: usize, values_rad: &[f64]) {
        for (row, value) in self.sensed_rad.iter_mut().zip(values_rad) {
            row[axis] = *value;
        }
    }

    /// Integrates increments of the body \[rad\] to the gyros' motion.
    pub fn motion(&self, increments_rad: Vec<Vector3<f64>>) -> GyroMotion {
        GyroMotion::new((self.start_s, self.rate_hz), increments_rad, self.reads)
    }

    /// Computes the white-noise variance of a row of `period_s` on each axis \[rad²\], averaged over axes of one noise
    /// group.
    fn white_noise_of_rows(&self, alike: Alike, period_s: f64) -> [f64; 3] {
        let mut rows_rad2 = [0.0; 3];
        for axes in alike {
            let sum: f64 = axes.iter().map(|&axis| self.white_noise_rad2[axis]).sum();
            let mean_rad2 = sum / axes.len() as f64 * self.rate_hz * period_s;
            axes.iter().for_each(|&axis| rows_rad2[axis] = mean_rad2);
        }
        rows_rad2
    }

    /// Sensed increments without the alignment's bias \[rad\]. A scale error also scales the dither of the gyro's block; the
    /// pickoff subtracted the dither at nominal scale only.
    fn without_bias(&self, alignment: &Alignment) -> Vec<Vector3<f64>> {
        let bias_rad = alignment.bias_rad_s / self.rate_hz;
        let mut unbiased: Vec<Vector3<f64>> =
            self.sensed_rad.iter().map(|row| row - bias_rad).collect();
        if let Some(dither) = &self.dither {
            let scale_error = alignment.scale_error();
            for (row, unbiased) in unbiased.iter_mut().enumerate() {
                *unbiased -= scale_error.component_mul(&dither.turn_rad(row));
            }
        }
        unbiased
    }

    /// Wiener-filtered motion of increments, less what a dither leaves in them \[rad\].
    fn conditioned(&self, increments_rad: &[Vector3<f64>]) -> Triad {
        let plan = &self.plan.conditioning;
        let Some(dither) = &self.dither else {
            return conditioned(increments_rad, self.rate_hz, plan);
        };
        let left = dither.left_rad(increments_rad, &self.lost_before);
        let pairs = increments_rad.iter().zip(&left);
        let moved: Vec<Vector3<f64>> = pairs.map(|(sensed, left)| sensed - left).collect();
        conditioned(&moved, self.rate_hz, plan)
    }

    /// Rate of change of the motion alone, as the gyros' noise enters after their filter \[rad by row and second\].
    fn growth_rad_s(&self, increments_rad: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let [x, y, z] = self.conditioned(increments_rad);
        let motion: Vec<Vector3<f64>> = (0..increments_rad.len())
            .map(|row| Vector3::new(x[row], y[row], z[row]))
            .collect();
        growth(&motion, self.rate_hz)
    }
}

/// Rows and motion, linearised about an alignment.
pub struct About {
    /// Attitude integrated from the gyros' increments.
    pub motion: GyroMotion,
    /// Rows of the likelihood.
    pub increments: Increments,
    /// Wiener-filtered motion in the gyros' axes, from which columns are formed \[rad\].
    pub conditioned_rad: Arc<Triad>,
    /// Rate of change of the sensed increments \[rad by row and second\]; present if a low pass is inverted.
    growth_rad_s: Option<Vec<Vector3<f64>>>,
    dither: Option<Arc<Dither>>,
    body_from_sensed: Matrix3<f64>,
    clock: ReferenceClock,
}

impl About {
    /// Forms rows about an alignment; `None` if fewer than two stamps lie within the gyros' record.
    pub fn new(
        gyros: &Gyros,
        samples: &[SlowSample],
        known: &Stamps,
        alignment: &Alignment,
    ) -> Option<Self> {
        let body_from_sensed = alignment.sensed_from_body.try_inverse()?;
        let mut unbiased = gyros.without_bias(alignment);
        let growth_rad_s = alignment.low_pass_s.map(|low_pass_s| {
            let growth_rad_s = gyros.growth_rad_s(&unbiased);
            for (row, growth) in unbiased.iter_mut().zip(&growth_rad_s) {
                *row += low_pass_s.component_mul(growth);
            }
            growth_rad_s
        });
        let body = unbiased.iter().map(|row| body_from_sensed * row);
        let mut motion = gyros.motion(body.collect());
        let clock = reference_clock(alignment, samples)?;
        let plan = &gyros.plan;
        let formed = |motion: &GyroMotion| {
            Increments::new(
                motion,
                samples,
                known,
                &clock,
                &gyros.lost_before,
                &plan.rows,
            )
        };
        let mut increments = formed(&motion)?;
        let slow = Slow::of(&increments, &motion, &plan.earth);
        let sensed_by_turn = alignment.sensed_by_turn();
        // It was estimated behind the scale.
        let before_scale = sensed_by_turn.matrix().transpose() * alignment.sensed_from_body;
        let rows = 0..unbiased.len();
        let fixed_rad: Vec<Vector3<f64>> = rows
            .map(|row| motion.in_row(row).inverse() * slow.fixed_rad_s / gyros.rate_hz)
            .map(|fixed| before_scale * fixed)
            .collect();
        // Columns hold no scale of what is fixed in space, and so no row does.
        let beyond_turn = Matrix3::identity() - body_from_sensed * sensed_by_turn.matrix();
        if beyond_turn != Matrix3::zeros() {
            drop(increments);
            let mut body = motion.into_increments_rad();
            for (body, fixed) in body.iter_mut().zip(&fixed_rad) {
                *body += beyond_turn * fixed;
            }
            motion = gyros.motion(body);
            increments = formed(&motion)?;
        }
        let constant_rad = slow.constant_rad_s / gyros.rate_hz;
        for (unbiased, fixed) in unbiased.iter_mut().zip(&fixed_rad) {
            *unbiased -= sensed_by_turn * (fixed + constant_rad);
        }
        drop(fixed_rad);
        increments.least_walk_rad2 =
            gyros.white_noise_of_rows(increments.alike, increments.period_s);
        increments.declared_walk_rad_sqrt_s = gyros.declared_walk_rad_sqrt_s;
        Some(Self {
            conditioned_rad: Arc::new(gyros.conditioned(&unbiased)),
            dither: gyros.dither.clone(),
            motion,
            increments,
            growth_rad_s,
            body_from_sensed,
            clock,
        })
    }

    /// Computes the column of an additional sensed increment \[rad by row\].
    pub fn carried(&self, sensed_rad: impl Fn(usize) -> Vector3<f64>) -> Triad {
        let sums = self
            .motion
            .carried_sum(|row| -(self.body_from_sensed * sensed_rad(row)));
        self.increments.carry(&sums)
    }

    /// Conditioned motion of a row in the gyros' axes \[rad\].
    fn sensed(&self, row: usize) -> Vector3<f64> {
        let last = self.motion.rows() - 1;
        Vector3::from_fn(|axis, _| self.conditioned_rad[axis][row.min(last)])
    }

    /// Computes the column of one gyro's filter: of its smoothing variance, half the second derivative of the rate over a
    /// row; of its low pass's time constant, minus the rate of change of the increments.
    fn filtered(&self, axis: usize) -> Triad {
        let rate_hz = self.motion.rate_hz();
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

    /// Columns of the registration, in the order of [`GROUPS`], each formed when it is asked for.
    pub fn columns(&self) -> impl Iterator<Item = Triad> {
        (0..COUNT).map(|place| self.column(place))
    }

    /// Computes the column of the registration parameter at a place.
    pub fn column(&self, place: usize) -> Triad {
        let period_s = 1.0 / self.motion.rate_hz();
        let (kind, own) = parameter_at(place);
        let axis = Vector3::ith(own, 1.0);
        match kind {
            "gyro_bias" => self.carried(|_| axis * period_s),
            "reference_misalignment" => self.carried(|row| axis.cross(&self.sensed(row))),
            "reference_delay" => self.increments.carry(&self.late()),
            "reference_clock_rate" => {
                let [start_s, _] = self.motion.span_s();
                let since_middle =
                    |boundary: usize| start_s + boundary as f64 * period_s - self.clock.middle_s;
                let mut drifted = self.late();
                for (boundary, late) in drifted.iter_mut().enumerate() {
                    *late *= since_middle(boundary);
                }
                self.increments.carry(&drifted)
            }
            "earth_rate" => {
                let turned = self.motion.fixed_sum(-period_s * axis);
                self.increments.carry_in_navigation(&turned)
            }
            "gyro_bandwidth" => self.filtered(own),
            "gyro_scale" => self.carried(|row| {
                let sensed = self.sensed(row);
                let turned = match &self.dither {
                    Some(dither) => sensed + dither.turn_rad(row),
                    None => sensed,
                };
                axis * turned[own]
            }),
            _ => {
                let (a, b) = PAIRS[own];
                let axes = [a, b].map(|axis| Vector3::ith(axis, 1.0));
                self.carried(|row| axes[0] * self.sensed(row)[b] + axes[1] * self.sensed(row)[a])
            }
        }
    }

    /// Change of the attitude by a delay of the gyros, per second \[rad/s\], at row boundaries.
    fn late(&self) -> Vec<Vector3<f64>> {
        let body = |row: usize| self.body_from_sensed * self.sensed(row);
        let half_hz = 0.5 * self.motion.rate_hz();
        self.motion
            .carried(|boundary| -(half_hz * (body(boundary.saturating_sub(1)) + body(boundary))))
    }
}

/// Clock of an alignment about the middle of the stamps; `None` without stamps.
fn reference_clock(alignment: &Alignment, samples: &[SlowSample]) -> Option<ReferenceClock> {
    let (first, last) = (samples.first()?, samples.last()?);
    Some(ReferenceClock {
        delay_s: alignment.delay_s,
        rate: alignment.clock_rate,
        middle_s: 0.5 * (first.time_s + last.time_s),
    })
}

/// Computes the rate of change of increments \[rad by row and second\] to fourth order, as a low pass is inverted up to its
/// corner.
fn growth(increments_rad: &[Vector3<f64>], rate_hz: f64) -> Vec<Vector3<f64>> {
    let last = increments_rad.len() - 1;
    let across = |row: usize, rows: usize| {
        let (from, to) = (row.saturating_sub(rows), (row + rows).min(last));
        (increments_rad[to] - increments_rad[from]) / (to - from) as f64
    };
    (0..=last)
        .map(|row| match (2..last.max(1) - 1).contains(&row) {
            true => (4.0 * across(row, 1) - across(row, 2)) * (rate_hz / 3.0),
            false => across(row, 1) * rate_hz,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use crate::rows::alignment::{GROUPS, places};

    /// Gyros that swing about three axes with sixteen frequencies each, and attitudes at 30 Hz without errors.
    fn scene() -> (Gyros, Vec<SlowSample>) {
        let (rate_hz, rows) = (200.0, 4000);
        let rate = |axis: usize, time_s: f64| {
            let wave = |k: u32| {
                let hz = 0.2 + 0.53 * f64::from(k) + 0.07 * axis as f64;
                (std::f64::consts::TAU * hz * time_s + f64::from(k * k) + axis as f64).sin()
            };
            0.2 * (0..16).map(wave).sum::<f64>()
        };
        let time_s = |row: usize| (row as f64 + 0.5) / rate_hz;
        let sensed_rad: Vec<Vector3<f64>> = (0..rows)
            .map(|row| Vector3::from_fn(|axis, _| rate(axis, time_s(row)) / rate_hz))
            .collect();
        let motion = GyroMotion::new((0.0, rate_hz), sensed_rad.clone(), Reads::Attitudes);
        let samples: Vec<SlowSample> = (0..550)
            .map(|stamp| {
                let time_s = 0.2 + f64::from(stamp) / 30.0;
                let place = motion.place(time_s).expect("inside");
                SlowSample {
                    time_s,
                    shown: motion.shown(place),
                    after_gap: false,
                }
            })
            .collect();
        let gyros = Gyros {
            start_s: 0.0,
            rate_hz,
            sensed_rad,
            white_noise_rad2: [0.0; 3],
            lost_before: vec![0; rows + 1],
            dither: None,
            reads: Reads::Attitudes,
            declared_walk_rad_sqrt_s: None,
            plan: Default::default(),
        };
        (gyros, samples)
    }

    /// The finite difference of the rows by each registration parameter equals its column.
    #[test]
    fn columns_are_what_the_rows_change_by() {
        let (gyros, samples) = scene();
        let stamps = Stamps::without(&vec![false; samples.len()]);
        for low_pass_s in [None, Some(Vector3::new(0.02, 0.03, 0.015))] {
            let alignment = Alignment {
                bias_rad_s: Vector3::new(0.01, -0.02, 0.005),
                sensed_from_body: Matrix3::identity(),
                delay_s: 0.004,
                clock_rate: 0.0,
                low_pass_s,
                turn: Rotation3::identity(),
            };
            let about = |alignment: &Alignment| {
                About::new(&gyros, &samples, &stamps, alignment).expect("inside")
            };
            let here = about(&alignment);
            let columns: Vec<Triad> = here.columns().collect();
            let inner = 3..here.increments.rows() - 3;
            // Not checked: Earth rate and smoothing enter by their columns only, and the bias changes the Wiener weights.
            let is_checked = |kind: &str| match kind {
                "earth_rate" => false,
                "gyro_bandwidth" => low_pass_s.is_some(),
                "gyro_bias" => low_pass_s.is_none(),
                _ => true,
            };
            for group in GROUPS.iter().filter(|group| is_checked(group.kind)) {
                for place in places(group.kind) {
                    let step = 1e-6;
                    let mut by = [0.0; COUNT];
                    by[place] = step;
                    let moved = about(&alignment.moved(&by));
                    let (mut missed, mut own) = (0.0, 0.0);
                    for (axis, column) in columns[place].iter().enumerate() {
                        for row in inner.clone() {
                            let [before, after] =
                                [&here, &moved].map(|about| about.increments.rows_rad[axis][row]);
                            let column = column[row];
                            missed += ((before - after) / step - column).powi(2);
                            own += column * column;
                        }
                    }
                    let missed = (missed / own).sqrt();
                    assert!(missed < 0.05, "{} {place}: {missed:.3}", group.kind);
                }
            }
        }
    }
}
