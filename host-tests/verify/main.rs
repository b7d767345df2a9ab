//! `cargo verify`: everything that must hold before a change is merged, on a machine that has only rustup.
//!
//! Reads the workspace and, if it is set, `RLG_RECORDINGS`, a folder with `bench-coning`. Prints the output of each
//! step, and as the last line `N passed, N failed`: tests by their own count, every other step as one. Exit code 0 only
//! if nothing failed.
//!
//! An example and not a binary of the package, so that `cargo install --path host-tests` installs `rlg`
//! alone. Everything runs in the release profile: it shares one set of compiled dependencies, and the
//! image is a release build anyway.

mod step;

mod set_up;

mod on_target;

mod fuzz;

use std::process::ExitCode;

use step::{Tally, cargo, cargo_command, heading, root, run};

/// The image's target.
const TARGET: &str = "thumbv7em-none-eabihf";

/// Features and the binaries that need them; the aliases that build them have the features' names.
const IMAGES: [(&str, [&str; 2]); 2] = [
    ("board", ["firmware", "firmware-fixed"]),
    ("emulator", ["emulated", "emulated-fixed"]),
];

fn main() -> ExitCode {
    let mut tally = Tally::default();

    heading("target and components");
    tally.step(set_up::compiler());
    heading("emulator");
    tally.step(set_up::emulator());
    heading("C++ compiler");
    tally.step(set_up::cxx());

    heading("formatting");
    tally.step(cargo(&["fmt", "--all", "--check"]));
    heading("clippy, host");
    tally.step(cargo(&[
        "clippy",
        "--release",
        "--workspace",
        "--all-targets",
        "--",
        "-D",
        "warnings",
    ]));
    heading("clippy, target");
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

    heading("documentation");
    let mut documentation = cargo_command(&["doc", "--release", "--workspace", "--no-deps"]);
    documentation.env("RUSTDOCFLAGS", "-D warnings");
    tally.step(run(documentation));

    heading("tests");
    tally.tests(&["test", "--release", "--workspace", "--no-fail-fast"]);
    heading("laws of the firmware, with overflow checks");
    tally.tests(&[
        "test",
        "--profile",
        "checked",
        "--package",
        "firmware-tests",
        "--test",
        "properties",
    ]);
    heading("fuzzing");
    match fuzz::build() {
        Ok(built) => {
            for name in fuzz::TARGETS {
                tally.step(fuzz::target(&built, name));
            }
        }
        Err(reason) => tally.step(Err(reason)),
    }
    heading("firmware images");
    for (feature, _) in IMAGES {
        // Aliases of .cargo/config.toml: what the documents tell people to type.
        tally.step(cargo(&[feature]));
    }
    heading("no panic links into the interrupt's path");
    tally.tests(&[
        "test",
        "--release",
        "--package",
        "firmware-tests",
        "--test",
        "interrupt_link",
        "--",
        "--ignored",
    ]);
    heading("tests on the emulated target");
    tally.tests(&[
        "test",
        "--release",
        "--package",
        "rlg",
        "--test",
        "on_target",
        "--test",
        "interrupt_calls",
        "--test",
        "fault_campaign",
        "--",
        "--ignored",
    ]);

    heading("a recording on the emulated target, gyros alone");
    play(&mut tally, on_target::gyros_alone(root()));
    heading("a recording on the emulated target, with accelerometers");
    play(&mut tally, on_target::with_accelerometers(root()));

    heading("instructions by stage");
    tally.step(cargo(&["stages"]));

    println!("\n{} passed, {} failed", tally.passed, tally.failed);
    if tally.failed == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Plays a recording through both images; one step for each.
fn play(tally: &mut Tally, recording: Result<on_target::Recording, String>) {
    match recording {
        Ok(recording) => {
            for outcome in on_target::hold_their_budgets(&recording) {
                tally.step(outcome);
            }
        }
        Err(reason) => tally.step(Err(reason)),
    }
}
