//! Limits of a turntable: the file of `rlg calibrate --propose`.
//!
//! TOML in SI units gives checked [`Limits`]. An unknown key is an error, because an ignored limit may break a table.

use std::path::Path;

use serde::Deserialize;

use rlg_recording::error::InputError;
use rlg_recording::toml_file::{self, within};

/// Limits of a turntable.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Format number of the file.
    #[serde(rename = "format")]
    _format: i64,
    /// Largest rate about any body axis \[rad/s\].
    pub greatest_rate_rad_s: f64,
    /// Largest angular acceleration about any body axis \[rad/s²\].
    pub greatest_acceleration_rad_s2: f64,
    /// Largest angle of an oscillation or cone \[rad\].
    #[serde(default = "half_a_radian")]
    pub greatest_angle_rad: f64,
    /// Largest frequency of an oscillation or cone \[Hz\].
    #[serde(default = "ten_hertz")]
    pub greatest_frequency_hz: f64,
    /// Time for the whole programme, rest and ramps included \[s\].
    pub table_time_s: f64,
    /// Rows per second of the recording \[Hz\].
    #[serde(default = "four_kilohertz")]
    pub rate_hz: f64,
}

/// Approximate reach of cones and oscillations of gimbals.
fn half_a_radian() -> f64 {
    0.5
}

/// Approximate bandwidth of rate tables for a sine.
fn ten_hertz() -> f64 {
    10.0
}

fn four_kilohertz() -> f64 {
    4000.0
}

impl Limits {
    /// Reads and checks `path`.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let (_, limits): (_, Self) = toml_file::read(path)?;
        let positive = |key: &str, value: f64, most: f64, unit: &str| {
            within(path, key, value, [f64::MIN_POSITIVE, most], unit)
        };
        // Ten turns a second and 1e5 rad/s² exceed any table; a week exceeds any test.
        positive(
            "greatest_rate_rad_s",
            limits.greatest_rate_rad_s,
            62.8,
            "rad/s",
        )?;
        positive(
            "greatest_acceleration_rad_s2",
            limits.greatest_acceleration_rad_s2,
            1e5,
            "rad/s^2",
        )?;
        positive("greatest_angle_rad", limits.greatest_angle_rad, 1.5, "rad")?;
        positive("table_time_s", limits.table_time_s, 604_800.0, "s")?;
        within(path, "rate_hz", limits.rate_hz, [100.0, 1e5], "Hz")?;
        // The column of flexure is at twice the frequency of a cone, which must be well inside the band.
        positive(
            "greatest_frequency_hz",
            limits.greatest_frequency_hz,
            limits.rate_hz / 10.0,
            "Hz",
        )?;
        Ok(limits)
    }
}
