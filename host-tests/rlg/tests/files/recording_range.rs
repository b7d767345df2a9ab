//! A stretch of a recording equals the whole recording for that time, row by row.

use std::fs;
use std::path::Path;

use rlg::recording::{Channel, Clock, Quantity, Recording, Table};

fn channel(column: &str, quantity: Quantity, values: Vec<f64>) -> Channel {
    Channel {
        column: column.to_string(),
        quantity,
        axis: Some("x".to_string()),
        scale: 1.0,
        offset: 0.0,
        values,
    }
}

fn table(file: &str, rate_hz: f64, start_s: f64, channels: Vec<Channel>) -> Table {
    Table {
        file: file.to_string(),
        clock: Clock::Uniform { rate_hz, start_s },
        rows: channels[0].values.len(),
        channels,
    }
}

/// 3 s at 1 kHz, with temperature at 10 Hz in a table of its own.
fn recording(folder: &Path, suffix: &str) -> Recording {
    let ramp = |rows: usize, step: f64| (0..rows).map(|row| row as f64 * step).collect();
    let rows = table(
        &format!("rows.{suffix}"),
        1000.0,
        5.0,
        vec![
            channel("gx", Quantity::GyroIncrement, ramp(3000, 1e-6)),
            channel("rx", Quantity::ReferenceIncrement, ramp(3000, 1e-6)),
        ],
    );
    let warm: Vec<f64> = (0..30).map(|row| 293.0 + f64::from(row)).collect();
    let slow = table(
        &format!("slow.{suffix}"),
        10.0,
        5.0,
        vec![channel("t", Quantity::Temperature, warm)],
    );
    let recording = Recording {
        name: "ramp".to_string(),
        folder: folder.to_path_buf(),
        site: None,
        tables: vec![rows, slow],
        segments: Vec::new(),
    };
    recording.write().expect("written");
    recording
}

#[test]
fn a_stretch_has_the_rows_and_the_clock_of_the_whole() {
    for suffix in ["parquet", "csv"] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        recording(folder.path(), suffix);
        let whole = Recording::read(folder.path()).expect("read");
        let part = Recording::read_between(folder.path(), 6.0, 6.5).expect("read");
        assert_eq!(part.tables[0].rows, 500);
        for (table, of) in part.tables.iter().zip(&whole.tables) {
            let rate_hz = table.clock.period_s(table.rows).recip();
            let first = ((table.start_s() - of.start_s()) * rate_hz).round() as usize;
            for (values, all) in table.channels.iter().zip(&of.channels) {
                assert_eq!(values.values, all.values[first..first + table.rows]);
            }
        }
        // A slower table extends over both ends, so that interpolation between its rows does, too.
        let slow = &part.tables[1];
        assert!(slow.start_s() <= 5.9 && slow.end_s() >= 6.6, "{suffix}");
    }
}

#[test]
fn the_extent_is_told_without_reading_rows() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    recording(folder.path(), "parquet");
    let extent = Recording::extent(folder.path()).expect("read");
    let extent = extent.expect("uniform rows in Parquet");
    assert_eq!(
        (extent.rows, extent.rate_hz, extent.start_s),
        (3000, 1000.0, 5.0)
    );
    // Text must be read to be counted.
    let text = tempfile::tempdir().expect("a temporary folder");
    recording(text.path(), "csv");
    assert!(Recording::extent(text.path()).expect("read").is_none());
}

#[test]
fn a_damaged_table_is_refused_when_only_its_length_is_asked_for() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    recording(folder.path(), "parquet");
    let file = folder.path().join("rows.parquet");
    let bytes = fs::read(&file).expect("a file");
    fs::write(&file, &bytes[..bytes.len() / 2]).expect("cut");
    let error = Recording::extent(folder.path()).expect_err("half a file");
    assert!(error.to_string().contains("rows.parquet"), "{error}");
}
