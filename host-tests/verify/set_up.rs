//! What the other steps need: the target's core library, rustfmt and clippy, the emulator.
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
    if starts(EMULATOR) {
        return Ok(());
    }
    let hint = format!("sudo apt-get update && sudo apt-get install -y {EMULATOR}");
    if !is_root() {
        return Err(format!("{EMULATOR} is missing; install it with: {hint}"));
    }
    for arguments in [
        &["update"][..],
        &["install", "-y", "--no-install-recommends", EMULATOR],
    ] {
        let mut command = Command::new("apt-get");
        command
            .env("DEBIAN_FRONTEND", "noninteractive")
            .args(arguments);
        run(command)?;
    }
    if starts(EMULATOR) {
        Ok(())
    } else {
        Err(format!("{EMULATOR} is installed but does not start"))
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
