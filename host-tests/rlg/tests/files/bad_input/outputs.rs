//! Outputs that cannot be written, and wrong command lines.

use std::fs;
use std::path::Path;

use assert_cmd::Command;

use super::bench::{Arguments, Bench, diagnose, navigate, on_target, replay};

#[test]
fn an_output_that_cannot_be_written() {
    // A path below a file: not even the superuser may write there.
    let bench = Bench::new();
    let blocked = bench.folder.path().join("file");
    fs::write(&blocked, "x").expect("a file");
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    let out = blocked.join("params.bin");
    let output = command
        .arg("params")
        .arg(bench.model())
        .arg("--out")
        .arg(&out)
        .output()
        .expect("runs");
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(words.contains("params.bin: cannot be written"), "{words}");
}

#[test]
fn a_command_line_that_is_wrong() {
    for arguments in [vec!["inspect"], vec!["no-such-command"], vec![]] {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        let output = command.args(arguments).output().expect("runs");
        assert_eq!(output.status.code(), Some(2));
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    use std::process::{Command as Process, Stdio};
    let bench = Bench::new();
    let mut child = Process::new(env!("CARGO_BIN_EXE_rlg"))
        .args(["inspect", "--json"])
        .arg(bench.recording())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    // Both readers leave before a word is written.
    drop(child.stdout.take());
    drop(child.stderr.take());
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
}

/// Checks for a refusal with `part`, and every file of the bench unchanged.
fn is_kept(bench: &Bench, command: Arguments, model: &Path, out: &Path, part: &str) {
    let files = [
        bench.recording().join("recording.toml"),
        bench.model(),
        model.into(),
    ];
    let read = || files.each_ref().map(|file| fs::read(file).expect("a file"));
    let before = read();
    let mut rlg = Command::cargo_bin("rlg").expect("the command is built");
    let arguments = command(&bench.recording(), model, out);
    let output = rlg.args(arguments).output().expect("runs");
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(words.contains(part), "no {part:?} in: {words}");
    assert_eq!(read(), before);
}

#[test]
fn an_output_folder_that_is_an_input() {
    let bench = Bench::new();
    let roundabout = bench.recording().join("..").join("recording");
    for command in [diagnose, replay, on_target, navigate] {
        for out in [&bench.recording(), &roundabout] {
            is_kept(&bench, command, &bench.model(), out, "recording itself");
        }
    }
    let models = bench.folder.path();
    is_kept(
        &bench,
        diagnose,
        &bench.model(),
        models,
        "holds the model, which the result model.toml would replace",
    );
    let named_as_a_result = models.join("on_target.json");
    fs::copy(bench.model(), &named_as_a_result).expect("a copy");
    is_kept(
        &bench,
        on_target,
        &named_as_a_result,
        models,
        "on_target.json would replace",
    );
}
