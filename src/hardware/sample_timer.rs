//! TIM2: one interrupt a sample period.
//!
//! Enters: nothing. Leaves: the TIM2 interrupt at the chain's design rate. Assumes the emulator's timer
//! clock, which is 1 GHz whatever the clock tree says.

use stm32f4::stm32f405::{RCC, TIM2};
use trueaxis::design_parameters::DESIGN_SAMPLE_RATE_HZ;

/// The emulator's timer clock \[Hz\].
const TIMER_CLOCK_HZ: u32 = 1_000_000_000;

/// Ticks of the timer in a sample period.
const PERIOD_TICKS: u32 = TIMER_CLOCK_HZ / DESIGN_SAMPLE_RATE_HZ as u32;

/// The running timer.
pub struct SampleTimer {
    timer: TIM2,
}

impl SampleTimer {
    /// Sets the period; nothing runs yet.
    pub fn new(timer: TIM2, rcc: &RCC) -> Self {
        rcc.apb1enr().modify(|_, w| w.tim2en().enabled());
        timer.psc().write(|w| w.psc().set(0));
        timer.arr().write(|w| w.arr().set(PERIOD_TICKS - 1));
        timer.dier().write(|w| w.uie().enabled());
        Self { timer }
    }

    /// Starts the periods.
    pub fn start(&self) {
        self.timer.cr1().modify(|_, w| w.cen().enabled());
    }

    /// No further interrupt.
    pub fn stop(&self) {
        self.timer.cr1().modify(|_, w| w.cen().disabled());
        self.acknowledge();
    }

    /// Clears the request that brought the interrupt here.
    #[inline(always)]
    pub fn acknowledge(&self) {
        self.timer.sr().write(|w| w.uif().clear());
    }

    /// Whether the next period ended in the meantime.
    #[inline(always)]
    pub fn is_pending(&self) -> bool {
        self.timer.sr().read().uif().is_update_pending()
    }
}
