//! Samples of a reference slower than the gyros.
//!
//! Enters: the four `reference_attitude` channels of one table, at any rate or stamped, or `reference_increment` channels on
//! a clock of their own. Leaves: unit quaternions, body to navigation frame, or cumulative sums of increments, with their
//! time \[s\]; rows without a value are skipped. Either sign of a quaternion is the same attitude.
//!
//! Increments are the integral of the case's rate in its own axes, as are the gyros' sums over the same time: sums are
//! compared with sums, for any motion within a row. An attitude integrated from them would lack coning above their rate.
//! After a gap the sum restarts from zero, and the sample is flagged.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::axes::AXES;
use rlg_plan::AttitudeSamplePlan;
use rlg_recording::error::InputError;
use rlg_recording::{Channel, Clock, Quantity, Recording, Table};

/// One attitude.
#[derive(Debug, Clone, Copy)]
pub struct AttitudeSample {
    /// Time \[s\]: the row's end, or its stamp.
    pub time_s: f64,
    /// Body to navigation frame.
    pub navigation_from_body: UnitQuaternion<f64>,
}

impl AttitudeSample {
    fn shown(&self) -> Shown {
        Shown::Attitude(self.navigation_from_body)
    }
}

/// Measured value of a slow reference.
#[derive(Debug, Clone, Copy)]
pub enum Shown {
    /// Body to navigation frame.
    Attitude(UnitQuaternion<f64>),
    /// The integral of the case's rate in its own axes since the last gap \[rad\].
    Sum(Vector3<f64>),
}

impl Shown {
    /// Removes the reference's rotation relative to the body.
    pub fn turned_back(self, body_from_reference: &UnitQuaternion<f64>) -> Self {
        match self {
            Self::Attitude(of) => Self::Attitude(of * body_from_reference.inverse()),
            Self::Sum(angle) => Self::Sum(body_from_reference * angle),
        }
    }

    /// Rotation from the other to this attitude, or difference of the sums.
    pub fn against(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Attitude(own), Self::Attitude(other)) => Self::Attitude(own * other.inverse()),
            (Self::Sum(own), Self::Sum(other)) => Self::Sum(own - other),
            _ => unreachable!("a recording has one kind of reference, and its path the same"),
        }
    }

    /// True if both are the same attitude to the last bit, of either sign (a held sample); false for sums.
    pub fn repeats(&self, other: &Self) -> bool {
        let (Self::Attitude(own), Self::Attitude(other)) = (self, other) else {
            return false;
        };
        own.coords == other.coords || own.coords == -other.coords
    }

    /// Rotation vector \[rad\].
    pub fn angle_rad(&self) -> Vector3<f64> {
        match self {
            Self::Attitude(of) => of.scaled_axis(),
            Self::Sum(angle) => *angle,
        }
    }

    /// Rotation vector from here to a later sample \[rad, body axes\].
    pub fn turn_to(&self, later: &Self) -> Vector3<f64> {
        match (self, later) {
            (Self::Attitude(from), Self::Attitude(to)) => (from.inverse() * to).scaled_axis(),
            _ => later.against(self).angle_rad(),
        }
    }
}

/// One sample of a slow reference.
#[derive(Debug, Clone, Copy)]
pub struct SlowSample {
    /// Time \[s\]: the row's end, or its stamp.
    pub time_s: f64,
    /// The measured value.
    pub shown: Shown,
    /// The sample's relation to its predecessor is unknown.
    pub after_gap: bool,
}

/// True if the recording has attitude samples.
pub fn has_attitude(recording: &Recording) -> bool {
    ["w", "x", "y", "z"].iter().all(|axis| {
        recording
            .channel(&Quantity::ReferenceAttitude, axis)
            .is_some()
    })
}

/// Returns the samples of the slow reference present; attitudes before increments.
pub fn slow_samples(
    recording: &Recording,
    plan: &AttitudeSamplePlan,
) -> Result<Vec<SlowSample>, InputError> {
    if has_attitude(recording) {
        let attitudes = attitude_samples(recording, plan)?;
        let shown = attitudes.into_iter().map(|sample| SlowSample {
            time_s: sample.time_s,
            shown: sample.shown(),
            after_gap: false,
        });
        Ok(shown.collect())
    } else {
        increment_samples(recording)
    }
}

/// Reads attitude samples.
pub fn attitude_samples(
    recording: &Recording,
    plan: &AttitudeSamplePlan,
) -> Result<Vec<AttitudeSample>, InputError> {
    let missing = |axis: &str| {
        InputError::new(
            recording.folder.join("recording.toml"),
            "has attitude samples without one of the four components",
        )
        .channel(format!("reference_attitude {axis}"))
        .expected("axis = \"w\", \"x\", \"y\" and \"z\" in one table")
    };
    let (table, w) = recording
        .channel(&Quantity::ReferenceAttitude, "w")
        .ok_or_else(|| missing("w"))?;
    let component = |axis: &str| {
        table
            .channel(&Quantity::ReferenceAttitude, axis)
            .ok_or_else(|| missing(axis))
    };
    let (x, y, z) = (component("x")?, component("y")?, component("z")?);
    let mut samples = Vec::new();
    for row in 0..table.rows {
        let quaternion =
            Quaternion::new(w.values[row], x.values[row], y.values[row], z.values[row]);
        let norm = quaternion.norm();
        if !norm.is_finite() || norm < plan.no_attitude {
            continue;
        }
        if (norm - 1.0).abs() > plan.norm_error {
            let file = recording.folder.join(&table.file);
            return Err(InputError::new(file, "is no unit quaternion")
                .channel("reference_attitude")
                .row(row as u64)
                .value(format!("a norm of {norm}"))
                .expected("w, x, y, z with a norm of 1"));
        }
        samples.push(AttitudeSample {
            time_s: end_s(table, row),
            navigation_from_body: UnitQuaternion::from_quaternion(quaternion),
        });
    }
    Ok(without_held(samples))
}

/// Removes held samples: a recorder faster than its reference repeats the last attitude, and only the first of equal ones is
/// new. A reference at rest repeats itself too, but not in most of its rows.
fn without_held(samples: Vec<AttitudeSample>) -> Vec<AttitudeSample> {
    let same = |pair: &[AttitudeSample]| pair[1].shown().repeats(&pair[0].shown());
    let held = samples.windows(2).filter(|pair| same(pair)).count();
    if 2 * held <= samples.len() {
        return samples;
    }
    let mut fresh: Vec<AttitudeSample> = samples.first().copied().into_iter().collect();
    let changes = samples.windows(2).filter(|pair| !same(pair));
    fresh.extend(changes.map(|pair| pair[1]));
    fresh
}

fn end_s(table: &Table, row: usize) -> f64 {
    match &table.clock {
        Clock::Uniform { rate_hz, start_s } => start_s + (row + 1) as f64 / rate_hz,
        Clock::Stamped { stamps_s, .. } => stamps_s[row],
    }
}

/// Sums up increments on a clock other than the gyros'.
fn increment_samples(recording: &Recording) -> Result<Vec<SlowSample>, InputError> {
    let file = recording.folder.join("recording.toml");
    let channels = AXES.map(|axis| recording.channel(&Quantity::ReferenceIncrement, axis));
    let [Some((table, x)), Some((_, y)), Some((_, z))] = channels else {
        return Err(
            InputError::new(&file, "no reference to predict the gyros from")
                .channel("reference_increment, reference_attitude")
                .expected("reference increments on x, y and z, or attitudes w, x, y and z"),
        );
    };
    let Clock::Uniform { rate_hz, start_s } = table.clock else {
        return Err(InputError::new(
            &file,
            "the reference's increments have stamps instead of a rate",
        )
        .channel(x.column.clone())
        .expected("rate_hz: increments are summed over equal periods"));
    };
    let channels: [&Channel; 3] = [x, y, z];
    if channels
        .iter()
        .any(|channel| channel.values.len() != table.rows)
        || table.rows < 3
    {
        return Err(
            InputError::new(&file, "too few rows of reference increments")
                .channel(x.column.clone())
                .value(table.rows)
                .expected("at least 3 rows, the same number on x, y and z"),
        );
    }
    let known: Vec<bool> = (0..table.rows)
        .map(|row| {
            channels
                .iter()
                .all(|channel| channel.values[row].is_finite())
        })
        .collect();
    // A sample at the beginning of each known stretch, then one a row.
    let mut samples = Vec::new();
    let mut sum_rad = Vector3::zeros();
    for row in 0..table.rows {
        if !known[row] {
            continue;
        }
        if row == 0 || !known[row - 1] {
            sum_rad = Vector3::zeros();
            samples.push(SlowSample {
                time_s: start_s + row as f64 / rate_hz,
                shown: Shown::Sum(sum_rad),
                after_gap: true,
            });
        }
        sum_rad += Vector3::from(channels.map(|channel| channel.values[row]));
        samples.push(SlowSample {
            time_s: start_s + (row + 1) as f64 / rate_hz,
            shown: Shown::Sum(sum_rad),
            after_gap: false,
        });
    }
    Ok(samples)
}
