//! What the other steps need: the target's core library, rustfmt and clippy, the emulator, a C++ compiler.
//!
//! Each is looked for first; nothing is downloaded where it is there. Where this program may not install
//! (no root), it says the exact command and the step fails.

use std::process::{Command, Stdio};

use crate::TARGET;
use crate::step::{root, run};

/// The emulator's program, and the Debian package that holds it.
const EMULATOR: &str = "qemu-system-arm";

/// Adds the image's target and the two components to the pinned toolchain, where they are missing.
pub fn compiler() -> Result<(), String> {
    for (list, wanted) in [
        (["target", "list", "--installed"], TARGET),
        (["component", "list", "--installed"], "rustfmt"),
        (["component", "list", "--installed"], "clippy"),
    ] {
        let output = rustup(&list)
            .stderr(Stdio::inherit())
            .output()
            .map_err(|error| format!("rustup cannot be started ({error})"))?;
        let installed = String::from_utf8_lossy(&output.stdout)
            .lines()
            .any(|line| line.starts_with(wanted));
        if !installed {
            run(rustup(&[list[0], "add", wanted]))?;
        }
        println!("{wanted}: there");
    }
    Ok(())
}

/// Installs the emulator where it is missing and this may be done.
pub fn emulator() -> Result<(), String> {
    program(EMULATOR, EMULATOR)
}

/// The compiler of the fuzzer's runtime.
pub fn cxx() -> Result<(), String> {
    program("c++", "g++")
}

/// Installs the Debian package `package` where `program` is missing and this may be done.
fn program(program: &str, package: &str) -> Result<(), String> {
    if starts(program) {
        return Ok(());
    }
    let hint = format!("sudo apt-get update && sudo apt-get install -y {package}");
    if !is_root() {
        return Err(format!("{program} is missing; install it with: {hint}"));
    }
    for arguments in [
        &["update"][..],
        &["install", "-y", "--no-install-recommends", package],
    ] {
        let mut command = Command::new("apt-get");
        command
            .env("DEBIAN_FRONTEND", "noninteractive")
            .args(arguments);
        run(command)?;
    }
    if starts(program) {
        Ok(())
    } else {
        Err(format!("{program} is installed but does not start"))
    }
}

fn rustup(arguments: &[&str]) -> Command {
    let mut command = Command::new("rustup");
    command.current_dir(root()).args(arguments);
    command
}

/// Whether `program --version` runs; prints what it says.
fn starts(program: &str) -> bool {
    Command::new(program)
        .arg("--version")
        .status()
        .is_ok_and(|status| status.success())
}

/// Whether this user may install packages.
fn is_root() -> bool {
    Command::new("id")
        .arg("-u")
        .output()
        .is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}
