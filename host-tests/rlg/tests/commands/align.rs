//! `rlg align`: two instruments, whatever their physics; compared with the planted values, and on the shared recordings with
//! an outside analysis.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;

/// Kinds that an alignment may report, faults of the data aside.
const REGISTRATION: [&str; 11] = [
    "gyro_bias",
    "reference_misalignment",
    "reference_delay",
    "gyro_delay",
    "reference_clock_rate",
    "earth_rate",
    "gyro_bandwidth",
    "reference_bandwidth",
    "gyro_scale",
    "reference_scale",
    "installation",
];

fn rlg<S: AsRef<OsStr>>(arguments: &[S]) -> Output {
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    command.args(arguments).output().expect("the command runs")
}

fn said(output: &Output) -> String {
    let [out, error] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    format!("{out}{error}")
}

/// Runs an alignment with the model in a recording's folder and returns its JSON.
fn aligned(recording: &Path) -> Value {
    let model = recording.join("model.toml");
    let [align, json, quiet, option] = ["align", "--json", "-q", "--model"].map(OsStr::new);
    let arguments = [
        align,
        json,
        quiet,
        recording.as_os_str(),
        option,
        model.as_os_str(),
    ];
    let output = rlg(&arguments);
    assert!(output.status.success(), "{}", said(&output));
    assert!(output.stderr.is_empty(), "{}", said(&output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn entries<'a>(aligned: &'a Value, list: &str) -> &'a Vec<Value> {
    aligned[list].as_array().expect("a list")
}

/// A number of the registration: name, value, σ.
type Number = (String, f64, f64);

/// Returns the registration's numbers of a kind, and true if they are supported.
fn registered(aligned: &Value, kind: &str) -> Option<(Vec<Number>, bool)> {
    let mut all = entries(aligned, "registration").iter();
    let entry = all.find(|one| one["kind"] == kind)?;
    let number = |one: &Value| {
        let name = one["name"].as_str().expect("a name").to_owned();
        let [value, std] = ["value", "std"].map(|key| one[key].as_f64().expect("a number"));
        (name, value, std)
    };
    let numbers = entries(entry, "parameters").iter().map(number).collect();
    Some((numbers, entry["supported"] == true))
}

/// Draws recordings and keeps them; returns each folder with its truth.
fn drawn(folder: &Path, options: &[&str]) -> Vec<(PathBuf, Value)> {
    let [kept, out] = ["kept", "out"].map(|name| folder.join(name));
    let fixed = [
        "challenge",
        "--marks",
        "--undiagnosed",
        "--seed",
        "11",
        "--keep",
    ]
    .map(OsStr::new);
    let mut arguments: Vec<&OsStr> = fixed.to_vec();
    arguments.extend([kept.as_os_str(), OsStr::new("--out"), out.as_os_str()]);
    arguments.extend(options.iter().map(OsStr::new));
    let output = rlg(&arguments);
    assert!(output.status.success(), "{}", said(&output));
    let mut trials: Vec<PathBuf> = fs::read_dir(kept)
        .expect("kept")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    trials.sort();
    let truth = |trial: PathBuf| {
        let text = fs::read_to_string(trial.join("truth.json")).expect("its truth");
        (
            trial.join("recording"),
            serde_json::from_str(&text).expect("JSON"),
        )
    };
    trials.into_iter().map(truth).collect()
}

/// Lists the kinds found that are no registration and no fault of the reference or the data.
fn physics(aligned: &Value) -> Vec<String> {
    let kinds = entries(aligned, "effects").iter();
    let kinds = kinds.map(|one| one["kind"].as_str().expect("a kind").to_owned());
    let faults = [
        "reference_spike",
        "reference_dropout",
        "reference_jump",
        "lost_samples",
        "spikes",
    ];
    // A stretch without an explanation names nothing.
    kinds
        .filter(|kind| !REGISTRATION.contains(&kind.as_str()) && kind != "unlisted")
        .filter(|kind| !faults.contains(&kind.as_str()))
        .collect()
}

/// Checks that every planted number is estimated within 4 σ: 1 of 16 000 is beyond by chance.
fn is_told(aligned: &Value, truth: &Value) {
    let planted = &entries(truth, "effects")[0];
    let kind = planted["kind"].as_str().expect("a kind");
    let found = registered(aligned, kind);
    let (numbers, supported) = found.unwrap_or_else(|| panic!("no {kind} in {aligned:#}"));
    assert!(supported, "{kind}: {numbers:?}");
    for (name, value, std) in numbers {
        let truth = planted["parameters"][&name].as_f64().unwrap_or(0.0);
        assert!(
            (value - truth).abs() < 4.0 * std,
            "{kind} {name}: {value} ± {std}, not {truth}"
        );
    }
}

#[test]
fn what_is_planted_beside_attitudes_is_told_and_physics_never_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let planted = "gyro_bias,gyro_scale,reference_delay,gyro_g_bias,axis_flexure";
    let trials = [
        "--family",
        "attitude",
        "--planted",
        planted,
        "--trials",
        "8",
    ];
    let mut told = 0;
    for (recording, truth) in drawn(folder.path(), &trials) {
        let aligned = aligned(&recording);
        assert_eq!(physics(&aligned), [""; 0], "{}", recording.display());
        assert_eq!(entries(&aligned, "registration").len(), 8);
        // On a cone a delay is equivalent to a rotation about the cone's axis.
        let is_cone = truth["conditions"][0] == "motion coning";
        let mut own = ["gyro_bias", "gyro_scale", "reference_delay"].iter();
        if own.any(|kind| truth["planted"] == *kind) && !is_cone {
            is_told(&aligned, &truth);
            told += 1;
        }
    }
    assert!(told >= 4, "{told}");
}

#[test]
fn what_is_planted_beside_rates_is_told_and_the_written_model_leaves_nothing_of_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut told = 0;
    let trials = ["--family", "basic", "--trials", "4", "--most-rows", "20000"];
    for (recording, truth) in drawn(folder.path(), &trials) {
        let found = aligned(&recording);
        assert_eq!(physics(&found), [""; 0], "{}", recording.display());
        let kind = &entries(&truth, "effects")[0]["kind"];
        // A delay common to all gyros has two names.
        if kind == "gyro_bias" || kind == "gyro_scale" {
            is_told(&found, &truth);
            told += 1;
        }
        let out = folder.path().join("aligned");
        let model = recording.join("model.toml");
        let [align, option, to] = ["align", "--model", "--out"].map(OsStr::new);
        let of = [
            align,
            recording.as_os_str(),
            option,
            model.as_os_str(),
            to,
            out.as_os_str(),
        ];
        let output = rlg(&of);
        assert!(output.status.success(), "{}", said(&output));
        let written = fs::read_to_string(out.join("registration.json")).expect("written");
        assert_eq!(
            serde_json::from_str::<Value>(&written).expect("JSON"),
            found
        );
        fs::copy(out.join("model.toml"), &model).expect("copied");
        let again = aligned(&recording);
        for entry in entries(&again, "registration") {
            assert_eq!(entry["supported"], false, "{entry:#}");
        }
    }
    assert!(told > 0);
}

#[test]
fn one_instrument_alone_is_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let trials = ["--family", "rest", "--planted", "none", "--trials", "1"];
    let (recording, _) = drawn(folder.path(), &trials).remove(0);
    let output = rlg(&[OsStr::new("align"), recording.as_os_str()]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    let words = said(&output);
    assert_eq!(words.lines().count(), 1, "{words}");
    for part in ["nothing to align with", "reference_attitude"] {
        assert!(words.contains(part), "no {part:?} in: {words}");
    }
}

#[test]
fn a_model_at_rest_has_nothing_to_align() {
    let folder = tempfile::tempdir().expect("a folder");
    let trials = ["--family", "attitude", "--planted", "none", "--trials", "1"];
    let (recording, _) = drawn(folder.path(), &trials).remove(0);
    let model = folder.path().join("still.toml");
    let moving = fs::read_to_string(recording.join("model.toml")).expect("its model");
    let still = moving.replace("source = \"reference\"", "source = \"static\"");
    assert_ne!(still, moving);
    fs::write(&model, still).expect("written");
    let [align, option] = ["align", "--model"].map(OsStr::new);
    let output = rlg(&[align, recording.as_os_str(), option, model.as_os_str()]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    let words = said(&output);
    assert!(
        words.contains("nothing to align with") && words.lines().count() == 1,
        "{words}"
    );
}

/// By `rlg align`; by the diagnosis `files/import_matrices.rs` tests them in every run.
#[test]
#[ignore = "minutes: --test commands -- --ignored in_full"]
fn two_real_recordings_are_aligned_as_an_outside_analysis_has_it_in_full() {
    let Some(shared) = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from) else {
        eprintln!("RLG_RECORDINGS names no folder: the real files were not read");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let aligned_file = |file: &str| {
        let file = shared.join(file);
        let out = folder.path().join(file.file_stem().expect("a name"));
        let [import, option] = ["import", "--out"].map(OsStr::new);
        let output = rlg(&[import, file.as_os_str(), option, out.as_os_str()]);
        assert!(output.status.success(), "{}", said(&output));
        aligned(&out)
    };
    // The fit of the supported groups alone, as printed on the terminal.
    let told = |aligned: &Value, kind: &str, name: &str| -> (f64, f64) {
        let mut effects = entries(aligned, "effects").iter();
        let effect = effects.find(|one| one["kind"] == kind).expect("supported");
        let mut numbers = entries(effect, "parameters").iter();
        let number = numbers.find(|one| one["name"] == name).expect("a number");
        let of = |key: &str| number[key].as_f64().expect("a number");
        (of("value"), of("std"))
    };
    let near = |(value, std): (f64, f64), expected: f64, within: f64| {
        assert!(
            (value - expected).abs() < within && std < within,
            "{value} ± {std}, not {expected}"
        );
    };
    let stick = aligned_file("repoimu-11/TStick_Test11_Trial1.csv");
    assert_eq!(physics(&stick), [""; 0]);
    near(told(&stick, "reference_misalignment", "x"), -0.047, 1e-3);
    let tapped = aligned_file("broad-24/24_disturbed_tapping_A.mat");
    assert_eq!(physics(&tapped), [""; 0]);
    near(told(&tapped, "reference_delay", "all"), -2.40e-3, 5e-5);
    for (axis, deg_s) in [("x", 0.49), ("y", -0.21), ("z", -0.28)] {
        let bias = told(&tapped, "gyro_bias", axis);
        near(bias, f64::to_radians(deg_s), f64::to_radians(0.02));
    }
}
