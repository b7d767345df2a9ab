//! Confirms that a peripheral's clock is on before the first access to it.
//!
//! A clock that was just enabled acts two cycles of its bus later, and an access before that is lost (RM0090 7.2.14;
//! errata sheet ES0182, "delay after an RCC peripheral clock enabling"). Reading the enable register back takes that time,
//! and shows a bit that did not stay.

use core::sync::atomic::{AtomicBool, Ordering};

/// Readings of an enable register before its bit counts as not set.
const POLLS: u32 = 8;

/// True once an enable bit did not read back. The emulator has no such registers: there it is always true.
static UNCONFIRMED: AtomicBool = AtomicBool::new(false);

/// Reads enable bits back by `is_set`; a bit that does not show is remembered, and the boot goes on: the peripheral is then
/// silent or its bus fails, and both show.
pub fn confirm(is_set: impl Fn() -> bool) {
    if !(0..POLLS).any(|_| is_set()) {
        UNCONFIRMED.store(true, Ordering::Relaxed);
    }
    // No access to the peripheral overtakes the reading.
    cortex_m::asm::dsb();
}

/// True if an enable bit did not read back since the reset.
#[cfg(feature = "board")]
pub fn has_failed() -> bool {
    UNCONFIRMED.load(Ordering::Relaxed)
}
