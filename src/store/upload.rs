//! Gathers a parameter block piece by piece, checks it whole and stores it.
//!
//! Nothing of flash is touched before the block is whole and good: CRC, version, every parameter in its range, and no
//! term that the build lacks; and none of another unit, which is the one that the parameters in force name, if the slots do not know their own
//! ([`ParameterSlots::of_unit`]). Then it is written to the slot that is not in use, as [`ParameterSlots::store`] does,
//! under the generation after the one in force, independent of the block's own generation. A power cut at any byte,
//! received or written, leaves the old block in force, or the new one.

use core::fmt;

use embedded_storage::nor_flash::NorFlash;

use crate::chain::identity::UnitNumber;
use crate::chain::parameters::Parameters;
use crate::store::parameter_block::{BlockError, LARGEST_BLOCK_BYTES, PARAMETER_BLOCK_BYTES};
use crate::store::parameter_slots::{Build, ParameterSlots, SlotError};

/// Reason that a block is not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum UploadError<E> {
    /// No upload has begun.
    NotBegun,
    /// A block of this build has no such length \[bytes\].
    Length(u16),
    /// These bytes do not follow those received \[bytes so far\].
    Order(u16),
    /// The block is not whole yet \[bytes so far\].
    Unfinished(u16),
    /// The bytes are no block, or a parameter is out of range.
    Block(BlockError),
    /// The block names another unit than this one, which has this number.
    OtherUnit(UnitNumber),
    /// The supply is not known to suffice for erasing and programming.
    SupplyLow,
    /// The block was not stored.
    Slot(SlotError<E>),
}

impl<E: fmt::Debug> fmt::Display for UploadError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotBegun => f.write_str("no upload of a parameter block has begun"),
            Self::Length(found) => write!(
                f,
                "parameter block of {found} bytes, this build takes {PARAMETER_BLOCK_BYTES} to {LARGEST_BLOCK_BYTES}"
            ),
            Self::Order(received) => {
                write!(f, "bytes out of order: {received} have been received")
            }
            Self::Unfinished(received) => {
                write!(f, "parameter block not whole: {received} bytes received")
            }
            Self::Block(error) => error.fmt(f),
            Self::OtherUnit(own) => write!(f, "parameter block of another unit than {own}"),
            Self::SupplyLow => f.write_str("the supply is too low to write flash"),
            Self::Slot(error) => error.fmt(f),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for UploadError<E> {}

/// A block on its way.
#[derive(Debug, Clone)]
pub struct Upload {
    bytes: [u8; LARGEST_BLOCK_BYTES],
    /// Bytes of the whole block; 0 before an upload begins.
    length: usize,
    received: usize,
}

impl Default for Upload {
    fn default() -> Self {
        Self {
            bytes: [0; LARGEST_BLOCK_BYTES],
            length: 0,
            received: 0,
        }
    }
}

impl Upload {
    /// Begins to gather a block of `length` bytes, and drops the one gathered before.
    ///
    /// # Errors
    /// [`UploadError::Length`] where no block of this build is so long.
    pub fn begin<E>(&mut self, length: u16) -> Result<(), UploadError<E>> {
        (self.length, self.received) = (0, 0);
        if !(PARAMETER_BLOCK_BYTES..=LARGEST_BLOCK_BYTES).contains(&usize::from(length)) {
            return Err(UploadError::Length(length));
        }
        self.length = usize::from(length);
        Ok(())
    }

    /// Takes bytes that belong at `offset`. Those that came before, sent again because the answer was lost, change nothing
    /// where they are the same.
    ///
    /// # Errors
    /// [`UploadError::Order`] where they do not follow those received, differ from them or go beyond the block's end.
    pub fn put<E>(&mut self, offset: u16, bytes: &[u8]) -> Result<(), UploadError<E>> {
        if self.length == 0 {
            return Err(UploadError::NotBegun);
        }
        let begin = usize::from(offset);
        let end = begin.saturating_add(bytes.len());
        let follows = begin == self.received && end <= self.length;
        let again = end <= self.received && self.bytes.get(begin..end) == Some(bytes);
        let Some(place) = self.bytes.get_mut(begin..end).filter(|_| follows || again) else {
            return Err(UploadError::Order(self.received as u16));
        };
        for (place, byte) in place.iter_mut().zip(bytes) {
            *place = *byte;
        }
        self.received = self.received.max(end);
        Ok(())
    }

    /// Checks the block and stores it; gives the generation under which it is in force from the next boot on.
    ///
    /// # Inputs
    /// `supply_suffices`: the supply is known to be high enough for erasing and programming.
    ///
    /// # Errors
    /// The block is not whole or not good, and nothing of flash was touched; or flash did not take it, and the block in
    /// force stays so.
    #[inline(never)]
    pub fn store<F: NorFlash, B: Build>(
        &self,
        slots: &mut ParameterSlots<F, B>,
        supply_suffices: bool,
    ) -> Result<u32, UploadError<F::Error>> {
        if self.length == 0 {
            return Err(UploadError::NotBegun);
        }
        let Some(block) = self.bytes.get(..self.length) else {
            return Err(UploadError::NotBegun);
        };
        if self.received < self.length {
            return Err(UploadError::Unfinished(self.received as u16));
        }
        let mut parameters = Parameters::default();
        parameters.read_block(block).map_err(UploadError::Block)?;
        B::check(&parameters).map_err(|error| UploadError::Block(BlockError::Parameter(error)))?;
        if let Some(named) = parameters.identity.map(|identity| identity.unit) {
            let own = slots.unit_in_force(&mut parameters);
            let own = own.map_err(|error| UploadError::Slot(SlotError::Flash(error)))?;
            if let Some(own) = own.filter(|own| *own != named) {
                return Err(UploadError::OtherUnit(own));
            }
        }
        if !supply_suffices {
            return Err(UploadError::SupplyLow);
        }
        slots
            .store_block(block, &mut parameters)
            .map_err(UploadError::Slot)
    }
}
