//! The registers under [`trueaxis::clock_start`], which selects the source and reports the reason.
//!
//! # Returns
//! [`Clocks`]: the running source, and the frequencies \[Hz\] that timers, SPI and USART divide, nominally. The RC oscillator
//! is off by -8 % to +4.5 % over temperature; the board measures it where it can (`board/low_speed.rs`). Should the
//! interrupt not fit at 16 MHz, its periods are counted as late and missed. A crystal that fails later ends in
//! [`super::failure`]: the clock security system raises the NMI, which resets into the fallback, where the crystal is
//! left alone until the next reset.
//!
//! The emulator does not model the clock tree: its registers read as zero, so there the last row is taken.

use stm32f4::stm32f405::{FLASH, PWR, RCC};
use trueaxis::clock_start::{self, BusDividers, ClockRegisters, Clocks, CoreClock, PllSettings};

use super::enable;

/// Starts the best clock that there is, without the crystal if the run before this one has lost it. Runs once, at boot, from
/// the internal oscillator.
pub fn start(rcc: &RCC, flash: &FLASH, pwr: &PWR, crystal_was_lost: bool) -> Clocks {
    rcc.apb1enr().modify(|_, w| w.pwren().enabled());
    enable::confirm(|| rcc.apb1enr().read().pwren().is_enabled());
    // 168 MHz needs the core's supply at scale 1.
    pwr.cr().modify(|_, w| w.vos().scale1());
    let registers = &mut Registers { rcc, flash };
    if crystal_was_lost {
        clock_start::start_without_crystal(registers)
    } else {
        clock_start::start(registers)
    }
}

/// True if the flash shows its caches, its prefetch and these wait states in force.
#[cfg(feature = "board")]
pub fn caches_are_on(flash: &FLASH, wait_states: u8) -> bool {
    let access = flash.acr().read();
    access.icen().is_enabled()
        && access.dcen().is_enabled()
        && access.prften().is_enabled()
        && access.latency().bits() == wait_states
}

struct Registers<'a> {
    rcc: &'a RCC,
    flash: &'a FLASH,
}

impl ClockRegisters for Registers<'_> {
    fn turn_crystal(&mut self, on: bool) {
        self.rcc.cr().modify(|_, w| w.hseon().bit(on));
    }

    fn crystal_is_ready(&mut self) -> bool {
        self.rcc.cr().read().hserdy().is_ready()
    }

    fn watch_crystal(&mut self, on: bool) {
        self.rcc.cr().modify(|_, w| w.csson().bit(on));
    }

    fn set_up_pll(&mut self, settings: PllSettings) {
        self.rcc.pllcfgr().write(|w| {
            // SAFETY: `clock_start` keeps VCO input, VCO output and USB divider within RM0090 7.3.2.
            unsafe {
                w.pllm().bits(settings.input_divider);
                w.plln().bits(settings.multiplier);
                w.pllq().bits(settings.usb_divider);
            }
            w.pllsrc().bit(settings.from_crystal);
            w.pllp().div2()
        });
    }

    fn turn_pll(&mut self, on: bool) {
        self.rcc.cr().modify(|_, w| w.pllon().bit(on));
    }

    fn pll_is_ready(&mut self) -> bool {
        self.rcc.cr().read().pllrdy().is_ready()
    }

    fn set_wait_states(&mut self, wait_states: u8) {
        self.flash.acr().write(|w| {
            w.latency().set(wait_states);
            w.prften().enabled().icen().enabled().dcen().enabled()
        });
    }

    fn wait_states(&mut self) -> u8 {
        self.flash.acr().read().latency().bits()
    }

    fn set_bus_dividers(&mut self, dividers: BusDividers) {
        self.rcc.cfgr().modify(|_, w| {
            w.ppre1().set(divider_bits(dividers.apb1));
            w.ppre2().set(divider_bits(dividers.apb2))
        });
    }

    fn select(&mut self, clock: CoreClock) {
        self.rcc.cfgr().modify(|_, w| match clock {
            CoreClock::Internal => w.sw().hsi(),
            CoreClock::Pll => w.sw().pll(),
        });
    }

    fn selected(&mut self) -> Option<CoreClock> {
        let shown = self.rcc.cfgr().read().sws();
        if shown.is_hsi() {
            Some(CoreClock::Internal)
        } else if shown.is_pll() {
            Some(CoreClock::Pll)
        } else {
            None
        }
    }

    fn pass_cycles(&mut self, cycles: u32) {
        // A turn of its loop is two instructions, so two cycles at least, and four at most.
        cortex_m::asm::delay(cycles / 2);
    }
}

/// A divider as PPRE1 and PPRE2 encode it (RM0090 7.3.3): 0 is 1, 4 to 7 are 2 to 16.
fn divider_bits(divider: u8) -> u8 {
    match divider {
        0 | 1 => 0b000,
        2 => 0b100,
        3 | 4 => 0b101,
        5..=8 => 0b110,
        _ => 0b111,
    }
}
