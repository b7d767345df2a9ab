//! Rows of the likelihood: increments of the attitude error between the reference's stamps, in the navigation frame.
//!
//! With D = (navigation from body, by the reference) × (body from start, by the gyros), row k is Log(D_{k+1} D_k⁻¹). White
//! noise of the attitude is then differenced white noise, and an error h of the gyros in body axes becomes D_k ∫ C h dt.
//! Each row is relative to its own initial attitude, so that an error may grow without bound. For a reference of summed
//! increments D is the difference of the sums, without rotation.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rlg_plan::AttitudeRowsPlan;
use rlg_signal::attitude_samples::{Shown, SlowSample};
use rlg_signal::axes::Triad;
use rlg_signal::transforms::smooth_length;

use crate::likelihood::noise::{ALL_ALIKE, Alike, EACH_ITS_OWN};
use crate::rows::gyro_motion::{GyroMotion, Place};

/// Conversion of the reference's stamps to the gyros' clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceClock {
    /// Delay of the stamps \[s\].
    pub delay_s: f64,
    /// Relative rate error of the reference's clock against the gyros', about `middle_s`, positive if fast \[1\].
    pub rate: f64,
    /// Middle of the stamps \[s\].
    pub middle_s: f64,
}

impl ReferenceClock {
    /// Converts a stamp to the gyros' clock \[s\].
    pub fn on_gyros_s(&self, stamp_s: f64) -> f64 {
        stamp_s - self.delay_s - self.rate * (stamp_s - self.middle_s)
    }
}

/// Flags of all stamps.
#[derive(Debug, Clone)]
pub struct Stamps {
    /// The stamp has no usable attitude.
    pub left_out: Vec<bool>,
    /// The reference jumped just before the stamp, permanently.
    pub jumped: Vec<bool>,
}

impl Stamps {
    /// Flags some stamps as left out and none as jumped.
    pub fn without(left_out: &[bool]) -> Self {
        Self {
            left_out: left_out.to_vec(),
            jumped: vec![false; left_out.len()],
        }
    }

    /// Leaves out used stamps flagged as faulty; true if there are any.
    ///
    /// # Inputs
    /// `used`: indices of the used stamps; `faulty`: flag of each.
    pub fn leave_out(&mut self, used: &[usize], faulty: &[bool]) -> bool {
        for (stamp, _) in used.iter().zip(faulty).filter(|(_, faulty)| **faulty) {
            self.left_out[*stamp] = true;
        }
        faulty.contains(&true)
    }
}

/// Rows of the likelihood, as defined above.
pub struct Increments {
    /// Rows in the navigation frame \[rad\].
    pub rows_rad: Triad,
    /// Indices of the used stamps, one more than rows.
    pub stamps: Vec<usize>,
    /// Times of the used stamps on the gyros' clock \[s\].
    pub times_s: Vec<f64>,
    /// Rotation from start to navigation frame at each row's begin.
    navigation_from_start: Vec<UnitQuaternion<f64>>,
    /// Free rows, with a nuisance parameter on each axis: across gaps of the stamps or of the gyros, across jumps, and at
    /// the two ends.
    pub free: Vec<usize>,
    /// Typical time between stamps \[s\].
    pub period_s: f64,
    /// Noise groups of the axes: one for attitudes, as each axis turns into the others.
    pub alike: Alike,
    /// Lower bound of each axis's random-walk variance in a row, the gyros' white noise \[rad²\].
    pub least_walk_rad2: [f64; 3],
    /// Angle random walk of gyros and reference as declared by the model \[rad/√s\].
    pub declared_walk_rad_sqrt_s: Option<f64>,
    places: Vec<Place>,
}

/// A stamp used for the rows.
struct Used {
    stamp: usize,
    /// On the gyros' clock \[s\].
    time_s: f64,
    place: Place,
}

impl Used {
    /// Stamps that are not left out and lie within the gyros' record and outside its gaps; of many stamps a few at the end
    /// are dropped, as the transform is fast at smooth lengths.
    fn all(
        motion: &GyroMotion,
        samples: &[SlowSample],
        known: &Stamps,
        clock: &ReferenceClock,
        lost_before: &[usize],
        plan: &AttitudeRowsPlan,
    ) -> Vec<Self> {
        let end_rows = if samples.len() > plan.short {
            plan.end_rows
        } else {
            0
        };
        let inside = |place: &Place| {
            let is_within = place.row >= end_rows && place.row + end_rows < motion.rows();
            is_within && !is_in_gap(place.row, lost_before, plan.bridged_rows)
        };
        let left_in = samples.iter().enumerate();
        let left_in = left_in.filter(|(stamp, _)| !known.left_out[*stamp]);
        let mut used: Vec<Self> = left_in
            .filter_map(|(stamp, sample)| {
                let time_s = clock.on_gyros_s(sample.time_s);
                Some(Self {
                    stamp,
                    time_s,
                    place: motion.place(time_s).filter(inside)?,
                })
            })
            .collect();
        let mut rows = used.len().saturating_sub(1);
        while rows > plan.short && smooth_length(rows) != rows {
            rows -= 1;
        }
        used.truncate(rows + 1);
        used
    }
}

impl Increments {
    /// Forms rows of the stamps that are not left out; `None` if fewer than two lie within the gyros' record.
    ///
    /// # Inputs
    /// `lost_before`: cumulative number of unmeasured gyro rows at each row boundary.
    pub fn new(
        motion: &GyroMotion,
        samples: &[SlowSample],
        known: &Stamps,
        clock: &ReferenceClock,
        lost_before: &[usize],
        plan: &AttitudeRowsPlan,
    ) -> Option<Self> {
        let used = Used::all(motion, samples, known, clock, lost_before, plan);
        if used.len() < 2 {
            return None;
        }
        let errors: Vec<Shown> = used
            .iter()
            .map(|one| samples[one.stamp].shown.against(&motion.shown(one.place)))
            .collect();
        let rows = used.len() - 1;
        let mut rows_rad: Triad = std::array::from_fn(|_| Vec::with_capacity(rows));
        for pair in errors.windows(2) {
            let grown = pair[1].against(&pair[0]).angle_rad();
            for axis in 0..3 {
                rows_rad[axis].push(grown[axis]);
            }
        }
        let times_s: Vec<f64> = used.iter().map(|one| one.time_s).collect();
        let places: Vec<Place> = used.iter().map(|one| one.place).collect();
        let period_s = typical_period_s(&times_s, plan);
        let lost = |row: usize| {
            let before = |place: Place| lost_before[(place.row + 1).min(lost_before.len() - 1)];
            before(places[row + 1]) - before(places[row])
        };
        let mut free = free_rows(&times_s, period_s, &lost, plan);
        let jumps = used.windows(2).enumerate().filter(|(_, pair)| {
            let stamps = pair[0].stamp + 1..=pair[1].stamp;
            known.jumped[stamps].contains(&true)
        });
        free.extend(jumps.map(|(row, _)| row));
        free.sort_unstable();
        free.dedup();
        Some(Self {
            rows_rad,
            stamps: used.iter().map(|one| one.stamp).collect(),
            navigation_from_start: errors[..rows]
                .iter()
                .map(|error| match error {
                    Shown::Attitude(error) => *error,
                    Shown::Sum(_) => UnitQuaternion::identity(),
                })
                .collect(),
            times_s,
            free,
            period_s,
            alike: match errors[0] {
                Shown::Attitude(_) => ALL_ALIKE,
                Shown::Sum(_) => EACH_ITS_OWN,
            },
            least_walk_rad2: [0.0; 3],
            declared_walk_rad_sqrt_s: None,
            places,
        })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.navigation_from_start.len()
    }

    /// Rotation from start to navigation frame at a row's begin.
    pub fn navigation_from_start(&self, row: usize) -> Matrix3<f64> {
        let rotation = self.navigation_from_start[row].to_rotation_matrix();
        rotation.into_inner()
    }

    /// True if a row is free.
    pub fn is_free(&self, row: usize) -> bool {
        self.free.binary_search(&row).is_ok()
    }

    /// Sets the free rows selected by `which` to 0.
    pub fn silence_free(&self, rows_rad: &mut Triad, which: impl Fn(usize) -> bool) {
        for &row in self.free.iter().filter(|row| which(**row)) {
            rows_rad.iter_mut().for_each(|values| values[row] = 0.0);
        }
    }

    /// Transforms a vector of a row to the body's axes.
    pub fn in_body(&self, motion: &GyroMotion, row: usize, value: Vector3<f64>) -> Vector3<f64> {
        let start = self.navigation_from_start(row).transpose() * value;
        motion.frame_from_body(self.places[row]).inverse() * start
    }

    /// Rate by which the gyros exceed the reference over a row, body axes \[rad/s\].
    pub fn excess_rad_s(&self, motion: &GyroMotion, row: usize) -> Vector3<f64> {
        let value = Vector3::from_fn(|axis, _| self.rows_rad[axis][row]);
        let lasts_s = self.times_s[row + 1] - self.times_s[row];
        // A gyro that reads too much lets the reference lag.
        -self.in_body(motion, row, value) / lasts_s
    }

    /// Places of the stamps along the gyros' rows.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Differences between stamps of a vector given at the gyros' row boundaries in the start frame, transformed to the
    /// navigation frame.
    pub fn carry(&self, at_boundaries: &[Vector3<f64>]) -> Triad {
        self.difference(at_boundaries, |row, grown| {
            self.navigation_from_start(row) * grown
        })
    }

    /// Differences between stamps of a vector already in the navigation frame.
    pub fn carry_in_navigation(&self, at_boundaries: &[Vector3<f64>]) -> Triad {
        self.difference(at_boundaries, |_, grown| grown)
    }

    fn difference(
        &self,
        at_boundaries: &[Vector3<f64>],
        turned: impl Fn(usize, Vector3<f64>) -> Vector3<f64>,
    ) -> Triad {
        let at = |place: Place| {
            at_boundaries[place.row].lerp(&at_boundaries[place.row + 1], place.share)
        };
        let mut values: Triad = std::array::from_fn(|_| Vec::with_capacity(self.rows()));
        let mut before = at(self.places[0]);
        for (row, place) in self.places[1..].iter().enumerate() {
            let now = at(*place);
            let grown = turned(row, now - before);
            for axis in 0..3 {
                values[axis].push(grown[axis]);
            }
            before = now;
        }
        values
    }
}

/// Typical period of stamps \[s\]: the mean for stamps in bursts, else the median, which missing stamps do not change.
fn typical_period_s(times_s: &[f64], plan: &AttitudeRowsPlan) -> f64 {
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let median = steps[steps.len() / 2];
    let gaps = steps.len().div_ceil(plan.gap_among).min(steps.len() - 1);
    let kept = &steps[..steps.len() - gaps];
    let mean = kept.iter().sum::<f64>() / kept.len() as f64;
    // Bursts: half of the stamps follow at once on another.
    if median < plan.burst * mean {
        mean
    } else {
        median
    }
}

/// True if a gyro row lies in a run of lost rows too long to bridge: stamps in it have no gyro motion to compare with.
fn is_in_gap(row: usize, lost_before: &[usize], bridged: usize) -> bool {
    let is_lost = |row: &usize| lost_before[row + 1] > lost_before[*row];
    let last = lost_before.len() - 2;
    let back = (0..=row).rev().take(bridged + 1).take_while(is_lost);
    let back = back.count();
    let ahead = (row + 1..=last).take(bridged).take_while(is_lost);
    back > 0 && back + ahead.count() > bridged
}

/// # Inputs
/// `lost`: number of unmeasured gyro rows within a row.
fn free_rows(
    times_s: &[f64],
    period_s: f64,
    lost: &dyn Fn(usize) -> usize,
    plan: &AttitudeRowsPlan,
) -> Vec<usize> {
    let last = times_s.len() - 2;
    let lasts_s = |row: usize| times_s[row + 1] - times_s[row];
    let mut gaps: Vec<usize> = (1..last)
        .filter(|&row| lasts_s(row) > plan.gap_periods * period_s || lost(row) > plan.bridged_rows)
        .collect();
    gaps.sort_by(|a, b| {
        let size = |row: usize| lasts_s(row) / period_s + lost(row) as f64;
        size(*b).total_cmp(&size(*a))
    });
    gaps.truncate(plan.most_gaps);
    gaps.extend([0, last]);
    gaps.sort_unstable();
    gaps.dedup();
    gaps
}
