//! Writes a table of results, texts and numbers, as CSV or Parquet.
//!
//! The same table gives the same bytes.

use std::path::Path;
use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use parquet::arrow::ArrowWriter;
use parquet::file::properties::DEFAULT_MAX_ROW_GROUP_ROW_COUNT;

use super::storage::writer_options;
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
        let rows = self.0.first().map_or(0, |(_, column)| column.len());
        // Writing to memory cannot fail, so the results are dropped.
        let _ = writer.write_record(self.0.iter().map(|(name, _)| name));
        for row in 0..rows {
            let _ = writer.write_record(self.0.iter().map(|(_, column)| column.cell(row)));
        }
        writer.into_inner().unwrap_or_default()
    }

    /// Writes the table as Parquet, for the file `path`; an unknown value is null.
    pub fn to_parquet(&self, path: &Path) -> Result<Vec<u8>, InputError> {
        let array = |column: &ResultColumn| match column {
            ResultColumn::Text(values) => Arc::new(StringArray::from(values.clone())) as ArrayRef,
            ResultColumn::Number(values) => Arc::new(Float64Array::from(values.clone())),
        };
        let columns = self.0.iter();
        let columns = columns.map(|(name, column)| (name, array(column), true));
        let fault = |error: &dyn std::fmt::Display| {
            InputError::new(path, format!("cannot be written ({error})"))
        };
        let batch = RecordBatch::try_from_iter_with_nullable(columns).map_err(|e| fault(&e))?;
        let mut bytes = Vec::new();
        let options = writer_options(DEFAULT_MAX_ROW_GROUP_ROW_COUNT);
        let mut writer = ArrowWriter::try_new_with_options(&mut bytes, batch.schema(), options)
            .map_err(|e| fault(&e))?;
        writer.write(&batch).map_err(|e| fault(&e))?;
        writer.close().map_err(|e| fault(&e))?;
        Ok(bytes)
    }
}
