//! The firmware for QEMU, with the f32 core. On the target: the image (`hardware`). On the host: the same binary prints
//! its build settings.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(all(target_os = "none", not(feature = "emulator")))]
compile_error!("the image `emulated` needs the feature `emulator`");

/// The number system of this image.
type Core = trueaxis::F32;

/// The optional terms of this image: all, or the one at the place that the variable gives, to measure its cost.
#[cfg(feature = "terms")]
type Terms = <trueaxis::terms::AllTerms<Core> as trueaxis::terms::Select<
    { trueaxis::terms::place(option_env!("TRUEAXIS_ONLY_TERM")) },
>>::Term;
#[cfg(not(feature = "terms"))]
type Terms = ();

#[cfg(target_os = "none")]
#[path = "../hardware/mod.rs"]
mod hardware;

#[cfg(not(target_os = "none"))]
mod settings;

#[cfg(not(target_os = "none"))]
fn main() {
    settings::print::<Core, Terms>("emulated");
}
