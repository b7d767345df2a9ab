//! The firmware image on the emulator, held against the same chain on the host.
//!
//! samples → records ─┬→ image in the emulator → telemetry, report ─┬→ comparison → [`OnTarget`]
//! parameters → slots ┴→ the same driver and processor, here ───────┘
//!
//! Enters: samples and parameters. Leaves: [`OnTarget`]: whether every byte of telemetry is equal, what the
//! processor costs in instructions, what the image takes in memory, and the events it logged.
//!
//! Deliberately not here: time. The emulator counts instructions; it knows nothing of cycles, flash wait
//! states or caches.

pub mod core;

pub mod records;

pub mod slots;

pub mod twin;

pub mod image;

pub mod code;

pub mod flow;

pub mod lines;

pub mod stack;

pub mod emulator;

pub mod events;

pub mod on_target;

pub mod budgets;

pub mod stages;

pub mod cycles;

pub use self::core::{Platform, TargetCore};
pub use emulator::Emulation;
pub use image::Image;
pub use on_target::OnTarget;
pub use slots::SlotImages;
