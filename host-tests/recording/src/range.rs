//! Reads a span of a recording longer than memory.
//!
//! The [`Recording`] holds the rows in the span, on the same clock. Parquet row groups outside are not decoded. CSV and
//! stamped tables are read whole and then cut. The unit of a channel is not checked, since a span may be too quiet for
//! that.

use std::ops::Range;
use std::path::Path;

use super::folder::read_table;
use super::manifest::{ClockEntry, MANIFEST, TableEntry};
use super::sampling::on_one_footing;
use super::{Clock, Quantity, Recording, Segment, Table, parquet_table};
use crate::error::InputError;

/// Rows kept on either side of a slower table's stretch, for linear interpolation beyond its ends.
const MARGIN_ROWS: usize = 3;

/// Extent of a recording, from its manifest without its rows.
#[derive(Debug, Clone)]
pub struct Extent {
    /// The recording's name.
    pub name: String,
    /// Named time intervals.
    pub segments: Vec<Segment>,
    /// Row rate of the gyros \[Hz\].
    pub rate_hz: f64,
    /// Start of the gyros' first row \[s\].
    pub start_s: f64,
    /// Number of the gyros' rows.
    pub rows: usize,
}

impl Recording {
    /// Returns the extent of the gyros' table; `None` if it is stamped or not Parquet, and must be read to be known, or
    /// if a reference has different rows.
    pub fn extent(folder: impl AsRef<Path>) -> Result<Option<Extent>, InputError> {
        let folder = folder.as_ref();
        let manifest = Self::manifest_of(folder)?;
        let table_of = |quantities: &[Quantity]| {
            let of = |table: &&TableEntry| {
                let mut channels = table.channels.iter();
                channels.any(|channel| quantities.contains(&channel.quantity()))
            };
            manifest.tables.iter().find(of)
        };
        let gyro = table_of(&Quantity::GYROS);
        let (Some(table), Some(reference)) = (gyro, table_of(&[Quantity::ReferenceIncrement]))
        else {
            return Ok(None);
        };
        let ClockEntry::Uniform { rate_hz, start_s } = table.clock() else {
            return Ok(None);
        };
        let same_rows = matches!(
            reference.clock(),
            ClockEntry::Uniform { rate_hz: own_hz, start_s: own_s }
                if (own_hz, own_s) == (rate_hz, start_s)
        );
        if !is_parquet(&table.file) || !same_rows {
            return Ok(None);
        }
        Ok(Some(Extent {
            name: Self::name_of(folder, &manifest),
            segments: manifest.segments(),
            rate_hz,
            start_s,
            rows: parquet_table::rows(&folder.join(&table.file))?,
        }))
    }

    /// Reads the rows that start in `from_s..to_s` \[s\], each table on its own clock.
    pub fn read_between(
        folder: impl AsRef<Path>,
        from_s: f64,
        to_s: f64,
    ) -> Result<Self, InputError> {
        let folder = folder.as_ref();
        let manifest = Self::manifest_of(folder)?;
        let fastest_hz = manifest
            .tables
            .iter()
            .filter_map(|table| match table.clock() {
                ClockEntry::Uniform { rate_hz, .. } => Some(rate_hz),
                ClockEntry::Stamped { .. } => None,
            })
            .fold(0.0, f64::max);
        let mut tables = Vec::with_capacity(manifest.tables.len());
        for entry in &manifest.tables {
            let ClockEntry::Uniform { rate_hz, start_s } = entry.clock() else {
                tables.push(read_table(folder, entry, None)?);
                continue;
            };
            let margin = if rate_hz < fastest_hz { MARGIN_ROWS } else { 0 };
            let row = |time_s: f64| ((time_s - start_s) * rate_hz).round().max(0.0) as usize;
            let wanted = row(from_s).saturating_sub(margin)..row(to_s) + margin;
            let table = if is_parquet(&entry.file) {
                read_table(folder, entry, Some(wanted.clone()))?
            } else {
                cut(read_table(folder, entry, None)?, &wanted)
            };
            tables.push(Table {
                clock: Clock::Uniform {
                    rate_hz,
                    start_s: start_s + wanted.start as f64 / rate_hz,
                },
                ..table
            });
        }
        on_one_footing(&folder.join(MANIFEST), &manifest.tables, &mut tables)?;
        Ok(Self {
            name: Self::name_of(folder, &manifest),
            folder: folder.to_path_buf(),
            site: manifest.site(),
            tables,
            segments: manifest.segments(),
        })
    }
}

fn is_parquet(file: &str) -> bool {
    file.to_ascii_lowercase().ends_with(".parquet")
}

fn cut(mut table: Table, wanted: &Range<usize>) -> Table {
    table.keep(wanted.clone());
    table
}
