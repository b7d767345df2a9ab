//! The clock tree: 168 MHz from the crystal, or the best that starts.
//!
//! Enters: nothing. Leaves: [`Clocks`]: which source runs, and the frequencies \[Hz\] that timers, SPI and
//! USART divide. Tried in this order (RM0090 section 7.2):
//!
//! | source | core | APB1, its timers | APB2 | flag |
//! |---|---|---|---|---|
//! | crystal 8 MHz → PLL | 168 MHz | 42, 84 MHz | 84 MHz | none |
//! | internal RC 16 MHz → PLL | 168 MHz | 42, 84 MHz | 84 MHz | `CLOCK_FALLBACK` |
//! | internal RC 16 MHz | 16 MHz | 16, 16 MHz | 16 MHz | `CLOCK_FALLBACK` |
//!
//! Every wait is bounded, because a dead crystal must become a flag and not a hang. The timers follow the
//! clock that really runs, so the sample rate stays what the parameters ask, to the 1 % of the RC oscillator.
//! On the last row a period of 250 µs has 4 000 cycles instead of 42 000; should the interrupt not fit, its
//! periods are counted as late and missed. The crystal failing later ends in
//! [`super::failure`]: the clock security system raises the NMI, which resets into this fallback.
//!
//! The emulator does not model the clock tree: there the last row is taken, always.

use stm32f4::stm32f405::{FLASH, PWR, RCC};

/// Polls before the crystal counts as dead. A poll takes at least 4 cycles of the 16 MHz internal
/// oscillator, so this waits at least 5 ms: crystals start within about 2 ms (t_SU(HSE), data sheet 5.3.8).
const CRYSTAL_POLLS: u32 = 20_000;

/// Polls before the PLL counts as not locking: 1 ms; it locks within 300 µs (t_LOCK, data sheet 5.3.10).
const PLL_POLLS: u32 = 4_000;

/// Polls for a register to show what was written to it: it takes a few bus cycles.
const REGISTER_POLLS: u32 = 1_000;

/// Cycles that a new bus divider takes to act, at most.
const DIVIDER_CYCLES: u32 = 16;

/// The internal RC oscillator \[Hz\].
const INTERNAL_HZ: u32 = 16_000_000;

/// VCO input over PLL input: both sources come down to 1 MHz, the low end of the allowed 1 to 2 MHz.
const CRYSTAL_DIVIDER: u8 = 8;
const INTERNAL_DIVIDER: u8 = 16;

/// VCO 336 MHz, halved to 168 MHz, the fastest the core may run; by 7 for USB's 48 MHz, unused here.
const VCO_MULTIPLIER: u16 = 336;
const USB_DIVIDER: u8 = 7;

/// What the system runs from.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum ClockSource {
    /// The crystal, through the PLL.
    Crystal,
    /// The internal RC oscillator, through the PLL.
    InternalPll,
    /// The internal RC oscillator itself.
    Internal,
}

/// The running clocks.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub struct Clocks {
    /// Where they come from.
    pub source: ClockSource,
    /// SPI1 and USART1 \[Hz\].
    pub apb2_hz: u32,
    /// TIM2 and TIM5 \[Hz\]: twice APB1 where that is divided.
    pub timer_hz: u32,
}

impl Clocks {
    /// Whether the crystal is not what runs.
    pub fn is_fallback(&self) -> bool {
        self.source != ClockSource::Crystal
    }
}

/// Starts the best clock that there is. Runs once, at boot, from the internal oscillator.
pub fn start(rcc: &RCC, flash: &FLASH, pwr: &PWR) -> Clocks {
    rcc.apb1enr().modify(|_, w| w.pwren().enabled());
    // 168 MHz needs the core's supply at scale 1.
    pwr.cr().modify(|_, w| w.vos().scale1());
    let full_speed = |source| Clocks {
        source,
        apb2_hz: 84_000_000,
        timer_hz: 84_000_000,
    };

    rcc.cr().modify(|_, w| w.hseon().on());
    if within(CRYSTAL_POLLS, || rcc.cr().read().hserdy().is_ready()) {
        if runs_from_pll(rcc, flash, ClockSource::Crystal) {
            rcc.cr().modify(|_, w| w.csson().on());
            return full_speed(ClockSource::Crystal);
        }
    } else {
        rcc.cr().modify(|_, w| w.hseon().off());
    }
    if runs_from_pll(rcc, flash, ClockSource::InternalPll) {
        return full_speed(ClockSource::InternalPll);
    }
    Clocks {
        source: ClockSource::Internal,
        apb2_hz: INTERNAL_HZ,
        timer_hz: INTERNAL_HZ,
    }
}

/// Tries to run from the PLL behind `source`; on failure the internal oscillator runs as after reset.
fn runs_from_pll(rcc: &RCC, flash: &FLASH, source: ClockSource) -> bool {
    rcc.pllcfgr().write(|w| {
        // SAFETY: VCO input 1 MHz, output 336 MHz and USB divider 7 are within RM0090 7.3.2.
        unsafe {
            w.plln().bits(VCO_MULTIPLIER).pllq().bits(USB_DIVIDER);
            w.pllm().bits(match source {
                ClockSource::Crystal => CRYSTAL_DIVIDER,
                _ => INTERNAL_DIVIDER,
            });
        }
        match source {
            ClockSource::Crystal => w.pllsrc().hse(),
            _ => w.pllsrc().hsi(),
        };
        w.pllp().div2()
    });
    rcc.cr().modify(|_, w| w.pllon().on());
    let locked = within(PLL_POLLS, || rcc.cr().read().pllrdy().is_ready());

    // 5 wait states at 168 MHz and 2.7 V to 3.6 V (RM0090 table 10); the caches hide most of them.
    flash.acr().write(|w| {
        w.latency().ws5();
        w.prften().enabled().icen().enabled().dcen().enabled()
    });
    let slow_enough = within(REGISTER_POLLS, || flash.acr().read().latency().is_ws5());
    if locked && slow_enough {
        // The dividers first: they take up to 16 cycles to act (RM0090 7.3.3), and the buses must not be
        // driven beyond their limits meanwhile.
        rcc.cfgr().modify(|_, w| w.ppre1().div4().ppre2().div2());
        cortex_m::asm::delay(DIVIDER_CYCLES);
        rcc.cfgr().modify(|_, w| w.sw().pll());
        if within(REGISTER_POLLS, || rcc.cfgr().read().sws().is_pll()) {
            return true;
        }
    }
    rcc.cfgr().modify(|_, w| w.sw().hsi());
    rcc.cfgr().modify(|_, w| w.ppre1().div1().ppre2().div1());
    rcc.cr().modify(|_, w| w.pllon().off());
    // The next attempt may write the PLL's configuration only when it has stopped.
    within(REGISTER_POLLS, || rcc.cr().read().pllrdy().is_not_ready());
    false
}

/// Polls until `ready`, at most `polls` times.
fn within(polls: u32, ready: impl Fn() -> bool) -> bool {
    (0..polls).any(|_| ready())
}
