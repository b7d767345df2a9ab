//! Written values are read back: every value bit for bit, whatever its scale, and the same bytes twice.

use std::path::Path;

use proptest::prelude::*;
use rlg::recording::{Channel, Clock, Quantity, Recording, Segment, Site, Table};

fn channel(column: &str, quantity: Quantity, axis: &str, scale: f64, values: Vec<f64>) -> Channel {
    Channel {
        column: column.to_owned(),
        quantity,
        axis: Some(axis.to_owned()),
        scale,
        offset: 0.0,
        values,
    }
}

/// Makes a recording with counted, scaled and free floating-point channels, and gaps.
fn recording(
    file: &str,
    counts: Vec<i32>,
    codes: Vec<i32>,
    rates: Vec<f64>,
    lsb: f64,
) -> Recording {
    let rows = counts.len();
    let mut pickoff: Vec<f64> = codes
        .iter()
        .map(|&code| f64::from(code) * lsb + 0.0)
        .collect();
    if rows > 2 {
        pickoff[1] = f64::NAN;
    }
    Recording {
        name: "a \"quoted\" name".to_owned(),
        folder: "unused".into(),
        site: Some(Site {
            latitude_rad: 0.6,
            gravity_m_s2: 9.80665,
        }),
        tables: vec![Table {
            file: file.to_owned(),
            clock: Clock::Uniform {
                rate_hz: 4000.0,
                start_s: 0.002,
            },
            rows,
            channels: vec![
                channel(
                    "g",
                    Quantity::GyroCount,
                    "x",
                    1.0,
                    counts.into_iter().map(f64::from).collect(),
                ),
                channel("d", Quantity::DitherAngle, "x", lsb, pickoff),
                channel("w", Quantity::Other("wind".to_owned()), "x", 1.0, rates),
            ],
        }],
        segments: vec![Segment {
            name: "still".to_owned(),
            kind: "still".to_owned(),
            start_s: 0.0,
            end_s: 1.0,
        }],
    }
}

fn bits(recording: &Recording) -> Vec<u64> {
    let channels = recording.tables.iter().flat_map(|table| &table.channels);
    channels
        .flat_map(|channel| channel.values.iter())
        .map(|value| {
            if value.is_nan() {
                f64::NAN.to_bits()
            } else {
                value.to_bits()
            }
        })
        .collect()
}

fn written_and_read(recording: &Recording) -> Recording {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("out");
    recording
        .write_to(&path)
        .unwrap_or_else(|error| panic!("{error}"));
    Recording::read(&path).unwrap_or_else(|error| panic!("{error}"))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_value_comes_back_bit_for_bit(
        rows in prop::collection::vec(
            (-1000..1000_i32, -100_000..100_000_i32, -1e3..1e3_f64), 1..200),
        lsb in 1e-9..1e-8_f64,
        csv in any::<bool>(),
    ) {
        let counts = rows.iter().map(|row| row.0).collect();
        let codes = rows.iter().map(|row| row.1).collect();
        let rates = rows.iter().map(|row| row.2).collect();
        let original = recording(if csv { "t.csv" } else { "t.parquet" }, counts, codes, rates, lsb);
        let back = written_and_read(&original);
        prop_assert_eq!(bits(&back), bits(&original));
        prop_assert_eq!(&back.name, &original.name);
        prop_assert_eq!(&back.segments, &original.segments);
        prop_assert_eq!(back.site, original.site);
        prop_assert_eq!(&back.tables[0].clock, &original.tables[0].clock);
        prop_assert_eq!(back.tables[0].channels[1].scale.to_bits(), lsb.to_bits());
    }
}

#[test]
fn the_same_recording_gives_the_same_bytes() {
    let original = recording(
        "t.parquet",
        vec![1, -2, 3],
        vec![4, 5, 6],
        vec![0.1, 0.2, 0.3],
        1e-9,
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["a", "b"] {
        original
            .write_to(folder.path().join(name))
            .unwrap_or_else(|error| panic!("{error}"));
    }
    for file in ["recording.toml", "t.parquet"] {
        let read =
            |name: &str| std::fs::read(folder.path().join(name).join(file)).expect("written");
        assert_eq!(read("a"), read("b"), "{file}");
    }
}

#[test]
fn a_channel_that_its_scale_does_not_explain_keeps_its_values() {
    // Values that are no multiple of the scale: stored unchanged, with scale 1.
    let mut original = recording("t.parquet", vec![1, 2], vec![0, 0], vec![0.0, 1.0], 1e-9);
    original.tables[0].channels[2].scale = 0.3;
    original.tables[0].channels[2].values = vec![0.1, std::f64::consts::PI];
    let back = written_and_read(&original);
    assert_eq!(bits(&back), bits(&original));
    assert_eq!(back.tables[0].channels[2].scale, 1.0);
}

#[test]
fn a_stamped_table_comes_back_with_its_stamps() {
    let mut original = recording(
        "t.parquet",
        vec![1, 2, 3],
        vec![1, 2, 3],
        vec![1.0, 2.0, 3.0],
        1e-9,
    );
    original.tables[0].clock = Clock::Stamped {
        column: "t".to_owned(),
        stamps_s: vec![0.0, 0.1, 0.35],
    };
    assert_eq!(
        written_and_read(&original).tables[0].clock,
        original.tables[0].clock
    );
}

#[test]
fn rows_that_are_missing_between_even_stamps_are_not_measured() {
    let counts = vec![1, 2, 3, 4];
    let mut original = recording("t.parquet", counts.clone(), counts, vec![1.0; 4], 1e-9);
    original.tables[0].clock = Clock::Stamped {
        column: "t".to_owned(),
        stamps_s: vec![5.0, 5.01, 5.02, 5.05],
    };
    let back = written_and_read(&original);
    let expected = Clock::Uniform {
        rate_hz: 100.0,
        start_s: 5.0,
    };
    assert_eq!(back.tables[0].clock, expected);
    assert_eq!(back.tables[0].rows, 6);
    let values = &back.tables[0].channels[0].values;
    assert!(values[3].is_nan() && values[4].is_nan(), "{values:?}");
    assert_eq!([values[2], values[5]], [3.0, 4.0]);
}

#[test]
fn a_folder_with_something_else_in_it_is_not_overwritten() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("thesis.txt"), "years of work").expect("a file");
    let original = recording("t.parquet", vec![1], vec![1], vec![1.0], 1e-9);
    let error = original.write_to(folder.path()).expect_err("must refuse");
    assert!(
        error
            .to_string()
            .contains("something other than a recording"),
        "{error}"
    );
    assert_eq!(files(folder.path()), ["thesis.txt"]);
}

#[test]
fn a_recording_is_replaced_and_nothing_temporary_is_left() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("r");
    for count in [1, 2] {
        let original = recording("t.parquet", vec![count], vec![1], vec![1.0], 1e-9);
        original
            .write_to(&path)
            .unwrap_or_else(|error| panic!("{error}"));
        let back = Recording::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(back.tables[0].channels[0].values, [f64::from(count)]);
    }
    assert_eq!(files(&path), ["recording.toml", "t.parquet"]);
    assert_eq!(files(folder.path()), ["r"]);
}

fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let name = |entry: std::io::Result<std::fs::DirEntry>| {
        entry
            .expect("an entry")
            .file_name()
            .to_string_lossy()
            .into_owned()
    };
    let mut names: Vec<_> = entries.map(name).collect();
    names.sort();
    names
}
