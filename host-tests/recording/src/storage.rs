//! Writes a recording: the folder of the contract with Parquet or CSV tables.
//!
//! The folder is written whole or not at all; the same recording gives the same bytes. A channel whose every value is
//! scale · integer + offset is stored as those integers, any other as f64 with scale 1, so that in both cases the
//! values are exact to the bit on reading.

use std::ops::Range;
use std::path::Path;

use parquet::basic::Type as Physical;
use parquet::errors::ParquetError;
use parquet::file::properties::DEFAULT_MAX_ROW_GROUP_ROW_COUNT;

use super::manifest::{MANIFEST, Manifest};
use super::manifest_text::manifest_text;
use super::parquet_writer::{Column, ParquetWriter};
use super::{Channel, Clock, Head, Recording, Table};
use crate::error::InputError;
use crate::output::OutputFolder;

/// Largest integer: beyond 2⁵³ integers are not exact in f64.
const LARGEST_INTEGER: f64 = 9_007_199_254_740_992.0;

/// Storage of a column.
enum Stored {
    /// Integers, `None` = not measured; with the channel's own scale and offset.
    Integers(Vec<Option<i64>>),
    /// Values as they are, NaN = not measured; scale 1, offset 0.
    Floats,
}

impl Recording {
    /// Writes the recording to its own folder; see [`Recording::write_to`].
    pub fn write(&self) -> Result<(), InputError> {
        self.write_to(&self.folder)
    }

    /// Writes the recording to `folder`, which must be new, empty, or a recording; tables of the same name and
    /// `recording.toml` are replaced.
    pub fn write_to(&self, folder: impl AsRef<Path>) -> Result<(), InputError> {
        let mut out = Self::create_folder(folder)?;
        self.write_into(&mut out)?;
        out.commit()
    }

    /// Prepares `folder` for a recording: rejects a folder with other content. For commands that check this before long
    /// work, or write more files with the recording.
    pub fn create_folder(folder: impl AsRef<Path>) -> Result<OutputFolder, InputError> {
        let folder = folder.as_ref();
        let filled = folder
            .read_dir()
            .is_ok_and(|mut entries| entries.next().is_some());
        if filled && !folder.join(MANIFEST).is_file() {
            return Err(
                InputError::new(folder, "holds something other than a recording")
                    .expected("a new or empty folder, or a recording to replace"),
            );
        }
        OutputFolder::create(folder)
    }

    /// Adds `recording.toml` alone, for tables already written row by row with their channels' scales.
    pub fn write_manifest_into(&self, out: &mut OutputFolder) -> Result<(), InputError> {
        let text = manifest_text(
            self,
            |table, channel| {
                let channel = &self.tables[table].channels[channel];
                (channel.scale, channel.offset)
            },
            &[],
        );
        Manifest::from_text(&out.target().join(MANIFEST), &text)?;
        out.write(MANIFEST, text.as_bytes())
    }

    /// Adds the recording's files to `out`, `recording.toml` last.
    pub fn write_into(&self, out: &mut OutputFolder) -> Result<(), InputError> {
        self.write_headed_into(out, &Head::default())
    }

    /// Adds the recording's files to `out` as [`Recording::write_into`] does, with `head` at the top of
    /// `recording.toml`.
    pub fn write_headed_into(&self, out: &mut OutputFolder, head: &Head) -> Result<(), InputError> {
        let mut stored = Vec::with_capacity(self.tables.len());
        for table in &self.tables {
            let fault = |problem: &str| InputError::new(out.target().join(&table.file), problem);
            if let Some(channel) = table.channels.iter().find(|c| c.values.len() != table.rows) {
                return Err(fault("has a channel of another length")
                    .channel(&channel.column)
                    .value(format!("{} values", channel.values.len()))
                    .expected(format!("{} rows", table.rows)));
            }
            if let Clock::Stamped { column, stamps_s } = &table.clock
                && stamps_s.len() != table.rows
            {
                return Err(fault("has stamps for another number of rows").channel(column));
            }
            stored.push(table.channels.iter().map(unscale).collect::<Vec<_>>());
        }
        let text = manifest_text(
            self,
            |table, channel| match stored[table][channel] {
                Stored::Integers(_) => {
                    let channel = &self.tables[table].channels[channel];
                    (channel.scale, channel.offset)
                }
                Stored::Floats => (1.0, 0.0),
            },
            &head.instants,
        );
        let text = format!("{}{text}", head.to_toml());
        Manifest::from_text(&out.target().join(MANIFEST), &text)?;
        for (table, stored) in self.tables.iter().zip(&stored) {
            let lower = table.file.to_ascii_lowercase();
            if lower.ends_with(".csv") {
                let bytes = csv_bytes(table, stored);
                out.write(&table.file, &bytes)?;
            } else if lower.ends_with(".parquet") {
                write_parquet(out, table, stored)?;
            } else {
                return Err(InputError::new(
                    out.target().join(&table.file),
                    "is a table of an unknown kind",
                )
                .expected("a name that ends in .parquet or .csv"));
            }
        }
        out.write(MANIFEST, text.as_bytes())
    }
}

fn unscale(channel: &Channel) -> Stored {
    let integer = |&value: &f64| {
        if value.is_nan() {
            return Some(None);
        }
        let stored = ((value - channel.offset) / channel.scale).round();
        // Bit for bit, so that −0.0 is preserved.
        let same = (stored * channel.scale + channel.offset).to_bits() == value.to_bits();
        (same && stored.abs() < LARGEST_INTEGER).then_some(Some(stored as i64))
    };
    let integers: Option<Vec<_>> = channel.values.iter().map(integer).collect();
    integers.map_or(Stored::Floats, Stored::Integers)
}

/// Columns in the order of the file; a column shared by two channels is written once.
fn columns<'a>(
    table: &'a Table,
    stored: &'a [Stored],
) -> Vec<(&'a str, &'a [f64], Option<&'a Stored>)> {
    let mut columns: Vec<(&str, &[f64], Option<&Stored>)> = Vec::new();
    if let Clock::Stamped { column, stamps_s } = &table.clock {
        columns.push((column, stamps_s, None));
    }
    for (channel, stored) in table.channels.iter().zip(stored) {
        if columns.iter().all(|(name, ..)| *name != channel.column) {
            columns.push((&channel.column, &channel.values, Some(stored)));
        }
    }
    columns
}

fn write_parquet(
    out: &mut OutputFolder,
    table: &Table,
    stored: &[Stored],
) -> Result<(), InputError> {
    let path = out.target().join(&table.file);
    let columns = columns(table, stored);
    let fields = columns.iter().map(|(name, _, stored)| {
        let physical = match stored {
            Some(Stored::Integers(integers)) => {
                let mut measured = integers.iter().flatten();
                match measured.all(|&value| i32::try_from(value).is_ok()) {
                    true => Physical::INT32,
                    false => Physical::INT64,
                }
            }
            Some(Stored::Floats) | None => Physical::DOUBLE,
        };
        (*name, physical)
    });
    let fault =
        |error: ParquetError| InputError::new(&path, format!("cannot be written ({error})"));
    let file = out.file(&table.file)?;
    let mut writer =
        ParquetWriter::create(file, fields, DEFAULT_MAX_ROW_GROUP_ROW_COUNT).map_err(fault)?;
    let encode = |column: &mut Column, place: usize, rows: Range<usize>| match columns[place] {
        (_, _, Some(Stored::Integers(integers))) => column.integers(integers[rows].iter().copied()),
        (_, values, _) => column.measured(&values[rows]),
    };
    writer.write(table.rows, encode).map_err(fault)?;
    writer.close().map_err(fault)
}

fn csv_bytes(table: &Table, stored: &[Stored]) -> Vec<u8> {
    let columns = columns(table, stored);
    let mut writer = csv::Writer::from_writer(Vec::new());
    // Writing to memory cannot fail, so the results are dropped.
    let _ = writer.write_record(columns.iter().map(|(name, ..)| name));
    for row in 0..table.rows {
        let cell = |(_, values, stored): &(&str, &[f64], Option<&Stored>)| match stored {
            Some(Stored::Integers(integers)) => {
                integers[row].map_or("nan".to_owned(), |v| v.to_string())
            }
            _ if values[row].is_nan() => "nan".to_owned(),
            _ => format!("{:?}", values[row]),
        };
        let _ = writer.write_record(columns.iter().map(cell));
    }
    writer.into_inner().unwrap_or_default()
}
