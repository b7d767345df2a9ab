//! `rlg doctor`: lists this installation, and the programs that some commands start.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;
use serde::Serialize;

use crate::error::InputError;
use crate::target::emulator::EMULATOR;
use crate::target::image::TARGET;
use crate::terminal::Terminal;

/// List what is installed, for a first look or a bug report
///
/// Version, system and threads; the folder for temporary files; and the programs that some commands start, each with its
/// version and path, or with what needs it and how it is installed. No command but those named needs them. Nothing is changed
/// and nothing is sent.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  rlg doctor\n  rlg doctor --json > doctor.json")]
pub struct Doctor {}

/// Result of the command.
#[derive(Debug, Serialize)]
struct Installation {
    version: &'static str,
    system: &'static str,
    architecture: &'static str,
    /// Cores that a diagnosis uses by default.
    threads: usize,
    /// Path of the running program.
    program: Option<PathBuf>,
    temporary_folder: Folder,
    programs: Vec<Program>,
}

/// A folder to write into.
#[derive(Debug, Serialize)]
struct Folder {
    path: PathBuf,
    is_writable: bool,
}

/// A program that some commands start, or a part of one.
#[derive(Debug, Serialize)]
struct Program {
    name: &'static str,
    /// Its first line about its version; `None` where it does not start.
    version: Option<String>,
    path: Option<PathBuf>,
    needed_for: &'static str,
    install: &'static str,
}

impl Doctor {
    /// Prints the installation.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let found = installation();
        let threads = found.threads;
        terminal.say(format!(
            "rlg {} on {} ({}), {threads} threads",
            found.version, found.system, found.architecture
        ));
        if let Some(program) = &found.program {
            terminal.say(format!("  program           {}", program.display()));
        }
        let Folder { path, is_writable } = &found.temporary_folder;
        let state = if *is_writable { "" } else { ": NOT WRITABLE" };
        terminal.say(format!("  temporary files   {}{state}", path.display()));
        for one in &found.programs {
            let Program {
                name,
                needed_for,
                install,
                ..
            } = one;
            terminal.say(match (&one.version, &one.path) {
                (Some(version), Some(path)) => {
                    format!("  {name:16}  {version} ({})", path.display())
                }
                (Some(version), None) => format!("  {name:16}  {version}"),
                (None, _) => {
                    format!("  {name:16}  not found; for {needed_for}. To install: {install}")
                }
            });
        }
        terminal.result(&found)
    }
}

fn installation() -> Installation {
    let folder = env::temp_dir();
    Installation {
        version: env!("CARGO_PKG_VERSION"),
        system: env::consts::OS,
        architecture: env::consts::ARCH,
        threads: rayon::current_num_threads(),
        program: env::current_exe().ok(),
        temporary_folder: Folder {
            is_writable: tempfile::tempfile_in(&folder).is_ok(),
            path: folder,
        },
        programs: programs(),
    }
}

fn programs() -> Vec<Program> {
    let look = |name, (program, arguments): (&str, &[&str]), needed_for, install| {
        let version = printed_by(program, arguments);
        let version = version.and_then(|text| text.lines().next().map(str::to_owned));
        Program {
            path: version.is_some().then(|| on_path(program)).flatten(),
            version,
            name,
            needed_for,
            install,
        }
    };
    let images = "the firmware images (cargo board, rlg on-target)";
    let installed = printed_by("rustup", &["target", "list", "--installed"]).unwrap_or_default();
    let target = Program {
        name: "firmware target",
        version: installed
            .lines()
            .find(|line| *line == TARGET)
            .map(str::to_owned),
        path: None,
        needed_for: images,
        install: "rustup target add thumbv7em-none-eabihf",
    };
    vec![
        look(
            "cargo",
            ("cargo", &["--version"]),
            images,
            "https://rustup.rs",
        ),
        target,
        look(
            "emulator",
            (EMULATOR, &["--version"]),
            "rlg on-target",
            "apt-get install qemu-system-arm, or its like",
        ),
        look(
            "probe-rs",
            ("probe-rs", &["--version"]),
            "flashing a board (cargo flash)",
            "cargo install probe-rs-tools --locked",
        ),
        look(
            "Python package",
            (
                "python3",
                &[
                    "-c",
                    "from importlib.metadata import version; print('rlg', version('rlg'))",
                ],
            ),
            "import rlg in Python",
            "docs/python.md",
        ),
    ]
}

/// Returns the standard output of a program that succeeds.
fn printed_by(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    output.status.success().then_some(text)
}

/// Returns the path of a program in a folder of `PATH`.
fn on_path(program: &str) -> Option<PathBuf> {
    let folders = env::var_os("PATH")?;
    let mut files = env::split_paths(&folders).map(|folder| folder.join(program));
    files.find(|file| Path::is_file(file))
}
