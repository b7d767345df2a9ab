//! Parquet tables: columns of numbers as f64, null as NaN.
//!
//! Any integer or floating type, any codec and encoding of the library, any number of row groups. Only the wanted
//! columns are decoded. Values are returned as stored, before scale and offset.

use std::fs::File;
use std::ops::Range;
use std::path::Path;

use half::f16;
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::metadata::{ParquetMetaData, RowGroupMetaData};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::TypePtr;

use super::parquet_kind::Kind;
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
    let file = open(path)?;
    let mut found = Vec::new();
    for (root, field) in fields(&file).iter().enumerate() {
        let kind = Kind::of(field);
        let has_zone = match kind {
            Kind::Dates { has_zone, .. } => has_zone,
            _ if kind.is_number() => false,
            _ => continue,
        };
        let column = ForeignColumn {
            name: field.name().to_owned(),
            values: Vec::new(),
            origin_s: None,
            has_zone,
        };
        found.push((root, kind, column));
    }
    let wanted: Vec<&str> = found
        .iter()
        .map(|(.., column)| column.name.as_str())
        .collect();
    locate(path, &names(&file), &wanted)?;
    let spans = spans(file.metadata(), None);
    for (root, kind, column) in &mut found {
        let decoded = match *kind {
            Kind::Dates { per_second, .. } => decode(&file, *root, &spans, |cell| {
                column.push_date(cell, per_second)
            }),
            _ => decode(&file, *root, &spans, |cell| {
                column.values.push(cell.number(kind));
            }),
        };
        decoded.map_err(|error| damaged(path, &error))?;
    }
    Ok(found.into_iter().map(|(.., column)| column).collect())
}

impl ForeignColumn {
    /// Adds a date-time as seconds since the whole second of the first one present.
    fn push_date(&mut self, cell: Cell, per_second: i64) {
        self.values.push(match cell {
            Cell::Integer(since) => {
                let whole_s = since.div_euclid(per_second);
                let origin_s = *self.origin_s.get_or_insert(whole_s);
                (whole_s - origin_s) as f64
                    + since.rem_euclid(per_second) as f64 / per_second as f64
            }
            _ => f64::NAN,
        });
    }
}

/// Reads the columns `wanted` of `path`, in that order, equally long; all rows or a range, in which case row groups
/// outside are not decoded.
pub(super) fn read_rows(
    path: &Path,
    wanted: &[&str],
    rows: Option<Range<usize>>,
) -> Result<Vec<Vec<f64>>, InputError> {
    let file = open(path)?;
    let roots = locate(path, &names(&file), wanted)?;
    let spans = spans(file.metadata(), rows);
    let capacity = spans.iter().map(|span| span.rows.len());
    // A damaged row count must not determine an allocation; a correct one only saves a few copies.
    let capacity = capacity.fold(0, usize::saturating_add).min(1 << 24);
    let read = |(&root, &name): (&usize, &&str)| {
        let mut values = Vec::with_capacity(capacity);
        let kind = Kind::of(&fields(&file)[root]);
        let decoded = match (&kind, spans.first()) {
            (_, None) => Ok(()),
            (Kind::Text, Some(span)) => return Err(text(path, name, &file, root, span)),
            _ if kind.is_number() || kind == Kind::Null => decode(&file, root, &spans, |cell| {
                values.push(cell.number(&kind));
            }),
            _ => {
                return Err(InputError::new(path, "is not a column of numbers")
                    .channel(name)
                    .value(kind.name())
                    .expected("integers or floating-point numbers"));
            }
        };
        decoded.map_err(|error| damaged(path, &error))?;
        Ok(values)
    };
    roots.iter().zip(wanted).map(read).collect()
}

/// Error about a column of text, with the first one of the first rows.
fn text(
    path: &Path,
    name: &str,
    file: &SerializedFileReader<File>,
    root: usize,
    span: &Span,
) -> InputError {
    let end = span.rows.end.min(span.rows.start + BATCH_ROWS);
    let first = Span {
        group: span.group,
        rows: span.rows.start..end,
    };
    let (mut row, mut found) = (0, None);
    let decoded = decode(file, root, &[first], |cell| {
        if let (Cell::Text(text), None) = (cell, &found) {
            found = Some((row, String::from_utf8_lossy(text).into_owned()));
        }
        row += 1;
    });
    if let Err(error) = decoded {
        return damaged(path, &error);
    }
    let error = InputError::new(path, "is text, not a number")
        .channel(name)
        .expected("a column of integers or floating-point numbers");
    match found {
        Some((row, value)) => error.row(row).value(format!("{value:?}")),
        None => error,
    }
}

/// Wanted rows of a row group.
struct Span {
    group: usize,
    /// Counted within the group.
    rows: Range<usize>,
}

/// Returns where the rows `wanted`, or all, are.
fn spans(metadata: &ParquetMetaData, wanted: Option<Range<usize>>) -> Vec<Span> {
    let wanted = wanted.unwrap_or(0..usize::MAX);
    let mut spans = Vec::new();
    let mut first = 0_usize;
    for (group, about) in metadata.row_groups().iter().enumerate() {
        let end = first.saturating_add(usize::try_from(about.num_rows()).unwrap_or(0));
        let rows = wanted.start.clamp(first, end) - first..wanted.end.clamp(first, end) - first;
        if !rows.is_empty() {
            spans.push(Span { group, rows });
        }
        first = end;
    }
    spans
}

/// Stored value of one row.
#[derive(Clone, Copy)]
enum Cell<'a> {
    Null,
    Integer(i64),
    Float(f64),
    Text(&'a [u8]),
}

impl Cell<'_> {
    /// Returns its number, NaN for null.
    fn number(self, kind: &Kind) -> f64 {
        match self {
            Self::Integer(stored) => kind.number(stored),
            Self::Float(value) => value,
            Self::Null | Self::Text(_) => f64::NAN,
        }
    }
}

/// Calls `take` with each row of a column, at position `root` in the file, in order.
fn decode(
    file: &SerializedFileReader<File>,
    root: usize,
    spans: &[Span],
    mut take: impl FnMut(Cell),
) -> ParquetResult<()> {
    let schema = file.metadata().file_metadata().schema_descr();
    let leaf = (0..schema.num_columns())
        .find(|&leaf| schema.get_column_root_idx(leaf) == root)
        .ok_or_else(|| ParquetError::General("a column without values".to_owned()))?;
    for Span { group, rows } in spans {
        use ColumnReader as Of;
        let (take, rows) = (&mut take, rows.clone());
        match file.get_row_group(*group)?.get_column_reader(leaf)? {
            Of::BoolColumnReader(from) => each(from, rows, |_| take(Cell::Null)),
            Of::Int32ColumnReader(from) => each(from, rows, |value| {
                take(value.map_or(Cell::Null, |&value| Cell::Integer(value.into())));
            }),
            Of::Int64ColumnReader(from) => each(from, rows, |value| {
                take(value.map_or(Cell::Null, |&value| Cell::Integer(value)));
            }),
            Of::Int96ColumnReader(from) => each(from, rows, |value| {
                take(value.map_or(Cell::Null, |value| Cell::Integer(value.to_nanos())));
            }),
            Of::FloatColumnReader(from) => each(from, rows, |value| {
                take(value.map_or(Cell::Null, |&value| Cell::Float(value.into())));
            }),
            Of::DoubleColumnReader(from) => each(from, rows, |value| {
                take(value.map_or(Cell::Null, |&value| Cell::Float(value)));
            }),
            Of::FixedLenByteArrayColumnReader(from) => each(from, rows, |value| {
                let half = value.and_then(|value| <[u8; 2]>::try_from(value.data()).ok());
                take(half.map_or(Cell::Null, |half| {
                    Cell::Float(f16::from_le_bytes(half).into())
                }));
            }),
            Of::ByteArrayColumnReader(from) => each(from, rows, |value| {
                take(value.map_or(Cell::Null, |value| Cell::Text(value.data())));
            }),
        }?;
    }
    Ok(())
}

/// Calls `take` with each of the rows `rows` of a column in a row group, `None` for null.
fn each<T: DataType>(
    mut from: ColumnReaderImpl<T>,
    rows: Range<usize>,
    mut take: impl FnMut(Option<&T::T>),
) -> ParquetResult<()> {
    let ends = || ParquetError::EOF("a column ends before its row group".to_owned());
    if from.skip_records(rows.start)? != rows.start {
        return Err(ends());
    }
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    let mut left = rows.len();
    while left > 0 {
        levels.clear();
        values.clear();
        let most = left.min(BATCH_ROWS);
        let (read, ..) = from.read_records(most, Some(&mut levels), None, &mut values)?;
        if read == 0 {
            return Err(ends());
        }
        left -= read;
        if levels.is_empty() {
            values.iter().for_each(|value| take(Some(value)));
        } else {
            let mut present = values.iter();
            for &level in &levels {
                take(if level > 0 { present.next() } else { None });
            }
        }
    }
    Ok(())
}

fn damaged(path: &Path, error: &dyn std::fmt::Display) -> InputError {
    InputError::new(path, format!("is truncated or damaged ({error})"))
        .expected("a whole Parquet file")
}

fn open(path: &Path) -> Result<SerializedFileReader<File>, InputError> {
    let file = File::open(path).map_err(|error| InputError::unreadable(path, &error))?;
    let length = file.metadata().map_or(u64::MAX, |metadata| metadata.len());
    if length == 0 {
        return Err(InputError::new(path, "is empty").expected("a Parquet file"));
    }
    let reader = SerializedFileReader::new(file).map_err(|error| damaged(path, &error))?;
    let mut groups = reader.metadata().row_groups().iter();
    if !groups.all(|group| lies_within(group, length)) {
        return Err(damaged(path, &"a column lies outside the file"));
    }
    Ok(reader)
}

fn fields(file: &SerializedFileReader<File>) -> &[TypePtr] {
    file.metadata().file_metadata().schema().get_fields()
}

fn names(file: &SerializedFileReader<File>) -> Vec<String> {
    let fields = fields(file).iter();
    fields.map(|field| field.name().to_owned()).collect()
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
