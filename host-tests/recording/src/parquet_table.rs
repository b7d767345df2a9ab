//! Parquet tables: columns of numbers as f64, null as NaN.
//!
//! Any integer or floating type, any codec and encoding of the library, any number of row groups. Only the wanted
//! columns are decoded. Values are returned as stored, before scale and offset.

use std::fs::File;
use std::ops::Range;
use std::path::Path;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type,
    TimestampMicrosecondType, TimestampMillisecondType, TimestampNanosecondType,
    TimestampSecondType, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef};
use arrow_schema::{DataType, TimeUnit};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ArrowReaderOptions, ParquetRecordBatchReaderBuilder};
use parquet::file::metadata::RowGroupMetaData;

use crate::error::InputError;

/// Rows decoded at a time: 64 Ki rows of twelve channels stay within a few MB.
const BATCH_ROWS: usize = 65_536;

/// Number of rows in the file's metadata.
pub(super) fn rows(path: &Path) -> Result<usize, InputError> {
    let rows = open(path)?.metadata().file_metadata().num_rows();
    Ok(usize::try_from(rows).unwrap_or(0))
}

/// Column of a file without a `recording.toml`.
#[derive(Debug, Clone, PartialEq)]
pub struct ForeignColumn {
    /// Name.
    pub name: String,
    /// Numbers as stored, NaN for null; for date-times the time since `origin_s` \[s\].
    pub values: Vec<f64>,
    /// Origin of `values` for date-times, a whole second since 1970 \[s\].
    pub origin_s: Option<i64>,
    /// The date-times are instants in UTC; else their zone is unknown.
    pub has_zone: bool,
}

/// Reads all columns of numbers and of date-times of `path`, for files without a `recording.toml`.
pub fn parquet_columns(path: &Path) -> Result<Vec<ForeignColumn>, InputError> {
    let builder = open(path)?;
    let is_number = |data_type: &DataType| data_type.is_numeric() && !is_decimal(data_type);
    let mut found = Vec::new();
    let mut are_dates = Vec::new();
    for field in builder.schema().fields() {
        let zone = match field.data_type() {
            DataType::Timestamp(_, zone) => Some(zone.is_some()),
            data_type if is_number(data_type) => None,
            _ => continue,
        };
        are_dates.push(zone.is_some());
        found.push(ForeignColumn {
            name: field.name().clone(),
            values: Vec::new(),
            origin_s: None,
            has_zone: zone.unwrap_or(false),
        });
    }
    let names: Vec<String> = found.iter().map(|column| column.name.clone()).collect();
    let wanted: Vec<&str> = names.iter().map(String::as_str).collect();
    batches(path, &wanted, None, |place, array| {
        let column = &mut found[place];
        match are_dates[place] {
            true => append_dates(array, column),
            false => append(path, wanted[place], array, &mut column.values)?,
        }
        Ok(())
    })?;
    Ok(found)
}

/// Appends date-times as seconds since the whole second of the first one present.
fn append_dates(array: &ArrayRef, column: &mut ForeignColumn) {
    macro_rules! dates {
        ($type:ty, $per_second:expr) => {
            for value in array.as_primitive::<$type>() {
                column.values.push(value.map_or(f64::NAN, |since: i64| {
                    let whole_s = since.div_euclid($per_second);
                    let origin_s = *column.origin_s.get_or_insert(whole_s);
                    (whole_s - origin_s) as f64
                        + since.rem_euclid($per_second) as f64 / $per_second as f64
                }));
            }
        };
    }
    match array.data_type() {
        DataType::Timestamp(TimeUnit::Second, _) => dates!(TimestampSecondType, 1),
        DataType::Timestamp(TimeUnit::Millisecond, _) => dates!(TimestampMillisecondType, 1_000),
        DataType::Timestamp(TimeUnit::Microsecond, _) => {
            dates!(TimestampMicrosecondType, 1_000_000);
        }
        _ => dates!(TimestampNanosecondType, 1_000_000_000),
    }
}

fn is_decimal(data_type: &DataType) -> bool {
    matches!(
        data_type,
        DataType::Decimal32(..)
            | DataType::Decimal64(..)
            | DataType::Decimal128(..)
            | DataType::Decimal256(..)
    )
}

/// Reads the columns `wanted` of `path`, in that order, equally long; all rows or a range, in which case row groups
/// outside are not decoded.
pub(super) fn read_rows(
    path: &Path,
    wanted: &[&str],
    rows: Option<Range<usize>>,
) -> Result<Vec<Vec<f64>>, InputError> {
    let capacity = match &rows {
        Some(rows) => rows.len(),
        None => self::rows(path)?,
    };
    // A damaged row count must not determine an allocation; a correct one only saves a few copies.
    let capacity = capacity.min(1 << 24);
    let mut columns: Vec<Vec<f64>> = wanted
        .iter()
        .map(|_| Vec::with_capacity(capacity))
        .collect();
    batches(path, wanted, rows, |place, array| {
        append(path, wanted[place], array, &mut columns[place])
    })?;
    Ok(columns)
}

/// Calls `take` with each batch of each wanted column, by its place in `wanted`, in the order of the rows.
fn batches(
    path: &Path,
    wanted: &[&str],
    rows: Option<Range<usize>>,
    mut take: impl FnMut(usize, &ArrayRef) -> Result<(), InputError>,
) -> Result<(), InputError> {
    let damaged = |error: &dyn std::fmt::Display| damaged(path, error);
    let mut builder = open(path)?;
    let names: Vec<String> = builder
        .schema()
        .fields()
        .iter()
        .map(|f| f.name().clone())
        .collect();
    let roots = locate(path, &names, wanted)?;

    let mask = ProjectionMask::roots(builder.parquet_schema(), roots.iter().copied());
    if let Some(rows) = rows {
        let mut first = 0;
        let mut before = 0;
        let mut groups = Vec::new();
        for (place, group) in builder.metadata().row_groups().iter().enumerate() {
            let end = first + usize::try_from(group.num_rows()).unwrap_or(0);
            if rows.start < end && first < rows.end {
                groups.push(place);
            } else if end <= rows.start {
                before = end;
            }
            first = end;
        }
        builder = builder
            .with_row_groups(groups)
            .with_offset(rows.start - before.min(rows.start))
            .with_limit(rows.len());
    }
    let reader = builder
        .with_projection(mask)
        .with_batch_size(BATCH_ROWS)
        .build()
        .map_err(|error| damaged(&error))?;
    for batch in reader {
        let batch = batch.map_err(|error| damaged(&error))?;
        for (place, (&root, name)) in roots.iter().zip(wanted).enumerate() {
            let array = batch
                .column_by_name(&names[root])
                .ok_or_else(|| InputError::new(path, "has no such column").channel(*name))?;
            take(place, array)?;
        }
    }
    Ok(())
}

fn damaged(path: &Path, error: &dyn std::fmt::Display) -> InputError {
    InputError::new(path, format!("is truncated or damaged ({error})"))
        .expected("a whole Parquet file")
}

fn open(path: &Path) -> Result<ParquetRecordBatchReaderBuilder<File>, InputError> {
    let file = File::open(path).map_err(|error| InputError::unreadable(path, &error))?;
    let length = file.metadata().map_or(u64::MAX, |metadata| metadata.len());
    if length == 0 {
        return Err(InputError::new(path, "is empty").expected("a Parquet file"));
    }
    let damaged = |error: &dyn std::fmt::Display| damaged(path, error);
    // The writer's own schema hints (dictionaries, views) are skipped: plain types suffice.
    let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
    let builder = ParquetRecordBatchReaderBuilder::try_new_with_options(file, options)
        .map_err(|error| damaged(&error))?;
    if !builder
        .metadata()
        .row_groups()
        .iter()
        .all(|group| lies_within(group, length))
    {
        return Err(damaged(&"a column lies outside the file"));
    }
    Ok(builder)
}

/// True if every column of a row group lies in a file of `length` bytes. The library asserts this instead of reporting
/// it, so a damaged file is detected here first.
fn lies_within(group: &RowGroupMetaData, length: u64) -> bool {
    group.columns().iter().all(|column| {
        let start = column.dictionary_page_offset().unwrap_or(column.data_page_offset());
        let range = (u64::try_from(start), u64::try_from(column.compressed_size()));
        matches!(range, (Ok(start), Ok(size)) if start.checked_add(size).is_some_and(|end| end <= length))
    })
}

/// Position of each wanted column among `names`.
pub(super) fn locate(
    path: &Path,
    names: &[String],
    wanted: &[&str],
) -> Result<Vec<usize>, InputError> {
    let position = |&column: &&str| {
        let mut found = names.iter().enumerate().filter(|(_, name)| *name == column);
        match (found.next(), found.next()) {
            (Some((index, _)), None) => Ok(index),
            (Some(_), Some(_)) => Err(InputError::new(path, "has this column twice")
                .channel(column)
                .expected("each column once")),
            _ => Err(InputError::new(path, "has no such column")
                .channel(column)
                .expected(format!("one of {}", names.join(", ")))),
        }
    };
    wanted.iter().map(position).collect()
}

fn append(path: &Path, name: &str, array: &ArrayRef, out: &mut Vec<f64>) -> Result<(), InputError> {
    macro_rules! numbers {
        ($type:ty, $convert:expr) => {
            out.extend(
                array
                    .as_primitive::<$type>()
                    .iter()
                    .map(|value| value.map_or(f64::NAN, $convert)),
            )
        };
    }
    match array.data_type() {
        DataType::Int8 => numbers!(Int8Type, f64::from),
        DataType::Int16 => numbers!(Int16Type, f64::from),
        DataType::Int32 => numbers!(Int32Type, f64::from),
        DataType::Int64 => numbers!(Int64Type, |value| value as f64),
        DataType::UInt8 => numbers!(UInt8Type, f64::from),
        DataType::UInt16 => numbers!(UInt16Type, f64::from),
        DataType::UInt32 => numbers!(UInt32Type, f64::from),
        DataType::UInt64 => numbers!(UInt64Type, |value| value as f64),
        DataType::Float16 => numbers!(Float16Type, f64::from),
        DataType::Float32 => numbers!(Float32Type, f64::from),
        DataType::Float64 => numbers!(Float64Type, |value| value),
        DataType::Null => out.extend(std::iter::repeat_n(f64::NAN, array.len())),
        DataType::Utf8 => {
            let text = array.as_string::<i32>();
            let found = text
                .iter()
                .enumerate()
                .find_map(|(row, value)| Some((row, value?)));
            let error = InputError::new(path, "is text, not a number")
                .channel(name)
                .expected("a column of integers or floating-point numbers");
            return Err(match found {
                Some((row, value)) => error
                    .row((out.len() + row) as u64)
                    .value(format!("{value:?}")),
                None => error,
            });
        }
        other => {
            return Err(InputError::new(path, "is not a column of numbers")
                .channel(name)
                .value(other)
                .expected("integers or floating-point numbers"));
        }
    }
    Ok(())
}
