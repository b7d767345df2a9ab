//! Parquet as written by others: any number type, nulls, row groups, dictionaries, codecs; and damage.

use std::fs::{self, File};
use std::path::Path;
use std::sync::Arc;

use arrow_array::builder::StringDictionaryBuilder;
use arrow_array::types::Int32Type;
use arrow_array::{
    ArrayRef, BooleanArray, Float32Array, Float64Array, Int8Array, Int16Array, Int32Array,
    Int64Array, RecordBatch, StringArray, UInt8Array, UInt16Array, UInt32Array, UInt64Array,
};
use parquet::arrow::ArrowWriter;
use parquet::basic::{BrotliLevel, Compression, GzipLevel, ZstdLevel};
use parquet::file::properties::WriterProperties;
use proptest::prelude::*;
use rlg::error::InputError;
use rlg::recording::Recording;

/// A recording of one Parquet table whose column `c` is read as a quantity without bounds.
fn folder_with(array: ArrayRef, properties: WriterProperties) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let batch =
        RecordBatch::try_from_iter([("unused", array.clone()), ("c", array)]).expect("a batch");
    let file = File::create(folder.path().join("t.parquet")).expect("a file");
    let mut writer =
        ArrowWriter::try_new(file, batch.schema(), Some(properties)).expect("a writer");
    writer.write(&batch).expect("written");
    writer.close().expect("closed");
    let manifest = "format = 1\n[[table]]\nfile = \"t.parquet\"\nrate_hz = 10\n\
                    [[table.channel]]\ncolumn = \"c\"\nquantity = \"strain\"\n";
    fs::write(folder.path().join("recording.toml"), manifest).expect("a file");
    folder
}

fn values(folder: &Path) -> Result<Vec<f64>, InputError> {
    Recording::read(folder)
        .map(|mut recording| recording.tables.remove(0).channels.remove(0).values)
}

fn read(array: impl arrow_array::Array + 'static) -> Result<Vec<f64>, InputError> {
    values(folder_with(Arc::new(array), WriterProperties::default()).path())
}

#[test]
fn every_integer_and_floating_type_reads_with_null_as_not_measured() {
    let results = [
        read(Int8Array::from(vec![Some(1), None, Some(3)])),
        read(Int16Array::from(vec![Some(1), None, Some(3)])),
        read(Int32Array::from(vec![Some(1), None, Some(3)])),
        read(Int64Array::from(vec![Some(1), None, Some(3)])),
        read(UInt8Array::from(vec![Some(1), None, Some(3)])),
        read(UInt16Array::from(vec![Some(1), None, Some(3)])),
        read(UInt32Array::from(vec![Some(1), None, Some(3)])),
        read(UInt64Array::from(vec![Some(1), None, Some(3)])),
        read(Float32Array::from(vec![Some(1.0), None, Some(3.0)])),
        read(Float64Array::from(vec![Some(1.0), None, Some(3.0)])),
        read(Float64Array::from(vec![1.0, f64::NAN, 3.0])),
    ];
    for result in results {
        let values = result.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((values[0], values[2], values.len()), (1.0, 3.0, 3));
        assert!(values[1].is_nan());
    }
}

#[test]
fn every_codec_and_small_row_groups_give_the_same_values() {
    let expected: Vec<f64> = (0..10_000).map(|i| f64::from(i % 97)).collect();
    let array: ArrayRef = Arc::new(Float64Array::from(expected.clone()));
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
            let folder = folder_with(array.clone(), properties);
            let values = values(folder.path()).unwrap_or_else(|error| panic!("{codec:?}: {error}"));
            assert_eq!(values, expected, "{codec:?}");
        }
    }
}

#[test]
fn a_text_column_names_the_file_the_channel_the_row_and_the_value() {
    let error = read(StringArray::from(vec![None, Some("warm"), Some("cold")])).expect_err("text");
    assert_eq!((error.channel.as_deref(), error.row), (Some("c"), Some(1)));
    let text = error.to_string();
    assert!(
        text.contains("t.parquet, c, row 1") && text.contains("\"warm\""),
        "{text}"
    );
}

#[test]
fn text_behind_a_dictionary_and_truth_values_are_no_numbers() {
    let mut builder = StringDictionaryBuilder::<Int32Type>::new();
    builder.append_value("warm");
    let error = read(builder.finish()).expect_err("text");
    assert!(error.to_string().contains("\"warm\""), "{error}");
    let error = read(BooleanArray::from(vec![true])).expect_err("truth values");
    assert!(
        error.to_string().contains("not a column of numbers"),
        "{error}"
    );
}

/// A Parquet file of some length for damage.
fn whole() -> (tempfile::TempDir, Vec<u8>) {
    let values: Vec<i32> = (0..5000).map(|i| (i * i) % 1009).collect();
    let folder = folder_with(
        Arc::new(Int32Array::from(values)),
        WriterProperties::default(),
    );
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
