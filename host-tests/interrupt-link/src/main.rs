//! A binary that links only if nothing in the sampling interrupt's path can panic.
//!
//! It is never run. For the target it links the interrupt's calls, for both number systems, from one entry (`path.rs`),
//! with a panic handler that calls a function which does not exist. The linker leaves out code that the entry cannot
//! reach; if a panic is reachable, so is its handler, and linking fails with `undefined symbol:
//! the_interrupt_can_panic`.
//!
//! The features `panic-by-*` put a panic in; `host-tests/firmware/tests/interrupt_link.rs` builds with and
//! without them, so the check is known to fail when it should.
//!
//! It leaves out the image's own peripherals: those are walked in the linked image
//! (`host-tests/rlg/tests/target/interrupt_calls.rs`).
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod path;

#[cfg(not(target_os = "none"))]
fn main() {
    println!("links the interrupt's path for thumbv7em-none-eabihf; see the source");
}
