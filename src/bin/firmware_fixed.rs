//! The firmware of the board, with the fixed-point core. On the target: the image (`hardware`). On the host: the same
//! binary prints its build settings.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(all(target_os = "none", not(feature = "board")))]
compile_error!("the image `firmware-fixed` needs the feature `board`");

/// The number system of this image.
type Core = trueaxis::Fixed;

/// The optional terms of this image.
#[cfg(feature = "terms")]
type Terms = trueaxis::terms::AllTerms<Core>;
#[cfg(not(feature = "terms"))]
type Terms = ();

#[cfg(target_os = "none")]
#[path = "../hardware/mod.rs"]
mod hardware;

#[cfg(not(target_os = "none"))]
mod settings;

#[cfg(not(target_os = "none"))]
fn main() {
    settings::print::<Core, Terms>("firmware-fixed");
}
