//! Writes a recording longer than memory, in blocks of rows.
//!
//! The recording is given first without its values, then in blocks of columns. The folder is the same as that of
//! [`Recording::write_into`], in Parquet only. The storage of a channel is selected before its values are known: whole
//! multiples of its scale as 64-bit integers, anything else as f64.

use std::fs::File;
use std::path::PathBuf;

use parquet::basic::Type as Physical;

use super::Recording;
use super::manifest::{MANIFEST, Manifest};
use super::manifest_text::manifest_text;
use super::parquet_writer::ParquetWriter;
use crate::error::InputError;
use crate::output::OutputFolder;

/// Rows of a Parquet row group, held in memory by the writer: a minute at 4 kHz, some ten megabytes.
const ROWS_PER_GROUP: usize = 1 << 18;

/// Recording in the course of being written to disk.
pub struct RecordingStream {
    tables: Vec<TableStream>,
    manifest: String,
}

struct TableStream {
    path: PathBuf,
    /// Scale of each column stored as integers.
    scales: Vec<Option<f64>>,
    writer: ParquetWriter<File>,
}

impl RecordingStream {
    /// Opens the tables. `is_whole`: true for a table's channel whose values are multiples of its scale.
    pub fn create(
        recording: &Recording,
        out: &mut OutputFolder,
        is_whole: impl Fn(usize, usize) -> bool,
    ) -> Result<Self, InputError> {
        let manifest = manifest_text(
            recording,
            |table, channel| {
                if is_whole(table, channel) {
                    let channel = &recording.tables[table].channels[channel];
                    (channel.scale, channel.offset)
                } else {
                    (1.0, 0.0)
                }
            },
            &[],
        );
        Manifest::from_text(&out.target().join(MANIFEST), &manifest)?;
        let mut tables = Vec::with_capacity(recording.tables.len());
        for (index, table) in recording.tables.iter().enumerate() {
            let path = out.target().join(&table.file);
            let channels = table.channels.iter().enumerate();
            let scales: Vec<Option<f64>> = channels
                .map(|(place, channel)| is_whole(index, place).then_some(channel.scale))
                .collect();
            let fields = table.channels.iter().zip(&scales).map(|(channel, scale)| {
                let physical = match scale {
                    Some(_) => Physical::INT64,
                    None => Physical::DOUBLE,
                };
                (channel.column.as_str(), physical)
            });
            let file = out.file(&table.file)?;
            let writer = ParquetWriter::create(file, fields, ROWS_PER_GROUP)
                .map_err(|error| unwritten(&path, &error))?;
            tables.push(TableStream {
                path,
                scales,
                writer,
            });
        }
        Ok(Self { tables, manifest })
    }

    /// Adds rows, \[table\]\[column\]\[row\]; NaN = not measured.
    pub fn write(&mut self, tables: &[Vec<Vec<f64>>]) -> Result<(), InputError> {
        for (table, columns) in self.tables.iter_mut().zip(tables) {
            table.write(columns)?;
        }
        Ok(())
    }

    /// Completes the tables and adds `recording.toml`.
    pub fn finish(self, out: &mut OutputFolder) -> Result<(), InputError> {
        for table in self.tables {
            table
                .writer
                .close()
                .map_err(|error| unwritten(&table.path, &error))?;
        }
        out.write(MANIFEST, self.manifest.as_bytes())
    }
}

impl TableStream {
    fn write(&mut self, columns: &[Vec<f64>]) -> Result<(), InputError> {
        let rows = columns.first().map_or(0, Vec::len);
        self.writer
            .write(rows, |column, place, rows| {
                let values = &columns[place][rows];
                match self.scales[place] {
                    None => column.measured(values),
                    Some(scale) => {
                        column.integers(values.iter().map(|&value| {
                            (!value.is_nan()).then(|| (value / scale).round() as i64)
                        }))
                    }
                }
            })
            .map_err(|error| unwritten(&self.path, &error))
    }
}

fn unwritten(path: &std::path::Path, error: &dyn std::fmt::Display) -> InputError {
    InputError::new(path, format!("cannot be written ({error})"))
}
