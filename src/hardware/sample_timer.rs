//! Times the samples: TIM2 requests the interrupt and the bank's latch once a period, TIM5 measures its lateness.
//!
//! It is set up from the timers' clock \[Hz\] and the sample rate \[Hz\]. It gives the TIM2 interrupt, the [`Timing`]
//! of each one, readings of TIM5 \[ticks, modulo 2³²\], which runs freely on the same clock, and a pulse on PA0 whose
//! rising edge is the period's end: there the bank latches, so a late interrupt moves no sample.
//!
//! Both timers count the same clock, so the end of every period is known in TIM5's time exactly, and no
//! period can be missed unseen: two update events that came to one interrupt leave it a whole period behind.
//! Assumes that the interrupt is served at least once in 2³¹ ticks (25 s at 84 MHz).

use core::num::NonZeroU32;
use core::sync::atomic::{Ordering, compiler_fence};

use stm32f4::stm32f405::{RCC, TIM2, TIM5};
use trueaxis::design_parameters::LATE_SHARE;
use trueaxis::processor::Timing;

use super::enable;

/// Pairs of readings of which the cheapest is the cost of reading itself. Under emulation all are equal;
/// a few guard against the first one carrying a start-up effect.
const OVERHEAD_PAIRS: usize = 8;

/// Both timers, and the end of the present period in TIM5's time.
pub struct SampleTimer {
    periods: TIM2,
    time: TIM5,
    period_ticks: NonZeroU32,
    /// End of the period that the next interrupt is for \[ticks\].
    due: u32,
    reading_overhead: u32,
}

impl SampleTimer {
    /// Starts TIM5 and sets TIM2's period; no interrupt yet. The period is whole ticks: at 84 MHz 4 kHz is
    /// exact, and any rate up to 8 kHz to 50 ppm.
    pub fn new(periods: TIM2, time: TIM5, rcc: &RCC, timer_hz: u32, sample_rate_hz: f64) -> Self {
        rcc.apb1enr()
            .modify(|_, w| w.tim2en().enabled().tim5en().enabled());
        enable::confirm(|| {
            let enables = rcc.apb1enr().read();
            enables.tim2en().is_enabled() && enables.tim5en().is_enabled()
        });
        let ticks = libm::round(f64::from(timer_hz) / sample_rate_hz) as u32;
        let period_ticks = NonZeroU32::new(ticks).unwrap_or(NonZeroU32::MIN);
        time.psc().write(|w| w.psc().set(0));
        time.arr().write(|w| w.arr().set(u32::MAX));
        time.cr1().modify(|_, w| w.cen().enabled());
        periods.psc().write(|w| w.psc().set(0));
        periods.arr().write(|w| w.arr().set(period_ticks.get() - 1));
        periods.dier().write(|w| w.uie().enabled());
        // Output compare 1: high from the period's beginning on, for a sixteenth of it.
        periods
            .ccr1()
            .write(|w| w.ccr().set(period_ticks.get() / 16));
        periods.ccmr1_output().write(|w| w.oc1m().pwm_mode1());
        periods.ccer().write(|w| w.cc1e().set_bit());
        let mut timer = Self {
            periods,
            time,
            period_ticks,
            due: 0,
            reading_overhead: 0,
        };
        timer.reading_overhead = (0..OVERHEAD_PAIRS)
            .map(|_| {
                let before = timer.now();
                timer.now().wrapping_sub(before)
            })
            .min()
            .unwrap_or(0);
        timer
    }

    /// Connects the latch pulse to PA0.
    #[cfg(feature = "board")]
    pub fn show_latch(gpioa: &stm32f4::stm32f405::GPIOA) {
        gpioa.afrl().modify(|_, w| w.afrl0().af1());
        gpioa.moder().modify(|_, w| w.moder0().alternate());
    }

    /// Length of a sample period \[ticks\].
    #[cfg(feature = "emulator")]
    pub fn period_ticks(&self) -> u32 {
        self.period_ticks.get()
    }

    /// Starts the periods. Whatever serves them must be ready within the first one.
    pub fn started(mut self) -> Self {
        self.periods.cr1().modify(|_, w| w.cen().enabled());
        self.due = self.now().wrapping_add(self.period_ticks.get());
        self
    }

    /// Takes the interrupt's request and returns its timing.
    ///
    /// The time is read before the request is cleared: an event between the two is then a missed period of
    /// the next interrupt, never a lost one.
    #[inline(always)]
    pub fn enter(&mut self) -> Timing {
        let now = self.now();
        self.periods.sr().write(|w| w.uif().clear());
        // An entry that seems early corrects the end of the period: `due` was read a few ticks after TIM2
        // began, and the emulator's TIM2 counts to ARR in one tick less than the hardware, so that 9 000
        // periods put it by 1/32 of a period off.
        if now.wrapping_sub(self.due) > i32::MAX as u32 {
            self.due = now;
        }
        let behind = now.wrapping_sub(self.due);
        let period = self.period_ticks.get();
        let missed = if behind < period {
            0
        } else {
            behind / self.period_ticks
        };
        let latency = behind.wrapping_sub(missed.wrapping_mul(period));
        self.due = self
            .due
            .wrapping_add(missed.wrapping_add(1).wrapping_mul(period));
        Timing {
            missed,
            late: latency > period / LATE_SHARE,
        }
    }

    /// Reading of TIM5 \[ticks\]. The fences keep memory accesses on their side of the reading.
    #[inline(always)]
    pub fn now(&self) -> u32 {
        compiler_fence(Ordering::SeqCst);
        let count = self.time.cnt().read().bits();
        compiler_fence(Ordering::SeqCst);
        count
    }

    /// Time between two readings \[ticks\], without the cost of reading.
    #[inline(always)]
    pub fn between(&self, before: u32, after: u32) -> u32 {
        after
            .wrapping_sub(before)
            .saturating_sub(self.reading_overhead)
    }

    /// Cost of one reading \[ticks\].
    #[cfg(feature = "emulator")]
    pub fn reading_overhead(&self) -> u32 {
        self.reading_overhead
    }
}
