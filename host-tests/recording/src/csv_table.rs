//! CSV tables with a header row: columns of numbers as f64; an empty cell, `nan` or `null` as NaN.
//!
//! Comma-separated UTF-8. Every row must have as many cells as the header; blank lines are allowed at the end only.
//! Values are returned as stored, before scale and offset.

use std::fs;
use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};

use super::parquet_table::locate;
use crate::error::InputError;

/// Reads the columns `wanted` of `path`, in that order, equally long.
pub(super) fn read(path: &Path, wanted: &[&str]) -> Result<Vec<Vec<f64>>, InputError> {
    let bytes = fs::read(path).map_err(|error| InputError::unreadable(path, &error))?;
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(InputError::new(path, "is empty").expected("a header row and rows of numbers"));
    }
    // Spreadsheets put a byte-order mark before the first column's name.
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes);
    let mut reader = ReaderBuilder::new().trim(Trim::All).from_reader(bytes);
    let header = reader.headers().map_err(|error| unreadable(path, &error))?;
    let names: Vec<String> = header.iter().map(str::to_owned).collect();
    let positions = locate(path, &names, wanted)?;

    let mut columns = vec![Vec::new(); wanted.len()];
    let mut record = StringRecord::new();
    let mut row = 0;
    let mut end = reader.position().byte() as usize;
    while reader
        .read_record(&mut record)
        .map_err(|error| unreadable(path, &error))?
    {
        // The library drops blank lines, which would shift every later row in time.
        if begins_with_a_blank_line(bytes, end) {
            return Err(InputError::new(path, "has a blank line between its rows")
                .row(row)
                .expected("a row of cells, nan or empty ones where nothing was measured"));
        }
        end = reader.position().byte() as usize;
        for ((column, &position), name) in columns.iter_mut().zip(&positions).zip(wanted) {
            column.push(number(path, name, row, &record[position])?);
        }
        row += 1;
    }
    Ok(columns)
}

/// True if an empty line follows the record that ends before byte `end`.
fn begins_with_a_blank_line(bytes: &[u8], end: usize) -> bool {
    let (before, rest) = bytes.split_at(end.min(bytes.len()));
    // The library ends a record at the first character of CR LF.
    let rest = match rest.strip_prefix(b"\n") {
        Some(stripped) if before.ends_with(b"\r") => stripped,
        _ => rest,
    };
    matches!(rest.first(), Some(b'\n' | b'\r'))
}

fn number(path: &Path, name: &str, row: u64, cell: &str) -> Result<f64, InputError> {
    if cell.is_empty() || cell.eq_ignore_ascii_case("nan") || cell.eq_ignore_ascii_case("null") {
        return Ok(f64::NAN);
    }
    cell.parse().map_err(|_| {
        InputError::new(path, "is text, not a number")
            .channel(name)
            .row(row)
            .value(format!("{cell:?}"))
            .expected("a number, or an empty cell where nothing was measured")
    })
}

fn unreadable(path: &Path, error: &csv::Error) -> InputError {
    // The header is record 0, so the first row of data is record 1.
    let row =
        |position: &Option<csv::Position>| position.as_ref().map(|p| p.record().saturating_sub(1));
    match error.kind() {
        csv::ErrorKind::UnequalLengths {
            pos,
            expected_len,
            len,
        } => {
            let error = InputError::new(path, "has a row of another length than the header")
                .value(format!("{len} cells"))
                .expected(format!("{expected_len} cells in every row"));
            match row(pos) {
                Some(row) => error.row(row),
                None => error,
            }
        }
        csv::ErrorKind::Utf8 { pos, .. } => {
            let error = InputError::new(path, "is not UTF-8 text").expected("a CSV file");
            match row(pos) {
                Some(row) => error.row(row),
                None => error,
            }
        }
        _ => InputError::new(path, format!("cannot be read ({error})")).expected("a CSV file"),
    }
}
