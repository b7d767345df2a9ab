//! The package's own tests, run by pytest on the library that cargo built.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Makes a folder with the package as installed by pip.
fn installed(libraries: &Path) -> PathBuf {
    let site = Path::new(env!("CARGO_TARGET_TMPDIR")).join("python-site");
    let package = site.join("rlg");
    if package.exists() {
        fs::remove_dir_all(&package).expect("the last run's copy");
    }
    fs::create_dir_all(&package).expect("a folder");
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/rlg");
    for entry in fs::read_dir(sources).expect("the package").flatten() {
        if entry.path().is_file() {
            fs::copy(entry.path(), package.join(entry.file_name())).expect("a copy");
        }
    }
    let library = format!(
        "{}_native{}",
        env::consts::DLL_PREFIX,
        env::consts::DLL_SUFFIX
    );
    fs::copy(libraries.join(library), package.join("_native.abi3.so")).expect("the library");
    site
}

#[test]
#[ignore = "needs a Python with host-tests/python/requirements.txt, named by RLG_PYTHON: cargo verify makes one"]
fn the_package_passes_pytest() {
    passes("not in_full");
}

#[test]
#[ignore = "as the other, and takes minutes: cargo verify nightly runs it"]
fn the_package_passes_pytest_in_full() {
    passes("in_full");
}

/// Runs the tests that a marker expression of pytest selects.
fn passes(marked: &str) {
    let python = env::var_os("RLG_PYTHON").unwrap_or_else(|| "python3".into());
    let this = env::current_exe().expect("a path");
    let libraries = this.parent().expect("the folder of what cargo built");
    let command = libraries
        .with_file_name("rlg")
        .with_extension(env::consts::EXE_EXTENSION);
    let status = Command::new(python)
        .args(["-m", "pytest", "-p", "no:cacheprovider", "--durations=5"])
        // A file at a time, so that data shared by its tests are made once.
        .args(["--numprocesses=2", "--dist=loadfile", "-m", marked])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("PYTHONPATH", installed(libraries))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("RLG_COMMAND", command)
        .status()
        .expect("Python starts");
    assert!(status.success(), "pytest: {status}");
}
