//! The built-in test: at power-up and on request of RAM ([`ram_test`]), flash and the floating-point unit ([`float_test`]), in service of
//! flash.
//!
//! | when | what | time at 168 MHz |
//! |---|---|---|
//! | power-on, brown-out, request | RAM, before the clock starts; then flash, once over; the floating-point unit | docs/board.md |
//! | any other reset | the floating-point unit | some µs |
//! | in service | flash, [`WORDS_A_TURN`] words in a turn of the main loop, [`TURNS`] turns in a period | 33 ms for 128 KiB |
//!
//! Words are read as data, so what is compared is the cells and the data cache; the interrupt has no part in it. Below
//! [`FAST_HZ`] there is a turn of [`WORDS_IF_SLOW`] words in a period, and a pass takes some seconds.

use core::ptr;

use trueaxis::SelfTest;
use trueaxis::flash_check::{CheckedFlash, FlashCheck};

use super::float_test::float_unit_is_right;
use super::ram_test;

const WORDS_A_TURN: u32 = 16;

const TURNS: u32 = 16;

const WORDS_IF_SLOW: u32 = 2;

const FAST_HZ: u32 = 100_000_000;

/// The built-in test of this run.
pub struct BuiltInTest {
    flash: FlashCheck,
    results: SelfTest,
    words_a_turn: u32,
    turns: u32,
    served: u32,
    turns_left: u32,
}

impl BuiltInTest {
    /// Takes the result of RAM's test; after it, tests flash; tests the floating-point unit.
    #[inline(never)]
    pub fn start(core_hz: u32) -> Self {
        let ram = ram_test::take();
        let mut flash = FlashCheck::new(checked_flash());
        let is_sealed = flash.has_check_sum();
        let flash_failed = ram.is_done && !flash.finish_pass(word);
        let results = SelfTest::default().with(|results| {
            results.ram_tested = ram.is_done;
            results.commanded = ram.was_commanded;
            results.flash_tested = ram.is_done && is_sealed;
            results.flash_failed = flash_failed;
            results.float_tested = true;
            results.float_failed = !float_unit_is_right();
        });
        defmt::info!("built-in test {}", results);
        let (words_a_turn, turns) = if core_hz < FAST_HZ {
            (WORDS_IF_SLOW, 1)
        } else {
            (WORDS_A_TURN, TURNS)
        };
        Self {
            flash,
            results,
            words_a_turn,
            turns,
            served: 0,
            turns_left: 0,
        }
    }

    /// Results so far.
    pub fn results(&self) -> SelfTest {
        self.results
    }

    /// Tests the next words of flash, after `served` interrupts; returns true if more of this period's are left.
    pub fn poll(&mut self, served: u32) -> bool {
        if self.served != served {
            (self.served, self.turns_left) = (served, self.turns);
        }
        if self.turns_left == 0 {
            return false;
        }
        self.turns_left -= 1;
        if self.flash.step(self.words_a_turn, word) {
            self.conclude();
        }
        self.turns_left > 0
    }

    /// Takes over what a pass has found.
    #[inline(never)]
    fn conclude(&mut self) {
        self.results.scrub_passes = self.results.scrub_passes.saturating_add(1);
        if self.flash.has_failed() && !self.results.scrub_failed {
            self.results.scrub_failed = true;
            defmt::error!("the image in flash differs from its check sum");
        }
    }
}

/// A word of flash.
fn word(address: u32) -> u32 {
    // SAFETY: aligned, and within flash: `CheckedFlash` gives no other address.
    unsafe { ptr::read_volatile(ptr::with_exposed_provenance(address as usize)) }
}

/// The running image.
#[cfg(feature = "slotted")]
fn checked_flash() -> CheckedFlash {
    use trueaxis::image::HEADER_BYTES;
    use trueaxis::image_layout::IMAGE_HEADER_BYTES;
    unsafe extern "C" {
        /// The vector table, from the linker script.
        static __vector_table: u8;
    }
    let vectors = (&raw const __vector_table).addr() as u32;
    let mut header = [0; HEADER_BYTES];
    for (at, bytes) in (vectors - IMAGE_HEADER_BYTES..)
        .step_by(4)
        .zip(header.as_chunks_mut::<4>().0)
    {
        *bytes = word(at).to_le_bytes();
    }
    CheckedFlash::in_slot(vectors, &header)
}

/// The running image.
#[cfg(not(feature = "slotted"))]
fn checked_flash() -> CheckedFlash {
    use trueaxis::flash_check::Seal;
    unsafe extern "C" {
        /// Initial values of variables, the image's last part: where they stand in flash, and their places in RAM.
        static __sidata: u8;
        static __sdata: u8;
        static __edata: u8;
    }
    /// Filled in by `rlg firmware --seal`. The name stands in the image as it is.
    #[unsafe(no_mangle)]
    #[used]
    static IMAGE_SEAL: [u32; 3] = Seal::ERASED;

    let bytes = (&raw const __edata).addr() - (&raw const __sdata).addr();
    let end = (&raw const __sidata).addr() + bytes;
    // SAFETY: a constant in flash, which a tool has changed since the compiler saw it.
    let seal = unsafe { ptr::read_volatile(&raw const IMAGE_SEAL) };
    CheckedFlash::alone(end as u32, (&raw const IMAGE_SEAL).addr() as u32, seal)
}
