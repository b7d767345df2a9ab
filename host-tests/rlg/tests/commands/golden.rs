//! The golden table: a part of it is recomputed and must equal the reviewed file, to the last bit of every diagnosis.
//!
//! Its bench recordings are compared in `diagnose/bench_recordings.rs`, which diagnoses them anyway. The whole table takes
//! minutes: `rlg challenge --golden host-tests/challenge/golden.tsv --compare --recordings R`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use rlg::challenge::commit::sha256;
use rlg::challenge::golden::{Table, trial_name};

fn reviewed() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../challenge/golden.tsv")
}

fn rlg(folder: &Path, arguments: &[&str]) -> Output {
    Command::cargo_bin("rlg")
        .expect("the binary")
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("it starts")
}

/// Returns the result, then the other output.
fn words(output: &Output) -> String {
    let streams = [&output.stdout, &output.stderr];
    streams.map(|bytes| String::from_utf8_lossy(bytes)).concat()
}

#[test]
fn the_first_trials_are_those_of_the_reviewed_table() {
    are_those_of_the_reviewed_table(4);
}

#[test]
#[ignore = "minutes: --test commands -- --ignored in_full"]
fn all_trials_are_those_of_the_reviewed_table_in_full() {
    let text = fs::read_to_string(reviewed()).expect("the reviewed table");
    let table = Table::parse(&text, &reviewed()).unwrap_or_else(|error| panic!("{error}"));
    are_those_of_the_reviewed_table(table.header.trials);
}

fn are_those_of_the_reviewed_table(trials: u64) {
    let output = Command::cargo_bin("rlg")
        .expect("the binary")
        .args(["challenge", "--compare", "--rows", &format!("0..{trials}")])
        .arg("--golden")
        .arg(reviewed())
        .output()
        .expect("it starts");
    let said = words(&output);
    assert!(output.status.success(), "{said}");
    let equal = format!("{trials} rows compared: {trials} equal");
    assert!(said.contains(&equal), "{said}");
}

#[test]
fn the_reviewed_table_reads_back_to_its_own_bytes() {
    let text = fs::read_to_string(reviewed()).expect("the reviewed table");
    let table = Table::parse(&text, &reviewed()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(table.text(), text, "rows are sorted");
    let trials = (0..table.header.trials).map(trial_name);
    let bench = ["bench-coning", "bench-null", "bench-shake"].map(str::to_owned);
    for name in trials.chain(bench) {
        let rows = table.rows.iter().filter(|row| row.name() == name);
        assert_eq!(rows.count(), 1, "{name}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_table_and_a_changed_field_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let golden = |file: &str, more: &[&str]| {
        let output = rlg(at, &[&["challenge", "--golden", file][..], more].concat());
        (output.status.code(), words(&output))
    };
    let part = ["--trials", "20", "--rows", "0..1", "--threads", "1"];
    let (code, said) = golden("one.tsv", &part);
    assert_eq!(code, Some(0), "{said}");
    let read = |name: &str| fs::read_to_string(at.join(name)).expect("written");
    let text = read("one.tsv");
    assert_eq!(text.lines().count(), 4, "{text}");

    // The hash is that of the file written by `rlg diagnose`, but for the version.
    let trial = [
        "challenge",
        "--out",
        "trial",
        "--trials",
        "20",
        "--trial",
        "0",
    ];
    let output = rlg(at, &trial);
    assert!(output.status.success(), "{}", words(&output));
    let model = "trial/recording/model.toml";
    let output = rlg(
        at,
        &[
            "diagnose",
            "trial/recording",
            "--model",
            model,
            "--out",
            "said",
        ],
    );
    assert!(output.status.success(), "{}", words(&output));
    let json = read("said/diagnosis.json");
    let kept = json
        .lines()
        .filter(|line| !line.starts_with("  \"version\": "));
    let kept: String = kept.map(|line| format!("{line}\n")).collect();
    let row = text.lines().last().expect("a row");
    assert!(row.starts_with("trial-0000\t"), "{row}");
    assert!(row.ends_with(&sha256(kept.as_bytes())), "{row}");

    fs::write(at.join("one.tsv"), text.replace("\tnull\t", "\tsingle\t")).expect("writable");
    let again = ["--compare", "--rows", "0..1", "--threads", "2"];
    let (code, said) = golden("one.tsv", &again);
    assert_eq!(code, Some(2), "{said}");
    // One field, and no other: the hash is that of one thread.
    assert_eq!(said.matches("    - ").count(), 1, "{said}");
    for part in [
        "trial-0000:",
        "family",
        "- single",
        "+ null",
        "0 equal, 1 differ",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // Rows missing from the reviewed table are no match, and leave it unchanged.
    let before = read("one.tsv");
    let (code, said) = golden("one.tsv", &["--compare", "--rows", "2..3"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("does not have the rows"), "{said}");
    assert_eq!(read("one.tsv"), before);
    // An empty comparison is not equality.
    for (rows, problem) in [("0..21", "is beyond the table"), ("0..0", "leaves no row")] {
        let (code, said) = golden("one.tsv", &["--compare", "--rows", rows]);
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(problem), "{said}");
    }
    fs::write(at.join("one.tsv"), "name\tverdict\n").expect("writable");
    let (code, said) = golden("one.tsv", &["--compare", "--rows", "0..2"]);
    assert_eq!(code, Some(2));
    assert!(said.contains("is no golden table"), "{said}");
}
