//! The firmware image on the emulator, held against the same chain on the host.
//!
//! samples, parameters → image → emulator → outputs and report → comparison → [`OnTarget`]
//!
//! Enters: samples and the parameter block, as bytes in the layouts of `trueaxis`. Leaves: [`OnTarget`]:
//! whether every output is equal bit for bit, what the chain costs in instructions, what the image takes
//! in memory, and the events it logged.
//!
//! Deliberately not here: time. The emulator counts instructions; it knows nothing of cycles, flash wait
//! states or caches.

pub mod core;

pub mod image;

pub mod code;

pub mod stack;

pub mod emulator;

pub mod events;

pub mod on_target;

pub mod budgets;

pub use self::core::TargetCore;
pub use emulator::Emulation;
pub use image::Image;
pub use on_target::OnTarget;
