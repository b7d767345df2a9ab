//! The flash of the boot selector's records and of both images ([`trueaxis::image_layout`]), for the selector and for the
//! images that it starts.

use core::ptr;

use trueaxis::image_layout::{
    IMAGE_SECTOR, IMAGE_SECTOR_BYTES, IMAGE_SLOT_BYTES, IMAGES_BEGIN, JOURNAL_BEGIN,
    JOURNAL_SECTOR, JOURNAL_SECTOR_BYTES, JOURNAL_SECTORS, NOTE_BEGIN,
};

use super::flash::{Region, RegionFlash};

/// Sectors of the records.
pub struct JournalSectors;

impl Region for JournalSectors {
    const FIRST_SECTOR: u8 = JOURNAL_SECTOR;
    const SECTOR_BYTES: u32 = JOURNAL_SECTOR_BYTES;
    const CAPACITY: u32 = JOURNAL_SECTORS * JOURNAL_SECTOR_BYTES;

    fn begin() -> *mut u8 {
        ptr::with_exposed_provenance_mut(JOURNAL_BEGIN as usize)
    }
}

/// Sectors of both images.
pub struct ImageSectors;

impl Region for ImageSectors {
    const FIRST_SECTOR: u8 = IMAGE_SECTOR;
    const SECTOR_BYTES: u32 = IMAGE_SECTOR_BYTES;
    const CAPACITY: u32 = 2 * IMAGE_SLOT_BYTES;

    #[cfg(feature = "selector")]
    fn at_reading() {
        super::feed_watchdog();
    }

    fn begin() -> *mut u8 {
        ptr::with_exposed_provenance_mut(IMAGES_BEGIN as usize)
    }
}

/// The flash of the records.
pub type JournalFlash = RegionFlash<JournalSectors>;

/// The flash of both images.
pub type ImageFlash = RegionFlash<ImageSectors>;

/// The words of the selector's note, at the end of RAM: no image has variables or its stack there (build.rs).
pub fn note() -> *mut [u32; 2] {
    ptr::with_exposed_provenance_mut(NOTE_BEGIN as usize)
}
