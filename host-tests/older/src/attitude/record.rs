//! A recording beside its attitudes: error angles at the stamps, and how anything on the gyros' rows shows there.
//!
//! Enters: the scene (its motion is the gyros' own), the model, the samples and how the reference's clock and frame
//! lie. Leaves: for each stamp the error e = Log(S C_refᵀ N) \[rad, start frame\]; S is the gyros' attitude, N ties
//! the reference's frame to the start frame at the first stamp of each chain. e grows by ∫ C(t) δω(t) dt, linear in
//! every effect; no small-angle expansion of the motion enters. Of a reference that sums up increments e is the difference
//! of the sums, and C nothing (path.rs).
//!
//! A reference late by d is read at t − d, one turned by r has C_ref turned back by r: both exactly, however large.
//! A step across rows that were not measured ends its chain.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::path::{Axes, Path};
use super::samples::{Shown, SlowSample};
use super::whiten::Step;
use crate::scene::Scene;
use crate::streams::Triad;

/// How the reference's clock and frame lie against the gyros'.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lie {
    /// The reference's row for t shows the case at t − delay \[s\].
    pub delay_s: f64,
    /// The reference is turned by this (right-hand) \[rad\].
    pub turn_rad: Vector3<f64>,
}

/// See the page above.
pub struct Record {
    /// The gyros' attitude.
    pub path: Path,
    /// What an error of the sensed increments of a row adds to e, by row.
    carry: Vec<Matrix3<f64>>,
    /// Places of the stamps in rows.
    pub places: Vec<f64>,
    /// Stamps \[s\], on the gyros' clock.
    pub times_s: Vec<f64>,
    /// e at the stamps.
    pub error_rad: Vec<Vector3<f64>>,
    /// Steps, the first leading nowhere.
    pub steps: Vec<Step>,
    /// Whether the step to a stamp is broken.
    pub broken: Vec<bool>,
}

/// More stamps than this are thinned: an hour at 3 Hz; products of channels are kept for every one.
const MOST_STAMPS: usize = 10_000;

impl Record {
    /// Compares. `increments_rad`: the case's own increments, less whatever the model explains.
    pub fn new(
        scene: &Scene,
        increments_rad: Triad,
        body_from_sensing: &Matrix3<f64>,
        samples: &[SlowSample],
        lie: &Lie,
        white_rad2: [f64; 3],
    ) -> Self {
        let streams = &scene.streams;
        let derived = |order: i32| -> Triad {
            [0, 1, 2].map(|axis: usize| match order {
                0 => scene.rate_rad_s[axis].clone(),
                1 => scene.acceleration_rad_s2[axis].clone(),
                _ => scene.rate_derived(axis, order),
            })
        };
        let sums = samples.iter().any(|one| matches!(one.shown, Shown::Sum(_)));
        let path = Path::new(
            streams.start_s,
            streams.rate_hz,
            increments_rad,
            [derived(0), derived(1), derived(2), derived(3)],
            if sums { Axes::Body } else { Axes::Start },
        );
        let one_less_scale = Vector3::from(scene.scale_error.map(|scale| 1.0 - scale));
        let case_from_sensed = body_from_sensing * Matrix3::from_diagonal(&one_less_scale);
        let carry: Vec<Matrix3<f64>> = (0..path.rows())
            .into_par_iter()
            .map(|row| path.start_from_body(row) * case_from_sensed)
            .collect();
        let body_from_reference = UnitQuaternion::from_scaled_axis(lie.turn_rad);
        let mut taken: Vec<(f64, SlowSample)> = Vec::new();
        let mut gap = false;
        for sample in samples {
            gap |= sample.after_gap;
            let place = path.place(sample.time_s - lie.delay_s);
            let rises = taken.last().is_none_or(|(last, _)| place > *last);
            if path.reaches(place) && rises {
                let mut kept = *sample;
                kept.after_gap = gap;
                taken.push((place, kept));
                gap = false;
            }
        }
        let every = taken.len().div_ceil(MOST_STAMPS).max(1);
        let mut gap = false;
        let mut thinned = Vec::new();
        for (index, mut one) in taken.into_iter().enumerate() {
            gap |= one.1.after_gap;
            if index % every == 0 {
                one.1.after_gap = gap;
                gap = false;
                thinned.push(one);
            }
        }
        let places: Vec<f64> = thinned.iter().map(|(place, _)| *place).collect();
        let broken: Vec<bool> = (0..places.len())
            .map(|stamp| {
                stamp == 0 || thinned[stamp].1.after_gap || {
                    let from = places[stamp - 1].floor() as usize;
                    let to = (places[stamp].ceil() as usize).min(streams.rows);
                    streams.usable[from..to].contains(&false)
                }
            })
            .collect();
        let mut tie = None;
        let error_rad = thinned
            .iter()
            .enumerate()
            .map(|(stamp, (place, sample))| {
                let read = sample.shown.turned_back(&body_from_reference);
                let apart = path.shown(*place).against(&read);
                if broken[stamp] {
                    tie = Some(apart);
                }
                tie.map_or_else(Vector3::zeros, |tie| apart.against(&tie).angle_rad())
            })
            .collect();
        let steps = steps(&path, &carry, &places, streams.rate_hz, white_rad2);
        Self {
            times_s: places
                .iter()
                .map(|place| streams.start_s + place / streams.rate_hz)
                .collect(),
            path,
            carry,
            places,
            error_rad,
            steps,
            broken,
        }
    }

    /// What additions to the sensed increments \[rad per row\] make of the error angles.
    pub fn push(&self, sensed: [Option<&[f64]>; 3]) -> Vec<Vector3<f64>> {
        self.path.summed(&self.places, |row| {
            let mut sum = Vector3::zeros();
            for (axis, values) in sensed.iter().enumerate() {
                if let Some(values) = values {
                    sum += self.carry[row].column(axis) * values[row];
                }
            }
            sum
        })
    }

    /// The body's rate at the stamps in the start frame \[rad/s\]: what a late reference shows a second.
    pub fn rate_at_stamps(&self, scene: &Scene) -> Vec<Vector3<f64>> {
        let rows = self.path.rows();
        self.places
            .iter()
            .map(|place| {
                // Between middles by straight lines.
                let at = (place - 0.5).clamp(0.0, (rows - 1) as f64);
                let row = (at.floor() as usize).min(rows.saturating_sub(2));
                let share = at - row as f64;
                let rate = Vector3::from_fn(|axis, _| {
                    let values = &scene.rate_rad_s[axis];
                    values[row] + share * (values[row + 1] - values[row])
                });
                self.path.at(*place) * rate
            })
            .collect()
    }

    /// What a reference that is turned by one radian about a body axis adds to the error angles, beside a constant, which
    /// the first stamp takes.
    pub fn turn_at_stamps(&self, axis: usize) -> Vec<Vector3<f64>> {
        match self.path.axes() {
            // e = −C r.
            Axes::Start => {
                let along = |step: &Step| -step.start_from_body.column(axis);
                self.steps.iter().map(along).collect()
            }
            // e = r × θ.
            Axes::Body => {
                let about = Vector3::ith(axis, 1.0);
                let of = |place: &f64| about.cross(&self.path.shown(*place).angle_rad());
                self.places.iter().map(of).collect()
            }
        }
    }

    /// Number of stamps.
    pub fn stamps(&self) -> usize {
        self.places.len()
    }
}

/// The geometry of every step.
fn steps(
    path: &Path,
    carry: &[Matrix3<f64>],
    places: &[f64],
    rate_hz: f64,
    white_rad2: [f64; 3],
) -> Vec<Step> {
    let period_s = 1.0 / rate_hz;
    let white = Matrix3::from_diagonal(&Vector3::from(white_rad2));
    let mut row = places.first().map_or(0, |place| place.floor() as usize);
    places
        .iter()
        .enumerate()
        .map(|(stamp, &place)| {
            let mut step = Step {
                seconds: if stamp == 0 {
                    0.0
                } else {
                    (place - places[stamp - 1]) * period_s
                },
                walk_s: [Matrix3::zeros(); 3],
                turned_rad2: Matrix3::zeros(),
                angle_from_rate_s: Matrix3::zeros(),
                start_from_body: *path.at(place).to_rotation_matrix().matrix(),
            };
            let last = (place.floor() as usize).min(carry.len());
            let begin = row;
            while row < last {
                let c = &carry[row];
                step.angle_from_rate_s += c;
                for axis in 0..3 {
                    step.walk_s[axis] += c.column(axis) * c.column(axis).transpose();
                }
                // White noise of angle does not telescope where the axes turn between readings.
                if path.axes() == Axes::Start {
                    let cross = path.increment(row).cross_matrix();
                    step.turned_rad2 += c * (cross * white * cross.transpose()) * c.transpose();
                }
                row += 1;
            }
            // Whole rows stand for the step; stamps inside a row lend or borrow a share of one.
            let counted = (last - begin).max(1) as f64 * period_s;
            if last == begin && begin < carry.len() {
                step.angle_from_rate_s = carry[begin];
                for axis in 0..3 {
                    let column = carry[begin].column(axis);
                    step.walk_s[axis] = column * column.transpose();
                }
            }
            let scale = if step.seconds > 0.0 {
                step.seconds / counted
            } else {
                0.0
            };
            step.angle_from_rate_s *= period_s * scale;
            step.walk_s
                .iter_mut()
                .for_each(|walk| *walk *= period_s * scale);
            step
        })
        .collect()
}
