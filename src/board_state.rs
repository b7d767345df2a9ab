//! Clock and supply of the board as one word, the detail of the answer to a `state` request.
//!
//! | bits | holds |
//! |---|---|
//! | 0..16 | the low-speed oscillator as the running clock measures it, taken for nominal \[Hz\]; 0 if it gives no sign |
//! | 16..28 | the same as the crystal measured it, in this run or one since power-on \[16 Hz\]; 0 if none did |
//! | 28 | the clock is a fallback |
//! | 29 | the brown-out level is below 3 |
//! | 30 | a cache of the flash, its prefetch, or the wait states are not as set |
//! | 31 | a peripheral's clock enable did not read back |
//!
//! Without the crystal the internal oscillator is off by -8 % to +4.5 % over temperature. Its deviation is the ratio of the
//! two measurements ([`BoardState::deviation`]), to the drift of the low-speed oscillator since the crystal ran. The word is
//! 0 from a unit that has no such registers, as in the emulator.

/// Clock and supply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BoardState {
    /// The low-speed oscillator as the running clock measures it \[Hz\], at most 65 535; 0: unknown.
    pub low_speed_hz: u32,
    /// The low-speed oscillator as the crystal measured it \[Hz\], at most 65 535, to 16 Hz in the word; 0: unknown.
    pub reference_hz: u32,
    /// The clock is a fallback.
    pub clock_fallback: bool,
    /// The brown-out level is below 3.
    pub brown_out_low: bool,
    /// A cache of the flash, its prefetch, or the wait states are not as set.
    pub caches_off: bool,
    /// A peripheral's clock enable did not read back.
    pub enable_unconfirmed: bool,
}

/// The reference's unit in the word \[Hz\].
const REFERENCE_HZ: u32 = 16;

impl BoardState {
    /// The word.
    pub const fn to_word(self) -> u32 {
        let low_speed = if self.low_speed_hz > 0xFFFF {
            0xFFFF
        } else {
            self.low_speed_hz
        };
        let reference = (self.reference_hz + REFERENCE_HZ / 2) / REFERENCE_HZ;
        let reference = if reference > 0xFFF { 0xFFF } else { reference };
        low_speed
            | reference << 16
            | (self.clock_fallback as u32) << 28
            | (self.brown_out_low as u32) << 29
            | (self.caches_off as u32) << 30
            | (self.enable_unconfirmed as u32) << 31
    }

    /// The inverse of [`Self::to_word`].
    pub const fn from_word(word: u32) -> Self {
        Self {
            low_speed_hz: word & 0xFFFF,
            reference_hz: (word >> 16 & 0xFFF) * REFERENCE_HZ,
            clock_fallback: word >> 28 & 1 != 0,
            brown_out_low: word >> 29 & 1 != 0,
            caches_off: word >> 30 & 1 != 0,
            enable_unconfirmed: word >> 31 & 1 != 0,
        }
    }

    /// Relative deviation of the running clock from nominal; `None` if either measurement is missing.
    pub fn deviation(&self) -> Option<f64> {
        (self.low_speed_hz > 0 && self.reference_hz > 0)
            .then(|| f64::from(self.reference_hz) / f64::from(self.low_speed_hz) - 1.0)
    }
}
