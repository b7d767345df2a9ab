//! `rlg demo`: the whole sequence, shortened.

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;
use trueaxis::Parameters;

/// Seconds of recording: a third of the demo's own. Each gyro still cones for seven, in which its random walk gives a mean a
/// standard deviation of 0.05 °/h, a twenty-eighth of the drift due to the flexure.
const SECONDS: &str = "24";

/// Smallest reduction of the drift by a found effect in the firmware's model, as stated by the project.
const LEAST_TIMES_LESS: f64 = 10.0;

/// Smallest initial drift \[°/h\]: (K_xy + K_xz)Ω³φ²/2 = 1.5 °/h at 15 Hz and 0.63°, less the tapers' share of a shortened
/// segment (a fifth) and four standard deviations of the random walk.
const LEAST_BEFORE_DEG_H: f64 = 1.0;

/// Largest difference of both number systems from the f64 reference chain \[°/h\].
const LARGEST_AGAINST_REFERENCE_DEG_H: f64 = 1e-3;

/// Largest difference between found and concealed combinations in standard deviations: three combinations, 1 in 5000 by
/// chance.
const LARGEST_DEVIATIONS: f64 = 4.0;

/// Range of the found sums: 1.40e-7, 1.48e-7 and 1.43e-7 s² are concealed, with four standard deviations (0.08e-7) on either
/// side.
const CONCEALED_SUMS_S2: std::ops::Range<f64> = 1.08e-7..1.80e-7;

fn demo(out: &Path, seed: &str) -> (Value, Vec<u8>, String) {
    let output = Command::cargo_bin("rlg")
        .expect("the command is built with its tests")
        .args([
            "--json",
            "demo",
            "--seconds",
            SECONDS,
            "--seed",
            seed,
            "--out",
        ])
        .arg(out)
        .output()
        .expect("the command starts");
    let words = String::from_utf8(output.stderr).expect("words are UTF-8");
    assert!(output.status.success(), "{words}");
    let json = serde_json::from_slice(&output.stdout).expect("a result in JSON");
    (json, output.stdout, words)
}

fn number(value: &Value, path: &str) -> f64 {
    value
        .pointer(path)
        .and_then(Value::as_f64)
        .unwrap_or_else(|| panic!("no {path} in {value}"))
}

/// The demo finds the concealed flexure, and the chain then drifts ten times less.
fn tells_the_whole_story(json: &Value, words: &str, out: &Path) {
    assert_eq!(json["found"], serde_json::json!(["axis_flexure"]));
    assert!(words.lines().count() <= 20, "{words}");
    assert!(
        words.contains("axis flexure") && words.contains("report.html"),
        "{words}"
    );

    let segments = json["segments"].as_array().expect("segments");
    assert_eq!(segments.len(), 3);
    let (mut before, mut after) = (0.0_f64, 0.0_f64);
    for (segment, axis) in segments.iter().zip(["x", "y", "z"]) {
        assert_eq!(
            segment["axis"], axis,
            "coning about an axis makes its own gyro drift"
        );
        let own = number(segment, "/before_deg_h").abs();
        assert!(
            own > LEAST_BEFORE_DEG_H,
            "gyro {axis} drifts by only {own} °/h"
        );
        before = before.max(own);
        for core in ["f32", "fixed"] {
            after = after.max(number(segment, &format!("/after_deg_h/{core}")).abs());
        }
    }
    assert!(
        before >= LEAST_TIMES_LESS * after,
        "{before} to {after} °/h"
    );
    for core in ["f32", "fixed"] {
        let against = number(json, &format!("/against_reference_deg_h/{core}"));
        assert!(
            against < LARGEST_AGAINST_REFERENCE_DEG_H,
            "{core}: {against} °/h"
        );
    }
    for fixed in json["fixed"].as_array().expect("combinations") {
        let apart = number(fixed, "/value") - number(fixed, "/concealed");
        assert!(
            apart.abs() < LARGEST_DEVIATIONS * number(fixed, "/std"),
            "{fixed}"
        );
    }

    let page = std::fs::read_to_string(out.join("report.html")).expect("a report");
    assert!(page.contains("axis_flexure"));
    let block = std::fs::read(out.join("params.bin")).expect("a parameter block");
    let (parameters, _) = Parameters::from_block(&block).expect("the firmware takes the block");
    let flexure = parameters.flexure_s2;
    for sum in [
        flexure.xy + flexure.xz,
        flexure.yx + flexure.yz,
        flexure.zx + flexure.zy,
    ] {
        assert!(CONCEALED_SUMS_S2.contains(&sum), "{sum} s²");
    }
    for file in [
        "diagnosis.json",
        "model.toml",
        "recording/recording.toml",
        "recording/model.toml",
    ] {
        assert!(out.join(file).is_file(), "no {file}");
    }
}

#[test]
fn the_demo_tells_its_story_and_the_same_seed_tells_it_to_the_byte_and_another_seed_does_not() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (first, second, third) = (
        folder.path().join("deep/er"),
        folder.path().join("b"),
        folder.path().join("c"),
    );
    let (json, one, words) = demo(&first, "3");
    tells_the_whole_story(&json, &words, &first);
    let (_, two, _) = demo(&second, "3");
    let (_, other, _) = demo(&third, "4");
    assert_eq!(one, two);
    assert_ne!(one, other);
    for file in [
        "report.html",
        "diagnosis.json",
        "params.bin",
        "recording/samples.parquet",
    ] {
        let read = |folder: &Path| std::fs::read(folder.join(file)).expect("a file of the demo");
        assert!(read(&first) == read(&second), "{file} differs");
    }
}

#[test]
fn the_demo_refuses_a_file_as_its_folder_before_it_works() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("taken");
    std::fs::write(&file, "mine").expect("a file");
    let output = Command::cargo_bin("rlg")
        .expect("the command is built with its tests")
        .args(["demo", "--seconds", SECONDS, "--out"])
        .arg(&file)
        .output()
        .expect("the command starts");
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(std::fs::read(&file).expect("still there"), b"mine");
}
