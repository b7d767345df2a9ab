//! The attitude samples of a recording.
//!
//! Enters: the four `reference_attitude` channels of one table. Leaves: unit quaternions, body to navigation
//! frame, with their time \[s\]; rows without a value are passed over.

use nalgebra::{Quaternion, UnitQuaternion};

use crate::error::InputError;
use crate::recording::{Clock, Quantity, Recording};

/// One attitude.
pub struct AttitudeSample {
    /// When \[s\]: the row's end, or its stamp.
    pub time_s: f64,
    /// Body to navigation frame.
    pub navigation_from_body: UnitQuaternion<f64>,
}

/// A unit quaternion stored in single precision is good to 1e-7; further off than this it is no attitude.
const NOT_A_UNIT: f64 = 1e-3;

/// Whether the recording has attitude samples.
pub fn has_attitude(recording: &Recording) -> bool {
    ["w", "x", "y", "z"].iter().all(|axis| {
        recording
            .channel(&Quantity::ReferenceAttitude, axis)
            .is_some()
    })
}

/// Reads them.
pub fn attitude_samples(recording: &Recording) -> Result<Vec<AttitudeSample>, InputError> {
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
        if !norm.is_finite() {
            continue;
        }
        if (norm - 1.0).abs() > NOT_A_UNIT {
            return Err(InputError::new(
                recording.folder.join(&table.file),
                "is no unit quaternion",
            )
            .channel("reference_attitude")
            .row(row as u64)
            .value(format!("a norm of {norm}"))
            .expected("w, x, y, z with a norm of 1"));
        }
        let time_s = match &table.clock {
            Clock::Uniform { rate_hz, start_s } => start_s + (row + 1) as f64 / rate_hz,
            Clock::Stamped { stamps_s, .. } => stamps_s[row],
        };
        samples.push(AttitudeSample {
            time_s,
            navigation_from_body: UnitQuaternion::from_quaternion(quaternion),
        });
    }
    Ok(samples)
}
