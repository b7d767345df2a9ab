//! Outputs that cannot be written, and wrong command lines.

use std::fs;

use assert_cmd::Command;

use crate::bench::Bench;

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
