//! Takes a firmware image piece by piece into the slot that is not in use.
//!
//! The header comes first and is kept: kind of unit, slot and length are checked before anything is erased. Each piece is
//! programmed as it comes and read back. At the end every byte is checked in flash against the header's CRC-32; then the
//! header is programmed, and last the record that makes the image a candidate. Power that fails at any step leaves the running
//! image in its slot, untouched, and records that name it; without the last record the new one is not started.

use core::fmt;

use embedded_storage::nor_flash::NorFlash;

use crate::store::image::{
    HEADER_BYTES, ImageError, ImageHeader, ImageSlot, PIECE_BYTES, check_content, check_image,
};
use crate::store::image_journal::{Event, ImageId, JournalError, ROOM_FOR_UPLOAD};
use crate::store::image_layout::IMAGE_HEADER_BYTES;
use crate::store::image_slots::ImageSlots;
use crate::store::image_state::{BootReason, ImageState};

/// Reason that an image is not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ImageUploadError {
    /// No upload has begun.
    NotBegun,
    /// The bytes are no image for this unit.
    Image(ImageError),
    /// The image is linked for the slot in use; the free one.
    Slot(ImageSlot),
    /// The other slot holds the only confirmed image.
    OnTrial,
    /// This piece does not follow those received, or differs from them \[pieces so far\].
    Order(u32),
    /// The image is not whole yet \[pieces so far\].
    Unfinished(u32),
    /// The supply is not known to suffice for erasing and programming.
    SupplyLow,
    /// Flash reported an error.
    Flash,
    /// Flash does not hold what was written.
    Verify,
}

impl fmt::Display for ImageUploadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotBegun => f.write_str("no upload of a firmware image has begun"),
            Self::Image(error) => error.fmt(f),
            Self::Slot(free) => write!(
                f,
                "firmware image is linked for the slot in use, slot {free:?} is free"
            ),
            Self::OnTrial => f.write_str("the other slot holds the only confirmed firmware image"),
            Self::Order(received) => {
                write!(f, "piece out of order: {received} have been received")
            }
            Self::Unfinished(received) => {
                write!(f, "firmware image not whole: {received} pieces received")
            }
            Self::SupplyLow => f.write_str("the supply is too low to write flash"),
            Self::Flash => f.write_str("the flash reported an error"),
            Self::Verify => f.write_str("the flash does not hold what was written"),
        }
    }
}

impl core::error::Error for ImageUploadError {}

impl From<JournalError> for ImageUploadError {
    fn from(error: JournalError) -> Self {
        match error {
            JournalError::Verify => Self::Verify,
            _ => Self::Flash,
        }
    }
}

/// An image on its way.
#[derive(Debug)]
pub struct ImageUpload<S, I> {
    slots: ImageSlots<S, I>,
    running: ImageSlot,
    reason: BootReason,
    header: Option<ImageHeader>,
    /// Pieces programmed so far.
    received: u32,
    is_stored: bool,
}

impl<S: NorFlash, I: NorFlash> ImageUpload<S, I> {
    const UNITS_FIT: () = assert!(
        PIECE_BYTES.is_multiple_of(I::WRITE_SIZE) && HEADER_BYTES.is_multiple_of(I::WRITE_SIZE)
    );

    /// Begins with nothing received, in an image that runs from `running`, started for `reason`.
    pub fn new(slots: ImageSlots<S, I>, running: ImageSlot, reason: BootReason) -> Self {
        Self {
            slots,
            running,
            reason,
            header: None,
            received: 0,
            is_stored: false,
        }
    }

    /// Gives the slots back.
    pub fn release(self) -> ImageSlots<S, I> {
        self.slots
    }

    /// State of the running image.
    pub fn state(&mut self) -> ImageState {
        self.slots.state(self.running, self.reason)
    }

    /// Begins to take the image of this header: erases its slot; gives the slot's number.
    ///
    /// # Inputs
    /// `supply_suffices`: the supply is known to be high enough for erasing and programming.
    ///
    /// # Errors
    /// The header is not one for this unit and the free slot, and nothing was erased; or flash failed.
    pub fn begin(
        &mut self,
        header: &[u8; HEADER_BYTES],
        supply_suffices: impl FnOnce() -> bool,
    ) -> Result<u32, ImageUploadError> {
        (self.header, self.received, self.is_stored) = (None, 0, false);
        let header = ImageHeader::of_bytes(header).map_err(ImageUploadError::Image)?;
        let free = self.state().free.ok_or(ImageUploadError::OnTrial)?;
        if header.slot != free {
            return Err(ImageUploadError::Slot(free));
        }
        if !supply_suffices() {
            return Err(ImageUploadError::SupplyLow);
        }
        self.slots.journal.make_room(ROOM_FOR_UPLOAD)?;
        self.record_running()?;
        let begin = free.offset();
        let end =
            begin + (IMAGE_HEADER_BYTES + header.length).next_multiple_of(I::ERASE_SIZE as u32);
        let erased = self.slots.images.erase(begin, end);
        erased.map_err(|_| ImageUploadError::Flash)?;
        self.header = Some(header);
        Ok(free as u32)
    }

    /// Confirms the running image if no image is: it is about to be the only one, and the one to go back to.
    fn record_running(&mut self) -> Result<(), ImageUploadError> {
        let own = self.slots.own_id(self.running);
        let own = own.map_err(ImageUploadError::Image)?;
        if self.slots.history()?.confirmed != Some(own) {
            self.slots.journal.append(Event::Confirmed, own)?;
        }
        Ok(())
    }

    /// Programs the piece of number `piece`. One that came before, sent again because the answer was lost, changes nothing.
    ///
    /// # Errors
    /// It does not follow those received or is no whole piece; or flash did not take it.
    pub fn put(&mut self, piece: u32, bytes: &[u8]) -> Result<(), ImageUploadError> {
        const { Self::UNITS_FIT };
        let header = self.header.ok_or(ImageUploadError::NotBegun)?;
        let pieces = header.length / PIECE_BYTES as u32;
        let order = Err(ImageUploadError::Order(self.received));
        let Some(bytes) = bytes.first_chunk::<PIECE_BYTES>() else {
            return order;
        };
        if piece > self.received || piece >= pieces {
            return order;
        }
        let at = header.slot.offset() + IMAGE_HEADER_BYTES + piece * PIECE_BYTES as u32;
        if piece < self.received {
            return if self.holds(at, bytes)? {
                Ok(())
            } else {
                order
            };
        }
        let written = self.slots.images.write(at, bytes);
        written.map_err(|_| ImageUploadError::Flash)?;
        if !self.holds(at, bytes)? {
            return Err(ImageUploadError::Verify);
        }
        self.received += 1;
        Ok(())
    }

    fn holds(&mut self, at: u32, bytes: &[u8; PIECE_BYTES]) -> Result<bool, ImageUploadError> {
        let mut found = [0; PIECE_BYTES];
        let read = self.slots.images.read(at, &mut found);
        read.map_err(|_| ImageUploadError::Flash)?;
        Ok(found == *bytes)
    }

    /// Checks the image in its slot and makes it the candidate of the next start; gives the slot's number.
    ///
    /// # Errors
    /// The image is not whole or not good, or flash failed; the running image stays the one to start.
    pub fn store(
        &mut self,
        supply_suffices: impl FnOnce() -> bool,
    ) -> Result<u32, ImageUploadError> {
        let header = self.header.ok_or(ImageUploadError::NotBegun)?;
        if self.received < header.length / PIECE_BYTES as u32 {
            return Err(ImageUploadError::Unfinished(self.received));
        }
        // Asked again because the answer was lost.
        if self.is_stored {
            return Ok(header.slot as u32);
        }
        if !supply_suffices() {
            return Err(ImageUploadError::SupplyLow);
        }
        let (slots, slot) = (&mut self.slots, header.slot);
        check_content(&mut slots.images, &header).map_err(ImageUploadError::Image)?;
        let written = slots.images.write(slot.offset(), &header.to_bytes());
        written.map_err(|_| ImageUploadError::Flash)?;
        if check_image(&mut slots.images, slot) != Ok(header) {
            return Err(ImageUploadError::Verify);
        }
        let crc = header.crc;
        slots.journal.append(Event::Stored, ImageId { slot, crc })?;
        self.is_stored = true;
        Ok(slot as u32)
    }
}
