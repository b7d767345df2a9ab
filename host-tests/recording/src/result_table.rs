//! Writes a table of results, texts and numbers, as CSV or Parquet.
//!
//! The same table gives the same bytes.

use std::path::Path;

use parquet::basic::Type as Physical;
use parquet::errors::Result as ParquetResult;
use parquet::file::properties::DEFAULT_MAX_ROW_GROUP_ROW_COUNT;

use super::parquet_writer::ParquetWriter;
use crate::error::InputError;

/// One column.
#[derive(Debug, Clone, PartialEq)]
pub enum ResultColumn {
    /// Texts; `None` for an empty cell.
    Text(Vec<Option<String>>),
    /// Numbers; `None` for an unknown value.
    Number(Vec<Option<f64>>),
}

/// Columns of equal length with their names.
#[derive(Debug, Clone, PartialEq)]
pub struct ResultTable(pub Vec<(String, ResultColumn)>);

impl ResultColumn {
    fn len(&self) -> usize {
        match self {
            Self::Text(values) => values.len(),
            Self::Number(values) => values.len(),
        }
    }

    /// Formats a cell as text; numbers with the digits that give the same f64 on reading.
    fn cell(&self, row: usize) -> String {
        match self {
            Self::Text(values) => values[row].clone().unwrap_or_default(),
            Self::Number(values) => {
                values[row].map_or_else(String::new, |value| format!("{value:?}"))
            }
        }
    }
}

impl ResultTable {
    /// Writes the table as CSV with a header; an unknown value is an empty cell.
    pub fn to_csv(&self) -> Vec<u8> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        // Writing to memory cannot fail, so the results are dropped.
        let _ = writer.write_record(self.0.iter().map(|(name, _)| name));
        for row in 0..self.rows() {
            let _ = writer.write_record(self.0.iter().map(|(_, column)| column.cell(row)));
        }
        writer.into_inner().unwrap_or_default()
    }

    /// Writes the table as Parquet, for the file `path`; an unknown value is null.
    pub fn to_parquet(&self, path: &Path) -> Result<Vec<u8>, InputError> {
        self.parquet()
            .map_err(|error| InputError::new(path, format!("cannot be written ({error})")))
    }

    fn parquet(&self) -> ParquetResult<Vec<u8>> {
        let fields = self.0.iter().map(|(name, column)| {
            let physical = match column {
                ResultColumn::Text(_) => Physical::BYTE_ARRAY,
                ResultColumn::Number(_) => Physical::DOUBLE,
            };
            (name.as_str(), physical)
        });
        let mut bytes = Vec::new();
        let mut writer =
            ParquetWriter::create(&mut bytes, fields, DEFAULT_MAX_ROW_GROUP_ROW_COUNT)?;
        writer.write(self.rows(), |column, place, rows| match &self.0[place].1 {
            ResultColumn::Text(values) => column.texts(&values[rows]),
            ResultColumn::Number(values) => column.numbers(values[rows].iter().copied()),
        })?;
        writer.close()?;
        Ok(bytes)
    }

    fn rows(&self) -> usize {
        self.0.first().map_or(0, |(_, column)| column.len())
    }
}
