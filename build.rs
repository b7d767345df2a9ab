//! Names the board's image by its git revision, and hands the linker its scripts, for this package's own images only: the host's binaries keep their own
//! linker set-up, and a firmware that uses the library keeps its own memory.x.

use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory.x");
    if env::var_os("CARGO_FEATURE_BOARD").is_some() {
        name_revision();
    }
    let is_image = env::var_os("CARGO_FEATURE_IMAGE").is_some();
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") || !is_image {
        return;
    }
    // cortex-m-rt's link.x includes memory.x from the linker's search path; a copy in OUT_DIR is found
    // whatever folder cargo was started in.
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy("memory.x", out.join("memory.x")).expect("memory.x stands beside build.rs");
    println!("cargo:rustc-link-search={}", out.display());
    // --nmagic: no padding of segments to the host's page size, so that the first one starts at the
    // vector table.
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}

/// Sets `TRUEAXIS_REVISION`, eight hexadecimal digits: seven of the commit's hash, and a last one of which bit 0 is set if
/// the tree has changes. Without git it stays unset.
fn name_revision() {
    // The flag must follow every change of a source, and every commit.
    println!("cargo:rerun-if-changed=src");
    println!("cargo:rerun-if-changed=Cargo.toml");
    for name in ["HEAD", "index"] {
        if let Some(path) = git(&["rev-parse", "--git-path", name]) {
            println!("cargo:rerun-if-changed={path}");
        }
    }
    let (Some(hash), Some(changes)) = (
        git(&["rev-parse", "HEAD"]),
        git(&["status", "--porcelain", "--untracked-files=no"]),
    ) else {
        return;
    };
    if let Some(seven) = hash.get(..7) {
        let dirty = u8::from(!changes.is_empty());
        println!("cargo:rustc-env=TRUEAXIS_REVISION={seven}{dirty}");
    }
}

/// Output of a git command without its last line end; `None` if it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim_end().to_owned())
}
