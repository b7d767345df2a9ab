//! The boot selector: chooses one of two firmware images at each reset, and starts it. On the host: the same binary prints the
//! layout of flash.
//!
//! The choice is [`trueaxis::image_slots`]. It runs on the internal oscillator, from the reset, and leaves every peripheral as it
//! was but the flash's data cache and the supply detector's clock; an image that is on trial also finds the watchdog running,
//! with 21 s at least: one that hangs before it starts its own ends in a reset, and in the image before it.
//!
//! With no good image it waits for a probe: every reset looks anew.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(all(target_os = "none", not(feature = "selector")))]
compile_error!("the image `selector` needs the feature `selector`");

#[cfg(target_os = "none")]
#[path = "../hardware/selector.rs"]
mod selector;

#[cfg(not(target_os = "none"))]
fn main() {
    use trueaxis::image::ImageSlot;
    use trueaxis::image_layout::{FLASH_BEGIN, IMAGE_SLOT_BYTES, JOURNAL_BEGIN, SELECTOR_BYTES};
    println!("selector {FLASH_BEGIN:#010x}, {SELECTOR_BYTES} bytes; records {JOURNAL_BEGIN:#010x}");
    for slot in ImageSlot::BOTH {
        let begin = slot.vector_table() - trueaxis::image_layout::IMAGE_HEADER_BYTES;
        println!("image {slot:?} {begin:#010x}, {IMAGE_SLOT_BYTES} bytes");
    }
}
