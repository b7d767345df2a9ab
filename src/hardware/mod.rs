//! The images: all code that depends on the processor. Exists only for `target_os = "none"`.
//!
//! ```text
//!          TIM2, each period                                    main loop
//! bank ──▶ CounterBank ─▶ Processor ─▶ queue ──────────────▶ Link ─▶ USART1
//!  ▲ SPI                     ├─▶ TRACE, WATCH ─────────────▶ Background ─▶ defmt
//!                            └─▶ RawTap (feature `raw`) ───▶ RawLink ─▶ DMA, USART6
//! ```
//! Both images are this; they differ at the two ends:
//!
//! | | `board` | `emulator` |
//! |---|---|---|
//! | `SpiDevice` | SPI1 | records of `frames.bin` |
//! | events | RTT | semihosting |
//! | slots while stopped | flash | memory, written to `slots.bin` |
//! | raw stream | DMA | the processor writes the bytes |
//! | beside it | watchdog | run report, painted stack |
//!
//! Read in this order: [`board`] or [`emulator`] (the main loop), [`sampling`] (the interrupt and its
//! deadline), [`sample_timer`], [`handover`], [`boot`], [`link`], [`service_mode`], `raw_tap`, `raw_link`, [`background`], then the peripherals
//! [`clock`], [`enable`], [`flash`], `supply`, [`serial`], and [`failure`]. A port to another board changes only this folder and
//! memory.x (docs/porting.md).

#[cfg(all(feature = "board", feature = "emulator"))]
compile_error!("one image at a time: feature `board` or feature `emulator`");

#[cfg(all(feature = "slot-a", feature = "slot-b"))]
compile_error!("an image is linked for one slot: feature `slot-a` or feature `slot-b`");

#[cfg(all(feature = "slotted", not(any(feature = "slot-a", feature = "slot-b"))))]
compile_error!("`slotted` is not named alone: feature `slot-a` or feature `slot-b`");

#[cfg(feature = "board")]
mod board;

#[cfg(feature = "emulator")]
mod emulator;

mod sampling;

mod sample_timer;

mod handover;

mod boot;

mod link;

mod service_mode;

#[cfg(feature = "raw")]
mod raw_tap;

#[cfg(feature = "raw")]
mod raw_link;

#[cfg(feature = "terms")]
mod slow_link;

mod background;

mod clock;

mod enable;

mod flash;

#[cfg(feature = "slotted")]
mod image_flash;

#[cfg(feature = "board")]
mod supply;

mod serial;

mod failure;

#[cfg(feature = "board")]
use board::Spi;

#[cfg(feature = "emulator")]
use emulator::Spi;

#[cfg(all(feature = "raw", feature = "board"))]
use board::RawPort;

#[cfg(all(feature = "raw", feature = "emulator"))]
use emulator::RawPort;
