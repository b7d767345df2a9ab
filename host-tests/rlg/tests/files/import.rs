//! `rlg import --format frames`: a captured stream becomes a recording, or is refused in one sentence.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use rlg::recording::{Clock, Quantity, Recording};
use tempfile::TempDir;
use trueaxis::health::HEALTH_ITEMS;
use trueaxis::sample_source::Reading;
use trueaxis::{
    AccelerometerParameters, BootReport, CrossAxis, F32, OUTPUT_RAD_PER_CODE, Parameters,
    Processor, Sample, Status, TELEMETRY_BYTES, TelemetryFrame, Timing,
};

/// Samples in an output period: 200 frames a second, the unit's default.
const PERIOD: u32 = 20;

/// Makes frames of a unit at 200 Hz that rotates about z with 3 pulses of 1e-6 rad a sample; the samples of frame `missing`
/// are lost.
fn frames(count: u32, parameters: &Parameters, missing: Option<u32>) -> Vec<TelemetryFrame> {
    let mut processor = Processor::<F32>::new(parameters, BootReport::default()).expect("in range");
    let mut periods = 0;
    (0..count * PERIOD)
        .filter_map(|period| {
            periods += 1;
            let came = missing.is_none_or(|frame| period / PERIOD != frame);
            let reading = if came {
                let periods = std::mem::take(&mut periods);
                let sample = Sample {
                    pulse_counts: [0, 0, 3 * periods],
                    ..Sample::default()
                };
                Reading::new(Some(sample), periods as u32, None)
            } else {
                Reading::default()
            };
            processor.period(reading, Timing::default())
        })
        .collect()
}

fn parameters() -> Parameters {
    Parameters::default().with(|p| {
        p.pulse_weight_rad = [1e-6; 3];
        p.pickoff_gain = [0.0; 3];
    })
}

fn bytes(frames: &[TelemetryFrame]) -> Vec<u8> {
    frames.iter().flat_map(TelemetryFrame::to_bytes).collect()
}

struct Bench(TempDir);

impl Bench {
    fn new(stream: &[u8]) -> Self {
        let bench = Self(tempfile::tempdir().expect("a temporary folder"));
        fs::write(bench.file(), stream).expect("a file");
        bench
    }
    fn file(&self) -> PathBuf {
        self.0.path().join("capture.bin")
    }
    fn out(&self) -> PathBuf {
        self.0.path().join("recording")
    }
    fn import(&self, file: &Path, more: &[&str]) -> Output {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command.args(["import", "--format", "frames", "--json", "--out"]);
        command.arg(self.out()).args(more).arg(file);
        command.output().expect("the command runs")
    }
    /// Imports and returns the result, and the recording as read by any reader of recordings.
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
        assert!(output.stdout.is_empty());
        assert!(!self.out().exists(), "something was left behind");
    }
}

fn column<'a>(recording: &'a Recording, name: &str) -> &'a [f64] {
    let channels = &recording.tables[0].channels;
    let channel = channels.iter().find(|channel| channel.column == name);
    &channel.expect("the column").values
}

#[test]
fn a_clean_stream_comes_back_code_for_code_at_the_units_own_rate() {
    let sent = frames(100, &parameters(), None);
    let (result, recording) = Bench::new(&bytes(&sent)).imported(&[]);
    let table = &recording.tables[0];
    let clock = Clock::Uniform {
        rate_hz: 200.0,
        start_s: 0.0,
    };
    assert_eq!((table.rows, &table.clock), (100, &clock));
    for (axis, name) in ["x", "y", "z"].iter().enumerate() {
        let seen = table
            .channel(&Quantity::GyroIncrement, name)
            .expect("an axis");
        let expected: Vec<f64> = sent
            .iter()
            .map(|frame| f64::from(frame.output.dtheta_codes[axis]) * OUTPUT_RAD_PER_CODE)
            .collect();
        assert_eq!(seen.values, expected);
    }
    let status = column(&recording, "status");
    assert_eq!(status[0], f64::from(Status::PRIMED.bits()));
    assert!(status[1..].iter().all(|bits| *bits == 0.0));
    assert_eq!(result["rows_without_frame"], 0);
    assert_eq!(result["status"]["primed"], 1);
    assert_eq!(
        result["health"].as_object().expect("items").len(),
        HEALTH_ITEMS.len()
    );
}

#[test]
fn velocity_is_there_only_for_a_unit_with_accelerometers() {
    let without = Bench::new(&bytes(&frames(40, &parameters(), None)));
    let velocity = |recording: &Recording| {
        recording
            .channel(&Quantity::VelocityIncrement, "x")
            .is_some()
    };
    assert!(!velocity(&without.imported(&[]).1));
    let accelerometers = AccelerometerParameters {
        weight_m_s: [1e-6; 3],
        bias_m_s2: [0.0; 3],
        scale_error: [0.0; 3],
        misalignment_rad: CrossAxis::default(),
        lever_arm_m: [[0.0; 3]; 3],
    };
    let parameters = parameters().with(|p| p.accelerometers = Some(accelerometers));
    let with = Bench::new(&bytes(&frames(40, &parameters, None)));
    assert!(velocity(&with.imported(&[]).1));
}

#[test]
fn what_is_lost_on_the_way_leaves_rows_that_were_not_measured() {
    let sent = frames(100, &parameters(), None);
    let mut stream = vec![0x17, 0xEB, 0x90, 0x55];
    stream.extend(bytes(&sent[..10]));
    // Frames 10 to 12 are lost, 20 is damaged, 30 is truncated, the last one unfinished.
    stream.extend(bytes(&sent[13..20]));
    let mut damaged = sent[20].to_bytes();
    damaged[17] ^= 4;
    stream.extend(damaged);
    stream.extend(bytes(&sent[21..30]));
    stream.extend(&sent[30].to_bytes()[..21]);
    stream.extend(bytes(&sent[31..99]));
    stream.extend(&sent[99].to_bytes()[..30]);
    let (result, recording) = Bench::new(&stream).imported(&[]);
    assert_eq!(recording.tables[0].rows, 99);
    let angle = column(&recording, "dtheta_z");
    let lost: Vec<_> = (0..99).filter(|row| angle[*row].is_nan()).collect();
    assert_eq!(lost, [10, 11, 12, 20, 30]);
    assert_eq!(
        angle[98],
        f64::from(sent[98].output.dtheta_codes[2]) * OUTPUT_RAD_PER_CODE
    );
    assert_eq!(result["rows_without_frame"], 5);
    assert_eq!(result["bad_checksums"], 2, "the damaged and the short one");
    assert_eq!(result["bytes_skipped"], 4 + TELEMETRY_BYTES + 21);
    assert_eq!(result["bytes_at_end"], 30);
}

#[test]
fn a_gap_of_the_units_own_keeps_its_angle_and_names_itself() {
    let (result, recording) = Bench::new(&bytes(&frames(40, &parameters(), Some(7)))).imported(&[]);
    assert_eq!(recording.tables[0].rows, 40);
    let angle = column(&recording, "dtheta_z");
    assert_eq!(angle[7], 0.0, "nothing was shown in the row of the gap");
    // The first sample adds no rotation; 3 pulses of 1e-6 rad in every other; frames end within a code.
    let whole = 3e-6 * f64::from(40 * PERIOD - 1);
    assert!((angle.iter().sum::<f64>() - whole).abs() < 2.0 * OUTPUT_RAD_PER_CODE);
    assert_eq!(result["status"]["gap"], 2, "the gap's frame and the next");
}

#[test]
fn a_stream_too_short_to_tell_its_rate_needs_it_on_the_command_line() {
    // The first frame holds the sample rate, the second the samples of an output period.
    let short = Bench::new(&bytes(&frames(1, &parameters(), None)));
    short.is_refused(
        &[],
        &["capture.bin", "how many frames a second", "--rate-hz"],
    );
    let (result, recording) = short.imported(&["--rate-hz", "200"]);
    assert_eq!(result["rate_hz"], 200.0);
    assert_eq!(recording.tables[0].rows, 1);
}

#[test]
fn a_rate_that_is_not_positive_is_refused() {
    let bench = Bench::new(&bytes(&frames(40, &parameters(), None)));
    for rate in ["0", "-200", "nan", "inf"] {
        let argument = format!("--rate-hz={rate}");
        bench.is_refused(&[&argument], &["--rate-hz", "positive number"]);
    }
}

#[test]
fn streams_without_a_frame_are_refused() {
    Bench::new(&[]).is_refused(&[], &["capture.bin", "is empty"]);
    Bench::new(b"no frame in here")
        .is_refused(&[], &["holds no telemetry frame", "16 bytes", "version 1"]);
    let cut = &bytes(&frames(1, &parameters(), None))[1..];
    Bench::new(cut).is_refused(&[], &["holds no telemetry frame", "42 bytes"]);
    let mut damaged = bytes(&frames(1, &parameters(), None));
    damaged[20] ^= 1;
    Bench::new(&damaged).is_refused(&[], &["holds no telemetry frame", "1 damaged frames"]);
    let mut other = bytes(&frames(3, &parameters(), None));
    for header in [2, 45, 88] {
        other[header] = 9;
    }
    Bench::new(&other).is_refused(
        &[],
        &["3 headers of another version", "frames of version 1"],
    );
}

#[test]
fn two_runs_in_one_stream_are_refused_with_the_place_to_cut() {
    let one = bytes(&frames(40, &parameters(), None));
    let place = format!("frame 0 after frame 39 at byte {}", one.len());
    Bench::new(&[one.clone(), one].concat()).is_refused(&[], &["more than one run", &place]);
}

#[test]
fn a_gap_beyond_any_recording_is_refused() {
    let mut sent = frames(40, &parameters(), None);
    sent[39].output.sequence = 100_000_000;
    Bench::new(&bytes(&sent)).is_refused(&[], &["has a gap", "frame 100000000 after frame 38"]);
}

#[test]
fn a_file_that_is_not_there_and_a_folder_of_something_else_are_refused() {
    let bench = Bench::new(&bytes(&frames(40, &parameters(), None)));
    let output = bench.import(&bench.0.path().join("nowhere.bin"), &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("nowhere.bin: does not exist"));
    fs::create_dir(bench.out()).expect("a folder");
    fs::write(bench.out().join("notes.txt"), "mine").expect("a file");
    let output = bench.import(&bench.file(), &[]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(fs::read_dir(bench.out()).expect("a folder").count(), 1);
}

#[test]
fn the_same_stream_gives_the_same_bytes() {
    let bench = Bench::new(&bytes(&frames(100, &parameters(), None)));
    bench.imported(&[]);
    let read = || {
        ["recording.toml", "frames.parquet"]
            .map(|name| fs::read(bench.out().join(name)).expect("a file"))
    };
    let first = read();
    bench.imported(&[]);
    assert_eq!(read(), first);
}
