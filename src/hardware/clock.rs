//! The clock tree, as far as this image needs it: is there an external oscillator?
//!
//! Enters: nothing. Leaves: [`Oscillator`]. The wait is bounded, because a dead crystal must become a
//! health flag and not a hang; the emulator, which does not model the clock tree, always takes the
//! fallback. Deliberately not here: the PLL. Without the board there is nothing to hold it against, and
//! the sample timer below runs from the emulator's fixed clock.

use stm32f4::stm32f405::RCC;

/// Polls before the external oscillator counts as dead. A poll takes at least 4 cycles of the 16 MHz
/// internal oscillator, so this waits at least 5 ms: crystals start within about 2 ms (t_SU(HSE) of the
/// STM32F405's data sheet).
const START_UP_POLLS: u32 = 20_000;

/// What the system runs from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Oscillator {
    /// The external crystal answered.
    External,
    /// It did not; the internal RC oscillator stays. A health flag, since its rate is only good to 1 %.
    InternalFallback,
}

/// Starts the external oscillator and waits for it, at most [`START_UP_POLLS`].
pub fn start(rcc: &RCC) -> Oscillator {
    rcc.cr().modify(|_, w| w.hseon().on());
    for _ in 0..START_UP_POLLS {
        if rcc.cr().read().hserdy().is_ready() {
            return Oscillator::External;
        }
    }
    rcc.cr().modify(|_, w| w.hseon().off());
    Oscillator::InternalFallback
}
