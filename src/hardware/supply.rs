//! Tests that the supply is high enough to erase and program flash.
//!
//! Flash takes words of 32 bits from 2.7 V on (RM0090 3.6.2), the width that [`super::flash`] uses. The programmable
//! voltage detector compares the supply with one of eight levels (RM0090 5.2.3). Level 6 is the lowest that is beyond
//! doubt above 2.7 V: the detector sees "higher" from 2.85 V at least and 3.10 V at most (both edges, data sheet table
//! 19), so a supply of 3.3 V ± 5 % passes. Level 5 may do so from 2.65 V.
//!
//! Brown-out reset at level 3 holds the processor below some 2.8 V (V_BOR3, DS8626 revision 12, table 19), so that no
//! code runs, and flash is not touched, at a supply that the chip's clock and flash are not made for. It is an option byte
//! that the flashing steps set (docs/board.md) and each boot reads: the chip leaves the factory with it off.
//!
//! It tests the present supply, which may still sag while a sector is erased; then there is a reset, and an attempt
//! that [`trueaxis::parameter_slots`] has counted.

use stm32f4::stm32f405::{FLASH, PWR};

/// Level 6: 2.93 V falling, 3.03 V rising.
const LEVEL: u8 = 6;

/// Brown-out level 3 in the option bytes.
const BROWN_OUT_LEVEL_3: u8 = 0;

/// Before the first reading \[cycles\]: 0.1 ms at 168 MHz, longer on a slower clock. Comparator and
/// reference start within some 10 µs.
const START_CYCLES: u32 = 16_800;

/// Readings, every one of which must be "higher".
const READINGS: u32 = 100;

/// Between two of them \[cycles\]: 10 µs at 168 MHz, so that all of them cover 1 ms.
const PAUSE_CYCLES: u32 = 1_680;

/// Returns `true` if the option bytes hold the processor below brown-out level 3.
///
/// The encoding is that of RM0090 3.9.10: 0 is level 3, 3 is off. The register crate's names for these values are in the
/// reverse order, so the bits are compared themselves.
pub fn brown_out_suffices(flash: &FLASH) -> bool {
    flash.optcr().read().bor_lev().bits() == BROWN_OUT_LEVEL_3
}

/// Returns `true` if the supply stays above the level for 1 ms. Needs the clock of the power controller.
///
/// # Returns
/// `false` also if the detector cannot be turned on: then the supply is unknown.
pub fn suffices(pwr: &PWR) -> bool {
    pwr.cr().modify(|_, w| w.pls().set(LEVEL).pvde().enabled());
    cortex_m::asm::delay(START_CYCLES);
    let detector = pwr.cr().read();
    let is_on = detector.pvde().is_enabled() && detector.pls().bits() == LEVEL;
    let is_high = (0..READINGS).all(|_| {
        cortex_m::asm::delay(PAUSE_CYCLES);
        pwr.csr().read().pvdo().is_higher()
    });
    pwr.cr().modify(|_, w| w.pvde().disabled());
    is_on && is_high
}
