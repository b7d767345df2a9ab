//! Writes a recording longer than memory, in blocks of rows.
//!
//! The recording is given first without its values, then in blocks of columns. The folder is the same as that of
//! [`Recording::write_into`], in Parquet only. The storage of a channel is selected before its values are known: whole
//! multiples of its scale as 64-bit integers, anything else as f64.

use std::fs::File;
use std::path::PathBuf;
use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, Int64Array, RecordBatch};
use arrow_schema::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;

use super::Recording;
use super::manifest::{MANIFEST, Manifest};
use super::manifest_text::manifest_text;
use super::storage::writer_options;
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
    schema: Arc<Schema>,
    /// Scale of each column stored as integers.
    scales: Vec<Option<f64>>,
    writer: ArrowWriter<File>,
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
            let mut fields = Vec::new();
            let mut scales = Vec::new();
            for (place, channel) in table.channels.iter().enumerate() {
                let whole = is_whole(index, place);
                let data_type = if whole {
                    DataType::Int64
                } else {
                    DataType::Float64
                };
                fields.push(Field::new(&channel.column, data_type, true));
                scales.push(whole.then_some(channel.scale));
            }
            let schema = Arc::new(Schema::new(fields));
            let options = writer_options(ROWS_PER_GROUP);
            let file = out.file(&table.file)?;
            let writer = ArrowWriter::try_new_with_options(file, Arc::clone(&schema), options)
                .map_err(|error| unwritten(&path, &error))?;
            tables.push(TableStream {
                path,
                schema,
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
        let arrays = columns.iter().zip(&self.scales).map(|(column, scale)| {
            let measured = column
                .iter()
                .map(|value| (!value.is_nan()).then_some(*value));
            let array: ArrayRef = match scale {
                None => Arc::new(measured.collect::<Float64Array>()),
                Some(scale) => Arc::new(
                    measured
                        .map(|value| value.map(|value| (value / scale).round() as i64))
                        .collect::<Int64Array>(),
                ),
            };
            array
        });
        let batch = RecordBatch::try_new(Arc::clone(&self.schema), arrays.collect())
            .map_err(|error| unwritten(&self.path, &error))?;
        self.writer
            .write(&batch)
            .map_err(|error| unwritten(&self.path, &error))
    }
}

fn unwritten(path: &std::path::Path, error: &dyn std::fmt::Display) -> InputError {
    InputError::new(path, format!("cannot be written ({error})"))
}
