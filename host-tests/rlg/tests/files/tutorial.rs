//! `docs/tutorial.md`: its script and commands run in the order of the page, and print the output shown on it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs")
}

/// An action of the reader, or an output.
#[derive(Debug, PartialEq)]
enum Step {
    /// A script of Python.
    Script(String),
    /// A command of `rlg`.
    Command(String),
    /// Beginning of the last command's output.
    Printed(String),
}

/// The steps of a page, in order.
fn steps(page: &str) -> Vec<Step> {
    let mut steps = Vec::new();
    for (place, part) in page.split("```").enumerate() {
        if place % 2 == 0 {
            let commands = part.lines().filter(|line| line.starts_with("    rlg "));
            steps.extend(commands.map(|line| Step::Command(line.trim().to_owned())));
        } else if let Some(script) = part.strip_prefix("python\n") {
            steps.push(Step::Script(script.to_owned()));
        } else if let Some(printed) = part.strip_prefix("text\n") {
            steps.push(Step::Printed(printed.to_owned()));
        }
    }
    steps
}

fn run(folder: &Path, command: &mut Command) -> String {
    let output = command.current_dir(folder).output();
    let output = output.unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {complaint}");
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn the_tutorial_runs_and_prints_what_it_says() {
    let folder = TempDir::new().expect("a temporary folder");
    let page = fs::read_to_string(docs().join("tutorial.md")).expect("the page");
    let (mut printed, mut compared, mut run_before) = (String::new(), 0, Vec::new());
    for step in steps(&page) {
        match step {
            Step::Script(script) => {
                let file = folder.path().join("log.py");
                fs::write(&file, script).expect("a file");
                run(folder.path(), Command::new("python3").arg(&file));
            }
            Step::Command(line) => {
                let mut command = Command::new(env!("CARGO_BIN_EXE_rlg"));
                command.args(line.split_whitespace().skip(1));
                printed = run(folder.path(), &mut command);
                run_before.push(Step::Command(line));
            }
            Step::Printed(expected) => {
                assert!(
                    printed.starts_with(&expected),
                    "printed is\n{printed}not\n{expected}"
                );
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 3, "import, first and second diagnosis");
    let picture = fs::read(folder.path().join("out/found/residual.svg")).expect("a picture");
    let shown = fs::read(docs().join("tutorial.svg")).expect("the page's picture");
    assert!(
        picture == shown,
        "the picture is not out/found/residual.svg"
    );
    let other = fs::read_to_string(docs().join("reading-a-report.md")).expect("the page");
    for step in steps(&other) {
        assert!(
            run_before.contains(&step),
            "{step:?} does not run in the tutorial"
        );
    }
}
