//! Writes Parquet by rows: a row group's columns are encoded side by side and held as compressed pages until it is full.
//!
//! The bytes do not depend on machine or time.

use std::io::Write;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::column::page::{CompressedPage, PageWriteSpec, PageWriter};
use parquet::column::writer::{ColumnWriter, ColumnWriterImpl, get_column_writer};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::{ParquetError, Result};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedPageWriter, TrackedWrite};
use parquet::schema::types::{ColumnDescPtr, Type, TypePtr};

/// Name of a file's root, as the earliest files have it.
const ROOT: &str = "arrow_schema";

/// Compressed pages of a column, shared with its encoder.
type Pages = Arc<Mutex<TrackedWrite<Vec<u8>>>>;

/// Parquet file in the course of being written.
pub(super) struct ParquetWriter<W: Write + Send> {
    file: SerializedFileWriter<W>,
    rows_per_group: usize,
    /// Columns of the row group at hand; none before its first row.
    group: Vec<Column>,
    group_rows: usize,
}

/// Column of the row group at hand.
pub(super) struct Column {
    encoder: ColumnWriter<'static>,
    pages: Pages,
}

impl<W: Write + Send> ParquetWriter<W> {
    /// Begins a file of nullable columns in row groups of `rows_per_group`. A column is INT32, INT64, DOUBLE, or, for
    /// text, BYTE_ARRAY.
    pub(super) fn create<'a>(
        sink: W,
        columns: impl IntoIterator<Item = (&'a str, Physical)>,
        rows_per_group: usize,
    ) -> Result<Self> {
        let columns = columns.into_iter();
        let fields = columns.map(|(name, physical)| {
            let text = (physical == Physical::BYTE_ARRAY).then_some(LogicalType::String);
            let column = Type::primitive_type_builder(name, physical)
                .with_repetition(Repetition::OPTIONAL)
                .with_logical_type(text);
            column.build().map(Arc::new)
        });
        let root = Type::group_type_builder(ROOT)
            .with_fields(fields.collect::<Result<Vec<TypePtr>>>()?)
            .build()?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_created_by(concat!("rlg ", env!("CARGO_PKG_VERSION")).to_owned())
            .build();
        Ok(Self {
            file: SerializedFileWriter::new(sink, Arc::new(root), Arc::new(properties))?,
            rows_per_group,
            group: Vec::new(),
            group_rows: 0,
        })
    }

    /// Adds `rows` rows. `encode` adds some of them, a range in `0..rows`, to a column given with its position.
    pub(super) fn write(
        &mut self,
        rows: usize,
        encode: impl Fn(&mut Column, usize, Range<usize>) -> Result<()>,
    ) -> Result<()> {
        let mut first = 0;
        while first < rows {
            if self.group.is_empty() {
                let columns = self.file.schema_descr().columns();
                self.group = columns.iter().map(|c| self.column(c)).collect();
            }
            let end = rows.min(first + self.rows_per_group - self.group_rows);
            for (place, column) in self.group.iter_mut().enumerate() {
                encode(column, place, first..end)?;
            }
            self.group_rows += end - first;
            first = end;
            if self.group_rows == self.rows_per_group {
                self.end_group()?;
            }
        }
        Ok(())
    }

    /// Completes the file.
    pub(super) fn close(mut self) -> Result<()> {
        self.end_group()?;
        self.file.close()?;
        Ok(())
    }

    fn column(&self, description: &ColumnDescPtr) -> Column {
        let pages = Arc::new(Mutex::new(TrackedWrite::new(Vec::new())));
        let properties = Arc::clone(self.file.properties());
        let sink = Box::new(PageSink(Arc::clone(&pages)));
        Column {
            encoder: get_column_writer(Arc::clone(description), properties, sink),
            pages,
        }
    }

    fn end_group(&mut self) -> Result<()> {
        if self.group.is_empty() {
            return Ok(());
        }
        let mut group = self.file.next_row_group()?;
        for column in self.group.drain(..) {
            let closed = column.encoder.close()?;
            let pages = Arc::into_inner(column.pages)
                .ok_or_else(|| ParquetError::General("a column is still open".to_owned()))?;
            let pages = pages.into_inner().unwrap_or_else(PoisonError::into_inner);
            group.append_column(&Bytes::from(pages.into_inner()?), closed)?;
        }
        group.close()?;
        self.group_rows = 0;
        Ok(())
    }
}

impl Column {
    /// Adds integers; `None` is null.
    pub(super) fn integers(&mut self, cells: impl Iterator<Item = Option<i64>>) -> Result<()> {
        match &mut self.encoder {
            ColumnWriter::Int32ColumnWriter(to) => {
                encode(to, cells.map(|cell| cell.map(|value| value as i32)))
            }
            ColumnWriter::Int64ColumnWriter(to) => encode(to, cells),
            _ => Err(other_type()),
        }
    }

    /// Adds floating-point numbers; `None` is null.
    pub(super) fn numbers(&mut self, cells: impl Iterator<Item = Option<f64>>) -> Result<()> {
        match &mut self.encoder {
            ColumnWriter::DoubleColumnWriter(to) => encode(to, cells),
            _ => Err(other_type()),
        }
    }

    /// Adds measured values; NaN, which is not measured, is null.
    pub(super) fn measured(&mut self, values: &[f64]) -> Result<()> {
        let values = values.iter();
        self.numbers(values.map(|value| (!value.is_nan()).then_some(*value)))
    }

    /// Adds texts; `None` is null.
    pub(super) fn texts(&mut self, cells: &[Option<String>]) -> Result<()> {
        match &mut self.encoder {
            ColumnWriter::ByteArrayColumnWriter(to) => {
                let cells = cells.iter();
                encode(to, cells.map(|cell| cell.as_deref().map(ByteArray::from)))
            }
            _ => Err(other_type()),
        }
    }
}

fn encode<T: DataType>(
    to: &mut ColumnWriterImpl<'_, T>,
    cells: impl Iterator<Item = Option<T::T>>,
) -> Result<()> {
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    for cell in cells {
        levels.push(i16::from(cell.is_some()));
        values.extend(cell);
    }
    to.write_batch(&values, Some(&levels), None)?;
    Ok(())
}

fn other_type() -> ParquetError {
    ParquetError::General("a column has another type than its values".to_owned())
}

/// Sink of a column's pages in memory.
struct PageSink(Pages);

impl PageWriter for PageSink {
    fn write_page(&mut self, page: CompressedPage) -> Result<PageWriteSpec> {
        let mut pages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        SerializedPageWriter::new(&mut pages).write_page(page)
    }

    fn close(&mut self) -> Result<()> {
        Ok(())
    }
}
