//! `rlg import` of files of others: they become recordings with the right units, or are refused in one sentence.
//!
//! The files are made here. If `RLG_RECORDINGS` names a folder with the real ones, those are read, too.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use rlg::model::{Model, MotionSource};
use rlg::recording::{Clock, Quantity, Recording};
use tempfile::TempDir;

const ARCSEC_RAD: f64 = std::f64::consts::PI / 180.0 / 3600.0;

struct Bench(TempDir);

impl Bench {
    fn new(content: &[u8]) -> Self {
        let bench = Self(tempfile::tempdir().expect("a temporary folder"));
        fs::write(bench.file(), content).expect("a file");
        bench
    }
    fn file(&self) -> PathBuf {
        self.0.path().join("foreign.bin")
    }
    fn out(&self) -> PathBuf {
        self.0.path().join("recording")
    }
    fn import(&self, file: &Path, more: &[&str]) -> Output {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command.args(["import", "--json", "--out"]).arg(self.out());
        command.args(more).arg(file);
        command.output().expect("the command runs")
    }
    fn imported(&self, more: &[&str]) -> (serde_json::Value, Recording) {
        let output = self.import(&self.file(), more);
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{words}");
        let result = serde_json::from_slice(&output.stdout).expect("JSON");
        (result, Recording::read(self.out()).expect("a recording"))
    }
    fn is_refused(&self, more: &[&str], parts: &[&str]) {
        let output = self.import(&self.file(), more);
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(
            words.starts_with("error: ") && words.lines().count() == 1,
            "{words}"
        );
        for part in parts {
            assert!(words.contains(part), "no {part:?} in: {words}");
        }
        assert!(!self.out().exists(), "something was left behind");
    }
}

const F64X7: [&str; 2] = ["--format", "f64x7"];
const PSINS: [&str; 2] = ["--format", "psins-imu"];

/// `rows` records at 64.05 Hz; gyros 0.25 °/s times 1, 2, 3 and the row's parity.
fn records(rows: u32) -> Vec<[f64; 7]> {
    (0..rows)
        .map(|row| {
            let odd = f64::from(row % 2);
            let t = 100.0 + f64::from(row + 1) / 64.05;
            [t, 0.25 * odd, 0.5 * odd, 0.75 * odd, 9.75, 0.125, -0.5]
        })
        .collect()
}

fn bytes(records: &[[f64; 7]]) -> Vec<u8> {
    let values = records.iter().flatten();
    values.flat_map(|value| value.to_le_bytes()).collect()
}

const HEADER: &str =
    "% words\n\n0 0 -90.6 0 0 0\n34.2 108.9 380 5 10 9.780327\n0.1 0.1 0.2 125 125 250\n";

#[test]
fn records_of_seven_become_rates_and_forces_on_the_nominal_clock_with_their_stamps_beside() {
    let bench = Bench::new(&bytes(&records(640)));
    let (result, recording) = bench.imported(&F64X7);
    let table = &recording.tables[0];
    let Clock::Uniform { rate_hz, start_s } = table.clock else {
        panic!("a uniform clock");
    };
    assert_eq!((table.rows, rate_hz), (640, 64.0));
    assert!((start_s + 1.0 / 64.0 - (100.0 + 1.0 / 64.05)).abs() < 1e-9);
    let stamped = result["stamped_rate_hz"].as_f64().expect("a rate");
    assert!((stamped - 64.05).abs() < 1e-6);
    let value = |quantity: Quantity, axis: &str, row: usize| {
        let channel = table.channel(&quantity, axis).expect("the channel");
        channel.values[row]
    };
    assert_eq!(
        value(Quantity::GyroRate, "z", 1),
        0.75 * (std::f64::consts::PI / 180.0)
    );
    assert_eq!(value(Quantity::SpecificForce, "x", 0), 9.75);
    let stamps = table
        .channels
        .iter()
        .find(|channel| channel.quantity == Quantity::Other("time_stamp".to_owned()))
        .expect("the stamps");
    assert_eq!(stamps.values[639], 100.0 + 640.0 / 64.05);
    let model = Model::read(bench.out().join("model.toml")).expect("a model, site or not");
    assert_eq!(model.motion, MotionSource::Static);
}

#[test]
fn with_a_site_comes_a_model_of_a_unit_at_rest() {
    let bench = Bench::new(&bytes(&records(64)));
    let site = [
        "--format",
        "f64x7",
        "--latitude-deg",
        "-51",
        "--gravity",
        "9.81",
    ];
    let (_, recording) = bench.imported(&site);
    let site = recording.site.expect("a site");
    assert_eq!(
        (site.latitude_rad, site.gravity_m_s2),
        ((-51.0_f64).to_radians(), 9.81)
    );
    let model = Model::read(bench.out().join("model.toml")).expect("a model");
    assert_eq!(model.motion, MotionSource::Static);
    assert!(model.gyro.angle_random_walk_rad_sqrt_s.is_none());
    // The gyros are written in steps of 0.25, 0.5, 0.75 degrees a second.
    let expected = [0.25, 0.5, 0.75].map(|step: f64| step.to_radians() / 64.0);
    for (found, expected) in model.gyro.pulse_weight_rad.iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-12);
    }
}

#[test]
fn psins_counts_become_increments_with_the_files_own_scales_rate_and_site() {
    let text = format!("{HEADER}3 -1 2 0 1 80\n0 0 -2 -1 0 40\r\n1 2 3 4 5 6");
    let (_, recording) = Bench::new(text.as_bytes()).imported(&PSINS);
    let table = &recording.tables[0];
    let clock = Clock::Uniform {
        rate_hz: 100.0,
        start_s: 5.0,
    };
    assert_eq!((table.rows, &table.clock), (3, &clock));
    let angle = table.channel(&Quantity::GyroIncrement, "z").expect("z");
    let expected = [2.0, -2.0, 3.0].map(|count| count * 0.2 * ARCSEC_RAD);
    for (found, expected) in angle.values.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-20);
    }
    let velocity = table.channel(&Quantity::VelocityIncrement, "z").expect("z");
    // 80 counts of 250 micro-g seconds.
    assert!((velocity.values[0] - 80.0 * 250e-6 * 9.780_327).abs() < 1e-12);
    let site = recording.site.expect("the file's site");
    assert_eq!(site.latitude_rad, 34.2_f64.to_radians());
    // Normal gravity at 34.2 degrees is 9.7966, and 380 m up 3.1e-6 a metre less.
    assert!((site.gravity_m_s2 - 9.7954).abs() < 3e-4);
}

#[test]
fn a_file_that_is_no_whole_number_of_records_is_refused() {
    let mut cut = bytes(&records(3));
    cut.truncate(150);
    Bench::new(&cut).is_refused(&F64X7, &["150 bytes, 38 too many", "56 bytes"]);
    Bench::new(&[]).is_refused(&F64X7, &["no whole number of records", "0 bytes"]);
    Bench::new(&bytes(&records(1))).is_refused(&F64X7, &["too few records"]);
}

#[test]
fn a_value_that_is_none_and_a_time_that_goes_back_are_refused_with_their_row() {
    let mut broken = records(40);
    broken[17][5] = f64::NAN;
    Bench::new(&bytes(&broken)).is_refused(&F64X7, &["foreign.bin, ay, row 17", "NaN"]);
    let mut back = records(40);
    back[8][0] = back[7][0];
    Bench::new(&bytes(&back)).is_refused(&F64X7, &["t, row 8", "a time after"]);
}

#[test]
fn text_that_is_no_number_is_refused_with_its_line_and_column() {
    let text = format!("{HEADER}0 0 0 0 0 80\n0 0 zero 0 0 80\n");
    Bench::new(text.as_bytes()).is_refused(&PSINS, &["line 7, column 3", "`zero`"]);
    let text = format!("{HEADER}0 0 0 0 0\n");
    Bench::new(text.as_bytes()).is_refused(&PSINS, &["line 6", "found 5", "expected 6"]);
    Bench::new(HEADER.as_bytes()).is_refused(&PSINS, &["too few lines of counts"]);
    Bench::new(&[b'1'; 5000]).is_refused(&PSINS, &["line 1", "too long"]);
    let wrong = HEADER.replace(" 10 9.78", " 0 9.78");
    Bench::new(wrong.as_bytes()).is_refused(&PSINS, &["no sampling interval", "positive"]);
}

#[test]
fn a_file_with_another_sum_than_it_should_have_leaves_nothing() {
    let bench = Bench::new(&bytes(&records(64)));
    let (result, _) = bench.imported(&F64X7);
    let sum = result["sha256"].as_str().expect("a sum").to_owned();
    let list = bench.0.path().join("SHA256SUMS");
    fs::write(&list, format!("{sum}  foreign.bin\n")).expect("a list");
    let list = list.to_string_lossy().into_owned();
    bench.imported(&["--format", "f64x7", "--sha256", &list]);
    bench.imported(&["--format", "f64x7", "--sha256", &sum]);
    let other = Bench::new(&bytes(&records(65)));
    let wrong = ["--format", "f64x7", "--sha256", &sum];
    other.is_refused(&wrong, &["is not the file it should be", &sum]);
    let unlisted = Bench::new(&bytes(&records(64)));
    fs::write(unlisted.0.path().join("SUMS"), "").expect("a list");
    let list = unlisted
        .0
        .path()
        .join("SUMS")
        .to_string_lossy()
        .into_owned();
    unlisted.is_refused(&["--format", "f64x7", "--sha256", &list], &["has no sum"]);
}

#[test]
fn an_impossible_site_is_refused() {
    let bench = Bench::new(&bytes(&records(64)));
    let with = |latitude, gravity| {
        [
            "--format",
            "f64x7",
            "--latitude-deg",
            latitude,
            "--gravity",
            gravity,
        ]
    };
    bench.is_refused(&with("91", "9.8"), &["--latitude-deg", "found 91"]);
    bench.is_refused(&with("45", "980"), &["--gravity", "found 980"]);
}

#[test]
fn the_same_file_gives_the_same_bytes() {
    let bench = Bench::new(&bytes(&records(70_000)));
    bench.imported(&F64X7);
    let read = || {
        ["recording.toml", "samples.parquet"]
            .map(|name| fs::read(bench.out().join(name)).expect("a file"))
    };
    let first = read();
    bench.imported(&F64X7);
    assert_eq!(read(), first);
}

#[test]
fn the_real_files_come_in_by_their_known_sums() {
    let Some(folder) = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from) else {
        eprintln!("RLG_RECORDINGS names no folder: the real files were not read");
        return;
    };
    for (name, format, rows) in [
        ("x_LN100_up.ins", F64X7, 19_217),
        ("lasergyro.imu", PSINS, 184_718),
    ] {
        let bench = Bench::new(&[]);
        let output = bench.import(&folder.join(name), &format);
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{words}");
        let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(result["rows"], rows);
        assert!(result["source"].is_string(), "the sum is a known one");
        assert!(Model::read(bench.out().join("model.toml")).is_ok());
        assert!(Recording::read(bench.out()).is_ok());
    }
}
