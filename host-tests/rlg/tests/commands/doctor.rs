//! `rlg doctor`: the installation, in words and as JSON.

use std::process::{Command, Output};

use serde_json::Value;

fn doctor(path: Option<&str>, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rlg"));
    command.arg("doctor").args(arguments);
    if let Some(path) = path {
        command.env("PATH", path);
    }
    command.output().expect("it runs")
}

#[test]
fn the_installation_is_listed_and_programs_that_are_missing_are_no_error() {
    let nowhere = tempfile::tempdir().expect("a folder");
    let path = nowhere.path().to_str().expect("UTF-8");
    let output = doctor(Some(path), &[]);
    assert!(output.status.success());
    let words = String::from_utf8(output.stdout).expect("UTF-8");
    let first = words.lines().next().expect("a line");
    assert!(
        first.starts_with(concat!("rlg ", env!("CARGO_PKG_VERSION"))),
        "{words}"
    );
    for missing in ["cargo", "emulator", "probe-rs", "Python package"] {
        let line = words.lines().find(|line| line.trim().starts_with(missing));
        let line = line.unwrap_or_else(|| panic!("no {missing} in {words}"));
        assert!(
            line.contains("not found; for ") && line.contains("To install: "),
            "{line}"
        );
    }
}

#[test]
fn programs_have_their_version_and_path() {
    let output = doctor(None, &["--json", "--quiet"]);
    assert!(output.status.success() && output.stderr.is_empty());
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(found["threads"].as_u64().is_some_and(|threads| threads > 0));
    assert_eq!(found["temporary_folder"]["is_writable"], true);
    let program = found["program"].as_str().expect("a path");
    assert_eq!(program, env!("CARGO_BIN_EXE_rlg"));
    let programs = found["programs"].as_array().expect("a list");
    let cargo = programs
        .iter()
        .find(|one| one["name"] == "cargo")
        .expect("cargo");
    let version = cargo["version"].as_str().expect("cargo runs this test");
    assert!(version.starts_with("cargo 1."), "{version}");
    assert!(
        cargo["path"]
            .as_str()
            .is_some_and(|path| path.ends_with("/cargo"))
    );
}
