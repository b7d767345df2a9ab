//! The firmware library as used by others: the chain alone, the examples under `examples/`, and the package.

use std::process::{Command, Stdio};

use crate::TARGET;
use crate::step::{cargo, cargo_command, root, run};

/// Builds chain and processor without anything around them, for the target.
pub fn chain_alone() -> Result<(), String> {
    cargo(&[
        "build",
        "--release",
        "--package",
        "trueaxis",
        "--lib",
        "--no-default-features",
        "--target",
        TARGET,
    ])
}

/// Checks that `libm` is the only dependency of that build.
pub fn its_dependencies() -> Result<(), String> {
    let mut command = cargo_command(&[
        "tree",
        "--package",
        "trueaxis",
        "--no-default-features",
        "--target",
        TARGET,
        "--edges",
        "normal,build",
        "--prefix",
        "none",
        "--format",
        "{lib}",
    ]);
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("{command:?} cannot be started ({error})"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let found: Vec<&str> = text.split_whitespace().collect();
    println!("chain alone: {}", found.join(", "));
    if output.status.success() && found == ["trueaxis", "libm"] {
        Ok(())
    } else {
        Err(format!(
            "{command:?}: expected trueaxis and libm, found {found:?}"
        ))
    }
}

/// Checks the format of the examples, a workspace of their own, and builds them; their manifest denies warnings.
pub fn examples() -> [Result<(), String>; 2] {
    [
        &["fmt", "--all", "--check"][..],
        &["build", "--release", "--locked"],
    ]
    .map(|arguments| run(of_examples(arguments)))
}

/// Prepares cargo in the folder of the examples, with its settings.
fn of_examples(arguments: &[&str]) -> Command {
    let mut command = cargo_command(arguments);
    command.current_dir(root().join("examples"));
    command
}

/// Packs the library for a registry, and builds it from the archive.
pub fn package() -> Result<(), String> {
    cargo(&[
        "package",
        "--package",
        "trueaxis",
        "--locked",
        "--allow-dirty",
    ])
}
