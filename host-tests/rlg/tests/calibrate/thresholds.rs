//! `rlg calibrate --plan FILE`: other thresholds change the answer and stand in it; a faulty file is refused.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use serde_json::{Value, json};

use crate::closed_form::{Against, TABLE_3, make, spins};
use crate::planner::{instrument, limits_text};

/// Runs the command on what `of` names, under the lines of a plan.
fn run(folder: &Path, of: &[&str], plan: Option<&str>) -> Output {
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    command.current_dir(folder).arg("calibrate").args(of);
    command.args(["--model", "model.toml", "--out", "out", "--json", "-q"]);
    if let Some(lines) = plan {
        let text = format!("format = 1\n{lines}\n");
        fs::write(folder.join("thresholds.toml"), text).expect("a file");
        command.args(["--plan", "thresholds.toml"]);
    }
    command.output().expect("the command runs")
}

fn answer(output: &Output) -> Value {
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{words}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn another_limit_of_a_combination_changes_what_counts_as_identifiable_and_stands_in_the_answer() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let made = make(&spins(), &TABLE_3, &Against::Rates, 3);
    made.model
        .write(folder.path().join("model.toml"))
        .expect("a model");
    let recording = folder.path().join("spins");
    made.recording.write_to(&recording).expect("a recording");
    let under = |plan: Option<&str>| answer(&run(folder.path(), &["spins"], plan));

    let default = under(None);
    assert_eq!(default.get("plan"), None);
    assert!(default["in_model"]["xy"].is_number(), "{default}");
    // A number at its default is no other threshold.
    let same = under(Some("[calibration]\nidentifiable_share = 0.15"));
    assert_eq!(same, default);

    let strict = under(Some("[calibration]\nidentifiable_share = 1e-4"));
    assert!(strict["in_model"]["xy"].is_null(), "{strict}");
    let nothing: &[Value] = &[];
    assert_eq!(strict["effects"][0]["identifiable"], json!(nothing));
    assert_eq!(
        strict["plan"],
        json!([{ "number": "calibration.identifiable_share", "value": [1e-4], "default": [0.15] }])
    );
    let first = strict["summary"][0].as_str().expect("a sentence");
    assert!(first.contains("0.0001 instead of 0.15"), "{first}");

    // The prior of a nuisance is a number of the same section, and moves digits: K leans on scale errors of 5 to 8 ppm.
    let narrow = under(Some("[calibration.prior]\ngyro_scale = 1e-6"));
    assert_ne!(
        narrow["effects"][0]["parameters"],
        default["effects"][0]["parameters"]
    );
    // Channels and motion are those of a diagnosis, with its numbers.
    let coarse = under(Some("[signal.gate]\nratio = 100.0"));
    assert_ne!(coarse["recordings"], default["recordings"]);
}

#[test]
fn another_grid_changes_the_programme() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = folder.path().join("model.toml");
    instrument().write(&model).expect("a model");
    fs::write(
        folder.path().join("limits.toml"),
        limits_text(300.0, 1000.0),
    )
    .expect("a file");
    let under = |plan: Option<&str>| {
        let planned = answer(&run(folder.path(), &["--propose", "limits.toml"], plan));
        let first = planned["programme"][0].as_str().expect("a move").to_owned();
        (first, planned)
    };
    let (first, default) = under(None);
    assert_eq!(
        (first.as_str(), default.get("plan")),
        ("4.00 s still", None)
    );
    let (first, longer) = under(Some("[calibration.programme]\nrest_s = 10"));
    assert_eq!(first, "10.00 s still");
    assert_eq!(longer["plan"][0]["number"], "calibration.programme.rest_s");
}

#[test]
fn a_plan_with_an_unknown_key_or_a_value_out_of_range_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    instrument()
        .write(folder.path().join("model.toml"))
        .expect("a model");
    fs::write(
        folder.path().join("limits.toml"),
        limits_text(300.0, 1000.0),
    )
    .expect("a file");
    for (lines, parts) in [
        (
            "[calibration]\nidentifiable_shares = 0.1",
            [
                "calibration.identifiable_shares",
                "is no number of the plan",
                "calibration.identifiable_share",
            ],
        ),
        (
            "[calibration]\nidentifiable_share = 2",
            [
                "calibration.identifiable_share",
                "is out of range",
                "from 0.0001 to 1",
            ],
        ),
        (
            "[calibration.programme]\nspins = [1.0, 0.5]",
            [
                "calibration.programme.spins",
                "has another number of values",
                "6 numbers",
            ],
        ),
    ] {
        // The folder of recordings does not exist: the plan is refused before it is read.
        for of in [&["nowhere"][..], &["--propose", "limits.toml"]] {
            let output = run(folder.path(), of, Some(lines));
            let words = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{words}");
            assert_eq!(words.lines().count(), 1, "{words}");
            for part in parts.into_iter().chain(["thresholds.toml"]) {
                assert!(words.contains(part), "no {part:?} in: {words}");
            }
            assert!(!folder.path().join("out").exists());
        }
    }
}
