//! Parquet files as others write them, for tests that read them.

use std::fs::File;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FixedLenByteArray,
    FixedLenByteArrayType, FloatType, Int32Type, Int64Type,
};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;

/// Cells of a column as they are stored; `None` is null.
pub enum Cells {
    Bool(Vec<Option<bool>>),
    Int32(Vec<Option<i32>>),
    Int64(Vec<Option<i64>>),
    Float(Vec<Option<f32>>),
    Double(Vec<Option<f64>>),
    Text(Vec<Option<&'static str>>),
    Half(Vec<Option<[u8; 2]>>),
}

/// Writes columns of `rows` rows, each with its type and name as Parquet's schemas have them.
pub fn write(path: &Path, rows: usize, columns: &[(&str, &Cells)], properties: WriterProperties) {
    let fields = columns
        .iter()
        .map(|(field, _)| format!("optional {field};"));
    let schema = format!("message schema {{ {} }}", fields.collect::<String>());
    let schema = parse_message_type(&schema).expect("a schema");
    let rows_per_group = properties.max_row_group_row_count().unwrap_or(rows);
    let file = File::create(path).expect("a file");
    let mut file =
        SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties)).expect("a writer");
    for first in (0..rows).step_by(rows_per_group) {
        let mut group = file.next_row_group().expect("a row group");
        for (_, cells) in columns {
            let mut column = group.next_column().expect("a column").expect("a column");
            cells.write(&mut column, first..rows.min(first + rows_per_group));
            column.close().expect("closed");
        }
        group.close().expect("closed");
    }
    file.close().expect("closed");
}

impl Cells {
    fn write(&self, to: &mut SerializedColumnWriter, rows: Range<usize>) {
        match self {
            Self::Bool(cells) => put::<BoolType, _>(to, &cells[rows], |value| value),
            Self::Int32(cells) => put::<Int32Type, _>(to, &cells[rows], |value| value),
            Self::Int64(cells) => put::<Int64Type, _>(to, &cells[rows], |value| value),
            Self::Float(cells) => put::<FloatType, _>(to, &cells[rows], |value| value),
            Self::Double(cells) => put::<DoubleType, _>(to, &cells[rows], |value| value),
            Self::Text(cells) => put::<ByteArrayType, _>(to, &cells[rows], ByteArray::from),
            Self::Half(cells) => put::<FixedLenByteArrayType, _>(to, &cells[rows], |value| {
                FixedLenByteArray::from(value.to_vec())
            }),
        }
    }
}

fn put<T: DataType, C: Copy>(
    to: &mut SerializedColumnWriter,
    cells: &[Option<C>],
    stored: impl Fn(C) -> T::T,
) {
    let levels: Vec<i16> = cells.iter().map(|cell| cell.is_some().into()).collect();
    let values: Vec<T::T> = cells.iter().flatten().map(|&cell| stored(cell)).collect();
    let column = to.typed::<T>();
    column
        .write_batch(&values, Some(&levels), None)
        .expect("written");
}
