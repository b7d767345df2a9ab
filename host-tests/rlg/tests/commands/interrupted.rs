//! A command that is signalled to end leaves its output whole, or not at all.

#![cfg(unix)]

use std::fs;
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Instant;

/// Number of moments of the run at which the signal is sent.
const MOMENTS: u32 = 10;

/// Files written by the command.
const RESULTS: [&str; 4] = [
    "diagnosis.json",
    "model.toml",
    "report.html",
    "residual.svg",
];

fn diagnose(bench: &Path, out: &Path) -> Child {
    Command::new(env!("CARGO_BIN_EXE_rlg"))
        .args(["diagnose", "-q", "-o"])
        .args([out, bench])
        .stdout(Stdio::null())
        .spawn()
        .expect("it starts")
}

/// Returns every name in a folder, hidden ones too.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    let mut names: Vec<String> = names
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn told_to_end_at_ten_moments_it_leaves_nothing_half_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = super::answer::recording(folder.path(), 2e-3);
    let begun = Instant::now();
    let whole = diagnose(&bench, &folder.path().join("whole")).wait();
    let whole = whole.expect("it ends");
    assert!(whole.success());
    let length = begun.elapsed();
    let mut ended = 0;
    for moment in 0..MOMENTS {
        // Into a new folder and into one that exists, by Ctrl-C's signal and by the one of `kill`.
        let place = folder.path().join(format!("at-{moment}"));
        fs::create_dir(&place).expect("a folder");
        let out = place.join("out");
        let exists = moment % 2 == 1;
        if exists {
            fs::create_dir(&out).expect("a folder");
        }
        let (signal, number) = [("-INT", 2), ("-TERM", 15)][(moment / 2 % 2) as usize];
        let mut child = diagnose(&bench, &out);
        thread::sleep(length.mul_f64((f64::from(moment) + 0.5) / f64::from(MOMENTS)));
        let told = Command::new("kill")
            .args([signal, &child.id().to_string()])
            .stderr(Stdio::null())
            .status();
        told.expect("kill is there");
        let status = child.wait().expect("it ends");
        let left = if out.exists() {
            names(&out)
        } else {
            Vec::new()
        };
        match status.signal() {
            Some(by) => {
                assert_eq!(by, number, "the shell sees which signal it was");
                ended += 1;
                assert!(
                    left.is_empty() || left == RESULTS,
                    "moment {moment}: {left:?}"
                );
                assert_eq!(out.exists(), exists || left == RESULTS, "moment {moment}");
            }
            None => assert_eq!(left, RESULTS, "it was done before"),
        }
        let beside = names(&place);
        assert!(beside.iter().all(|name| name == "out"), "{beside:?}");
    }
    assert!(ended >= MOMENTS / 2, "only {ended} were told in time");
}
