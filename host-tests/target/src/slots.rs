//! Holds the parameter slots of the image as flash content.
//!
//! From parameter blocks it makes the bytes of each slot, for the emulator to load, and a readable flash of the same
//! bytes, so that the host chooses between the slots by the firmware's own code.

use embedded_storage::nor_flash::{ErrorType, NorFlashErrorKind, ReadNorFlash};
use trueaxis::parameter_slots::{
    LARGEST_UNIT_BYTES, Loaded, MEND_ATTEMPTS, MEND_MARKS_OFFSET, ParameterSlots,
};
use trueaxis::terms::{AllTerms, TermKinds};
use trueaxis::{Chain, F32, Parameters};

/// Beginnings of the slots in the image's address space: SLOTS in memory.x.
pub const SLOT_ADDRESSES: [u32; 2] = [0x080C_0000, 0x080E_0000];

/// Bytes of a slot that the firmware reads: the block and the marks of attempts to mend behind it.
const SLOT_BYTES: usize = MEND_MARKS_OFFSET as usize + MEND_ATTEMPTS * LARGEST_UNIT_BYTES;

/// Bytes of a slot that a stopped image keeps.
const STORED_BYTES: usize = 2048;

/// Flash that was erased and not written.
const ERASED: u8 = 0xFF;

/// The content of both slots.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlotImages(pub [Vec<u8>; 2]);

impl SlotImages {
    /// Puts the same block into both slots: a unit without faults.
    pub fn both(parameters: &Parameters) -> Self {
        // The emulator fills bytes not loaded with 0, which on the board reads as attempts already made.
        let mut slot = parameters.to_block(1).to_vec();
        slot.resize(SLOT_BYTES, ERASED);
        Self([slot.clone(), slot])
    }

    /// Erases both slots: a new unit.
    pub fn erased() -> Self {
        Self([vec![ERASED; SLOT_BYTES], vec![ERASED; SLOT_BYTES]])
    }

    /// Takes the slots as a stopped image left them (`src/hardware/emulator/slot_memory.rs`); `None` if it left none.
    pub(crate) fn stored(bytes: &[u8]) -> Option<Self> {
        let (first, second) = bytes.split_at_checked(STORED_BYTES)?;
        let slot = |bytes: &[u8]| bytes.get(..SLOT_BYTES).map(<[u8]>::to_vec);
        Some(Self([slot(first)?, slot(second)?]))
    }

    /// Loads the parameters as firmware with these terms does.
    pub fn load(&self, terms: TermKinds) -> Loaded {
        let mut slots = ParameterSlots::new(self, [0, SLOT_BYTES as u32]);
        if terms == TermKinds::NONE {
            slots.load()
        } else {
            slots.accepting::<Chain<F32, AllTerms<F32>>>().load()
        }
    }
}

impl ErrorType for &SlotImages {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for &SlotImages {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let (slot, from) = (offset as usize / SLOT_BYTES, offset as usize % SLOT_BYTES);
        let content = self.0.get(slot).ok_or(NorFlashErrorKind::OutOfBounds)?;
        for (at, byte) in (from..).zip(bytes) {
            *byte = content.get(at).copied().unwrap_or(ERASED);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SLOT_BYTES
    }
}
