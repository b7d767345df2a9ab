//! Tells the linker where the path begins; what it does not reach from there, it leaves out.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        println!("cargo:rustc-link-arg-bins=--entry=interrupt_path");
    }
}
