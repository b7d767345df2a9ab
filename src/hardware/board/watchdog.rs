//! Drives the independent watchdog, which resets the board when samples stop or the main loop hangs.
//!
//! The main loop feeds it with the number of periods served so far. It runs from its own 32 kHz oscillator, so it also
//! detects a dead system clock. It is fed only if both have moved on: the main loop by calling, the interrupt by its
//! count.
//!
//! A debugger that halts the core halts it too.

use stm32f4::stm32f405::{DBGMCU, IWDG};

/// Reload: 512 ticks of 32 kHz / 32, 0.5 s, between 0.35 s and 0.96 s over the oscillator's tolerance
/// (17 kHz to 47 kHz, data sheet 5.3.9). 2 000 periods: far beyond any recovery of the interrupt, and
/// short beside the second in which a navigator notices silence.
const RELOAD: u16 = 512;

/// The running watchdog.
pub struct Watchdog {
    watchdog: IWDG,
    periods_seen: u32,
}

impl Watchdog {
    /// Starts the watchdog; from here on it must be fed.
    pub fn start(watchdog: IWDG, debug: &DBGMCU) -> Self {
        debug.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
        watchdog.kr().write(|w| w.key().start());
        watchdog.kr().write(|w| w.key().unlock());
        watchdog.pr().write(|w| w.pr().divide_by32());
        watchdog.rlr().write(|w| w.rl().set(RELOAD));
        watchdog.kr().write(|w| w.key().feed());
        Self {
            watchdog,
            periods_seen: 0,
        }
    }

    /// Feeds it if the interrupt has served a period since the last time.
    pub fn feed(&mut self, periods_served: u32) {
        if periods_served != self.periods_seen {
            self.periods_seen = periods_served;
            self.watchdog.kr().write(|w| w.key().feed());
        }
    }
}
