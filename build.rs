//! Hands the linker its scripts, for this package's own images only: the host's binaries keep their own
//! linker set-up, and a firmware that uses the library keeps its own memory.x.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory.x");
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
