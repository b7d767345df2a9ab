//! Holds the results of the built-in test as one word: health item 67, and the detail of the answer to a `self_test` request.
//!
//! | bits | hold |
//! |---|---|
//! | 0 | RAM did not hold what was written |
//! | 1 | the image in flash differed from its check sum at power-up |
//! | 2 | the floating-point unit gave a wrong result |
//! | 3 | the image in flash differs from its check sum in service |
//! | 4 | RAM was tested |
//! | 5 | flash was tested at power-up: the image has a check sum |
//! | 6 | the floating-point unit was tested |
//! | 7 | the test at power-up was commanded by a request |
//! | 16..32 | passes of the test in service over the whole image, at most 65 535 |
//!
//! A result stays until the next power-up or commanded test. The word is 0 from a unit without these tests, as in the emulator.
//!
//! The word takes its turn among the health items ([`SelfTest::show_in`]); once a test has failed, it also takes the place of
//! another item in every [`SHOWN_EVERY`]-th frame, so that it shows within 18 ms at 400 frames a second.

use crate::unit::health::{HEALTH_ITEMS, HealthItem, item};
use crate::unit::telemetry_frame::TelemetryFrame;

/// Frames from one to the next that show a failed test.
pub const SHOWN_EVERY: u32 = 7;

// Each of the other items still has its turn.
const _: () = assert!(!HEALTH_ITEMS.len().is_multiple_of(SHOWN_EVERY as usize));

/// Results of the built-in test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[must_use = "a test may have failed"]
pub struct SelfTest {
    /// RAM did not hold what was written.
    pub ram_failed: bool,
    /// The image in flash differed from its check sum at power-up.
    pub flash_failed: bool,
    /// The floating-point unit gave a wrong result.
    pub float_failed: bool,
    /// The image in flash differs from its check sum in service.
    pub scrub_failed: bool,
    /// RAM was tested.
    pub ram_tested: bool,
    /// Flash was tested at power-up.
    pub flash_tested: bool,
    /// The floating-point unit was tested.
    pub float_tested: bool,
    /// The test was commanded.
    pub commanded: bool,
    /// Passes of the test in service.
    pub scrub_passes: u16,
}

impl SelfTest {
    /// Returns these results after `change`.
    pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }

    /// The word.
    pub const fn to_word(self) -> u32 {
        (self.ram_failed as u32)
            | (self.flash_failed as u32) << 1
            | (self.float_failed as u32) << 2
            | (self.scrub_failed as u32) << 3
            | (self.ram_tested as u32) << 4
            | (self.flash_tested as u32) << 5
            | (self.float_tested as u32) << 6
            | (self.commanded as u32) << 7
            | (self.scrub_passes as u32) << 16
    }

    /// The inverse of [`Self::to_word`].
    pub const fn from_word(word: u32) -> Self {
        Self {
            ram_failed: word & 1 != 0,
            flash_failed: word >> 1 & 1 != 0,
            float_failed: word >> 2 & 1 != 0,
            scrub_failed: word >> 3 & 1 != 0,
            ram_tested: word >> 4 & 1 != 0,
            flash_tested: word >> 5 & 1 != 0,
            float_tested: word >> 6 & 1 != 0,
            commanded: word >> 7 & 1 != 0,
            scrub_passes: (word >> 16) as u16,
        }
    }

    /// True if a test has failed.
    pub const fn has_failed(&self) -> bool {
        self.ram_failed || self.flash_failed || self.float_failed || self.scrub_failed
    }

    /// Names of the tests that have failed, in the order of their bits.
    pub fn failures(&self) -> impl Iterator<Item = &'static str> {
        [
            (self.ram_failed, "RAM"),
            (self.flash_failed, "flash at power-up"),
            (self.float_failed, "floating-point unit"),
            (self.scrub_failed, "flash in service"),
        ]
        .into_iter()
        .filter_map(|(has_failed, name)| has_failed.then_some(name))
    }

    /// Puts the word into a frame whose health item it is, or whose place it takes.
    #[inline]
    pub fn show_in(&self, frame: &mut TelemetryFrame) {
        let is_shown = frame.health.index == item::SELF_TEST
            || self.has_failed() && frame.output.sequence.is_multiple_of(SHOWN_EVERY);
        if is_shown {
            frame.health = HealthItem {
                index: item::SELF_TEST,
                value: self.to_word(),
            };
        }
    }
}
