//! Time and memory of a diagnosis: `cargo bench --package rlg --bench diagnose`.
//!
//! `whole`: `scenarios/vibration.toml`, 60 s of three dithered gyros with pickoffs, reference and accelerometers at
//! 4 kHz, read from disk and held against the whole catalogue. On Linux the peak of the memory in use is printed
//! first; the recording is made and forgotten before it is counted.
//!
//! Printed before that: `scenarios/attitudes.toml`, gyros and attitudes at 200 Hz, by a process of its own for each length; bytes
//! a row are the growth of the largest memory by the rows more.

use divan::Bencher;
use rlg::diagnose::streams::Streams;
use rlg::diagnose::{Settings, diagnose_streams};
use rlg::model::{DeclaredModel, Model};
use rlg::recording::{Channel, Quantity, Recording};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

const SCENARIO: &str = include_str!("../../scenarios/vibration.toml");

const ATTITUDES: &str = include_str!("../../scenarios/attitudes.toml");

/// A megabyte in the kilobytes of /proc.
const MB_KB: f64 = 1000.0 / 1.024;

static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();

static MODEL: OnceLock<Model> = OnceLock::new();

fn main() {
    attitudes();
    let folder = FOLDER.get_or_init(|| tempfile::tempdir().expect("a temporary folder"));
    let scenario =
        Scenario::parse(SCENARIO, Path::new("vibration.toml")).expect("it comes with the tool");
    let made = simulate(&scenario, 1, |_| {});
    made.recording
        .write_to(folder.path().join("recording"))
        .expect("room for a recording");
    MODEL.set(made.model.clone()).expect("set once");
    drop(made);
    // Writing 5 forgets the peak so far (proc(5)); elsewhere than on Linux nothing is printed.
    if std::fs::write("/proc/self/clear_refs", "5").is_ok() {
        let before = in_use_kb("VmRSS:");
        diagnose_once();
        if let (Some(before), Some(peak)) = (before, in_use_kb("VmHWM:")) {
            println!(
                "peak {:.0} MB, of them {:.0} MB left over from making the recording",
                peak / MB_KB,
                before / MB_KB
            );
        }
    }
    divan::main();
}

/// Prints the largest memory of `rlg diagnose` against attitudes at three lengths.
fn attitudes() {
    let mut before: Option<(usize, f64)> = None;
    for lasts_s in [60_u32, 240, 900] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let moved_s = format!("duration_s = {}.0", lasts_s - 3);
        let text = ATTITUDES.replace("duration_s = 57.0", &moved_s);
        let scenario =
            Scenario::parse(&text, Path::new("attitudes.toml")).expect("it comes with the tool");
        let mut made = simulate(&scenario, 1, |_| {});
        for table in &mut made.recording.tables {
            let is_kept = |one: &Channel| one.quantity != Quantity::ReferenceIncrement;
            table.channels.retain(is_kept);
        }
        let recording = folder.path().join("recording");
        made.recording
            .write_to(&recording)
            .expect("room for a recording");
        let model = folder.path().join("model.toml");
        std::fs::write(&model, made.model.to_toml()).expect("room for a model");
        let said = Command::new(env!("CARGO_BIN_EXE_rlg"))
            .args(["diagnose", "--timings", "--threads", "1", "--model"])
            .args([&model, &recording])
            .output()
            .expect("rlg is built with its benchmarks");
        let said = String::from_utf8_lossy(&said.stdout);
        let Some(peak_mb) = said.lines().find_map(largest_memory_mb) else {
            println!("attitudes: the platform measures no peak of memory");
            return;
        };
        let rows = scenario.rows();
        let by_row = before.map(|(of, mb)| 1e6 * (peak_mb - mb) / (rows - of) as f64);
        let by_row = by_row.map_or_else(String::new, |bytes| format!(", {bytes:.0} B a row more"));
        println!("attitudes, {rows} rows: {peak_mb:.0} MB{by_row}");
        before = Some((rows, peak_mb));
    }
}

/// Reads the line of `--timings` on memory \[MB\].
fn largest_memory_mb(line: &str) -> Option<f64> {
    let megabytes = line.strip_prefix("largest memory ")?.strip_suffix(" MB")?;
    megabytes.parse().ok()
}

fn in_use_kb(entry: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(entry))?;
    line.split_whitespace().next()?.parse().ok()
}

fn diagnose_once() {
    let folder = FOLDER.get().expect("made").path().join("recording");
    let model = MODEL.get().expect("made");
    let recording = Recording::read(&folder).expect("just written");
    let settings = Settings::default();
    let streams =
        Streams::align(&recording, model, &settings.plan.signal.align).expect("it aligns");
    drop(recording);
    let file = Path::new("model.toml");
    let outcome = diagnose_streams(&settings, streams, DeclaredModel::new(model, file), &|_| {});
    assert!(!outcome.expect("a diagnosis").diagnosis.summary.is_empty());
}

/// 60 s.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn whole(bencher: Bencher) {
    bencher.bench(diagnose_once);
}
