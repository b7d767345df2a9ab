//! Columns of numbers as stored in a foreign file: before any unit, quantity or clock.

use std::path::{Path, PathBuf};

use crate::error::InputError;

/// One column of a foreign file.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name in the file; of a matrix variable `name[0]`, `name[1]` and so on.
    pub name: String,
    /// Unit stated in a line of units beneath the header.
    pub unit: Option<String>,
    /// Values as stored; NaN for missing ones; for date-times the seconds since their origin.
    pub values: Vec<f64>,
    /// Origin, if they are date-times or times of day.
    pub dates: Option<Dates>,
    /// Row and text of the first cell that is no number. An error only if the column is used.
    pub bad_cell: Option<(u64, String)>,
}

/// Origin of a column of date-times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dates {
    /// Whole second since 1970, UTC, or since midnight \[s\].
    pub origin_s: i64,
    /// True if they state their zone; else they are read as UTC.
    pub has_zone: bool,
    /// True if they state their day.
    pub has_day: bool,
}

/// Columns of equal length from one file.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// The file.
    pub file: PathBuf,
    /// Rows of every column.
    pub rows: usize,
    /// The columns in the order of the file.
    pub columns: Vec<Column>,
    /// Rows a second \[Hz\], if stated by the file.
    pub rate_hz: Option<f64>,
    /// Notes on the reading, as clauses.
    pub notes: Vec<String>,
}

impl Column {
    /// Creates a column without a unit of its own and without a bad cell.
    pub fn new(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            unit: None,
            values,
            dates: None,
            bad_cell: None,
        }
    }

    /// Refuses a column with a cell that is no number, if the column is used.
    pub fn check(&self, file: &Path) -> Result<(), InputError> {
        if let Some((row, text)) = &self.bad_cell {
            return Err(InputError::new(file, "is text, not a number")
                .channel(&self.name)
                .row(*row)
                .value(format!("{text:?}"))
                .expected("a number, or an empty cell where nothing was measured"));
        }
        let infinite = self.values.iter().position(|value| value.is_infinite());
        match infinite {
            Some(row) => Err(InputError::new(file, "is infinite")
                .channel(&self.name)
                .row(row as u64)
                .value(self.values[row])
                .expected("a finite number, or an empty cell where nothing was measured")),
            None => Ok(()),
        }
    }
}

/// Sorts columns of any length into blocks of equal length, in the order in which the lengths appear.
pub fn blocks(file: &Path, columns: Vec<Column>, rate_hz: Option<f64>) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    for column in columns {
        let rows = column.values.len();
        match found.iter_mut().find(|block| block.rows == rows) {
            Some(block) => block.columns.push(column),
            None => found.push(Block {
                file: file.to_path_buf(),
                rows,
                columns: vec![column],
                rate_hz,
                notes: Vec::new(),
            }),
        }
    }
    found
}
