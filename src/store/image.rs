//! Reads and checks the header of a firmware image, in a file or in its slot of flash.
//!
//! An image is a block of [`IMAGE_HEADER_BYTES`] and the code, which begins with the vector table. The block is the header,
//! little-endian, filled up with 0xFF:
//!
//! | offset | holds |
//! |---|---|
//! | 0 | magic `RLGI` |
//! | 4 | `u16` version of this layout, 1 |
//! | 6 | `u8` slot that the image is linked for: 1 A, 2 B |
//! | 7 | 0 |
//! | 8 | `u32` kind of unit ([`HARDWARE`]) |
//! | 12 | `u32` address of the vector table |
//! | 16 | `u32` bytes of the code, whole pieces of [`PIECE_BYTES`] |
//! | 20 | `u32` version of the firmware, as health item 34 |
//! | 24 | `u32` revision of the firmware, as health item 50 |
//! | 28 | `u32` CRC-32 (ISO-HDLC, as zip) of the header in front of it, the filling and the code |
//!
//! The CRC names an image, too: two images of one CRC are the same.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc};
use embedded_storage::nor_flash::ReadNorFlash;

use crate::store::image_layout::{
    IMAGE_HEADER_BYTES, IMAGE_SLOT_BYTES, IMAGES_BEGIN, NOTE_BEGIN, RAM_BEGIN,
};

/// Kind of unit that this firmware is for: the STM32F405 board of docs/board.md.
pub const HARDWARE: u32 = u32::from_le_bytes(*b"F405");

/// Bytes of the header without the filling.
pub const HEADER_BYTES: usize = 32;

/// Bytes of code that one request brings.
pub const PIECE_BYTES: usize = 32;

/// Largest code \[bytes\].
pub const LARGEST_CODE_BYTES: u32 = IMAGE_SLOT_BYTES - IMAGE_HEADER_BYTES;

const MAGIC: [u8; 4] = *b"RLGI";
const LAYOUT_VERSION: u16 = 1;
/// Offset of the CRC in the header.
pub(crate) const CRC_AT: usize = 28;
/// Bytes read at a time.
const CHUNK_BYTES: usize = 256;

/// With a table of 1 KiB: the selector computes it at each boot, at 16 MHz.
pub(crate) static CHECKSUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// One of the two slots of images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum ImageSlot {
    /// The first.
    A = 1,
    /// The second.
    B = 2,
}

impl ImageSlot {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::A, Self::B];

    /// The slot of this number, if it is one.
    pub const fn of_number(number: u8) -> Option<Self> {
        match number {
            1 => Some(Self::A),
            2 => Some(Self::B),
            _ => None,
        }
    }

    /// The slot whose images have their vector table at `address`, if it is one.
    pub fn of_vector_table(address: u32) -> Option<Self> {
        let is_it = |slot: &Self| slot.vector_table() == address;
        Self::BOTH.into_iter().find(is_it)
    }

    /// The other slot.
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }

    /// Offset over both slots \[bytes\].
    pub const fn offset(self) -> u32 {
        match self {
            Self::A => 0,
            Self::B => IMAGE_SLOT_BYTES,
        }
    }

    /// Address of the vector table of the slot's images.
    pub const fn vector_table(self) -> u32 {
        IMAGES_BEGIN + self.offset() + IMAGE_HEADER_BYTES
    }
}

/// Reason that bytes are no image for a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ImageError {
    /// They do not begin with `RLGI`.
    Magic,
    /// A layout that is not known.
    Version(u16),
    /// A kind of unit that is not this one.
    Hardware(u32),
    /// The image is linked for another place: the address of its vector table.
    Address(u32),
    /// No code of this length fits, or it is not made of whole pieces \[bytes\].
    Length(u32),
    /// Stack pointer or first instruction of the vector table are outside RAM or code: the word.
    Vectors(u32),
    /// The computed CRC-32 differs from the stored one.
    Checksum {
        /// As stored.
        stored: u32,
        /// As computed.
        computed: u32,
    },
    /// Flash cannot be read.
    Unreadable,
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Magic => f.write_str("firmware image does not begin with RLGI"),
            Self::Version(found) => write!(
                f,
                "firmware image of layout {found}, expected {LAYOUT_VERSION}"
            ),
            Self::Hardware(found) => write!(
                f,
                "firmware image for units of kind {found:#010x}, expected {HARDWARE:#010x}"
            ),
            Self::Address(found) => {
                write!(f, "firmware image is linked for address {found:#010x}")
            }
            Self::Length(found) => write!(
                f,
                "firmware image has {found} bytes of code, expected whole pieces of {PIECE_BYTES}, at most {LARGEST_CODE_BYTES}"
            ),
            Self::Vectors(found) => write!(
                f,
                "firmware image begins with {found:#010x}, which is no stack pointer or no first instruction"
            ),
            Self::Checksum { stored, computed } => write!(
                f,
                "firmware image CRC-32 is {stored:#010x}, computed {computed:#010x}"
            ),
            Self::Unreadable => f.write_str("firmware image cannot be read"),
        }
    }
}

impl core::error::Error for ImageError {}

/// Header of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ImageHeader {
    /// Slot that the image is linked for.
    pub slot: ImageSlot,
    /// Bytes of the code.
    pub length: u32,
    /// Version of the firmware, as health item 34.
    pub version: u32,
    /// Revision of the firmware, as health item 50.
    pub revision: u32,
    /// CRC-32 of the image.
    pub crc: u32,
}

impl ImageHeader {
    /// Reads a header, without the check sum.
    ///
    /// # Errors
    /// Everything of [`ImageError`] but the vectors, the check sum and reading.
    pub fn of_bytes(bytes: &[u8; HEADER_BYTES]) -> Result<Self, ImageError> {
        let word = |at: usize| {
            let four = bytes.get(at..).and_then(<[u8]>::first_chunk::<4>);
            four.map_or(0, |four| u32::from_le_bytes(*four))
        };
        if !bytes.starts_with(&MAGIC) {
            return Err(ImageError::Magic);
        }
        let version = u16::from_le_bytes([bytes[4], bytes[5]]);
        if version != LAYOUT_VERSION || bytes[7] != 0 {
            return Err(ImageError::Version(version));
        }
        if word(8) != HARDWARE {
            return Err(ImageError::Hardware(word(8)));
        }
        let slot = ImageSlot::of_number(bytes[6]);
        let Some(slot) = slot.filter(|slot| slot.vector_table() == word(12)) else {
            return Err(ImageError::Address(word(12)));
        };
        let length = word(16);
        if length == 0 || length > LARGEST_CODE_BYTES || !length.is_multiple_of(PIECE_BYTES as u32)
        {
            return Err(ImageError::Length(length));
        }
        Ok(Self {
            slot,
            length,
            version: word(20),
            revision: word(24),
            crc: word(CRC_AT),
        })
    }

    /// The bytes of the header.
    pub fn to_bytes(&self) -> [u8; HEADER_BYTES] {
        let [low, high] = LAYOUT_VERSION.to_le_bytes();
        let words = [
            HARDWARE,
            self.slot.vector_table(),
            self.length,
            self.version,
            self.revision,
            self.crc,
        ];
        let content = MAGIC
            .into_iter()
            .chain([low, high, self.slot as u8, 0])
            .chain(words.into_iter().flat_map(u32::to_le_bytes));
        let mut bytes = [0; HEADER_BYTES];
        for (place, byte) in bytes.iter_mut().zip(content) {
            *place = byte;
        }
        bytes
    }

    /// Reads and checks a whole image at the beginning of a file, as a sender does.
    ///
    /// # Returns
    /// Its header, its code and the bytes behind it, which may be the next image.
    ///
    /// # Errors
    /// The first reason that the file does not begin with an image; [`ImageError::Length`] also if it ends early.
    pub fn of_file(file: &[u8]) -> Result<(Self, &[u8], &[u8]), ImageError> {
        let short = ImageError::Length(file.len() as u32);
        let bytes = file.first_chunk::<HEADER_BYTES>().ok_or(short)?;
        let header = Self::of_bytes(bytes)?;
        let block = file.split_at_checked(IMAGE_HEADER_BYTES as usize);
        let (block, rest) = block.ok_or(short)?;
        let code = rest.split_at_checked(header.length as usize);
        let (code, rest) = code.ok_or(short)?;
        let computed = header.checksum([code].into_iter());
        let is_filled = block.iter().skip(HEADER_BYTES).all(|byte| *byte == 0xFF);
        if computed != header.crc || !is_filled {
            return Err(ImageError::Checksum {
                stored: header.crc,
                computed,
            });
        }
        let mut words = code
            .as_chunks()
            .0
            .iter()
            .map(|word| u32::from_le_bytes(*word));
        let (stack, reset) = (words.next().unwrap_or(0), words.next().unwrap_or(0));
        header.check_vectors(stack, reset)?;
        Ok((header, code, rest))
    }

    /// The header of `code`, which is whole pieces: with its length and its check sum.
    pub fn sealing(slot: ImageSlot, version: u32, revision: u32, code: &[u8]) -> Self {
        let mut header = Self {
            slot,
            length: code.len() as u32,
            version,
            revision,
            crc: 0,
        };
        header.crc = header.checksum([code].into_iter());
        header
    }

    /// The check sum of an image with this header and this code.
    fn checksum<'a>(&self, code: impl Iterator<Item = &'a [u8]>) -> u32 {
        let mut digest = CHECKSUM.digest();
        digest.update(self.to_bytes().get(..CRC_AT).unwrap_or(&[]));
        digest.update(&[0xFF; IMAGE_HEADER_BYTES as usize - HEADER_BYTES]);
        code.for_each(|piece| digest.update(piece));
        digest.finalize()
    }

    /// Address behind the code.
    fn end(&self) -> u32 {
        self.slot.vector_table().saturating_add(self.length)
    }

    /// Checks the first two vectors: a stack pointer within RAM, and a first instruction within the code, in Thumb state
    /// (PM0214 2.3.4).
    ///
    /// # Errors
    /// [`ImageError::Vectors`] with the word that is none.
    pub fn check_vectors(&self, stack: u32, reset: u32) -> Result<(), ImageError> {
        if !(RAM_BEGIN + 4..=NOTE_BEGIN).contains(&stack) || !stack.is_multiple_of(4) {
            return Err(ImageError::Vectors(stack));
        }
        if !(self.slot.vector_table()..self.end()).contains(&reset) || reset.is_multiple_of(2) {
            return Err(ImageError::Vectors(reset));
        }
        Ok(())
    }
}

/// Checks the image in a slot of flash: its header, every byte and its first vectors.
///
/// # Inputs
/// `flash`: both slots, the first at offset 0.
///
/// # Errors
/// The first reason that the slot holds no image for it.
pub fn check_image<F: ReadNorFlash>(
    flash: &mut F,
    slot: ImageSlot,
) -> Result<ImageHeader, ImageError> {
    let begin = slot.offset();
    let mut chunk = [0; CHUNK_BYTES];
    read(flash, begin, &mut chunk)?;
    let header = chunk.first_chunk::<HEADER_BYTES>();
    let header = ImageHeader::of_bytes(header.ok_or(ImageError::Unreadable)?)?;
    if header.slot != slot {
        return Err(ImageError::Address(header.slot.vector_table()));
    }
    check_content(flash, &header)?;
    Ok(header)
}

/// Checks filling, code and vectors of an image in its slot against a header, which flash may not hold yet.
///
/// # Errors
/// A byte is not the image's, or the vectors are none.
pub fn check_content<F: ReadNorFlash>(
    flash: &mut F,
    header: &ImageHeader,
) -> Result<(), ImageError> {
    let begin = header.slot.offset();
    let end = begin + IMAGE_HEADER_BYTES + header.length;
    let mut digest = CHECKSUM.digest();
    digest.update(header.to_bytes().get(..CRC_AT).unwrap_or(&[]));
    let mut vectors = [0; 2];
    let mut chunk = [0; CHUNK_BYTES];
    let mut at = begin;
    while at < end {
        let length = (end - at).min(CHUNK_BYTES as u32);
        let part = chunk
            .get_mut(..length as usize)
            .ok_or(ImageError::Unreadable)?;
        read(flash, at, part)?;
        if at == begin + IMAGE_HEADER_BYTES {
            for (vector, word) in vectors.iter_mut().zip(part.as_chunks().0) {
                *vector = u32::from_le_bytes(*word);
            }
        }
        let covered = if at == begin { HEADER_BYTES } else { 0 };
        digest.update(part.get(covered..).unwrap_or(&[]));
        at += length;
    }
    let computed = digest.finalize();
    if computed != header.crc {
        return Err(ImageError::Checksum {
            stored: header.crc,
            computed,
        });
    }
    header.check_vectors(vectors[0], vectors[1])
}

fn read<F: ReadNorFlash>(flash: &mut F, at: u32, bytes: &mut [u8]) -> Result<(), ImageError> {
    flash.read(at, bytes).map_err(|_| ImageError::Unreadable)
}
