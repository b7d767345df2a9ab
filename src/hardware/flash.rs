//! Gives access to sectors of flash through the traits of `embedded-storage`: to the parameter slots and, in images with a boot
//! selector, to its records and to both images.
//!
//! Offsets count over the sectors of a [`Region`], which are of one size (RM0090 section 3.3): parameter slot A begins at 0,
//! slot B at [`SECTOR_BYTES`]. Every wait is bounded; a controller that does not answer gives a [`FlashFault`].
//!
//! Writing and erasing hold the processor (the flash is one bank: instructions cannot be fetched meanwhile), up to 4 s
//! for a sector: at boot only, before sampling and the watchdog start; but for single words (`board/confirmation.rs`). Assumes a supply of 2.7 V to 3.6 V, for words of
//! 32 bits at a time; the board checks `supply` before it mends a slot. The emulator's flash is read-only: there a
//! write changes nothing, and reading back shows it.

use core::marker::PhantomData;
use core::ptr;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use stm32f4::stm32f405::FLASH;

/// Size of a parameter slot's sector \[bytes\].
pub const SECTOR_BYTES: u32 = 128 * 1024;

/// Sectors of one size in a row.
pub trait Region {
    /// Number of the sector at offset 0.
    const FIRST_SECTOR: u8;
    /// Size of a sector \[bytes\].
    const SECTOR_BYTES: u32;
    /// Size of all of them \[bytes\].
    const CAPACITY: u32;
    /// Work at each reading: none, but for a selector that feeds a watchdog.
    #[inline]
    fn at_reading() {}
    /// Address of offset 0.
    fn begin() -> *mut u8;
}

/// Sectors 10 and 11, set apart in memory.x.
pub struct ParameterSectors;

impl Region for ParameterSectors {
    const FIRST_SECTOR: u8 = 10;
    const SECTOR_BYTES: u32 = SECTOR_BYTES;
    const CAPACITY: u32 = 2 * SECTOR_BYTES;

    fn begin() -> *mut u8 {
        (&raw const _parameter_slots).cast_mut()
    }
}

/// RM0090 3.6.1: these two, in this order, unlock the control register until the next reset or lock.
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

/// Polls while an erase is under way. A poll takes at least 4 cycles at 168 MHz, so this waits at least
/// 4.7 s; a sector takes at most 4 s (t_ERASE128KB at 8 bits, data sheet 5.3.12; 2 s at 32 bits).
const ERASE_POLLS: u32 = 200_000_000;

/// Polls while a word is written: 2.3 ms; it takes at most 100 µs.
const WRITE_POLLS: u32 = 100_000;

unsafe extern "C" {
    /// First address of the slots, from memory.x.
    static _parameter_slots: u8;
}

/// Reason that a flash operation failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FlashFault {
    /// The range is beyond the region.
    OutOfBounds,
    /// The range is not one of whole words, or of whole sectors.
    NotAligned,
    /// The controller did not finish within its bound.
    Timeout,
    /// The controller reported an error of programming or protection.
    Refused,
}

impl NorFlashError for FlashFault {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            Self::NotAligned => NorFlashErrorKind::NotAligned,
            Self::Timeout | Self::Refused => NorFlashErrorKind::Other,
        }
    }
}

/// The flash of the parameter slots.
pub type SlotFlash = RegionFlash<ParameterSectors>;

/// Sectors of flash, with the controller that writes them.
pub struct RegionFlash<R> {
    controller: FLASH,
    region: PhantomData<R>,
}

impl<R: Region> RegionFlash<R> {
    /// Takes the controller, which is locked after reset.
    pub fn new(controller: FLASH) -> Self {
        Self {
            controller,
            region: PhantomData,
        }
    }

    /// The address of `offset`.
    fn address(offset: u32) -> *mut u8 {
        R::begin().wrapping_add(offset as usize)
    }

    /// Runs `work` with the controller unlocked.
    fn unlocked(
        &mut self,
        work: impl FnOnce(&FLASH) -> Result<(), FlashFault>,
    ) -> Result<(), FlashFault> {
        for key in KEYS {
            self.controller.keyr().write(|w| w.key().set(key));
        }
        // Writing a flag clears it: errors of an earlier attempt must not be taken for this one's.
        // SAFETY: every bit of the register is a flag that is cleared by writing 1.
        self.controller
            .sr()
            .write(|w| unsafe { w.bits(ERROR_FLAGS) });
        let outcome = work(&self.controller);
        self.controller.cr().write(|w| w.lock().locked());
        // The data cache still holds the old sectors; it may be emptied only while it is off (RM0090 3.5.2).
        let cache = self.controller.acr();
        cache.modify(|_, w| w.dcen().disabled());
        cache.modify(|_, w| w.dcrst().reset());
        cache.modify(|_, w| w.dcrst().no_reset());
        cache.modify(|_, w| w.dcen().enabled());
        outcome
    }
}

/// OPERR, WRPERR, PGAERR, PGPERR, PGSERR (RM0090 3.9.4).
const ERROR_FLAGS: u32 = 0b1111_0010;

/// Waits for the controller, at most `polls`.
fn finished(controller: &FLASH, polls: u32) -> Result<(), FlashFault> {
    let idle = (0..polls).any(|_| !controller.sr().read().bsy().bit());
    if !idle {
        Err(FlashFault::Timeout)
    } else if controller.sr().read().bits() & ERROR_FLAGS != 0 {
        Err(FlashFault::Refused)
    } else {
        Ok(())
    }
}

/// Checks that `length` bytes from `offset` lie within the region.
fn check_bounds<R: Region>(offset: u32, length: usize) -> Result<(), FlashFault> {
    let end = (offset as usize).saturating_add(length);
    (end <= R::CAPACITY as usize)
        .then_some(())
        .ok_or(FlashFault::OutOfBounds)
}

impl<R: Region> ErrorType for RegionFlash<R> {
    type Error = FlashFault;
}

impl<R: Region> ReadNorFlash for RegionFlash<R> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashFault> {
        check_bounds::<R>(offset, bytes.len())?;
        R::at_reading();
        let (words, rest) = if offset.is_multiple_of(4) {
            bytes.as_chunks_mut::<4>()
        } else {
            (&mut [][..], bytes)
        };
        let at_rest = offset + 4 * words.len() as u32;
        for (at, bytes) in (offset..).step_by(4).zip(words) {
            // SAFETY: aligned and within the region, which is readable memory; volatile, because it changes behind the
            // compiler's back.
            *bytes = unsafe { ptr::read_volatile(Self::address(at).cast::<u32>()) }.to_le_bytes();
        }
        for (at, byte) in (at_rest..).zip(rest) {
            // SAFETY: as above, a byte.
            *byte = unsafe { ptr::read_volatile(Self::address(at)) };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        R::CAPACITY as usize
    }
}

impl<R: Region> NorFlash for RegionFlash<R> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = R::SECTOR_BYTES as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashFault> {
        check_bounds::<R>(to, 0)?;
        if from > to {
            return Err(FlashFault::OutOfBounds);
        }
        if !from.is_multiple_of(R::SECTOR_BYTES) || !to.is_multiple_of(R::SECTOR_BYTES) {
            return Err(FlashFault::NotAligned);
        }
        self.unlocked(|controller| {
            for sector in from / R::SECTOR_BYTES..to / R::SECTOR_BYTES {
                // The lock bit is set after reset, so a write that does not name it would lock.
                controller.cr().write(|w| {
                    w.lock().unlocked();
                    // SAFETY: the number of a sector of the region.
                    unsafe { w.snb().bits(R::FIRST_SECTOR + sector as u8) };
                    w.ser().sector_erase().psize().psize32()
                });
                controller
                    .cr()
                    .modify(|_, w| w.lock().unlocked().strt().start());
                finished(controller, ERASE_POLLS)?;
            }
            Ok(())
        })
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashFault> {
        check_bounds::<R>(offset, bytes.len())?;
        let (words, rest) = bytes.as_chunks::<4>();
        if !offset.is_multiple_of(4) || !rest.is_empty() {
            return Err(FlashFault::NotAligned);
        }
        self.unlocked(|controller| {
            controller.cr().write(|w| {
                w.lock().unlocked();
                w.pg().program().psize().psize32()
            });
            for (at, word) in (offset..).step_by(4).zip(words) {
                // SAFETY: aligned and within the region; the controller is in programming mode, where a
                // store of a word is how flash is written.
                unsafe {
                    ptr::write_volatile(Self::address(at).cast::<u32>(), u32::from_le_bytes(*word));
                }
                // The write must have left the processor before its end is waited for.
                cortex_m::asm::dsb();
                finished(controller, WRITE_POLLS)?;
            }
            Ok(())
        })
    }
}
