//! `docs/recording-elsewhere.md`: its Python lines write a recording that `rlg` reads and explains.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

const PAGE: &str = include_str!("../../../../docs/recording-elsewhere.md");

/// Returns the lines between ```` ```language ```` and the next fence.
fn block(language: &str) -> String {
    let begin = format!("```{language}\n");
    let (_, rest) = PAGE.split_once(&begin).expect("the page has such lines");
    let (lines, _) = rest.split_once("\n```").expect("the fence is closed");
    format!("{lines}\n")
}

/// Runs the lines in `folder`; `None` if this machine cannot.
fn run(lines: &str, needs: &str, folder: &Path) -> Option<()> {
    let python = |code: &str| {
        let mut command = Command::new("python3");
        command.current_dir(folder).args(["-c", code]);
        command.output()
    };
    match python(needs) {
        Ok(output) if output.status.success() => {}
        _ => {
            eprintln!("skipped: no python3 that can `{needs}`");
            return None;
        }
    }
    let output = python(lines).expect("it ran before");
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words}");
    Some(())
}

fn rlg(arguments: &[&str], folder: &Path) -> Value {
    let output = assert_cmd::Command::cargo_bin("rlg")
        .expect("the command is built")
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("it runs");
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{words}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn what_the_standard_librarys_lines_write_matches_its_model() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(()) = run(&block("python"), "import csv", folder.path()) else {
        return;
    };
    rlg(&["inspect", "bench-17", "--json"], folder.path());
    let model = "bench-17/model.toml";
    let arguments = [
        "diagnose", "bench-17", "--model", model, "--out", "out", "--json",
    ];
    let diagnosis = rlg(&arguments, folder.path());
    assert_eq!(
        diagnosis["effects"].as_array().map(Vec::len),
        Some(0),
        "{}",
        diagnosis["summary"]
    );
    assert_eq!(diagnosis["verdict"], "matches");
}

#[test]
fn what_pyarrow_writes_is_the_same_recording() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let lines = block("python") + &block("python-pyarrow");
    let needs = "import numpy, pyarrow, pyarrow.parquet";
    let Some(()) = run(&lines, needs, folder.path()) else {
        return;
    };
    let packed = rlg(&["inspect", "bench-17", "--json"], folder.path());
    let manifest = folder.path().join("bench-17/recording.toml");
    let text = fs::read_to_string(&manifest).expect("just written");
    fs::write(&manifest, text.replace(".parquet", ".csv")).expect("a temporary folder");
    let plain = rlg(&["inspect", "bench-17", "--json"], folder.path());
    let numbers = |inspected: &Value| {
        let text = inspected.to_string();
        text.replace(".parquet", "").replace(".csv", "")
    };
    assert_eq!(numbers(&packed), numbers(&plain));
}

#[test]
fn the_tumble_test_is_imported_and_tells_what_its_lines_conceal() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(()) = run(&block("python-tumble"), "import math", folder.path()) else {
        return;
    };
    let commands = |begin: &str| -> Vec<String> {
        let line = PAGE
            .lines()
            .find_map(|line| line.trim().strip_prefix(begin));
        let words = line.expect("the page has the command").split_whitespace();
        words.map(str::to_owned).collect()
    };
    let import = commands("rlg import tumble.csv");
    let mut arguments = vec!["import", "tumble.csv", "--json"];
    arguments.extend(import.iter().map(String::as_str));
    rlg(&arguments, folder.path());
    let diagnosis = rlg(
        &["diagnose", "tumble", "--out", "out/tumble", "--json"],
        folder.path(),
    );
    let effects = diagnosis["effects"].as_array().expect("effects");
    let mut named: Vec<&str> = effects
        .iter()
        .filter_map(|one| one["kind"].as_str())
        .collect();
    named.sort_unstable();
    let all = ["accel_bias", "accel_misalignment", "accel_scale"];
    assert_eq!(named, all, "{}", diagnosis["summary"]);
    for file in ["report.html", "model.toml", "residual.svg"] {
        assert!(
            folder.path().join("out/tumble").join(file).is_file(),
            "{file}"
        );
    }
}
