//! Runs the board's own image, the ELF file that is flashed, against models of the registers of an STM32F405.
//!
//! The processor is Unicorn's. Everything around it is here, written from ST's reference manual RM0090 (revision 19) and data
//! sheet DS8626, a file a peripheral:
//!
//! | module | models |
//! |---|---|
//! | [`rcc`] | oscillators, PLL, clock security system, bus clocks, cause of the reset |
//! | [`flash`] | wait states, keys, erasing, programming, power that fails meanwhile |
//! | [`spi`], [`bank`] | SPI1 and the bank of gyros behind it, with faults of the line |
//! | [`timer`] | TIM2, which samples, and TIM5, which measures time |
//! | [`watchdog`] | the independent watchdog on its own oscillator |
//! | [`usart`], [`dma`] | USART1 and USART6, and the stream that feeds the latter |
//! | [`line_driver`] | the enable pin of an RS-422 line, against the bits on it |
//! | [`power`], [`port`], [`system`] | supply detector, pins, the processor's own registers |
//!
//! [`machine`] joins them: it counts time, enters interrupts and notices resets. [`host`] is the other end of the serial
//! line.
//!
//! A model refuses violations of the manual: an access to a peripheral without a clock, a PLL that is set up while it
//! runs, a store to locked flash, too few wait states. Each refusal is kept as a sentence, and every test requires an
//! empty list. Judged are too: the regulator's scale against the core's clock, the receiver's pin and its pull-up, the speed of
//! the bus's pads, chip select against the busy flag, caches and prefetch when sampling begins, and accesses to a peripheral
//! whose clock enable was not read back.
//!
//! # Time
//! Ticks of [`ticks::PER_SECOND`]. An instruction takes a given number of cycles of the core, one by default: then
//! every bounded wait of a driver is as short as it can be. Delays of flash and buses are not modelled.

pub mod bank;
pub mod board;
pub mod dma;
mod exceptions;
pub mod flash;
pub mod host;
pub mod image;
pub mod line_driver;
pub mod machine;
pub mod port;
pub mod power;
pub mod random;
pub mod rcc;
pub mod spi;
pub mod system;
pub mod ticks;
pub mod timer;
pub mod usart;
pub mod watchdog;

/// Registers of a model: name, offset, and bits, each by the maker's name.
pub type Named = &'static [(&'static str, u32, &'static [(&'static str, u32)])];

/// A bit of a register where it is set.
fn flag(bit: u32, is_set: bool) -> u32 {
    if is_set { bit } else { 0 }
}
