//! Keeps the history of the firmware images: records that are only appended, in two sectors of flash.
//!
//! A sector is a page of places of [`RECORD_BYTES`]. A record, little-endian:
//!
//! | offset | holds |
//! |---|---|
//! | 0 | `RJ` |
//! | 2 | `u8` kind of [`Event`], 0 for the head of a page |
//! | 3 | `u8` number of the slot, 0 for the head |
//! | 4 | `u32` CRC-32 of the image; of the head the generation of the page |
//! | 8 | `u32` place of the record in its page |
//! | 12 | `u32` CRC-32 (ISO-HDLC) of the 12 bytes in front |
//!
//! The head stands at place 0 and is written last: a page without it does not count, and of two pages the newer counts
//! (ahead by less than 2³¹). A record that is damaged, as one whose power failed, is passed over, and so is its place.
//! Records become part of the [`History`] in their order. Power that fails at any word leaves the history with the record or
//! without it.
//!
//! [`Journal::make_room`] is the only step that erases: it writes the history into the other page. It is done while the
//! unit is stopped, before an upload; the selector appends alone.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};

use crate::store::image::ImageSlot;

/// Bytes of a record.
pub const RECORD_BYTES: usize = 16;

/// Places that an upload wants free: its own records are three, and each power cut spends one more.
pub const ROOM_FOR_UPLOAD: u32 = 32;

const MARK: [u8; 2] = *b"RJ";
const HEAD: u8 = 0;
const ERASED: [u8; RECORD_BYTES] = [0xFF; RECORD_BYTES];
const CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// An image, by its slot and its CRC-32.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ImageId {
    /// Its slot.
    pub slot: ImageSlot,
    /// CRC-32 of its header.
    pub crc: u32,
}

/// Events in the life of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Event {
    /// It was uploaded, and checked in its slot.
    Stored = 1,
    /// The selector is about to start it for the first time.
    Tried = 2,
    /// It has run in health.
    Confirmed = 3,
}

impl Event {
    const fn of_number(number: u8) -> Option<Self> {
        match number {
            1 => Some(Self::Stored),
            2 => Some(Self::Tried),
            3 => Some(Self::Confirmed),
            _ => None,
        }
    }
}

/// Result of all records.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct History {
    /// The image that has last run in health.
    pub confirmed: Option<ImageId>,
    /// The image that was uploaded since.
    pub candidate: Option<ImageId>,
    /// True if that one has been started.
    pub tried: bool,
}

impl History {
    /// The history after an event of this image.
    #[must_use]
    pub fn after(mut self, event: Event, image: ImageId) -> Self {
        match event {
            Event::Stored => {
                (self.candidate, self.tried) = (Some(image), false);
                // Its place was overwritten, and it has to run in health anew.
                self.confirmed = self.confirmed.filter(|confirmed| *confirmed != image);
            }
            Event::Tried => self.tried |= self.candidate == Some(image),
            Event::Confirmed => {
                self.confirmed = Some(image);
                if self.candidate == Some(image) {
                    (self.candidate, self.tried) = (None, false);
                }
            }
        }
        self
    }
}

/// Reason that a record was not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum JournalError {
    /// Flash reported an error.
    Flash,
    /// No page has a head, or the page is full.
    NoRoom,
    /// Flash does not hold what was written.
    Verify,
}

/// The page in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Page {
    sector: u32,
    generation: u32,
    /// First place behind every written one.
    free: u32,
    /// Result of its records.
    pub history: History,
}

/// A record and the offset that it belongs at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pending {
    /// Offset in the journal's flash \[bytes\].
    pub offset: u32,
    /// The record.
    pub bytes: [u8; RECORD_BYTES],
}

/// Records in two sectors of a flash, from offset 0.
#[derive(Debug)]
pub struct Journal<F> {
    flash: F,
}

impl<F: NorFlash> Journal<F> {
    const SECTOR: u32 = F::ERASE_SIZE as u32;
    /// Places of a page.
    pub const PLACES: u32 = Self::SECTOR / RECORD_BYTES as u32;
    const UNIT_FITS: () = assert!(RECORD_BYTES.is_multiple_of(F::WRITE_SIZE));

    /// The records of this flash.
    pub fn new(flash: F) -> Self {
        Self { flash }
    }

    /// Gives the flash back.
    pub fn release(self) -> F {
        self.flash
    }

    /// The flash, to write a [`Pending`] record word by word.
    pub fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Reads both pages; gives the one in force, if one has a head.
    ///
    /// # Errors
    /// [`JournalError::Flash`].
    pub fn page(&mut self) -> Result<Option<Page>, JournalError> {
        let heads = [self.head(0)?, self.head(1)?];
        let found = match heads {
            [Some(first), Some(second)] if (second.wrapping_sub(first) as i32) > 0 => (1, second),
            [Some(first), _] => (0, first),
            [None, Some(second)] => (1, second),
            [None, None] => return Ok(None),
        };
        let (sector, generation) = found;
        let mut page = Page {
            sector,
            generation,
            free: 1,
            history: History::default(),
        };
        for place in 1..Self::PLACES {
            let bytes = self.read(sector, place)?;
            if bytes == ERASED {
                continue;
            }
            page.free = place + 1;
            if let Some((Some(event), image)) = decode(&bytes, place) {
                page.history = page.history.after(event, image);
            }
        }
        Ok(Some(page))
    }

    /// The generation of a page with a head.
    fn head(&mut self, sector: u32) -> Result<Option<u32>, JournalError> {
        let bytes = self.read(sector, 0)?;
        Ok(decode_head(&bytes))
    }

    fn read(&mut self, sector: u32, place: u32) -> Result<[u8; RECORD_BYTES], JournalError> {
        let mut bytes = [0; RECORD_BYTES];
        let read = self.flash.read(Self::offset(sector, place), &mut bytes);
        read.map_err(|_| JournalError::Flash)?;
        Ok(bytes)
    }

    fn offset(sector: u32, place: u32) -> u32 {
        sector * Self::SECTOR + place * RECORD_BYTES as u32
    }

    /// Begins the first page of flash that was never written, without an erasure.
    ///
    /// # Errors
    /// [`JournalError::NoRoom`] if its first place is written already: then [`make_room`](Self::make_room) has to erase.
    pub fn begin(&mut self) -> Result<(), JournalError> {
        for place in 0..Self::PLACES {
            if self.read(0, place)? != ERASED {
                return Err(JournalError::NoRoom);
            }
        }
        self.write(Self::offset(0, 0), &encode_head(1))
    }

    /// The next record, to be written by the caller.
    ///
    /// # Errors
    /// There is no page, or no place is free.
    pub fn prepare(&mut self, event: Event, image: ImageId) -> Result<Pending, JournalError> {
        let page = self.page()?.ok_or(JournalError::NoRoom)?;
        if page.free >= Self::PLACES {
            return Err(JournalError::NoRoom);
        }
        Ok(Pending {
            offset: Self::offset(page.sector, page.free),
            bytes: encode(event, image, page.free),
        })
    }

    /// Appends a record and reads it back.
    ///
    /// # Errors
    /// It is not written, or is damaged and will be passed over.
    pub fn append(&mut self, event: Event, image: ImageId) -> Result<(), JournalError> {
        let pending = self.prepare(event, image)?;
        self.write(pending.offset, &pending.bytes)
    }

    /// Sees to a page in force with at least `least` free places, by writing the history into the other page, if need be.
    ///
    /// # Errors
    /// Flash did not take it; the page in force stays so.
    pub fn make_room(&mut self, least: u32) -> Result<(), JournalError> {
        let page = self.page()?;
        if page.is_some_and(|page| page.free.saturating_add(least) <= Self::PLACES) {
            return Ok(());
        }
        let (sector, generation, history) = page.map_or((0, 1, History::default()), |page| {
            let generation = page.generation.wrapping_add(1);
            (1 - page.sector.min(1), generation, page.history)
        });
        let begin = sector * Self::SECTOR;
        let erased = self.flash.erase(begin, begin + Self::SECTOR);
        erased.map_err(|_| JournalError::Flash)?;
        let tried = history.candidate.filter(|_| history.tried);
        let records = [
            history.confirmed.map(|image| (Event::Confirmed, image)),
            history.candidate.map(|image| (Event::Stored, image)),
            tried.map(|image| (Event::Tried, image)),
        ];
        for ((event, image), place) in records.into_iter().flatten().zip(1..) {
            self.write(Self::offset(sector, place), &encode(event, image, place))?;
        }
        self.write(begin, &encode_head(generation))
    }

    fn write(&mut self, offset: u32, bytes: &[u8; RECORD_BYTES]) -> Result<(), JournalError> {
        const { Self::UNIT_FITS };
        self.flash
            .write(offset, bytes)
            .map_err(|_| JournalError::Flash)?;
        self.verify(offset, bytes)
    }

    /// Compares flash with a record that was written.
    ///
    /// # Errors
    /// They differ, or flash cannot be read.
    pub fn verify(&mut self, offset: u32, bytes: &[u8; RECORD_BYTES]) -> Result<(), JournalError> {
        let mut found = [0; RECORD_BYTES];
        let read = ReadNorFlash::read(&mut self.flash, offset, &mut found);
        read.map_err(|_| JournalError::Flash)?;
        if found == *bytes {
            Ok(())
        } else {
            Err(JournalError::Verify)
        }
    }
}

/// A record of a kind, a slot's number, a word and its place.
fn seal(kind: u8, slot: u8, word: u32, place: u32) -> [u8; RECORD_BYTES] {
    let [first, second] = MARK;
    let [w0, w1, w2, w3] = word.to_le_bytes();
    let [p0, p1, p2, p3] = place.to_le_bytes();
    let content = [first, second, kind, slot, w0, w1, w2, w3, p0, p1, p2, p3];
    let sum = CHECKSUM.checksum(&content).to_le_bytes();
    let mut bytes = [0; RECORD_BYTES];
    for (place, byte) in bytes.iter_mut().zip(content.into_iter().chain(sum)) {
        *place = byte;
    }
    bytes
}

fn encode(event: Event, image: ImageId, place: u32) -> [u8; RECORD_BYTES] {
    seal(event as u8, image.slot as u8, image.crc, place)
}

fn encode_head(generation: u32) -> [u8; RECORD_BYTES] {
    seal(HEAD, 0, generation, 0)
}

/// Event, if it is known, and image of a whole record at this place.
fn decode(bytes: &[u8; RECORD_BYTES], place: u32) -> Option<(Option<Event>, ImageId)> {
    let [_, _, kind, slot, w0, w1, w2, w3, ..] = *bytes;
    let word = u32::from_le_bytes([w0, w1, w2, w3]);
    if *bytes != seal(kind, slot, word, place) {
        return None;
    }
    let slot = ImageSlot::of_number(slot)?;
    Some((Event::of_number(kind), ImageId { slot, crc: word }))
}

/// Generation of a whole head.
fn decode_head(bytes: &[u8; RECORD_BYTES]) -> Option<u32> {
    let [_, _, _, _, w0, w1, w2, w3, ..] = *bytes;
    let generation = u32::from_le_bytes([w0, w1, w2, w3]);
    (*bytes == encode_head(generation)).then_some(generation)
}
