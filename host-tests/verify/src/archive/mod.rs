//! `target/archive/`: files that install the command and the Python package without a compiler, made, and tried in an empty folder.
//!
//! - `rlg-VERSION-x86_64-linux.tar.gz`: the program, its pages, completions and documentation.
//! - `rlg-VERSION-cp310-abi3-....whl`: the Python package, one file for 3.10 and later.
//! - `rlg-VERSION-source.tar.gz`: the commit that both were built from.
//! - `SHA256SUMS`.
//!
//! The program is linked statically against glibc, not musl: the golden table and every test ran with glibc's mathematics, so
//! the answer keeps its digits, and the allocator's settings (`rlg/src/main.rs`) are glibc's. It needs no C compiler beyond
//! that of every other build. Archives are made by tar, gzip and sha256sum, which every Linux has and people unpack them
//! with; this program has no dependencies (`Cargo.toml`), and the tar and sha2 crates would be its first.
//!
//! The version is that of the workspace (`Cargo.toml`), which this program was built with.

mod licences;

mod trial;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::set_up;
use crate::step::{cargo_command, environment_program, root, run};

/// Version of the workspace.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Compiler's triple of the program.
const TARGET: &str = "x86_64-unknown-linux-gnu";

/// Variable with the compiler's flags for that triple alone: build scripts and macros are linked as always.
const FLAGS: &str = "CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_RUSTFLAGS";

/// Files and folders of the workspace beside the program, at their places, so that commands and links of the README hold.
const BESIDE: [&str; 7] = [
    "README.md",
    "CHANGELOG.md",
    "CITATION.cff",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "docs",
    "host-tests/scenarios",
];

/// Shells with the place of their completions.
const COMPLETIONS: [(&str, &str); 3] = [
    ("bash", "share/bash-completion/completions/rlg"),
    ("zsh", "share/zsh/site-functions/_rlg"),
    ("fish", "share/fish/vendor_completions.d/rlg.fish"),
];

/// Makes the archive, tries it, and puts it to its place, which holds the last complete one until then.
pub fn archive() -> Result<(), String> {
    if !cfg!(all(
        target_os = "linux",
        target_env = "gnu",
        target_arch = "x86_64"
    )) {
        return Err(format!("archives are made on {TARGET}"));
    }
    is_committed()?;
    let target = root().join("target");
    let (part, whole) = (target.join("archive.part"), target.join("archive"));
    let made = empty(&part).and_then(|()| {
        made_in(&part)?;
        trial::tried(&part, VERSION)
    });
    if let Err(reason) = made {
        remove(&part)?;
        return Err(reason);
    }
    remove(&whole)?;
    fs::rename(&part, &whole).map_err(|error| format!("{}: {error}", whole.display()))?;
    for (name, bytes) in files(&whole)? {
        println!("{:7.1} MB  {name}", bytes as f64 * 1e-6);
    }
    Ok(())
}

/// Fails if the source package would not be what the program is built from.
fn is_committed() -> Result<(), String> {
    let changed = output_of(git(&["status", "--porcelain"]))?;
    match changed.lines().next() {
        None => Ok(()),
        Some(first) => Err(format!(
            "{}: not committed, so it would be missing from the source package",
            first.trim_start()
        )),
    }
}

/// Makes every file of the archive in a folder.
fn made_in(folder: &Path) -> Result<(), String> {
    source(folder)?;
    let program = program()?;
    packed(&program, folder)?;
    wheel(folder)?;
    let names = files(folder)?;
    let mut sums = Command::new("sha256sum");
    sums.current_dir(folder)
        .args(names.iter().map(|(name, _)| name));
    write(&folder.join("SHA256SUMS"), &output_of(sums)?)
}

/// Packs the commit.
fn source(folder: &Path) -> Result<(), String> {
    let name = format!("rlg-{VERSION}-source");
    let mut command = git(&["archive", "--format=tar.gz"]);
    command.arg(format!("--prefix={name}/"));
    command.arg("--output").arg(folder.join(name + ".tar.gz"));
    command.arg("HEAD");
    run(command)
}

/// Returns the folder of the builds: neither selects the features of the tests, which would be compiled again after it.
fn build_folder() -> PathBuf {
    let folder = std::env::var_os("CARGO_TARGET_DIR");
    let folder = folder.map_or_else(|| root().join("target"), PathBuf::from);
    folder.join("archive-build")
}

/// Builds the program.
///
/// # Returns
/// Its path.
fn program() -> Result<PathBuf, String> {
    let arguments = [
        "build",
        "--release",
        "--locked",
        "--package",
        "rlg",
        "--bin",
        "rlg",
    ];
    let mut command = cargo_command(&arguments);
    command.args(["--target", TARGET]);
    command.arg("--target-dir").arg(build_folder());
    command.env(FLAGS, "-C target-feature=+crt-static -C strip=symbols");
    run(command)?;
    let program = build_folder().join(TARGET).join("release").join("rlg");
    match needed_libraries(&program)? {
        0 => Ok(program),
        needed => Err(format!("{}: needs {needed} libraries", program.display())),
    }
}

/// Counts the shared libraries that a program needs.
fn needed_libraries(program: &Path) -> Result<usize, String> {
    let mut command = Command::new("readelf");
    command.args(["--dynamic", "--wide"]).arg(program);
    let said = output_of(command)?;
    Ok(said
        .lines()
        .filter(|line| line.contains("(NEEDED)"))
        .count())
}

/// Packs the program with its pages, completions, licences and documentation.
fn packed(program: &Path, folder: &Path) -> Result<(), String> {
    let name = format!("rlg-{VERSION}-x86_64-linux");
    let tree = folder.join(&name);
    for place in ["bin", "share/man"] {
        make(&tree.join(place))?;
    }
    copy(program, &tree.join("bin/rlg"))?;
    let mut pages = Command::new(program);
    pages
        .args(["man", "--out"])
        .arg(tree.join("share/man/man1"));
    run(pages)?;
    for (shell, place) in COMPLETIONS {
        let place = tree.join(place);
        make(place.parent().unwrap_or(&tree))?;
        let mut command = Command::new(program);
        command.args(["completions", shell]);
        write(&place, &output_of(command)?)?;
    }
    for place in BESIDE {
        let parent = tree.join(place);
        make(parent.parent().unwrap_or(&tree))?;
        let mut command = Command::new("cp");
        command.arg("-r").arg(root().join(place)).arg(&parent);
        run(command)?;
    }
    let licences = licences::text()?;
    write(&tree.join("LICENSES-OTHERS"), &licences)?;
    write(&folder.join("LICENSES-OTHERS"), &licences)?;
    // The same commit gives the same bytes, whoever packs them.
    let time = output_of(git(&["log", "-1", "--format=%ct"]))?;
    let mut command = Command::new("tar");
    command.current_dir(folder);
    command.args(["--sort=name", "--owner=0", "--group=0", "--numeric-owner"]);
    command.args(["--mode=go=rX,u+rw", "--use-compress-program=gzip -9n"]);
    command.arg(format!("--mtime=@{}", time.trim()));
    command.args(["-cf", &format!("{name}.tar.gz"), &name]);
    run(command)?;
    remove(&tree)
}

/// Builds the Python package, with maturin from the environment of the Python tests.
fn wheel(folder: &Path) -> Result<(), String> {
    set_up::python()?;
    let mut command = Command::new(environment_program("maturin"));
    command.current_dir(root());
    command.env("CARGO_TARGET_DIR", build_folder());
    command.args(["build", "--release", "--locked", "--manifest-path"]);
    command.arg("host-tests/python/Cargo.toml");
    command
        .arg("--interpreter")
        .arg(environment_program("python"));
    command.arg("--out").arg(folder);
    run(command)
}

/// Lists the files of a folder by name, with their sizes \[bytes\].
fn files(folder: &Path) -> Result<Vec<(String, u64)>, String> {
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let size = entry.metadata().map_err(failed)?.len();
        found.push((entry.file_name().to_string_lossy().into_owned(), size));
    }
    found.sort();
    Ok(found)
}

fn git(arguments: &[&str]) -> Command {
    let mut command = Command::new("git");
    command.current_dir(root()).args(arguments);
    command
}

/// Returns what a command prints; its errors go to this program's.
fn output_of(mut command: Command) -> Result<String, String> {
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("{command:?} cannot be started ({error})"))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(format!("{command:?}: {}", output.status)),
    }
}

fn make(folder: &Path) -> Result<(), String> {
    fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))
}

fn copy(from: &Path, to: &Path) -> Result<(), String> {
    let copied = fs::copy(from, to);
    copied.map_or_else(
        |error| Err(format!("{}: {error}", from.display())),
        |_| Ok(()),
    )
}

fn write(file: &Path, text: &str) -> Result<(), String> {
    fs::write(file, text).map_err(|error| format!("{}: {error}", file.display()))
}

/// Removes a folder, if it is there.
fn remove(folder: &Path) -> Result<(), String> {
    match fs::remove_dir_all(folder) {
        Err(error) if folder.exists() => Err(format!("{}: {error}", folder.display())),
        _ => Ok(()),
    }
}

/// Makes a folder without files.
fn empty(folder: &Path) -> Result<(), String> {
    remove(folder)?;
    make(folder)
}
