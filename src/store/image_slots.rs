//! Chooses the firmware image to start, and judges the trial of a new one.
//!
//! The choice of the selector, in this order ([`ImageSlots::select`]):
//!
//! | found | image | reason |
//! |---|---|---|
//! | a new image, not tried, good, and its trial is recorded | the new one | `Trial` |
//! | the confirmed image is good | the confirmed one | `Confirmed`; or of a new one: `RolledBack` tried, `Refused` not good, `Postponed` trial not recorded |
//! | another good image; one that failed its trial last | that one | `Unconfirmed` if none was ever confirmed, else `Fallback` |
//! | none | none | – |
//!
//! *Good* is [`check_image`]: kind of unit, address, length, vectors and CRC-32 of every byte, at each start; and it must be
//! the image that the record names. The trial is recorded **before** the image is started, so any reset ends it: power,
//! watchdog, panic, or the image itself. A trial image confirms itself after [`CONFIRM_AFTER_S`] in health ([`judge`]).

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};

use crate::store::image::{ImageError, ImageHeader, ImageSlot, check_image};
use crate::store::image_journal::{Event, History, ImageId, Journal, JournalError};
use crate::store::image_state::{BootReason, ImageState};

/// Time in service after which an image is judged \[s\]: all slow channels and the pulse per second have come many times, and
/// a watchdog that starves has long acted.
pub const CONFIRM_AFTER_S: u32 = 30;

/// Next step of a running image that is not confirmed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// To wait.
    Wait,
    /// To record that it runs in health.
    Confirm,
    /// To reset: the image before it takes over.
    GiveUp,
}

/// Judges an image that is not confirmed, `seconds` after its start of sampling.
///
/// # Inputs
/// `healthy`: parameters are in force, or there are none; no fault was latched in service. `on_trial`: the selector has
/// another image to go back to.
pub const fn judge(seconds: u32, healthy: bool, on_trial: bool) -> Verdict {
    if seconds < CONFIRM_AFTER_S {
        Verdict::Wait
    } else if healthy {
        Verdict::Confirm
    } else if on_trial {
        Verdict::GiveUp
    } else {
        Verdict::Wait
    }
}

/// The image to start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Choice {
    /// Its header.
    pub header: ImageHeader,
    /// The reason.
    pub reason: BootReason,
}

/// The records and both slots.
#[derive(Debug)]
pub struct ImageSlots<S, I> {
    /// The records.
    pub journal: Journal<S>,
    /// Flash of both slots, the first at offset 0.
    pub images: I,
}

impl<S: NorFlash, I: ReadNorFlash> ImageSlots<S, I> {
    /// Records in `journal`, slots in `images`.
    pub fn new(journal: S, images: I) -> Self {
        Self {
            journal: Journal::new(journal),
            images,
        }
    }

    /// The history; empty where there is no page.
    ///
    /// # Errors
    /// Flash cannot be read.
    pub fn history(&mut self) -> Result<History, JournalError> {
        Ok(self
            .journal
            .page()?
            .map(|page| page.history)
            .unwrap_or_default())
    }

    /// The header of this very image, if its slot holds it.
    fn good(&mut self, image: ImageId) -> Option<ImageHeader> {
        let header = check_image(&mut self.images, image.slot).ok()?;
        (header.crc == image.crc).then_some(header)
    }

    /// Chooses the image to start, and records the trial of a new one; begins the records on flash that has none.
    ///
    /// # Inputs
    /// `supply_suffices` is called before flash is written: the supply is known to be high enough for programming.
    ///
    /// # Returns
    /// `None` if neither slot holds a good image.
    pub fn select(&mut self, supply_suffices: impl FnOnce() -> bool) -> Option<Choice> {
        let page = self.journal.page().unwrap_or(None);
        if page.is_none() {
            // Without records there is no trial; a first image begins them. The failure has no consequence here.
            if supply_suffices() {
                let _ = self.journal.begin();
            }
            return self.any_good(History::default());
        }
        let history = page.map(|page| page.history).unwrap_or_default();
        let mut reason = BootReason::Confirmed;
        if let Some(candidate) = history.candidate {
            reason = if history.tried {
                BootReason::RolledBack
            } else if let Some(header) = self.good(candidate) {
                let may_write = supply_suffices();
                if may_write && self.journal.append(Event::Tried, candidate).is_ok() {
                    let reason = BootReason::Trial;
                    return Some(Choice { header, reason });
                }
                BootReason::Postponed
            } else {
                BootReason::Refused
            };
        }
        let confirmed = history.confirmed.and_then(|image| self.good(image));
        if let Some(header) = confirmed {
            return Some(Choice { header, reason });
        }
        self.any_good(history)
    }

    /// A good image, independent of records; that of a failed trial last.
    fn any_good(&mut self, history: History) -> Option<Choice> {
        let reason = match history.confirmed {
            None => BootReason::Unconfirmed,
            Some(_) => BootReason::Fallback,
        };
        let failed = history.candidate.filter(|_| history.tried);
        let first = match failed {
            Some(image) => image.slot.other(),
            None => ImageSlot::A,
        };
        let found = [first, first.other()].map(|slot| check_image(&mut self.images, slot).ok());
        let header = found.into_iter().flatten().next()?;
        Some(Choice { header, reason })
    }

    /// State of an image that runs from `running`, started for `reason`.
    pub fn state(&mut self, running: ImageSlot, reason: BootReason) -> ImageState {
        let confirmed = self.history().map(|history| history.confirmed);
        // Only its own header is needed: the selector has checked the rest.
        let own = self.own_id(running);
        let is_confirmed = own.is_ok() && own.ok() == confirmed.ok().flatten();
        let other = running.other();
        let may_overwrite = is_confirmed
            || reason != BootReason::Trial && check_image(&mut self.images, other).is_err();
        ImageState {
            running: Some(running),
            free: may_overwrite.then_some(other),
            reason,
            is_confirmed,
        }
    }

    /// The image in a slot by its header alone.
    ///
    /// # Errors
    /// There is no header.
    pub fn own_id(&mut self, slot: ImageSlot) -> Result<ImageId, ImageError> {
        let mut bytes = [0; crate::store::image::HEADER_BYTES];
        let read = self.images.read(slot.offset(), &mut bytes);
        read.map_err(|_| ImageError::Unreadable)?;
        let header = ImageHeader::of_bytes(&bytes)?;
        let crc = header.crc;
        Ok(ImageId { slot, crc })
    }
}
