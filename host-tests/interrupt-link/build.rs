//! Sets the linker's entry at the path's beginning; the linker leaves out all code not reachable from it.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        println!("cargo:rustc-link-arg-bins=--entry=interrupt_path");
    }
}
