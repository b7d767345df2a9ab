//! `cargo verify [quick|full|nightly|archive]`: all checks required before a change is merged, on a machine with only rustup.
//!
//! `quick` is for use during work: formatting, lints and the tests of the packages that take seconds. `full`, which
//! continuous integration runs, is every check that a change could break. `nightly` adds longer searches: the fuzzer, the
//! tests with `in_full` in their name, the images against register models if there is cmake, and marks of the diagnosis on a
//! new seed, and makes and tries the archive. `archive` does that alone: what installs the command and the Python package
//! without a compiler (`archive`).
//!
//! Inputs: the workspace, and recordings of others from `RLG_RECORDINGS` if that is set. It prints the output of each step,
//! then the seconds of each and of the longest test programs, and as the last line `N passed, N failed`: the tests by their
//! own count, every other step as one. The exit code is 0 only if nothing failed.
//!
//! Host code is compiled once: every step that runs some of it names the whole workspace with its tests, because cargo
//! compiles packages again for another selection of features. Only the crates with unit tests are compiled a second time, in
//! packages without optimisation (`unit-tests`). Steps that share no artefacts run in parallel.

mod level;

mod step;

mod set_up;

mod fuzz;

mod library;

mod archive;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use level::Level;
use step::{Beside, Tally, cargo, cargo_command, root, run};

/// The image's target.
const TARGET: &str = "thumbv7em-none-eabihf";

/// Features and the binaries that need them; their build aliases have the features' names.
const IMAGES: [(&str, [&str; 2]); 2] = [
    ("board", ["firmware", "firmware-fixed"]),
    ("emulator", ["emulated", "emulated-fixed"]),
];

/// Images around the boot selector, their features and binaries; their build aliases have the features' names.
const UPDATE_IMAGES: [(&str, &[&str]); 3] = [
    ("selector", &["selector"]),
    ("slot-a", &["firmware", "firmware-fixed"]),
    ("slot-b", &["firmware", "firmware-fixed"]),
];

/// First arguments of each test command.
const TEST: [&str; 3] = ["test", "--release", "--workspace"];

/// Packages with tests of a few seconds.
const QUICK: [&str; 7] = [
    "firmware-tests",
    "strapdown",
    "rlg-signal",
    "rlg-inference",
    "rlg-catalogue",
    "rlg-findings",
    "unit-tests",
];

fn main() -> ExitCode {
    let level = match Level::of(std::env::args().skip(1)) {
        Ok(level) => level,
        Err(problem) => {
            eprintln!("{problem}");
            return ExitCode::from(2);
        }
    };
    let mut tally = Tally::default();
    match level {
        Level::Quick => quick(&mut tally),
        Level::Full => full(&mut tally),
        Level::Nightly => {
            full(&mut tally);
            nightly(&mut tally);
            archived(&mut tally);
        }
        Level::Archive => archived(&mut tally),
    }
    if tally.end() == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Runs every check that a change could break.
fn full(tally: &mut Tally) {
    set_up(tally);
    // With artefacts of their own, so that neither waits for the other.
    tally.beside(apart(), |tally| {
        checks(tally);
        firmware(tally);
        tally.heading("building the tests");
        tally.step(cargo(&[&TEST[..], &["--no-run"]].concat()));
    });
    tests(tally);
}

/// Makes and tries the archive.
fn archived(tally: &mut Tally) {
    tally.heading("archive");
    tally.step(archive::archive());
}

/// Runs formatting, lints and tests of seconds.
fn quick(tally: &mut Tally) {
    tally.heading("compiler");
    tally.step(set_up::compiler());
    tally.heading("formatting");
    tally.step(cargo(&["fmt", "--all", "--check"]));
    let packages = QUICK.iter().flat_map(|package| ["--package", package]);
    let packages: Vec<&str> = packages.collect();
    tally.heading("clippy");
    let clippy = [&["clippy", "--release", "--all-targets"], &packages[..]].concat();
    tally.step(cargo(&[&clippy[..], &["--", "-D", "warnings"]].concat()));
    tally.heading("tests");
    tally.tests(&[&["test", "--release", "--no-fail-fast"], &packages[..]].concat());
}

/// Installs the requirements on the machine.
fn set_up(tally: &mut Tally) {
    tally.heading("target and components");
    tally.step(set_up::compiler());
    tally.heading("emulator");
    tally.step(set_up::emulator());
    tally.heading("browser");
    tally.step(set_up::browser());
    tally.heading("C++ compiler");
    tally.step(set_up::cxx());
}

/// Lists the steps that share nothing with the workspace's release build.
fn apart() -> Vec<Beside> {
    vec![
        Beside::steps("Python", || vec![set_up::python()]),
        Beside::steps("licences, sources and unused dependencies", dependencies),
        Beside::steps("the library as others take it", || {
            let examples = library::examples().into_iter();
            examples.chain([library::package()]).collect()
        }),
        Beside::tests(
            "laws of the firmware, with overflow checks",
            &[
                "test",
                "--profile",
                "checked",
                "--package",
                "firmware-tests",
                "--test",
                "properties",
            ],
        ),
    ]
}

fn dependencies() -> Vec<Result<(), String>> {
    match set_up::dependency_tools() {
        Ok([deny, shear]) => {
            let checks = ["check", "licenses", "bans", "sources"];
            let arguments = [&["--locked", "--workspace"], &checks[..]].concat();
            vec![
                run(in_workspace(&deny, &arguments)),
                run(in_workspace(&shear, &["--locked", "--deny-warnings"])),
            ]
        }
        Err(reason) => vec![Err(reason)],
    }
}

/// Runs the checks that need no program to run.
fn checks(tally: &mut Tally) {
    tally.heading("formatting");
    tally.step(cargo(&["fmt", "--all", "--check"]));
    tally.heading("clippy, host");
    tally.step(cargo(&[
        "clippy",
        "--release",
        "--workspace",
        "--all-targets",
        "--",
        "-D",
        "warnings",
    ]));
    tally.heading("clippy, target");
    for (feature, [one, other]) in IMAGES {
        tally.step(cargo(&[
            "clippy",
            "--release",
            "--package",
            "trueaxis",
            "--lib",
            "--features",
            feature,
            "--bin",
            one,
            "--bin",
            other,
            "--target",
            TARGET,
            "--",
            "-D",
            "warnings",
        ]));
    }
    for (feature, binaries) in UPDATE_IMAGES {
        let lint = [
            "clippy",
            "--release",
            "--package",
            "trueaxis",
            "--target",
            TARGET,
        ];
        let binaries = binaries.iter().flat_map(|binary| ["--bin", binary]);
        let of_image: Vec<&str> = ["--features", feature]
            .into_iter()
            .chain(binaries)
            .collect();
        // The selector has no part of the library but the slots.
        let defaults: &[&str] = if feature == "selector" {
            &["--no-default-features"]
        } else {
            &[]
        };
        tally.step(cargo(
            &[&lint[..], defaults, &of_image, &["--", "-D", "warnings"]].concat(),
        ));
    }
    tally.heading("documentation");
    let mut documentation = cargo_command(&["doc", "--release", "--workspace", "--no-deps"]);
    documentation.env("RUSTDOCFLAGS", "-D warnings");
    tally.step(run(documentation));
}

/// Builds the images, and the chain alone.
fn firmware(tally: &mut Tally) {
    tally.heading("firmware images");
    let aliases = IMAGES.map(|(feature, _)| feature).into_iter();
    for alias in aliases.chain(UPDATE_IMAGES.map(|(feature, _)| feature)) {
        // Aliases of .cargo/config.toml: the commands in the documents.
        tally.step(cargo(&[alias]));
    }
    tally.heading("the chain alone");
    tally.step(library::chain_alone());
    tally.step(library::its_dependencies());
}

fn tests(tally: &mut Tally) {
    let of = |heading, more: &[&'static str]| Beside::tests(heading, &[&TEST[..], more].concat());
    let others = vec![
        of(
            "tests on the emulated target",
            // Tests in full take half an hour.
            &["--test", "target", "--", "--ignored", "--skip", "in_full"],
        ),
        of(
            "no panic links into the interrupt's path",
            &["--test", "interrupt_link", "--", "--ignored"],
        ),
        of(
            "the page in a browser",
            &["--test", "commands", "--", "--ignored", "in_a_browser"],
        ),
        of(
            "Python package and fleets",
            &["--test", "pytest", "--", "--ignored", "--skip", "in_full"],
        ),
    ];
    tally.beside(others, |tally| {
        tally.heading("tests");
        tally.tests(&[&TEST[..], &["--no-fail-fast"]].concat());
    });
    tally.heading("instructions by stage");
    tally.step(run(built("examples/stages")));
}

/// Runs the longer searches.
fn nightly(tally: &mut Tally) {
    tally.heading("fuzzing");
    match fuzz::build() {
        Ok(built) => {
            for outcome in fuzz::targets(&built) {
                tally.step(outcome);
            }
        }
        Err(reason) => tally.step(Err(reason)),
    }
    tally.heading("tests in full");
    tally.tests(&[&TEST[..], &["--no-fail-fast", "--", "--ignored", "in_full"]].concat());
    tally.heading("images against register models");
    // Unicorn is compiled from source, which requires more than rustup installs.
    if Command::new("cmake").arg("--version").output().is_ok() {
        tally.tests(&["registers", "--no-fail-fast"]);
    } else {
        println!("passed over: there is no cmake (host-tests/registers/README.md)");
    }
    tally.heading("marks on a fresh seed");
    let mut marks = built("rlg");
    let seed = level::days_since_1970().to_string();
    marks.args([
        "challenge",
        "--marks",
        "--declares",
        "nothing",
        "--trials",
        "200",
    ]);
    marks.args(["--most-rows", "60000", "--seed", &seed, "--out"]);
    marks.arg(root().join("target").join("marks").join(&seed));
    tally.step(run(marks));
}

/// Returns a program that `cargo test` built with the tests.
fn built(name: &str) -> Command {
    let folder = std::env::var_os("CARGO_TARGET_DIR");
    let folder = folder.map_or_else(|| root().join("target"), PathBuf::from);
    Command::new(folder.join("release").join(name))
}

fn in_workspace(program: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.current_dir(root()).args(arguments);
    command
}
