//! Stands in for the flash of the parameter slots while the emulated unit is stopped: the emulator's own flash is read-only.
//!
//! It keeps NOR's rules in memory (erasing sets whole sectors, programming clears bits), begins with the content of
//! flash and is written to `slots.bin` at the end of the run. A slot is its first [`SLOT_BYTES`] only, which is more
//! than the firmware writes.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

use crate::hardware::flash::{SECTOR_BYTES, SlotFlash};

/// Bytes of a slot in memory.
pub const SLOT_BYTES: usize = 2048;

/// Both slots.
pub type SlotBytes = [u8; 2 * SLOT_BYTES];

/// Flash in memory.
pub struct SlotMemory {
    bytes: &'static mut SlotBytes,
}

impl SlotMemory {
    /// Begins with the content of the emulator's flash.
    pub fn new(bytes: &'static mut SlotBytes, flash: &mut SlotFlash) -> Self {
        for (place, sector) in bytes.chunks_mut(SLOT_BYTES).zip([0, SECTOR_BYTES]) {
            // Both are within the two sectors, all that reading can refuse.
            let _ = flash.read(sector, place);
        }
        Self { bytes }
    }

    /// Content of the slots.
    pub fn bytes(&self) -> &SlotBytes {
        self.bytes
    }

    fn range(&mut self, from: u32, to: usize) -> Result<&mut [u8], NorFlashErrorKind> {
        let range = self.bytes.get_mut(from as usize..to);
        range.ok_or(NorFlashErrorKind::OutOfBounds)
    }
}

impl ErrorType for SlotMemory {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for SlotMemory {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let found = self.range(offset, (offset as usize).saturating_add(bytes.len()))?;
        for (place, byte) in bytes.iter_mut().zip(found) {
            *place = *byte;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SLOT_BYTES
    }
}

impl NorFlash for SlotMemory {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SLOT_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.range(from, to as usize)?.fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let place = self.range(offset, (offset as usize).saturating_add(bytes.len()))?;
        for (place, byte) in place.iter_mut().zip(bytes) {
            *place &= *byte;
        }
        Ok(())
    }
}
