//! Damaged recordings: a verdict, or one sentence on the fault; never a panic, nothing half written.

mod damage;

use std::path::Path;

use assert_cmd::Command;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rlg::diagnose::diagnose;
use rlg::model::Model;
use rlg::recording::Recording;
use rlg::report::page;

/// Damaged recordings of the long test; `RLG_DAMAGED` requests another number, and the fuzz target continues after these.
const CASES: u64 = 300;

/// Damaged recordings of the short test.
const FEWER: u64 = 100;

/// Further ones for the command, which takes a process each.
const COMMANDS: u64 = 16;

/// Bytes that select the damage: one to three damages.
const MOST_BYTES: usize = 14;

fn choices(seed: u64) -> Vec<u8> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let length = random.random_range(4..MOST_BYTES);
    (0..length).map(|_| random.random()).collect()
}

/// Reads and diagnoses `folder`: returns the verdict, or the error.
fn outcome(folder: &Path) -> Result<String, String> {
    let recording = Recording::read(folder).map_err(|error| error.to_string())?;
    let file = folder.join("model.toml");
    let model = Model::read(&file).map_err(|error| error.to_string())?;
    let outcome =
        diagnose(&recording, &model, &file, 0, &|_| {}).map_err(|error| error.to_string())?;
    let page = page(&outcome.diagnosis, outcome.pictures.as_ref());
    assert!(page.ends_with("</html>"), "the page is cut off");
    serde_json::to_string(&outcome.diagnosis).expect("a result has a JSON form");
    Ok(format!("{:?}", outcome.diagnosis.verdict))
}

#[test]
fn the_recordings_that_are_to_be_damaged_are_whole() {
    for files in &damage::whole()[..3] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        damage::write(files, folder.path());
        let verdict = outcome(folder.path());
        assert!(verdict.is_ok(), "{verdict:?}");
    }
}

fn cases() -> u64 {
    let asked = std::env::var("RLG_DAMAGED").ok();
    asked.and_then(|text| text.parse().ok()).unwrap_or(CASES)
}

#[test]
fn a_damaged_recording_ends_in_a_verdict_or_in_one_sentence() {
    each_ends_in_a_verdict_or_a_sentence(FEWER);
}

#[test]
#[ignore = "many seeds: --test files -- --ignored in_full"]
fn a_damaged_recording_ends_in_a_verdict_or_in_one_sentence_in_full() {
    each_ends_in_a_verdict_or_a_sentence(cases());
}

fn each_ends_in_a_verdict_or_a_sentence(cases: u64) {
    let (mut verdicts, mut sentences, mut panics) = (0, 0, Vec::new());
    for seed in 0..cases {
        let folder = tempfile::tempdir().expect("a temporary folder");
        damage::write(&damage::damaged(&choices(seed)), folder.path());
        let said = std::panic::catch_unwind(|| outcome(folder.path()));
        match said {
            Err(_) => panics.push(seed),
            Ok(Ok(_)) => verdicts += 1,
            Ok(Err(sentence)) => {
                sentences += 1;
                let lines = sentence.lines().count();
                assert_eq!(lines, 1, "seed {seed}: {sentence}");
            }
        }
    }
    assert!(panics.is_empty(), "panics with seeds {panics:?}");
    // Damage that is always or never detected tests nothing.
    let both = cases / 5..cases;
    assert!(
        both.contains(&verdicts) && both.contains(&sentences),
        "{verdicts} verdicts, {sentences} sentences"
    );
}

#[test]
fn the_command_leaves_all_of_its_results_or_none() {
    for seed in 0..COMMANDS {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let recording = folder.path().join("recording");
        std::fs::create_dir(&recording).expect("a temporary folder");
        damage::write(&damage::damaged(&choices(CASES + seed)), &recording);
        let out = folder.path().join("out");
        let output = Command::cargo_bin("rlg")
            .expect("the command is built")
            .args(["diagnose", "--model"])
            .args([&recording.join("model.toml"), &recording])
            .arg("--out")
            .arg(&out)
            .output()
            .expect("it runs");
        let left = std::fs::read_dir(folder.path()).expect("there").count();
        let words = String::from_utf8_lossy(&output.stderr);
        match output.status.code() {
            Some(0) => {
                for name in ["diagnosis.json", "report.html", "residual.svg"] {
                    assert!(out.join(name).exists(), "seed {seed}: no {name}");
                }
                let json = std::fs::read_to_string(out.join("diagnosis.json")).expect("written");
                let is_unusable = json.contains("\"verdict\": \"unusable\"");
                let has_model = out.join("model.toml").exists();
                assert_eq!(has_model, !is_unusable, "seed {seed}: a model");
                assert_eq!(left, 2, "seed {seed}: something beside the results");
            }
            Some(2) => {
                assert_eq!(left, 1, "seed {seed}: something is left: {words}");
                let errors = words.lines().filter(|line| line.starts_with("error"));
                assert_eq!(errors.count(), 1, "seed {seed}: {words}");
            }
            other => panic!("seed {seed}: exit {other:?}: {words}"),
        }
    }
}
