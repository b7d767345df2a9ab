//! Runs the firmware image in the emulator and compares it with the same chain on the host.
//!
//! samples → records ─┬→ image in the emulator → telemetry, report ─┬→ comparison → [`OnTarget`]
//! parameters → slots ┴→ the same driver and processor, here ───────┘
//!
//! From samples and parameters it gives [`OnTarget`]: the equality of every byte of telemetry, the processor's cost in
//! instructions, the image's memory, and its logged events.
//!
//! Time is not measured: the emulator counts instructions and does not model cycles, flash wait states or caches.

pub mod core;

pub mod records;

pub mod slots;

pub mod host_run;

pub mod image;

pub mod firmware_file;

pub mod code;

pub mod flow;

pub mod lines;

pub mod stack;

pub mod worst_case;

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
