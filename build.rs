//! Names the board's image by its git revision, and hands the linker its scripts, for this package's own images only: the host's binaries keep their own
//! linker set-up, and a firmware that uses the library keeps its own memory.x.

use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

#[path = "src/store/image_layout.rs"]
#[allow(dead_code, reason = "the library uses the rest")]
mod image_layout;

use image_layout::{
    FLASH_BEGIN, IMAGE_HEADER_BYTES, IMAGE_SLOT_BYTES, IMAGES_BEGIN, NOTE_BEGIN, NOTE_BYTES,
    PARAMETER_SLOTS_BEGIN, PARAMETER_SLOTS_BYTES, RAM_BEGIN, RAM_BYTES, SELECTOR_BYTES,
    SELECTOR_RAM_BYTES,
};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=src/store/image_layout.rs");
    if env::var_os("CARGO_FEATURE_BOARD").is_some() {
        name_revision();
    }
    let has = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    let is_image = has("IMAGE");
    let is_selector = has("SELECTOR");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") || !(is_image || is_selector) {
        return;
    }
    // cortex-m-rt's link.x includes memory.x from the folder of the build or the linker's search path, and that includes
    // regions.x: copies in OUT_DIR are found whatever folder cargo was started in.
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy("memory.x", out.join("memory.x")).expect("memory.x stands beside build.rs");
    // src/hardware/mod.rs refuses both slots at a time.
    let room = IMAGE_SLOT_BYTES - IMAGE_HEADER_BYTES;
    let ram = (RAM_BEGIN, RAM_BYTES - NOTE_BYTES);
    let regions = if is_selector {
        let ram = (NOTE_BEGIN - SELECTOR_RAM_BYTES, SELECTOR_RAM_BYTES);
        regions((FLASH_BEGIN, SELECTOR_BYTES), ram)
    } else if has("SLOT_A") {
        regions((IMAGES_BEGIN + IMAGE_HEADER_BYTES, room), ram)
    } else if has("SLOT_B") {
        let begin = IMAGES_BEGIN + IMAGE_SLOT_BYTES + IMAGE_HEADER_BYTES;
        regions((begin, room), ram)
    } else {
        let bytes = PARAMETER_SLOTS_BEGIN - FLASH_BEGIN;
        regions((FLASH_BEGIN, bytes), (RAM_BEGIN, RAM_BYTES))
    };
    fs::write(out.join("regions.x"), regions).expect("OUT_DIR takes a file");
    println!("cargo:rustc-link-search={}", out.display());
    // --nmagic: no padding of segments to the host's page size, so that the first one starts at the
    // vector table.
    let defmt = is_image.then_some("-Tdefmt.x");
    for argument in ["--nmagic", "-Tlink.x"].into_iter().chain(defmt) {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}

/// The linker's regions of an image, each beginning and bytes.
fn regions((flash, flash_bytes): (u32, u32), (ram, ram_bytes): (u32, u32)) -> String {
    format!(
        "/* Made by build.rs from src/store/image_layout.rs. */
MEMORY
{{
  FLASH : ORIGIN = {flash:#010x}, LENGTH = {flash_bytes}
  SLOTS : ORIGIN = {PARAMETER_SLOTS_BEGIN:#010x}, LENGTH = {PARAMETER_SLOTS_BYTES}
  RAM   : ORIGIN = {ram:#010x}, LENGTH = {ram_bytes}
}}
"
    )
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
