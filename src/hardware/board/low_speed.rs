//! Measures the internal low-speed oscillator with the running clock, and keeps the crystal's measurement over resets.
//!
//! TIM5 counts the timers' clock; its channel 4 captures every eighth edge of the oscillator (TI4_RMP, RM0090 18.4.21). The
//! oscillator is anywhere between 17 and 47 kHz (DS8626 revision 12, table 35), so alone it is no measure of the clock. But
//! one value holds for one chip: a run on the crystal leaves it in memory that a reset keeps, and a run that follows without
//! the crystal learns from it how fast its own clock is.

use core::sync::atomic::{AtomicU32, Ordering};

use stm32f4::stm32f405::{RCC, TIM5};

use crate::hardware::enable;

/// Edges of the oscillator from one capture to the next.
const EDGES: u32 = 8;

/// Captures of a measurement: 64 periods, 1.4 to 3.8 ms.
const CAPTURES: u32 = 8;

/// Polls for a capture: at least 4 cycles each, so at least 0.95 ms at 168 MHz; eight periods take 0.47 ms at most.
const CAPTURE_POLLS: u32 = 40_000;

/// Polls until the oscillator is ready: at least 0.24 ms at 168 MHz; it starts within 40 µs.
const START_POLLS: u32 = 10_000;

/// The range of the oscillator \[Hz\].
const RANGE_HZ: [u32; 2] = [17_000, 47_000];

/// Distinguishes a stored value from the random content after power-on.
const MARK: u32 = u32::from_le_bytes(*b"LSI ");

/// The oscillator as the crystal measured it \[Hz\], and the same with the mark. Not cleared and not loaded at boot.
#[unsafe(link_section = ".uninit.LSI_REFERENCE")]
static REFERENCE: [AtomicU32; 2] = [AtomicU32::new(0), AtomicU32::new(0)];

/// Measures the oscillator \[Hz\] with TIM5, which counts `timer_hz` and is left counting; 0 if it gives no sign.
pub fn measure(rcc: &RCC, time: &TIM5, timer_hz: u32) -> u32 {
    rcc.csr().modify(|_, w| w.lsion().on());
    if !(0..START_POLLS).any(|_| rcc.csr().read().lsirdy().is_ready()) {
        return 0;
    }
    rcc.apb1enr().modify(|_, w| w.tim5en().enabled());
    enable::confirm(|| rcc.apb1enr().read().tim5en().is_enabled());
    // SAFETY: 1 connects the oscillator; the field has two bits.
    time.or().write(|w| unsafe { w.it4_rmp().bits(0b01) });
    time.arr().write(|w| w.arr().set(u32::MAX));
    // SAFETY: the channel's input is its own pin's, and eight edges make a capture; fields of two bits each.
    time.ccmr2_input()
        .write(|w| unsafe { w.cc4s().bits(0b01).ic4psc().bits(0b11) });
    time.ccer().modify(|_, w| w.cc4e().set_bit());
    time.cr1().modify(|_, w| w.cen().enabled());
    let hz = measured(time, timer_hz);
    time.ccer().modify(|_, w| w.cc4e().clear_bit());
    hz
}

/// Waits for the captures; 0 without them.
fn measured(time: &TIM5, timer_hz: u32) -> u32 {
    let Some(begun) = captured(time) else {
        return 0;
    };
    let mut ended = begun;
    for _ in 0..CAPTURES {
        let Some(at) = captured(time) else {
            return 0;
        };
        ended = at;
    }
    // A capture that was overwritten would count for two.
    if time.sr().read().cc4of().bit() {
        return 0;
    }
    let ticks = ended.wrapping_sub(begun).max(1);
    let hz = u64::from(EDGES * CAPTURES) * u64::from(timer_hz) / u64::from(ticks);
    u32::try_from(hz).unwrap_or(0)
}

/// The next capture \[ticks\]; reading it clears its flag (RM0090 18.4.5).
fn captured(time: &TIM5) -> Option<u32> {
    (0..CAPTURE_POLLS)
        .any(|_| time.sr().read().cc4if().bit())
        .then(|| time.ccr4().read().bits())
}

/// Keeps the crystal's measurement, if it is one.
pub fn keep(low_speed_hz: u32) {
    if (RANGE_HZ[0]..=RANGE_HZ[1]).contains(&low_speed_hz) {
        let [value, marked] = &REFERENCE;
        value.store(low_speed_hz, Ordering::Relaxed);
        marked.store(low_speed_hz ^ MARK, Ordering::Relaxed);
    }
}

/// The crystal's measurement of an earlier run \[Hz\]; 0 if there was none since power-on.
pub fn kept() -> u32 {
    let [value, marked] = REFERENCE
        .each_ref()
        .map(|word| word.load(Ordering::Relaxed));
    if value ^ marked == MARK && (RANGE_HZ[0]..=RANGE_HZ[1]).contains(&value) {
        value
    } else {
        0
    }
}
