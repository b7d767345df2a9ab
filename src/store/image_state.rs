//! Reports which firmware image runs and why, as one word: health item 66, and the detail of the answer to an `image_state`
//! request.
//!
//! | bits | holds |
//! |---|---|
//! | 0..2 | slot of the running image: 0 none (an image without a selector), 1 A, 2 B |
//! | 2..4 | slot that takes the next image: 0 none, 1 A, 2 B |
//! | 4..8 | reason of the selector, [`BootReason`] |
//! | 8 | the running image is confirmed |
//!
//! The selector hands slot and reason to the image by a [`BootNote`] in RAM.

use crate::store::image::ImageSlot;

/// Reason of the selector for starting an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum BootReason {
    /// There is no selector, or it left no note.
    #[default]
    None = 0,
    /// The confirmed image; no other was uploaded since.
    Confirmed = 1,
    /// A new image, for the first time.
    Trial = 2,
    /// The confirmed image: the new one was started once and not confirmed.
    RolledBack = 3,
    /// The confirmed image: the new one is damaged or not for this unit.
    Refused = 4,
    /// The confirmed image: the supply or flash did not allow to record the new one's trial. The next start tries it.
    Postponed = 5,
    /// The confirmed image is damaged, and this is the other one.
    Fallback = 6,
    /// No image was confirmed yet.
    Unconfirmed = 7,
}

impl BootReason {
    /// The reason of this number, if it is one.
    pub const fn of_number(number: u8) -> Option<Self> {
        Some(match number {
            0 => Self::None,
            1 => Self::Confirmed,
            2 => Self::Trial,
            3 => Self::RolledBack,
            4 => Self::Refused,
            5 => Self::Postponed,
            6 => Self::Fallback,
            7 => Self::Unconfirmed,
            _ => return None,
        })
    }

    /// The reason in a few words.
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::None => "an image without a boot selector",
            Self::Confirmed => "the confirmed image",
            Self::Trial => "a new image, on trial",
            Self::RolledBack => "the confirmed image: the new one did not confirm itself",
            Self::Refused => "the confirmed image: the new one is damaged",
            Self::Postponed => "the confirmed image: the trial of the new one is postponed",
            Self::Fallback => "the other image: the confirmed one is damaged",
            Self::Unconfirmed => "an image that is not confirmed yet",
        }
    }
}

/// The running image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ImageState {
    /// Its slot; `None` for an image without a selector.
    pub running: Option<ImageSlot>,
    /// The slot that takes the next image, if one may be overwritten.
    pub free: Option<ImageSlot>,
    /// Reason of the selector.
    pub reason: BootReason,
    /// True if the running image is confirmed.
    pub is_confirmed: bool,
}

const fn number(slot: Option<ImageSlot>) -> u32 {
    match slot {
        Some(slot) => slot as u32,
        None => 0,
    }
}

impl ImageState {
    /// The word.
    pub const fn to_word(self) -> u32 {
        number(self.running)
            | number(self.free) << 2
            | (self.reason as u32) << 4
            | (self.is_confirmed as u32) << 8
    }

    /// The inverse of [`to_word`](Self::to_word); a reason that is not known is [`BootReason::None`].
    pub const fn of_word(word: u32) -> Self {
        let reason = match BootReason::of_number((word >> 4 & 0xF) as u8) {
            Some(reason) => reason,
            None => BootReason::None,
        };
        Self {
            running: ImageSlot::of_number((word & 0b11) as u8),
            free: ImageSlot::of_number((word >> 2 & 0b11) as u8),
            reason,
            is_confirmed: word >> 8 & 1 != 0,
        }
    }
}

/// Note of the selector to the image that it starts, two words at
/// [`NOTE_BEGIN`](crate::store::image_layout::NOTE_BEGIN).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BootNote {
    /// Slot of the image.
    pub slot: ImageSlot,
    /// Reason for it.
    pub reason: BootReason,
}

/// Distinguishes a note from the random content of RAM after power-on.
const NOTE_MARK: u32 = u32::from_le_bytes(*b"NOTE");

impl BootNote {
    /// The words.
    pub const fn to_words(self) -> [u32; 2] {
        let word = self.slot as u32 | (self.reason as u32) << 8;
        [word, word ^ NOTE_MARK]
    }

    /// The note, if these words are one.
    pub const fn of_words(words: [u32; 2]) -> Option<Self> {
        let [word, marked] = words;
        let slot = ImageSlot::of_number(word as u8);
        let reason = BootReason::of_number((word >> 8) as u8);
        match (slot, reason) {
            (Some(slot), Some(reason)) if word ^ marked == NOTE_MARK && word >> 16 == 0 => {
                Some(Self { slot, reason })
            }
            _ => None,
        }
    }
}
