//! `rlg import` of the unit's raw stream: every code comes back, every gap is reported, and a replay gives the chain the
//! same bits.

use std::fs;
use std::path::PathBuf;
use std::process::Output;

use assert_cmd::Command;
use rlg::recording::{Quantity, Recording};
use serde_json::Value;
use tempfile::TempDir;
use trueaxis::raw_frame::{RAW_BYTES, RawFrame, RawItems};
use trueaxis::raw_period::RawCounters;
use trueaxis::sample_source::{Reading, SourceFault};
use trueaxis::{AccelerometerParameters, CrossAxis, Parameters, Sample, SlowReadings, Timing};

const PICKOFF_RAD: f64 = 9.7e-9;
const VELOCITY_M_S: [f64; 3] = [6.1e-6, 5.9e-6, 6.3e-6];

fn parameters() -> Parameters {
    Parameters::default().with(|p| {
        p.pulse_weight_rad = [2.1e-6, 1.9e-6, 2.05e-6];
        p.pickoff_weight_rad = PICKOFF_RAD;
        p.accelerometers = Some(AccelerometerParameters {
            weight_m_s: VELOCITY_M_S,
            bias_m_s2: [0.0; 3],
            scale_error: [0.0; 3],
            misalignment_rad: CrossAxis::default(),
            lever_arm_m: [[0.0; 3]; 3],
        });
    })
}

/// Makes codes that differ from row to row and from axis to axis.
fn sample(row: u32) -> Sample {
    let row = row as i32;
    Sample {
        pulse_counts: [row % 200, -(row % 77), 3],
        pickoff_codes: [1000 * (row % 41 - 20), 999 * (row % 17), -row],
        accelerometer_codes: [400 + row % 3, -(row % 5), row % 7],
    }
}

/// Makes a unit's stream, a frame a period; `lost` lists the periods without a sample.
fn stream(periods: u32, lost: &[u32], slow: SlowReadings) -> Vec<RawFrame> {
    let mut counters = RawCounters::NONE;
    let mut items = RawItems::new(&parameters(), 5);
    items.slow = slow;
    let mut since = 0;
    (1..=periods)
        .map(|number| {
            since += 1;
            let reading = if lost.contains(&number) {
                Reading::without_sample(SourceFault::Checksum)
            } else {
                let covered = std::mem::take(&mut since);
                let mut sample = sample(number);
                if number == 1 {
                    // A bank's first frame has no predecessor to be differenced with.
                    sample.pulse_counts = [0; 3];
                    sample.accelerometer_codes = [0; 3];
                }
                Reading::new(Some(sample), if number == 1 { 0 } else { covered }, None)
            };
            RawFrame {
                period: counters.period(number, &reading, Timing::default()),
                item: items.turn(),
            }
        })
        .collect()
}

fn bytes(frames: &[RawFrame]) -> Vec<u8> {
    frames.iter().flat_map(RawFrame::to_bytes).collect()
}

struct Bench(TempDir);

impl Bench {
    fn new(stream: &[u8]) -> Self {
        let bench = Self(tempfile::tempdir().expect("a temporary folder"));
        fs::write(bench.0.path().join("raw.bin"), stream).expect("a file");
        bench
    }
    fn out(&self) -> PathBuf {
        self.0.path().join("run")
    }
    /// Without `--format`: the stream is detected by its frames.
    fn import(&self, more: &[&str]) -> Output {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command.args(["import", "--json", "--out"]).arg(self.out());
        command.args(more).arg(self.0.path().join("raw.bin"));
        command.output().expect("the command runs")
    }
    fn imported(&self) -> (Value, Recording, String) {
        let output = self.import(&[]);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{words}");
        let result = serde_json::from_slice(&output.stdout).expect("JSON");
        let recording = Recording::read(self.out()).expect("a recording");
        (result, recording, words)
    }
    fn refused(&self, more: &[&str]) -> String {
        let output = self.import(more);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(
            words.starts_with("error: ") && words.lines().count() == 1,
            "{words}"
        );
        assert!(!self.out().exists(), "something was left behind");
        words
    }
}

/// Returns the rows of a quantity as codes of their scale.
fn codes(recording: &Recording, quantity: &Quantity) -> Vec<[f64; 3]> {
    let channels = ["x", "y", "z"].map(|axis| {
        let (_, channel) = recording.channel(quantity, axis).expect("a channel");
        channel
    });
    (0..channels[0].values.len())
        .map(|row| channels.map(|channel| channel.values[row] / channel.scale))
        .collect()
}

fn holds(found: [f64; 3], due: [i32; 3]) -> bool {
    (0..3).all(|axis| (found[axis] - f64::from(due[axis])).abs() < 1e-6)
}

#[test]
fn every_code_comes_back_and_the_model_has_the_pulse_weights() {
    let bench = Bench::new(&bytes(&stream(500, &[], SlowReadings::default())));
    let (result, recording, words) = bench.imported();
    assert_eq!(result["rows"], 500);
    assert_eq!(result["rate_hz"], 4000.0);
    assert_eq!(result["generation"], 5);
    assert_eq!(result["gaps"].as_array().expect("gaps").len(), 0, "{words}");
    let counts = codes(&recording, &Quantity::GyroCount);
    let pickoffs = codes(&recording, &Quantity::DitherAngle);
    let velocities = codes(&recording, &Quantity::VelocityIncrement);
    assert!(counts[0].iter().all(|count| count.is_nan()));
    for row in 0..500_u32 {
        let due = sample(row + 1);
        let at = row as usize;
        assert!(holds(pickoffs[at], due.pickoff_codes), "row {row}");
        if row > 0 {
            assert!(holds(counts[at], due.pulse_counts), "row {row}");
            assert!(holds(velocities[at], due.accelerometer_codes), "row {row}");
        }
    }
    assert_eq!(recording.tables.len(), 1, "nothing was measured slowly");
    let model = rlg::model::Model::read(bench.out().join("model.toml")).expect("a model");
    assert_eq!(model.gyro.pulse_weight_rad, [2.1e-6, 1.9e-6, 2.05e-6]);
}

#[test]
fn temperatures_and_flux_densities_have_a_table_of_their_own() {
    let slow = SlowReadings {
        temperature_k: [293.5, 294.5, 295.5],
        temperature_rate_k_s: [0.0; 3],
        magnetic_field_t: [1e-5, -2e-5, 3e-5],
    };
    let (_, recording, _) = Bench::new(&bytes(&stream(600, &[], slow))).imported();
    let (table, y) = recording.channel(&Quantity::Temperature, "y").expect("y");
    assert_eq!(table.rows, 23);
    assert!(y.values.iter().all(|value| *value == 294.5));
    let (_, z) = recording.channel(&Quantity::MagneticField, "z").expect("z");
    assert!(z.values.iter().all(|value| *value == f64::from(3e-5_f32)));
}

/// Bytes cut out and bits flipped cost the frames that they touch; each gap is reported with its row, its length and the
/// counts over it, and every other row keeps its codes.
#[test]
fn damage_is_said_and_nothing_is_invented() {
    let whole = bytes(&stream(2000, &[], SlowReadings::default()));
    let mut damaged = whole.clone();
    // Frame 1500 (row 1500): a flipped bit. Rows 700 to 703: a cut within the first and the last of them. 33 bytes before all.
    damaged[1500 * RAW_BYTES + 20] ^= 4;
    damaged.drain(700 * RAW_BYTES + 11..703 * RAW_BYTES + 5);
    damaged.splice(0..0, [0x1A; 33]);
    let bench = Bench::new(&damaged);
    let (result, recording, words) = bench.imported();
    assert_eq!(result["rows"], 2000);
    assert_eq!(result["bad_checksums"], 2);
    let gaps = result["gaps"].as_array().expect("gaps");
    let counted = |rows: std::ops::RangeInclusive<u32>| -> Vec<i32> {
        (0..3)
            .map(|axis| {
                rows.clone()
                    .map(|row| sample(row + 1).pulse_counts[axis])
                    .sum()
            })
            .collect()
    };
    for (gap, row, rows, lost) in [(&gaps[0], 700, 5, 4), (&gaps[1], 1500, 2, 1)] {
        assert_eq!(gap["row"], row);
        assert_eq!(gap["rows"], rows);
        assert_eq!(gap["frames_lost"], lost);
        let due = counted(row..=row + rows - 1);
        assert_eq!(gap["counts"], serde_json::json!(due));
        assert!(
            words.contains(&format!("{rows} rows from row {row} ")),
            "{words}"
        );
    }
    assert_eq!(gaps.len(), 2);
    let counts = codes(&recording, &Quantity::GyroCount);
    let pickoffs = codes(&recording, &Quantity::DitherAngle);
    for row in 1..2000_u32 {
        let at = row as usize;
        let in_gap = (700..705).contains(&row) || (1500..1502).contains(&row);
        let lost = (700..704).contains(&row) || row == 1500;
        assert_eq!(counts[at][0].is_nan(), in_gap, "row {row}");
        assert_eq!(pickoffs[at][0].is_nan(), lost, "row {row}");
        assert!(
            in_gap || holds(counts[at], sample(row + 1).pulse_counts),
            "row {row}"
        );
    }
}

#[test]
fn a_period_in_which_the_unit_had_no_sample_is_a_gap_of_its_own_kind() {
    let frames = stream(300, &[100, 101], SlowReadings::default());
    let (result, recording, _) = Bench::new(&bytes(&frames)).imported();
    let gaps = result["gaps"].as_array().expect("gaps");
    assert_eq!(gaps.len(), 1);
    assert_eq!(gaps[0]["row"], 99);
    assert_eq!(gaps[0]["rows"], 3);
    assert_eq!(gaps[0]["without_sample"], 2);
    assert_eq!(gaps[0]["frames_lost"], 0);
    // The sample after the gap includes the bank's counts during it.
    assert_eq!(
        gaps[0]["counts"],
        serde_json::json!(sample(102).pulse_counts)
    );
    let counts = codes(&recording, &Quantity::GyroCount);
    assert!(counts[99..102].iter().all(|row| row[0].is_nan()));
    assert!(holds(counts[102], sample(103).pulse_counts));
}

#[test]
fn what_cannot_be_one_recording_is_refused_in_one_sentence() {
    let frames = bytes(&stream(100, &[], SlowReadings::default()));
    let twice = [frames.clone(), frames.clone()].concat();
    let words = Bench::new(&twice).refused(&[]);
    assert!(
        words.contains("more than one run") && words.contains("byte 5400"),
        "{words}"
    );
    let words = Bench::new(&frames[..10 * RAW_BYTES]).refused(&[]);
    assert!(
        words.contains("10 frames") && words.contains("at least 26"),
        "{words}"
    );
    let words = Bench::new(&[0x1A; 5000]).refused(&["--format", "raw"]);
    assert!(words.contains("no frame of the raw stream"), "{words}");
    let words = Bench::new(&[0x1A; 5000]).refused(&[]);
    assert!(words.contains("tells no format"), "{words}");
}
