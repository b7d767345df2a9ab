//! Parquet as written by others: any number type, nulls, row groups, dictionaries, codecs; and damage.

use std::fs;
use std::path::Path;

use parquet::basic::{BrotliLevel, Compression, GzipLevel, ZstdLevel};
use parquet::file::properties::WriterProperties;
use proptest::prelude::*;
use rlg::error::InputError;
use rlg::recording::Recording;

use super::parquet_file::{Cells, write};

/// A recording of one Parquet table whose column `c` is read as a quantity without bounds.
fn folder_with(
    rows: usize,
    field: &str,
    cells: &Cells,
    properties: WriterProperties,
) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let unused = field.replacen(" c", " unused", 1);
    let columns = [(unused.as_str(), cells), (field, cells)];
    write(&folder.path().join("t.parquet"), rows, &columns, properties);
    let manifest = "format = 1\n[[table]]\nfile = \"t.parquet\"\nrate_hz = 10\n\
                    [[table.channel]]\ncolumn = \"c\"\nquantity = \"strain\"\n";
    fs::write(folder.path().join("recording.toml"), manifest).expect("a file");
    folder
}

fn values(folder: &Path) -> Result<Vec<f64>, InputError> {
    Recording::read(folder)
        .map(|mut recording| recording.tables.remove(0).channels.remove(0).values)
}

fn read(rows: usize, field: &str, cells: &Cells) -> Result<Vec<f64>, InputError> {
    values(folder_with(rows, field, cells, WriterProperties::default()).path())
}

#[test]
fn every_integer_and_floating_type_reads_with_null_as_not_measured() {
    let int32 = &Cells::Int32(vec![Some(1), None, Some(3)]);
    let int64 = &Cells::Int64(vec![Some(1), None, Some(3)]);
    let results = [
        read(3, "int32 c (INTEGER(8,true))", int32),
        read(3, "int32 c (INTEGER(16,true))", int32),
        read(3, "int32 c", int32),
        read(3, "int64 c", int64),
        read(3, "int32 c (INTEGER(8,false))", int32),
        read(3, "int32 c (INTEGER(16,false))", int32),
        read(3, "int32 c (INTEGER(32,false))", int32),
        read(3, "int64 c (INTEGER(64,false))", int64),
        read(3, "int32 c (UINT_8)", int32),
        read(3, "int64 c (INT_64)", int64),
        read(
            3,
            "fixed_len_byte_array(2) c (FLOAT16)",
            &Cells::Half(vec![Some([0, 0x3c]), None, Some([0, 0x42])]),
        ),
        read(
            3,
            "float c",
            &Cells::Float(vec![Some(1.0), None, Some(3.0)]),
        ),
        read(
            3,
            "double c",
            &Cells::Double(vec![Some(1.0), None, Some(3.0)]),
        ),
        read(
            3,
            "double c",
            &Cells::Double(vec![Some(1.0), Some(f64::NAN), Some(3.0)]),
        ),
    ];
    for result in results {
        let values = result.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((values[0], values[2], values.len()), (1.0, 3.0, 3));
        assert!(values[1].is_nan());
    }
}

#[test]
fn the_largest_unsigned_integers_are_not_negative() {
    let int32 = &Cells::Int32(vec![Some(-1)]);
    for (bits, expected) in [(8, 255.0), (16, 65_535.0), (32, 4_294_967_295.0)] {
        let field = format!("int32 c (INTEGER({bits},false))");
        assert_eq!(read(1, &field, int32), Ok(vec![expected]));
    }
    let int64 = &Cells::Int64(vec![Some(-1)]);
    let values = read(1, "int64 c (INTEGER(64,false))", int64);
    assert_eq!(values, Ok(vec![u64::MAX as f64]));
}

#[test]
fn every_codec_and_small_row_groups_give_the_same_values() {
    let expected: Vec<f64> = (0..10_000).map(|i| f64::from(i % 97)).collect();
    let cells = Cells::Double(expected.iter().copied().map(Some).collect());
    for codec in [
        Compression::UNCOMPRESSED,
        Compression::SNAPPY,
        Compression::GZIP(GzipLevel::default()),
        Compression::BROTLI(BrotliLevel::default()),
        Compression::LZ4_RAW,
        Compression::ZSTD(ZstdLevel::default()),
    ] {
        for dictionary in [true, false] {
            let properties = WriterProperties::builder()
                .set_compression(codec)
                .set_dictionary_enabled(dictionary)
                .set_max_row_group_row_count(Some(777))
                .build();
            let folder = folder_with(expected.len(), "double c", &cells, properties);
            let values = values(folder.path()).unwrap_or_else(|error| panic!("{codec:?}: {error}"));
            assert_eq!(values, expected, "{codec:?}");
        }
    }
}

#[test]
fn a_text_column_names_the_file_the_channel_the_row_and_the_value() {
    let cells = Cells::Text(vec![None, Some("warm"), Some("cold")]);
    let error = read(3, "binary c (STRING)", &cells).expect_err("text");
    assert_eq!((error.channel.as_deref(), error.row), (Some("c"), Some(1)));
    let text = error.to_string();
    assert!(
        text.contains("t.parquet, c, row 1") && text.contains("\"warm\""),
        "{text}"
    );
}

#[test]
fn truth_values_and_times_are_no_numbers() {
    let cells = Cells::Int64(vec![Some(1)]);
    let error = read(1, "int64 c (TIMESTAMP(MICROS,true))", &cells).expect_err("a time");
    assert!(error.to_string().contains("Timestamp"), "{error}");
    let cells = Cells::Bool(vec![Some(true)]);
    let error = read(1, "boolean c", &cells).expect_err("truth values");
    assert!(
        error.to_string().contains("not a column of numbers"),
        "{error}"
    );
}

/// A Parquet file of some length for damage.
fn whole() -> (tempfile::TempDir, Vec<u8>) {
    let cells = Cells::Int32((0..5000).map(|i| Some((i * i) % 1009)).collect());
    let folder = folder_with(5000, "int32 c", &cells, WriterProperties::default());
    let bytes = fs::read(folder.path().join("t.parquet")).expect("written");
    (folder, bytes)
}

#[test]
fn a_truncated_file_is_refused_wherever_it_ends() {
    let (folder, bytes) = whole();
    for length in (0..bytes.len()).step_by(bytes.len() / 200) {
        fs::write(folder.path().join("t.parquet"), &bytes[..length]).expect("written");
        let error = values(folder.path()).expect_err("truncated");
        let text = error.to_string();
        assert!(
            text.contains("t.parquet") && text.contains("Parquet"),
            "{length}: {text}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn a_damaged_file_never_ends_in_a_panic(place in any::<prop::sample::Index>(), bits in 1..=255_u8, tail in any::<bool>()) {
        let (folder, mut bytes) = whole();
        // Half of the cases hit the last kilobyte, which holds the file's own description.
        let from = if tail { bytes.len() - 1000 } else { 0 };
        let at = from + place.index(bytes.len() - from);
        bytes[at] ^= bits;
        fs::write(folder.path().join("t.parquet"), &bytes).expect("written");
        if let Err(error) = values(folder.path()) {
            prop_assert!(error.to_string().contains("t.parquet"), "{}", error);
        }
    }
}
