//! Reads the circumstances of a recording: instrument, date, temperature.
//!
//! `instrument = "SN 17"` and `start = 2026-03-01T12:00:00Z` are optional keys of `recording.toml`; the temperature is
//! that of its temperature channels. No diagnosis uses them: they serve the comparison of many recordings.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::folder::read_table;
use super::manifest::MANIFEST;
use super::{Quantity, Recording};
use crate::error::InputError;
use crate::toml_file;

/// Circumstances of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// Name of the recording.
    pub recording: String,
    /// Name of the instrument.
    pub instrument: Option<String>,
    /// Date and time of the recording's time 0, by RFC 3339.
    pub start: Option<String>,
    /// The same as the time since 1970, UTC \[s\].
    pub start_s: Option<f64>,
    /// Mean temperature \[K\].
    pub temperature_k: Option<f64>,
}

/// Head of a written `recording.toml`, in addition to the description of the rows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Head {
    /// Lines starting with `#`.
    pub comment: String,
    /// Name of the instrument.
    pub instrument: Option<String>,
    /// Date and time of the recording's time 0 with its zone, by RFC 3339.
    pub start: Option<String>,
    /// Quantities sampled at the row's end instead of averaged over the row.
    pub instants: Vec<Quantity>,
}

impl Head {
    /// Formats the text, without keys that have no value.
    pub(super) fn to_toml(&self) -> String {
        let mut text = self.comment.clone();
        if let Some(instrument) = &self.instrument {
            text.push_str(&format!("instrument = {}\n", toml_file::string(instrument)));
        }
        if let Some(start) = &self.start {
            text.push_str(&format!("start = {start}\n"));
        }
        text
    }
}

impl About {
    /// Reads name, instrument and start from the manifest alone, as far as it states them: for a recording whose tables
    /// cannot be read.
    pub fn of_manifest(folder: impl AsRef<Path>) -> Result<Self, InputError> {
        let folder = folder.as_ref();
        let manifest = Recording::manifest_of(folder)?;
        let start = manifest.start.map(|start| start.to_string());
        let parsed = start.as_deref().map(chrono::DateTime::parse_from_rfc3339);
        Ok(Self {
            recording: Recording::name_of(folder, &manifest),
            instrument: manifest.instrument,
            start_s: parsed.and_then(Result::ok).map(seconds_since_1970),
            start,
            temperature_k: None,
        })
    }

    /// Reads the manifest in `folder`, and its tables with temperatures.
    pub fn read(folder: impl AsRef<Path>) -> Result<Self, InputError> {
        let folder = folder.as_ref();
        let mut manifest = Recording::manifest_of(folder)?;
        let start = manifest.start.map(|start| start.to_string());
        let parsed = start.as_deref().map(chrono::DateTime::parse_from_rfc3339);
        let parsed = parsed.transpose().map_err(|_| {
            InputError::new(folder.join(MANIFEST), "has no date and time")
                .channel("start")
                .value(start.as_deref().unwrap_or_default())
                .expected("one with its zone, such as 2026-03-01T12:00:00Z")
        })?;
        let (mut sum, mut count) = (0.0, 0_usize);
        for table in &mut manifest.tables {
            table
                .channels
                .retain(|channel| channel.quantity() == Quantity::Temperature);
            if table.channels.is_empty() {
                continue;
            }
            for channel in read_table(folder, table, None)?.channels {
                let measured = channel.values.iter().filter(|value| value.is_finite());
                count += measured.clone().count();
                sum += measured.sum::<f64>();
            }
        }
        Ok(Self {
            recording: Recording::name_of(folder, &manifest),
            instrument: manifest.instrument,
            start,
            start_s: parsed.map(seconds_since_1970),
            temperature_k: (count > 0).then(|| sum / count as f64),
        })
    }
}

/// Time of a date since 1970, UTC \[s\]; its microseconds fit f64.
fn seconds_since_1970(date: chrono::DateTime<chrono::FixedOffset>) -> f64 {
    date.timestamp_micros() as f64 * 1e-6
}
