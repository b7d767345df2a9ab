//! The firmware with the fixed-point core. On the target: the image (`hardware`). On the host: the same binary
//! prints what it was built with.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// The number system of this image.
type Core = trueaxis::Fixed;

#[cfg(target_os = "none")]
mod hardware;

#[cfg(not(target_os = "none"))]
mod settings;

#[cfg(not(target_os = "none"))]
fn main() {
    settings::print::<Core>();
}
