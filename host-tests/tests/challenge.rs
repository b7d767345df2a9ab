//! A short challenge: commitments come first, shards give the bytes of the whole, and scores are of what was said.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;

/// Four trials: an effect-free record, one effect, and both again.
const SHORT: [&str; 6] = ["--trials", "4", "--families", "null,single", "--seed", "5"];

/// What a challenge leaves.
const FILES: [&str; 5] = [
    "commitments.txt",
    "answers.jsonl",
    "outcomes.jsonl",
    "challenge.json",
    "report.html",
];

fn rlg(folder: &Path, arguments: &[&str]) -> Output {
    Command::cargo_bin("rlg")
        .expect("the binary")
        .current_dir(folder)
        .arg("challenge")
        .args(arguments)
        .output()
        .expect("it starts")
}

fn challenge(folder: &Path, more: &[&str]) {
    let arguments = [&SHORT[..], more].concat();
    let output = rlg(folder, &arguments);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn shards_and_threads_give_the_bytes_of_the_whole_and_a_changed_answer_is_noticed() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    challenge(at, &["--out", "whole", "--threads", "1"]);
    challenge(at, &["--out", "s0", "--shard", "0/2", "--threads", "2"]);
    challenge(at, &["--out", "s1", "--shard", "1/2"]);
    // In the other order: the trials' numbers sort them.
    let output = rlg(at, &["--out", "merged", "--merge", "s1", "s0"]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    for file in FILES {
        let [whole, merged] = ["whole", "merged"].map(|name| fs::read(at.join(name).join(file)));
        assert!(
            whole.expect("written") == merged.expect("written"),
            "{file} differs"
        );
    }

    let scores: serde_json::Value =
        serde_json::from_slice(&fs::read(at.join("whole/challenge.json")).expect("written"))
            .expect("JSON");
    assert_eq!(scores["scored"], 4);
    assert_eq!(scores["by_family"]["null"]["trials"], 2);
    assert_eq!(scores["by_family"]["single"]["trials"], 2);
    let marks = scores["marks"].as_array().expect("marks");
    assert_eq!(
        marks[0]["trials"], 2,
        "both effect-free records stand behind the first mark"
    );
    let page = fs::read_to_string(at.join("whole/report.html")).expect("written");
    assert!(
        !page.contains("http") && !page.contains("<script"),
        "the page needs no network"
    );

    assert!(rlg(at, &["--check", "whole"]).status.success());
    let file = at.join("whole/answers.jsonl");
    let answers = fs::read_to_string(&file).expect("written");
    fs::write(&file, answers.replacen("null", "nil", 1)).expect("writable");
    let output = rlg(at, &["--check", "whole"]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        said.contains("answers.jsonl") && said.contains("trial 0"),
        "{said}"
    );

    let output = rlg(at, &["--out", "twice", "--merge", "s0", "s0"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(!at.join("twice").exists(), "nothing half written");
}

#[test]
fn a_trial_repeated_alone_is_the_same_trial() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    challenge(at, &["--out", "all"]);
    challenge(at, &["--out", "one", "--trial", "3"]);
    for file in ["answers.jsonl", "outcomes.jsonl", "commitments.txt"] {
        let [all, one] = ["all", "one"]
            .map(|name| fs::read_to_string(at.join(name).join(file)).expect("written"));
        assert_eq!(all.lines().nth(3), one.lines().next(), "{file}");
    }
}
