//! A panic in the interrupt's path fails the build: `interrupt-link` links, and does not with one put in.

use std::path::Path;
use std::process::{Command, Output};

/// The linker's message on the handler that does not exist.
const MESSAGE: &str = "undefined symbol: the_interrupt_can_panic";

fn link(features: &[&str]) -> Output {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .current_dir(workspace)
        .args(["build", "--release", "--package", "interrupt-link"])
        .args(["--target", "thumbv7em-none-eabihf"])
        .args(features)
        .output()
        .expect("cargo starts")
}

#[test]
#[ignore = "needs the image's target; cargo verify runs it"]
fn nothing_in_the_interrupts_path_can_panic() {
    let output = link(&[]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
#[ignore = "needs the image's target; cargo verify runs it"]
fn a_panic_put_into_the_interrupts_path_does_not_link() {
    for panic in ["panic-by-index", "panic-by-division", "panic-by-unwrap"] {
        let output = link(&["--features", panic]);
        let words = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{panic} links");
        assert!(words.contains(MESSAGE), "{panic}: {words}");
    }
}
