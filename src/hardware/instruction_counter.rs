//! TIM5 as the counter of executed instructions.
//!
//! The emulator's timers count at 1 GHz whatever the clock tree says, and under `-icount shift=0` one
//! instruction is one nanosecond of its virtual time: so TIM5, free-running, counts instructions exactly
//! and repeatably. Enters: nothing. Leaves: differences \[instructions\], modulo 2³².
//!
//! Deliberately not here: time. On a board the same code would count ticks of the timer's clock.

use core::sync::atomic::{Ordering, compiler_fence};

use stm32f4::stm32f405::{RCC, TIM5};

/// Pairs of readings of which the cheapest is the cost of reading itself. Under emulation all are equal;
/// a few guard against the first one carrying a start-up effect.
const OVERHEAD_PAIRS: usize = 8;

/// The running counter.
pub struct InstructionCounter {
    timer: TIM5,
    reading_overhead: u32,
}

impl InstructionCounter {
    /// Starts TIM5 over its full 32 bits and measures what a reading costs.
    pub fn start(timer: TIM5, rcc: &RCC) -> Self {
        rcc.apb1enr().modify(|_, w| w.tim5en().enabled());
        timer.psc().write(|w| w.psc().set(0));
        timer.arr().write(|w| w.arr().set(u32::MAX));
        timer.cr1().modify(|_, w| w.cen().enabled());
        let mut counter = Self {
            timer,
            reading_overhead: 0,
        };
        counter.reading_overhead = (0..OVERHEAD_PAIRS)
            .map(|_| {
                let before = counter.now();
                counter.now().wrapping_sub(before)
            })
            .min()
            .unwrap_or(0);
        counter
    }

    /// The count now. The fences keep memory accesses on their side of the reading.
    #[inline(always)]
    pub fn now(&self) -> u32 {
        compiler_fence(Ordering::SeqCst);
        let count = self.timer.cnt().read().bits();
        compiler_fence(Ordering::SeqCst);
        count
    }

    /// Instructions between two readings, without the cost of reading.
    #[inline(always)]
    pub fn between(&self, before: u32, after: u32) -> u32 {
        after
            .wrapping_sub(before)
            .saturating_sub(self.reading_overhead)
    }

    /// What a reading costs \[instructions\].
    pub fn reading_overhead(&self) -> u32 {
        self.reading_overhead
    }
}
