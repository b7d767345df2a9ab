//! Writes a table of f64 columns row by row, in bounded memory.
//!
//! Rows are as stored (before scale and offset), NaN for unmeasured values, and go to one Parquet file of the output
//! folder. The same rows give the same bytes.
//!
//! Unlike `streamed.rs` it needs no description of the recording beforehand: rate and site of a foreign file are known
//! only during reading. Out of scope: integer columns; zstd makes whole numbers in f64 small.

use std::fs::File;
use std::path::PathBuf;

use parquet::basic::Type as Physical;
use parquet::file::properties::DEFAULT_MAX_ROW_GROUP_ROW_COUNT;

use super::parquet_writer::ParquetWriter;
use crate::error::InputError;
use crate::output::OutputFolder;

/// Rows per batch in memory: half a megabyte a column, and few enough writes to have negligible cost.
const BATCH_ROWS: usize = 65_536;

/// Table written row by row.
pub struct TableStream {
    path: PathBuf,
    writer: ParquetWriter<File>,
    columns: Vec<Vec<f64>>,
    rows: usize,
}

impl TableStream {
    /// Opens the table `file` of the folder `out` with these columns.
    pub fn create(
        out: &mut OutputFolder,
        file: &str,
        columns: &[&str],
    ) -> Result<Self, InputError> {
        let path = out.target().join(file);
        let fields = columns.iter().map(|name| (*name, Physical::DOUBLE));
        let writer =
            ParquetWriter::create(out.file(file)?, fields, DEFAULT_MAX_ROW_GROUP_ROW_COUNT)
                .map_err(|error| fault(&path, &error))?;
        Ok(Self {
            path,
            writer,
            columns: vec![Vec::with_capacity(BATCH_ROWS); columns.len()],
            rows: 0,
        })
    }

    /// Adds one row, one value per column.
    pub fn push(&mut self, row: &[f64]) -> Result<(), InputError> {
        for (column, value) in self.columns.iter_mut().zip(row) {
            column.push(*value);
        }
        self.rows += 1;
        if self
            .columns
            .first()
            .is_some_and(|column| column.len() >= BATCH_ROWS)
        {
            self.flush()?;
        }
        Ok(())
    }

    /// Completes the file and returns its number of rows.
    pub fn finish(mut self) -> Result<usize, InputError> {
        self.flush()?;
        self.writer
            .close()
            .map_err(|error| fault(&self.path, &error))?;
        Ok(self.rows)
    }

    fn flush(&mut self) -> Result<(), InputError> {
        let rows = self.columns.first().map_or(0, Vec::len);
        let columns = &self.columns;
        self.writer
            .write(rows, |column, place, rows| {
                column.measured(&columns[place][rows])
            })
            .map_err(|error| fault(&self.path, &error))?;
        self.columns.iter_mut().for_each(Vec::clear);
        Ok(())
    }
}

fn fault(path: &std::path::Path, error: &dyn std::fmt::Display) -> InputError {
    InputError::new(path, format!("cannot be written ({error})"))
}
