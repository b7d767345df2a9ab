//! A valid recording and a valid model, each to be corrupted in one way at a time.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use tempfile::TempDir;

/// The arguments of a command, from a recording, a model and an output.
pub type Arguments = fn(&Path, &Path, &Path) -> Vec<OsString>;

pub const READERS_OF_RECORDINGS: &[Arguments] = &[inspect, diagnose, calibrate, replay, navigate];
pub const READERS_OF_MODELS: &[Arguments] = &[params, diagnose, calibrate, replay, navigate];

/// Commands that accept the valid recording's single gyro, kept for short cases: the others refuse it for that alone and are
/// tested on valid recordings in their own tests.
pub const CONTENT_WITH_ONE_GYRO: &[Arguments] = &[inspect, params];

pub fn inspect(recording: &Path, _: &Path, _: &Path) -> Vec<OsString> {
    vec!["inspect".into(), "--json".into(), recording.into()]
}

pub fn diagnose(recording: &Path, model: &Path, out: &Path) -> Vec<OsString> {
    let (model_flag, out_flag) = ("--model".into(), "--out".into());
    vec![
        "diagnose".into(),
        recording.into(),
        model_flag,
        model.into(),
        out_flag,
        out.into(),
    ]
}

pub fn calibrate(recording: &Path, model: &Path, out: &Path) -> Vec<OsString> {
    let mut arguments = diagnose(recording, model, out);
    arguments[0] = "calibrate".into();
    arguments
}

pub fn replay(recording: &Path, model: &Path, out: &Path) -> Vec<OsString> {
    let mut arguments = diagnose(recording, model, out);
    arguments[0] = "replay".into();
    arguments.extend(["--core".into(), "f32".into()]);
    arguments
}

pub fn navigate(recording: &Path, model: &Path, out: &Path) -> Vec<OsString> {
    let mut arguments = diagnose(recording, model, out);
    arguments[0] = "navigate".into();
    arguments
}

pub fn on_target(recording: &Path, model: &Path, out: &Path) -> Vec<OsString> {
    let mut arguments = replay(recording, model, out);
    arguments[0] = "on-target".into();
    arguments
}

pub fn params(_: &Path, model: &Path, out: &Path) -> Vec<OsString> {
    vec!["params".into(), model.into(), "--out".into(), out.into()]
}

const RECORDING: &str = r#"format = 1
name = "good"
[[table]]
file = "t.csv"
rate_hz = 4000.0
start_s = 0.0
  [[table.channel]]
  column = "gx"
  quantity = "gyro_count"
  axis = "x"
  [[table.channel]]
  column = "dx"
  quantity = "dither_angle"
  axis = "x"
  scale = 1e-8
  [[table.channel]]
  column = "rx"
  quantity = "reference_increment"
  axis = "x"
  scale = 5e-9
[[segment]]
name = "still"
kind = "still"
start_s = 0.0
end_s = 1.0
"#;

const TABLE: &str = "gx,dx,rx\n1,100,3\n-2,200,4\n3,,5\n4,nan,-6\n";

const MODEL: &str = r#"format = 1
[motion]
source = "reference"
earth_rate = true
[gyro]
pulse_weight_rad = [2e-6, 2e-6, 2e-6]
bias_rad_s = [1e-6, 0.0, 0.0]
scale_error = [1e-5, 0.0, 0.0]
installation_rad = { xy = 1e-4, xz = 0.0, yx = 0.0, yz = 0.0, zx = 0.0, zy = 0.0 }
[dither]
pickoff_gain = [1.0, 1.0, 1.0]
pickoff_noise_rad = [2e-7, 2e-7, 2e-7]
[reference]
angle_noise_rad = 2e-7
angle_random_walk_rad_sqrt_s = 1e-7
[[effect]]
kind = "axis_flexure"
xy = 7e-8
"#;

/// A valid recording and a valid model, to be corrupted.
pub struct Bench {
    pub folder: TempDir,
}

impl Bench {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let bench = Self { folder };
        fs::create_dir(bench.recording()).expect("a folder");
        bench.write("recording.toml", RECORDING);
        bench.write("t.csv", TABLE);
        fs::write(bench.model(), MODEL).expect("a file");
        bench
    }
    pub fn recording(&self) -> PathBuf {
        self.folder.path().join("recording")
    }
    pub fn model(&self) -> PathBuf {
        self.folder.path().join("model.toml")
    }
    pub fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.recording().join(name), content).expect("a file");
    }
    pub fn run(&self, arguments: Arguments) -> std::process::Output {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command.args(arguments(&self.recording(), &self.model(), &self.out()));
        command.output().expect("the command runs")
    }
    /// Checks that every one of `commands` refuses with one line that holds all of `parts`, and leaves nothing.
    pub fn is_refused(&self, commands: &[Arguments], parts: &[&str]) {
        let before = listing(self.folder.path());
        for arguments in commands {
            let output = self.run(*arguments);
            let words = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{words}");
            assert!(
                words.starts_with("error: ") && words.lines().count() == 1,
                "{words}"
            );
            for part in parts {
                assert!(words.contains(part), "no {part:?} in: {words}");
            }
            assert!(output.stdout.is_empty(), "something on standard output");
            assert_eq!(
                listing(self.folder.path()),
                before,
                "something was left behind"
            );
        }
    }
    pub fn recording_is_refused(&self, parts: &[&str]) {
        self.is_refused(READERS_OF_RECORDINGS, parts);
    }
}

/// Returns all paths under `folder`.
fn listing(folder: &Path) -> Vec<PathBuf> {
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            paths.extend(listing(&path));
        }
        paths.push(path);
    }
    paths.sort();
    paths
}

/// Returns the valid recording with `from` replaced in recording.toml.
pub fn manifest(from: &str, to: &str) -> Bench {
    let bench = Bench::new();
    assert!(
        RECORDING.contains(from),
        "{from:?} is not in the good recording"
    );
    bench.write("recording.toml", RECORDING.replacen(from, to, 1));
    bench
}

/// Returns the valid recording with another table.
pub fn table(text: &str) -> Bench {
    let bench = Bench::new();
    bench.write("t.csv", text);
    bench
}

/// Returns the valid model with `from` replaced.
pub fn model_with(from: &str, to: &str) -> Bench {
    let bench = Bench::new();
    assert!(MODEL.contains(from), "{from:?} is not in the good model");
    fs::write(bench.model(), MODEL.replacen(from, to, 1)).expect("a file");
    bench
}

/// Checks that every reader of models refuses the valid model with `from` replaced.
pub fn model(from: &str, to: &str, parts: &[&str]) {
    let bench = model_with(from, to);
    bench.is_refused(READERS_OF_MODELS, parts);
}
