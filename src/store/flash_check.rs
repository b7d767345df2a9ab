//! Compares the running image in flash with its check sum, some words at a time.
//!
//! The words and their order are the caller's to read: the test needs no flash driver. An image behind a boot selector has
//! its check sum in the header ([`image`](crate::store::image)); one without may have a [`Seal`]; with neither, the first pass
//! gives the sum for those that follow.

use core::ops::Range;

use crc::{Digest, Table};

use crate::store::image::{
    CHECKSUM, CRC_AT, HEADER_BYTES, ImageHeader, LARGEST_CODE_BYTES, PIECE_BYTES,
};
use crate::store::image_layout::{FLASH_BEGIN, IMAGE_HEADER_BYTES, PARAMETER_SLOTS_BEGIN};

/// Check sum of an image that no boot selector starts: three words within the image, under the name `IMAGE_SEAL`, which the
/// linker leaves erased and `rlg firmware --seal` fills in.
///
/// | word | holds |
/// |---|---|
/// | 0 | `SEAL` |
/// | 1 | bytes of the image from the beginning of flash, whole words |
/// | 2 | CRC-32 (ISO-HDLC) of these bytes without the seal's |
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Seal {
    /// Bytes of the image.
    pub bytes: u32,
    /// CRC-32.
    pub crc: u32,
}

/// First word of a seal.
const SEAL_MAGIC: u32 = u32::from_le_bytes(*b"SEAL");

impl Seal {
    /// Bytes of a seal.
    pub const BYTES: u32 = 12;

    /// Words of an image without one.
    pub const ERASED: [u32; 3] = [u32::MAX; 3];

    /// The words.
    pub const fn to_words(self) -> [u32; 3] {
        [SEAL_MAGIC, self.bytes, self.crc]
    }

    /// The seal of these words, if they are one.
    pub fn of_words([magic, bytes, crc]: [u32; 3]) -> Option<Self> {
        let fits = bytes <= PARAMETER_SLOTS_BEGIN - FLASH_BEGIN && bytes.is_multiple_of(4);
        (magic == SEAL_MAGIC && fits).then_some(Self { bytes, crc })
    }

    /// The seal of an image whose seal stands at the offset `at`; the image is filled up to whole words with 0xFF.
    pub fn sealing(image: &[u8], at: usize) -> Self {
        let (before, rest) = image.split_at(at.min(image.len()));
        let behind = rest.get(Self::BYTES as usize..).unwrap_or_default();
        let filling = image.len().next_multiple_of(4) - image.len();
        let mut digest = CHECKSUM.digest();
        digest.update(before);
        digest.update(behind);
        digest.update([0xFF; 3].get(..filling).unwrap_or_default());
        Self {
            bytes: (image.len() + filling) as u32,
            crc: digest.finalize(),
        }
    }
}

/// Part of flash that is tested, and its check sum.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CheckedFlash {
    /// Addresses of its words.
    pub words: Range<u32>,
    /// Addresses that are left out: those of the check sum.
    pub without: Range<u32>,
    /// The check sum; `None` if the image has none.
    pub crc: Option<u32>,
}

impl CheckedFlash {
    /// An image from the beginning of flash to `end`, with the words of its seal at the address `seal_at`. Words that are neither a
    /// seal nor erased give a part that fails.
    pub fn alone(end: u32, seal_at: u32, words: [u32; 3]) -> Self {
        let seal = Seal::of_words(words);
        let end = seal.map_or(end.next_multiple_of(4), |seal| FLASH_BEGIN + seal.bytes);
        // A sum that the part has by a chance of 2^-32 only.
        let damaged = (words != Seal::ERASED).then_some(0);
        Self {
            words: FLASH_BEGIN..end,
            without: seal_at..seal_at + Seal::BYTES,
            crc: seal.map(|seal| seal.crc).or(damaged),
        }
    }

    /// An image behind a boot selector, whose header the selector has checked at this start. A header that no longer reads
    /// as one gives a part that fails.
    pub fn in_slot(vector_table: u32, header: &[u8; HEADER_BYTES]) -> Self {
        let begin = vector_table - IMAGE_HEADER_BYTES;
        let header = ImageHeader::of_bytes(header).ok();
        let length = header.map_or(PIECE_BYTES as u32, |header| header.length);
        let crc_at = begin + CRC_AT as u32;
        Self {
            words: begin..vector_table + length.min(LARGEST_CODE_BYTES),
            without: crc_at..crc_at + 4,
            // A sum that the part has by a chance of 2^-32 only.
            crc: Some(header.map_or(0, |header| header.crc)),
        }
    }
}

/// The test: a pass over the words after another.
pub struct FlashCheck {
    flash: CheckedFlash,
    at: u32,
    digest: Digest<'static, u32, Table<1>>,
    has_failed: bool,
}

impl FlashCheck {
    /// Before the first word.
    pub fn new(flash: CheckedFlash) -> Self {
        Self {
            at: flash.words.start,
            flash,
            digest: CHECKSUM.digest(),
            has_failed: false,
        }
    }

    /// Takes the next `words`, each read by its address; ends with the pass.
    ///
    /// # Returns
    /// True if a pass has ended.
    #[inline(never)]
    pub fn step(&mut self, words: u32, read: impl Fn(u32) -> u32) -> bool {
        for _ in 0..words {
            if self.at == self.flash.without.start {
                self.at = self.flash.without.end;
            }
            if self.at >= self.flash.words.end {
                self.conclude();
                return true;
            }
            self.digest.update(&read(self.at).to_le_bytes());
            self.at += 4;
        }
        false
    }

    /// Runs to the end of the pass; returns true if all passes so far agreed with the check sum.
    pub fn finish_pass(&mut self, read: impl Fn(u32) -> u32) -> bool {
        while !self.step(u32::MAX, &read) {}
        !self.has_failed
    }

    fn conclude(&mut self) {
        let digest = core::mem::replace(&mut self.digest, CHECKSUM.digest());
        let crc = digest.finalize();
        self.has_failed |= *self.flash.crc.get_or_insert(crc) != crc;
        self.at = self.flash.words.start;
    }

    /// True if the image has a check sum, or a pass has given one.
    pub fn has_check_sum(&self) -> bool {
        self.flash.crc.is_some()
    }

    /// True once a pass has disagreed.
    pub fn has_failed(&self) -> bool {
        self.has_failed
    }
}
