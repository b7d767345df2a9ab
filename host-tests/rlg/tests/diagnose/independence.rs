//! The tool never sees the answer, and its answer does not depend on the machine.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use rlg::simulate::coning_demo;

#[test]
fn any_number_of_threads_writes_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let simulation = coning_demo(3).expect("the demo's scenario");
    let recording = folder.path().join("recording");
    simulation
        .recording
        .write_to(&recording)
        .expect("a recording");
    let model = folder.path().join("model.toml");
    simulation.model.write(&model).expect("a model");
    let mut second = coning_demo(4).expect("the demo's scenario");
    second.recording.name += " again";
    let several = folder.path().join("several");
    second.recording.write_to(&several).expect("a recording");
    same_bytes(&folder, &model, &[&recording], None, &["1", "2", "3"]);
    same_bytes(&folder, &model, &[&recording, &several], None, &["1", "3"]);
    // A third of its rows at once.
    same_bytes(&folder, &model, &[&recording], Some("80000"), &["1", "3"]);
}

/// Diagnoses with several numbers of threads.
fn same_bytes(
    folder: &tempfile::TempDir,
    model: &Path,
    recordings: &[&PathBuf],
    most_rows: Option<&str>,
    threads: &[&str],
) {
    let written: Vec<Vec<(String, Vec<u8>)>> = threads
        .iter()
        .map(|threads| {
            let count = recordings.len();
            let rows = most_rows.unwrap_or("all");
            let out = folder.path().join(format!("out-{count}-{rows}-{threads}"));
            Command::cargo_bin("rlg")
                .expect("the command is built")
                .args(["diagnose", "--quiet", "--threads", threads, "--model"])
                .arg(model)
                .args(recordings)
                .args(most_rows.iter().flat_map(|rows| ["--most-rows", rows]))
                .arg("--out")
                .arg(&out)
                .assert()
                .success();
            [
                "diagnosis.json",
                "model.toml",
                "report.html",
                "residual.svg",
            ]
            .map(|name| {
                (
                    name.to_string(),
                    fs::read(out.join(name)).expect("a result"),
                )
            })
            .to_vec()
        })
        .collect();
    assert!(written.windows(2).all(|pair| pair[0] == pair[1]));
}
