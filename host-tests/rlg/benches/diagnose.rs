//! Time and memory of a diagnosis: `cargo bench --package rlg --bench diagnose`.
//!
//! `whole`: `scenarios/vibration.toml`, 60 s of three dithered gyros with pickoffs, reference and accelerometers at
//! 4 kHz, read from disk and held against the whole catalogue. On Linux the peak of the memory in use is printed
//! first; the recording is made and forgotten before it is counted.

use divan::Bencher;
use rlg::diagnose::streams::Streams;
use rlg::diagnose::{Settings, diagnose_streams};
use rlg::model::{DeclaredModel, Model};
use rlg::recording::Recording;
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;
use std::path::Path;
use std::sync::OnceLock;

const SCENARIO: &str = include_str!("../../scenarios/vibration.toml");

/// A megabyte in the kilobytes of /proc.
const MB_KB: f64 = 1000.0 / 1.024;

static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();

static MODEL: OnceLock<Model> = OnceLock::new();

fn main() {
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
