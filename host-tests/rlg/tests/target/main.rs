//! The firmware's images: played in the emulator and compared with the host, and read instruction by instruction.
//!
//! Most tests need `qemu-system-arm` and the image's target, so a plain `cargo test` skips them; `cargo verify` installs
//! both and runs them.

mod fault_campaign;
mod interrupt_calls;
mod on_target;
mod raw_stream;
#[cfg(unix)]
mod self_test;
mod terms;
mod upload;
#[cfg(unix)]
mod upload_firmware;
mod whole_recordings;
