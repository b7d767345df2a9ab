//! A unit with a boot selector on flash that loses power: records in two sectors of 16 KiB, two images in four of 128 KiB, as
//! on the chip.
//!
//! Every erasure of a sector and every programmed word is an operation; power fails in the one of a given number, and
//! leaves it undone, done in part (each bit that it would change, changed or not) or done. Nothing works after that until
//! the next boot. Images are random code behind two plausible vectors; [`Unit::running`] compares the flash that is started
//! with them byte for byte, without any check sum.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueaxis::image::{HEADER_BYTES, ImageHeader, ImageSlot, PIECE_BYTES};
use trueaxis::image_journal::Event;
use trueaxis::image_layout::{
    IMAGE_HEADER_BYTES, IMAGE_SECTOR_BYTES, IMAGE_SLOT_BYTES, JOURNAL_SECTOR_BYTES,
    JOURNAL_SECTORS, NOTE_BEGIN,
};
use trueaxis::image_slots::{Choice, ImageSlots};
use trueaxis::image_state::BootReason;
use trueaxis::image_upload::ImageUpload;
use trueaxis::service::images::carry_out;
use trueaxis::service_frame::{Request, RequestKind, RequestReceiver};

/// Result of an operation that lost its power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Leftover {
    /// The old content.
    Nothing,
    /// Part of the bits.
    SomeBits,
    /// All of it is done.
    Whole,
}

/// All of them.
pub const LEFTOVERS: [Leftover; 3] = [Leftover::Nothing, Leftover::SomeBits, Leftover::Whole];

/// Both regions of one chip.
#[derive(Debug, Clone)]
pub struct Chip {
    /// Records and images.
    pub content: [Vec<u8>; 2],
    /// Power fails in this operation.
    pub cut: Option<(usize, Leftover)>,
    /// Operations since the last boot.
    pub operations: usize,
    /// This operation reports an error and changes nothing.
    pub refuses: Option<usize>,
    is_dead: bool,
    random: ChaCha8Rng,
}

impl Chip {
    /// Erased throughout.
    pub fn erased() -> Self {
        let bytes = [JOURNAL_SECTORS * JOURNAL_SECTOR_BYTES, 2 * IMAGE_SLOT_BYTES];
        Self {
            content: bytes.map(|bytes| vec![0xFF; bytes as usize]),
            cut: None,
            operations: 0,
            refuses: None,
            is_dead: false,
            random: ChaCha8Rng::seed_from_u64(1),
        }
    }

    /// Restarts after a power cut or any other reset; its content stays.
    pub fn reboot(&mut self) {
        (self.cut, self.refuses, self.operations, self.is_dead) = (None, None, 0, false);
    }

    fn operate(&mut self, region: usize, at: usize, new: &[u8]) -> Result<(), Dead> {
        let operation = self.operations;
        self.operations += 1;
        if self.is_dead || self.refuses == Some(operation) {
            return Err(Dead);
        }
        let place = &mut self.content[region][at..at + new.len()];
        match self.cut.filter(|(cut, _)| *cut == operation) {
            None => {
                place.copy_from_slice(new);
                return Ok(());
            }
            Some((_, Leftover::Whole)) => place.copy_from_slice(new),
            Some((_, Leftover::Nothing)) => {}
            Some((_, Leftover::SomeBits)) => {
                for (byte, new) in place.iter_mut().zip(new) {
                    *byte ^= (*byte ^ new) & self.random.random::<u8>();
                }
            }
        }
        self.is_dead = true;
        Err(Dead)
    }
}

/// The flash has no power, or refuses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dead;

impl NorFlashError for Dead {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// One region of a chip, with sectors of `SECTOR` bytes.
#[derive(Debug, Clone)]
pub struct View<const REGION: usize, const SECTOR: usize>(Rc<RefCell<Chip>>);

/// The records.
pub type JournalView = View<0, { JOURNAL_SECTOR_BYTES as usize }>;

/// The images.
pub type ImagesView = View<1, { IMAGE_SECTOR_BYTES as usize }>;

impl<const REGION: usize, const SECTOR: usize> ErrorType for View<REGION, SECTOR> {
    type Error = Dead;
}

impl<const REGION: usize, const SECTOR: usize> ReadNorFlash for View<REGION, SECTOR> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Dead> {
        let chip = self.0.borrow();
        if chip.is_dead {
            return Err(Dead);
        }
        let begin = offset as usize;
        bytes.copy_from_slice(&chip.content[REGION][begin..begin + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.borrow().content[REGION].len()
    }
}

impl<const REGION: usize, const SECTOR: usize> NorFlash for View<REGION, SECTOR> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Dead> {
        let (from, to) = (from as usize, to as usize);
        assert!(from.is_multiple_of(SECTOR) && to.is_multiple_of(SECTOR) && from < to);
        let erased = vec![0xFF; SECTOR];
        (from / SECTOR..to / SECTOR).try_for_each(|sector| {
            let mut chip = self.0.borrow_mut();
            chip.operate(REGION, sector * SECTOR, &erased)
        })
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Dead> {
        let (words, rest) = bytes.as_chunks::<4>();
        assert!(offset.is_multiple_of(4) && rest.is_empty());
        (offset as usize..)
            .step_by(4)
            .zip(words)
            .try_for_each(|(at, word)| {
                let mut chip = self.0.borrow_mut();
                // Programming clears bits alone.
                let new: [u8; 4] =
                    std::array::from_fn(|byte| chip.content[REGION][at + byte] & word[byte]);
                chip.operate(REGION, at, &new)
            })
    }
}

/// An image as its file: header, filling, code.
pub fn image(slot: ImageSlot, code_bytes: usize, seed: u64) -> Vec<u8> {
    assert!(code_bytes.is_multiple_of(PIECE_BYTES));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut code: Vec<u8> = (0..code_bytes).map(|_| random.random()).collect();
    let reset = slot.vector_table() + 9;
    code[..4].copy_from_slice(&NOTE_BEGIN.to_le_bytes());
    code[4..8].copy_from_slice(&reset.to_le_bytes());
    sealed(slot, &code)
}

/// The image of this code.
pub fn sealed(slot: ImageSlot, code: &[u8]) -> Vec<u8> {
    let header = ImageHeader::sealing(slot, 0x0001_0000, 0xABCD_EF10, code);
    let mut file = header.to_bytes().to_vec();
    file.resize(IMAGE_HEADER_BYTES as usize, 0xFF);
    file.extend(code);
    file
}

/// Requests of a sender for the image in `file`.
pub fn requests(file: &[u8]) -> Vec<Request> {
    let (block, code) = file.split_at(IMAGE_HEADER_BYTES as usize);
    let begin = Request::with_bytes(1, RequestKind::ImageBegin, 0, &block[..HEADER_BYTES]);
    let pieces = code.chunks(PIECE_BYTES).enumerate();
    let data =
        pieces.map(|(at, piece)| Request::with_bytes(2, RequestKind::ImageData, at as u16, piece));
    let store = Request::new(3, RequestKind::ImageStore, 0);
    std::iter::once(begin).chain(data).chain([store]).collect()
}

/// A unit, by the chip that it has.
#[derive(Debug, Clone)]
pub struct Unit {
    /// The chip.
    pub chip: Rc<RefCell<Chip>>,
    /// The supply is high enough for flash.
    pub supply_suffices: bool,
}

impl Unit {
    /// A unit with this chip.
    pub fn new(chip: Chip) -> Self {
        Self {
            chip: Rc::new(RefCell::new(chip)),
            supply_suffices: true,
        }
    }

    /// A unit with an image in slot A, flashed by a probe, which has run in health; `older`: the content of slot B.
    pub fn in_service(image: &[u8], older: &[u8]) -> Self {
        let unit = Self::new(Chip::erased());
        unit.flash(ImageSlot::A, image);
        unit.flash(ImageSlot::B, older);
        let choice = unit.boot().expect("a good image");
        assert_eq!(choice.reason, BootReason::Unconfirmed);
        assert!(unit.confirm(choice.header.slot));
        assert_eq!(
            unit.boot().map(|choice| choice.reason),
            Some(BootReason::Confirmed)
        );
        unit
    }

    /// A copy of it with a chip of its own, rebooted.
    pub fn copy(&self) -> Self {
        let mut chip = self.chip.borrow().clone();
        chip.reboot();
        Self::new(chip)
    }

    /// Writes a file into a slot, as a probe does.
    pub fn flash(&self, slot: ImageSlot, file: &[u8]) {
        let begin = slot.offset() as usize;
        self.chip.borrow_mut().content[1][begin..begin + file.len()].copy_from_slice(file);
    }

    /// Records and slots.
    pub fn slots(&self) -> ImageSlots<JournalView, ImagesView> {
        ImageSlots::new(View(self.chip.clone()), View(self.chip.clone()))
    }

    /// Choice of the selector.
    pub fn boot(&self) -> Option<Choice> {
        self.slots().select(|| self.supply_suffices)
    }

    /// Records that the image in this slot runs in health, word by word as the image does; true if all of it was written.
    pub fn confirm(&self, slot: ImageSlot) -> bool {
        let mut slots = self.slots();
        let Ok(own) = slots.own_id(slot) else {
            return false;
        };
        let Ok(pending) = slots.journal.prepare(Event::Confirmed, own) else {
            return false;
        };
        let words = pending.bytes.as_chunks::<4>().0;
        let flash = slots.journal.flash();
        let written = (pending.offset..)
            .step_by(4)
            .zip(words)
            .all(|(at, word)| flash.write(at, word).is_ok());
        written && slots.journal.verify(pending.offset, &pending.bytes).is_ok()
    }

    /// Brings requests to the stopped unit, byte by byte; every outcome and detail, up to the first that is refused.
    pub fn send(&self, running: ImageSlot, requests: &[Request]) -> Vec<(u8, u32)> {
        let mut upload = ImageUpload::new(self.slots(), running, BootReason::Confirmed);
        let mut receiver = RequestReceiver::new();
        let mut outcomes = Vec::new();
        for byte in requests.iter().flat_map(Request::to_bytes) {
            if let Some(request) = receiver.push(byte) {
                outcomes.push(carry_out(&mut upload, &request, || self.supply_suffices));
                if outcomes.last().is_some_and(|(outcome, _)| *outcome != 0) {
                    break;
                }
            }
        }
        outcomes
    }

    /// Place among `files` of the image that the choice starts, byte for byte.
    ///
    /// # Panics
    /// The image started is not among `files`.
    pub fn running(&self, choice: &Choice, files: &[&[u8]]) -> usize {
        let chip = self.chip.borrow();
        let slot = &chip.content[1][choice.header.slot.offset() as usize..];
        let found = files.iter().position(|file| slot.starts_with(file));
        found.unwrap_or_else(|| panic!("{choice:?} starts an image that nobody has sent"))
    }
}
