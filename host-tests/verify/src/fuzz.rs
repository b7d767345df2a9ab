//! The fuzz targets of `host-tests/fuzz`, each for a bounded time.
//!
//! The fuzzer starts without a corpus, from a fixed seed. For each target the number of inputs is printed, or the input that
//! ended it.
//!
//! LLVM's fuzzer tracks the branches reached by an input. The pinned stable compiler inserts the counters for it with the
//! flags below, which cargo-fuzz passes too; only the address sanitizer needs nightly, and the fuzzed code is safe Rust,
//! with overflow checks and debug assertions (profile `checked`).

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use crate::step::{cargo_command, root, run};

/// Each target.
pub const TARGETS: [&str; 4] = [
    "fuzz-telemetry",
    "fuzz-parameter-block",
    "fuzz-bank-frame",
    "fuzz-image-requests",
];

/// Time for each \[s\]: about a million inputs. No new branches are found after the first five seconds.
const SECONDS: u32 = 20;

/// Longest input \[bytes\]: some hundred frames, four parameter blocks.
const MOST_BYTES: u32 = 4096;

/// Flags for one counter a branch, compared values passed to the fuzzer; one unit of code generation, as required by the
/// counters.
const FLAGS: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
                     -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
                     -Cllvm-args=-sanitizer-coverage-pc-table \
                     -Cllvm-args=-sanitizer-coverage-trace-compares \
                     -Ccodegen-units=1 --cfg fuzzing";

/// Builds all targets and returns their folder. Separate from the other builds, which do not use the flags; for a named
/// target, so that build scripts are not compiled with them.
pub fn build() -> Result<PathBuf, String> {
    let host = host()?;
    let folder = root().join("target").join("fuzz");
    let mut command = cargo_command(&["build", "--profile", "checked", "--package"]);
    command
        .args(["firmware-fuzz", "--features", "fuzzer", "--target", &host])
        .arg("--target-dir")
        .arg(&folder)
        .env("RUSTFLAGS", FLAGS);
    run(command)?;
    Ok(folder.join(host).join("checked"))
}

/// Runs every target for its time, in parallel: each keeps one processor busy.
pub fn targets(built: &Path) -> Vec<Result<(), String>> {
    thread::scope(|scope| {
        TARGETS
            .map(|name| scope.spawn(move || target(built, name)))
            .into_iter()
            .map(|run| run.join().unwrap_or_else(|_| Err("panicked".to_owned())))
            .collect()
    })
}

/// Runs one target for its time.
fn target(built: &Path, name: &str) -> Result<(), String> {
    let found = root().join("target").join("fuzz").join("found");
    fs::create_dir_all(&found).map_err(|error| format!("{}: {error}", found.display()))?;
    let mut command = Command::new(built.join(name));
    command
        .arg(format!("-max_total_time={SECONDS}"))
        .arg(format!("-max_len={MOST_BYTES}"))
        .args(["-seed=1", "-print_final_stats=1"])
        .arg(format!("-artifact_prefix={}/{name}-", found.display()))
        .stderr(Stdio::piped());
    let mut child = command
        .spawn()
        .map_err(|error| format!("{command:?} cannot be started ({error})"))?;
    let output = child.stderr.take().expect("the output is piped");
    let mut last = Vec::new();
    let mut executed = None;
    for line in BufReader::new(output).lines().map_while(Result::ok) {
        if let Some(count) = line.strip_prefix("stat::number_of_executed_units:") {
            executed = Some(count.trim().to_owned());
        }
        // Its progress is long; on a failure its last lines are the relevant ones.
        last.push(line);
        if last.len() > 40 {
            last.remove(0);
        }
    }
    let status = child.wait().map_err(|error| format!("{name}: {error}"))?;
    match executed {
        Some(executed) if status.success() => {
            println!("{name}: {executed} inputs in {SECONDS} s, none that breaks it");
            Ok(())
        }
        _ => Err(format!("{name}: {status}\n{}", last.join("\n"))),
    }
}

/// Returns the compiler's triple of this machine.
fn host() -> Result<String, String> {
    let output = Command::new("rustc")
        .current_dir(root())
        .arg("-vV")
        .output()
        .map_err(|error| format!("rustc cannot be started ({error})"))?;
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .find_map(|line| line.strip_prefix("host: "))
        .map(str::to_owned)
        .ok_or_else(|| "rustc -vV names no host".to_owned())
}
