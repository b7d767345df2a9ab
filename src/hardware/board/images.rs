//! The image behind a boot selector: the reason for which it runs, uploads of the next one, and the confirmation of itself.
//!
//! An image that is not confirmed is judged once, 30 s after the start of sampling ([`judge`]). In health it
//! records that it is, a word of flash in a period: while flash is programmed no instruction is fetched, so a word is begun
//! only where the rest of the period is longer than the longest time of a word. Otherwise, if the selector has started it on
//! trial, it resets, and the image before it takes over.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use stm32f4::stm32f405::{FLASH, TIM2};
use trueaxis::image::{HARDWARE, ImageSlot};
use trueaxis::image_journal::{Event, Pending};
use trueaxis::image_slots::{ImageSlots, Verdict, judge};
use trueaxis::image_state::{BootNote, BootReason, ImageState};
use trueaxis::image_upload::ImageUpload;
use trueaxis::parameter_slots::Loaded;
use trueaxis::processor::version_word;

use crate::Core;
use crate::hardware::flash::{SECTOR_BYTES, SlotFlash};
use crate::hardware::image_flash::{ImageFlash, JournalFlash, note};
use crate::hardware::sampling::WATCH;

/// Kind of unit, version and revision of this image, for tools that read the image's file. The name stands in the image as it
/// is.
#[unsafe(no_mangle)]
static FIRMWARE_IDENTITY: [AtomicU32; 3] = [
    AtomicU32::new(HARDWARE),
    AtomicU32::new(version_word::<Core>()),
    AtomicU32::new(trueaxis::REVISION),
];

/// Longest time of a word with its overhead \[µs\]: 100 µs to program (DS8626 table 41), and the driver's part.
const WORD_US: u32 = 105;

/// Beginning of a parameter block.
const BLOCK_MAGIC: [u8; 4] = *b"RLGP";

unsafe extern "C" {
    /// The vector table, from the linker script.
    static __vector_table: u8;
}

/// Revision of this image.
pub fn revision() -> u32 {
    FIRMWARE_IDENTITY[2].load(Ordering::Relaxed)
}

/// The running image and its slot.
pub struct Images {
    slots: ImageSlots<JournalFlash, ImageFlash>,
    running: ImageSlot,
    state: ImageState,
}

impl Images {
    /// Takes the selector's note, once.
    pub fn find() -> Self {
        // SAFETY: two words of RAM that nothing else uses.
        let words = unsafe { note().read_volatile() };
        // SAFETY: as above.
        unsafe { note().write_volatile([0; 2]) };
        let address = (&raw const __vector_table).addr() as u32;
        // The build script links slotted images nowhere else.
        let running = ImageSlot::of_vector_table(address).unwrap_or(ImageSlot::A);
        let left = BootNote::of_words(words).filter(|note| note.slot == running);
        let reason = left.map_or(BootReason::None, |note| note.reason);
        // SAFETY: the main loop alone works with these, and never with two controllers at the same time.
        let (journal, images) = unsafe { (FLASH::steal(), FLASH::steal()) };
        let mut slots = ImageSlots::new(JournalFlash::new(journal), ImageFlash::new(images));
        let state = slots.state(running, reason);
        defmt::info!("firmware image {}", state);
        Self {
            slots,
            running,
            state,
        }
    }

    /// State at boot.
    pub fn state(&self) -> ImageState {
        self.state
    }

    /// Begins to take the next image.
    pub fn upload(self) -> ImageUpload<JournalFlash, ImageFlash> {
        ImageUpload::new(self.slots, self.running, self.state.reason)
    }

    /// Begins to judge this one. `loaded`: the parameters in force; `timer_hz`: clock of TIM2.
    pub fn confirmation(self, loaded: &Loaded, timer_hz: u32) -> Confirmation {
        Confirmation {
            has_parameters: !loaded.parameters_default() || !holds_a_block(),
            periods_a_second: loaded.parameters.sample_rate_hz as u32,
            word_ticks: timer_hz / 1_000_000 * WORD_US,
            seen: 0,
            step: if self.state.is_confirmed {
                Step::Done
            } else {
                Step::Judge
            },
            images: self,
        }
    }
}

/// True if a parameter slot begins with a block, good or not: then this image ought to have found parameters.
fn holds_a_block() -> bool {
    // SAFETY: reading needs no register of the controller.
    let mut flash = SlotFlash::new(unsafe { FLASH::steal() });
    [0, SECTOR_BYTES].into_iter().any(|slot| {
        let mut magic = [0; BLOCK_MAGIC.len()];
        flash.read(slot, &mut magic).is_ok() && magic == BLOCK_MAGIC
    })
}

/// Step of the confirmation.
enum Step {
    /// To judge.
    Judge,
    /// To write the words of the record from this one on.
    Write(Pending, usize),
    /// Nothing.
    Done,
}

/// Judges this image and records that it runs in health.
pub struct Confirmation {
    images: Images,
    has_parameters: bool,
    periods_a_second: u32,
    word_ticks: u32,
    seen: u32,
    step: Step,
}

impl Confirmation {
    /// Does the next step, after `served` interrupts. `tests_passed`: no part of the built-in test has failed.
    ///
    /// # Returns
    /// The new state once the image is confirmed.
    pub fn poll(
        &mut self,
        served: u32,
        tests_passed: bool,
        supply_suffices: impl FnOnce() -> bool,
    ) -> Option<ImageState> {
        if served == self.seen {
            return None;
        }
        self.seen = served;
        match self.step {
            Step::Done => None,
            Step::Judge => {
                let seconds = served / self.periods_a_second.max(1);
                self.judge(seconds, tests_passed, supply_suffices);
                None
            }
            Step::Write(pending, word) => self.write(pending, word),
        }
    }

    #[inline(never)]
    fn judge(&mut self, seconds: u32, tests_passed: bool, supply_suffices: impl FnOnce() -> bool) {
        let on_trial = self.images.state.reason == BootReason::Trial;
        let healthy =
            self.has_parameters && tests_passed && WATCH.first_fault.load(Ordering::Relaxed) == 0;
        match judge(seconds, healthy, on_trial) {
            Verdict::Wait => {}
            Verdict::Confirm => {
                let slots = &mut self.images.slots;
                let own = slots.own_id(self.images.running);
                let pending = own
                    .ok()
                    .filter(|_| supply_suffices())
                    .and_then(|own| slots.journal.prepare(Event::Confirmed, own).ok());
                match pending {
                    Some(pending) => self.step = Step::Write(pending, 0),
                    None => self.fail(on_trial),
                }
            }
            Verdict::GiveUp => self.fail(on_trial),
        }
    }

    /// Ends a trial; an image that is the only one goes on.
    fn fail(&mut self, on_trial: bool) {
        self.step = Step::Done;
        if on_trial {
            defmt::error!("the trial of this image ends: not in health, or not recorded");
            SCB::sys_reset();
        }
        defmt::warn!("this image is not confirmed: its record could not be written");
    }

    /// Writes a word if the period leaves the time for it; behind the last, compares.
    #[inline(never)]
    fn write(&mut self, pending: Pending, word: usize) -> Option<ImageState> {
        let slots = &mut self.images.slots;
        let Some(bytes) = pending.bytes.as_chunks::<4>().0.get(word) else {
            let verified = slots.journal.verify(pending.offset, &pending.bytes);
            if verified.is_err() {
                self.fail(self.images.state.reason == BootReason::Trial);
                return None;
            }
            self.step = Step::Done;
            self.images.state = slots.state(self.images.running, self.images.state.reason);
            defmt::info!("firmware image {}", self.images.state);
            return Some(self.images.state);
        };
        if !period_has_room(self.word_ticks) {
            return None;
        }
        let at = pending.offset + 4 * word as u32;
        match slots.journal.flash().write(at, bytes) {
            Ok(()) => self.step = Step::Write(pending, word + 1),
            Err(_) => self.fail(self.images.state.reason == BootReason::Trial),
        }
        None
    }
}

/// True if so many ticks are left of the sampling period; also of a period that is too short for them at any time, which then
/// has one late interrupt.
fn period_has_room(ticks: u32) -> bool {
    // SAFETY: only read; the interrupt has the timer.
    let timer = unsafe { TIM2::steal() };
    let period = timer.arr().read().bits();
    period < 2 * ticks || timer.cnt().read().bits().saturating_add(ticks) <= period
}
