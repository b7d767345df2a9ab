//! `rlg export`: the file equals the recording, and `rlg import` reads it back value for value.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use rlg::recording::{Channel, Clock, Quantity, Recording, Table};
use tempfile::TempDir;

const ROWS: usize = 40;

/// Makes numbers that need every digit of f64; row 7 is missing.
fn values(seed: f64, rows: usize) -> Vec<f64> {
    let value = |row: usize| match row {
        7 => f64::NAN,
        row => (seed + row as f64).sin() / 30.0,
    };
    (0..rows).map(value).collect()
}

fn channel(column: &str, quantity: Quantity, axis: Option<&str>, values: Vec<f64>) -> Channel {
    Channel {
        column: column.to_owned(),
        quantity,
        axis: axis.map(str::to_owned),
        scale: 1.0,
        offset: 0.0,
        values,
    }
}

/// Makes gyros, forces, fields and a thermometer on even rows; attitudes on uneven ones.
fn recording(folder: PathBuf) -> Recording {
    let mut channels = Vec::new();
    let mut seed = 0.0;
    let triads = [
        Quantity::GyroRate,
        Quantity::SpecificForce,
        Quantity::MagneticField,
        Quantity::ReferenceIncrement,
    ];
    for quantity in triads {
        for axis in ["x", "y", "z"] {
            seed += 100.0;
            let column = format!("{}{axis}", quantity.name());
            let values = values(seed, ROWS);
            channels.push(channel(&column, quantity.clone(), Some(axis), values));
        }
    }
    // No plausible unit is at 0 K.
    let warm = values(1.0, ROWS)
        .iter()
        .map(|value| 300.0 + value)
        .collect();
    channels.push(channel("warm", Quantity::Temperature, None, warm));
    let own = channel(
        "humidity",
        Quantity::Other("humidity".to_owned()),
        None,
        values(9.0, ROWS),
    );
    channels.push(own);
    let stamps_s: Vec<f64> = (0..25)
        .map(|row| 0.013 * row as f64 + 3e-3 * (row as f64).sin())
        .collect();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let attitude = ["w", "x", "y", "z"].map(|axis| {
        let value = if matches!(axis, "w" | "x") { half } else { 0.0 };
        channel(
            axis,
            Quantity::ReferenceAttitude,
            Some(axis),
            vec![value; 25],
        )
    });
    let even = Clock::Uniform {
        rate_hz: 2000.0 / 7.0,
        start_s: 0.05,
    };
    let stamped = Clock::Stamped {
        column: "t".to_owned(),
        stamps_s,
    };
    let table = |file: &str, clock, rows, channels| Table {
        file: file.to_owned(),
        clock,
        rows,
        channels,
    };
    Recording {
        name: "bench".to_owned(),
        folder,
        site: None,
        tables: vec![
            table("samples.parquet", even, ROWS, channels),
            table("camera-1.parquet", stamped, 25, attitude.into()),
        ],
        segments: Vec::new(),
    }
}

fn rlg(arguments: &[&str], paths: &[&Path]) -> Output {
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    command
        .args(arguments)
        .args(paths)
        .output()
        .expect("it runs")
}

fn done(output: &Output) {
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{words}");
}

/// Exports a recording in a folder with `rlg export`, next to it.
fn exported(format: &str) -> (TempDir, Recording, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let recording = recording(folder.path().join("recording"));
    recording.write().expect("a recording");
    let file = folder.path().join(format!("log.{format}"));
    let output = rlg(
        &["export", "-q"],
        &[&recording.folder, Path::new("--out"), &file],
    );
    done(&output);
    (folder, recording, file)
}

/// Checks that `found` has every channel of `expected`, bit for bit, at the same times.
fn is_same(found: &Recording, expected: &Recording) {
    for table in &expected.tables {
        for channel in &table.channels {
            if matches!(channel.quantity, Quantity::Other(_)) {
                continue;
            }
            let name = format!("{} {:?}", channel.quantity.name(), channel.axis);
            let mut tables = found.tables.iter();
            let (there, other) = tables
                .find_map(|table| {
                    let mut channels = table.channels.iter();
                    let is_it = |one: &&Channel| {
                        (&one.quantity, &one.axis) == (&channel.quantity, &channel.axis)
                    };
                    Some((table, channels.find(is_it)?))
                })
                .unwrap_or_else(|| panic!("no {name}"));
            let bits = |values: &[f64]| {
                values
                    .iter()
                    .map(|value| value.to_bits())
                    .collect::<Vec<_>>()
            };
            assert_eq!(bits(&other.values), bits(&channel.values), "{name}");
            match (&there.clock, &table.clock) {
                (
                    Clock::Uniform { rate_hz, start_s },
                    Clock::Uniform {
                        rate_hz: rate,
                        start_s: start,
                    },
                ) => {
                    assert!((rate_hz / rate - 1.0).abs() < 1e-12, "{rate_hz} {rate}");
                    assert!((start_s - start).abs() < 1e-9, "{start_s} {start}");
                }
                (
                    Clock::Stamped { stamps_s, .. },
                    Clock::Stamped {
                        stamps_s: stamps, ..
                    },
                ) => {
                    assert_eq!(bits(stamps_s), bits(stamps));
                }
                other => panic!("{other:?}"),
            }
        }
    }
}

#[test]
fn csv_matlab_and_parquet_come_back_bit_for_bit() {
    for (format, others) in [("csv", 1), ("mat", 0), ("parquet", 1)] {
        let (folder, expected, file) = exported(format);
        let mut files = vec![file];
        if others > 0 {
            files.push(folder.path().join(format!("log-camera_1.{format}")));
        }
        let back = folder.path().join("back");
        let mut paths: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
        paths.extend([Path::new("--out"), &back]);
        done(&rlg(&["import", "-q", "--anyway"], &paths));
        is_same(&Recording::read(&back).expect("a recording"), &expected);
        let made = fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!(made, 3 + others, "files beside the two recordings");
    }
}

#[test]
fn mcap_holds_a_topic_a_table_and_a_message_a_row() {
    let (_folder, recording, file) = exported("mcap");
    let bytes = fs::read(file).expect("a file");
    let messages = mcap::MessageStream::new(&bytes).expect("an MCAP file");
    let messages: Vec<_> = messages
        .map(|message| message.expect("a message"))
        .collect();
    assert_eq!(messages.len(), ROWS + 25);
    let mut row_of = std::collections::BTreeMap::new();
    for message in &messages {
        let topic = message.channel.topic.clone();
        let table = match topic.as_str() {
            "/samples" => &recording.tables[0],
            "/camera_1" => &recording.tables[1],
            other => panic!("{other}"),
        };
        let row: &mut usize = row_of.entry(topic).or_default();
        let object: serde_json::Value = serde_json::from_slice(&message.data).expect("JSON");
        let (name, channel) = match table.channels[0].quantity {
            Quantity::GyroRate => ("gyro_x_rad_s", &table.channels[0]),
            _ => ("ref_quat_w", &table.channels[0]),
        };
        let value = channel.values[*row];
        assert_eq!(object[name].as_f64(), (!value.is_nan()).then_some(value));
        let time_s = object["t_s"].as_f64().expect("a time");
        assert_eq!(message.log_time, (time_s * 1e9).round() as u64);
        *row += 1;
    }
    let schema = messages[0].channel.schema.as_ref().expect("a schema");
    assert_eq!(schema.encoding, "jsonschema");
}

#[test]
fn what_cannot_be_written_is_refused_and_nothing_is_left() {
    let (folder, recording, file) = exported("csv");
    fs::remove_file(&file).expect("the file");
    let refused = |out: &Path, parts: &[&str]| {
        let before = fs::read_dir(folder.path()).expect("a folder").count();
        let output = rlg(&["export"], &[&recording.folder, Path::new("--out"), out]);
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words}");
        for part in parts {
            assert!(words.contains(part), "no {part:?} in {words}");
        }
        assert_eq!(
            fs::read_dir(folder.path()).expect("a folder").count(),
            before
        );
    };
    refused(
        &folder.path().join("log.xlsx"),
        &["tells no format", "csv|mat|parquet|mcap"],
    );
    refused(
        &recording.folder.join("samples.parquet"),
        &["a file of the recording"],
    );
}
