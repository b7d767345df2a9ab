//! The tool never reads the answer, and its result does not depend on the machine.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;

use super::support::{at_a_quarter, of_gyros};

#[test]
fn any_number_of_threads_writes_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let demo = at_a_quarter(include_str!("../../../scenarios/coning.toml"));
    let demo = demo.replace("duration_s = 17.0", "duration_s = 7.0");
    let gyros = of_gyros(&demo);
    let written = |name: &str, text: &str, seed: u64| {
        let scenario = Scenario::parse(text, Path::new("coning.toml")).expect("a scenario");
        let mut simulation = simulate(&scenario, seed, |_| {});
        simulation.recording.name = name.to_owned();
        let [recording, model] =
            ["", ".model.toml"].map(|end| folder.path().join(name.to_owned() + end));
        simulation
            .recording
            .write_to(&recording)
            .expect("a recording");
        simulation.model.write(&model).expect("a model");
        (recording, model)
    };
    let (whole, with_accelerometers) = written("whole", &demo, 3);
    same_bytes(&folder, &with_accelerometers, &[&whole], None);
    let (first, model) = written("first", &gyros, 3);
    let (second, _) = written("second", &gyros, 4);
    same_bytes(&folder, &model, &[&first, &second], None);
    // A third of its rows at once.
    same_bytes(&folder, &model, &[&first], Some("10000"));
}

/// Diagnoses with one thread and with three.
fn same_bytes(
    folder: &tempfile::TempDir,
    model: &Path,
    recordings: &[&PathBuf],
    most_rows: Option<&str>,
) {
    let written: Vec<Vec<(String, Vec<u8>)>> = ["1", "3"]
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
