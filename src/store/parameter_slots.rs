//! Keeps the parameter block in two places of flash, of which one is always whole.
//!
//! The flash is NOR flash behind `embedded_storage::nor_flash`. Loading gives [`Loaded`]: the parameters to start with
//! and the faults of the slots. Storing writes and verifies a slot.
//!
//! | slots found | parameters | flags |
//! |---|---|---|
//! | both good | of the newer generation | none |
//! | one good, or the newer does not read the same twice | the good one's | `slot_bad` |
//! | none of this unit, one of another | [`Parameters::default`] | `parameters_default`, `foreign` has its number |
//! | none good (new device, both worn out) | [`Parameters::default`]: a perfect triad, nothing corrected | `parameters_default` |
//!
//! *Good* is a block that [`Parameters::from_block`] accepts: magic, version, length, CRC-32 and every field in its
//! range; and without records of terms that the build lacks ([`ParameterSlots::accepting`]); and not of another unit
//! ([`ParameterSlots::of_unit`]). A newer generation is one
//! that is ahead by less than 2³¹, so the number may wrap.
//!
//! [`ParameterSlots::store`] writes only to the slot that is **not** in use: erase, everything but the CRC, the CRC
//! last, read back. Power may fail at any of these steps: the slot in use is not touched, and the content of the other
//! fails its CRC. So the next boot finds the old block or the new one, never neither;
//! `host-tests/firmware/tests/parameter_slots.rs` cuts the power at every step. The CRC stands last because a driver
//! may write a range in any order; alone, it makes the rest valid in one last step.
//!
//! # Mending
//! [`ParameterSlots::mend`] rewrites a slot that is not good from the one that is, at boot before sampling:
//! erasing a sector stops the STM32F405 from running code in flash for up to two seconds. Two things bound it:
//!
//! - The supply must be known to suffice: a supply that sags below the level for programming damages the written data,
//!   and resets the board in the middle.
//! - At most [`MEND_ATTEMPTS`] attempts, over all boots: a worn-out slot would else cost each boot an erasure,
//!   and its seconds. They are counted in the good slot's sector without erasing it: behind the block there is
//!   a mark for each attempt, erased until it is made. The mark is written **before** the erasure, so that a
//!   reset in the middle counts.
//!
//! | offset in a slot | holds |
//! |---|---|
//! | 0 | the block, filled up with 0xFF to a whole [`LARGEST_UNIT_BYTES`] |
//! | [`MEND_MARKS_OFFSET`] | [`MEND_ATTEMPTS`] marks of [`LARGEST_UNIT_BYTES`] each: all 0xFF = free, anything else = an attempt made |
//!
//! Whatever erases that sector frees its marks: a [`ParameterSlots::store`] into it (every second one), or a
//! programming tool; a tool that writes only the block leaves them 0xFF, no attempt made. Each mark is
//! programmed once, as a whole unit of any supported flash, so flash with an error-correcting code serves too.
//!
//! Assumes erased flash reads 0xFF and programming only clears bits. It leaves out wear levelling: parameters
//! change when the instrument is calibrated, and a sector stands 10 000 erasures.

use core::fmt;
use core::marker::PhantomData;

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};

use crate::chain::Chain;
use crate::chain::identity::UnitNumber;
use crate::chain::numbers::{F32, NumberSystem};
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::terms::Term;
use crate::store::parameter_block::{LARGEST_BLOCK_BYTES, block_length, set_generation};

/// Largest unit of reading or writing that is served \[bytes\]: the 256 bits of an STM32H7's flash word;
/// an STM32F405 has 1 to 8 bytes.
pub const LARGEST_UNIT_BYTES: usize = 32;

/// Size of the largest block, filled up to whole units \[bytes\].
const BUFFER_BYTES: usize = LARGEST_BLOCK_BYTES.next_multiple_of(LARGEST_UNIT_BYTES);

/// Attempts to mend a slot until the good slot's sector is erased.
pub const MEND_ATTEMPTS: usize = 3;

/// Offset of a slot's marks of attempts \[bytes\].
pub const MEND_MARKS_OFFSET: u32 = BUFFER_BYTES as u32;

/// Size of all marks \[bytes\].
const MARKS_BYTES: usize = MEND_ATTEMPTS * LARGEST_UNIT_BYTES;

/// Bytes of the CRC at the block's end.
const CRC_BYTES: usize = 4;

/// Value of flash bytes not programmed since the last erasure.
const ERASED: u8 = 0xFF;

/// One of the two slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Slot {
    /// The slot at the first offset.
    First,
    /// The slot at the second offset.
    Second,
}

impl Slot {
    const BOTH: [Self; 2] = [Self::First, Self::Second];

    fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

/// Parameters at start, and their origin.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[must_use = "slots may be bad"]
pub struct Loaded {
    /// Of the newer good slot, or [`Parameters::default`].
    pub parameters: Parameters,
    /// Generation of the parameters; 0 for the default.
    pub generation: u32,
    /// The slot that the parameters came from; `None` for the default.
    pub slot: Option<Slot>,
    /// True if one slot is good and the other is not.
    pub slot_bad: bool,
    /// The unit whose parameters a slot holds, where no slot has some of this unit.
    pub foreign: Option<UnitNumber>,
}

impl Loaded {
    /// The default parameters, from no slot.
    pub fn none() -> Self {
        Self {
            parameters: Parameters::default(),
            generation: 0,
            slot: None,
            slot_bad: false,
            foreign: None,
        }
    }

    /// True if no slot is good, so that the default parameters are used.
    pub fn parameters_default(&self) -> bool {
        self.slot.is_none()
    }
}

/// Outcome of [`ParameterSlots::mend`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "the slot may still be bad"]
pub enum Mending {
    /// Nothing: both slots are good, or none is.
    NotNeeded,
    /// The bad slot holds the good one's block.
    Done,
    /// Nothing: the supply is not known to suffice.
    SupplyLow,
    /// Nothing: all attempts are made.
    Exhausted,
}

/// Reason that a slot could not be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SlotError<E> {
    /// These parameters would be refused at the next boot.
    Parameter(ParameterError),
    /// These parameters are of another unit.
    Foreign(UnitNumber),
    /// A slot does not begin at an erasable sector, overlaps the other or ends beyond the flash.
    Layout,
    /// The flash reported an error.
    Flash(E),
    /// The bytes read back differ from those written.
    Verify,
}

impl<E: fmt::Debug> fmt::Display for SlotError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parameter(error) => error.fmt(f),
            Self::Foreign(unit) => write!(f, "parameters of unit {unit}, not of this one"),
            Self::Layout => f.write_str("the parameter slots do not fit the flash's sectors"),
            Self::Flash(error) => write!(f, "flash error {error:?}"),
            Self::Verify => f.write_str("the parameter slot does not hold what was written"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for SlotError<E> {}

/// Two slots in one flash, or in two sectors of it.
#[derive(Debug)]
pub struct ParameterSlots<F, B = Chain<F32>> {
    flash: F,
    offsets: [u32; 2],
    /// The unit that reads; `None` if it does not know its number.
    unit: Option<UnitNumber>,
    build: PhantomData<B>,
}

/// A build of the chain, which can use some parameters and not others. A type and no function's address, so that the
/// image calls nothing through a register and its stack has a bound.
pub trait Build {
    /// Checks that the build can use these parameters.
    ///
    /// # Errors
    /// A parameter is out of its range, or asks for a term that the build lacks.
    fn check(parameters: &Parameters) -> Result<(), ParameterError>;
}

impl<N: NumberSystem, T: Term<N>> Build for Chain<N, T> {
    fn check(parameters: &Parameters) -> Result<(), ParameterError> {
        Self::check(parameters)
    }
}

impl<F: ReadNorFlash> ParameterSlots<F> {
    /// Slots that begin at `offsets` of `flash`, each the first byte of an erasable sector.
    pub fn new(flash: F, offsets: [u32; 2]) -> Self {
        Self {
            flash,
            offsets,
            unit: None,
            build: PhantomData,
        }
    }

    /// Restricts good slots to parameters that the build `D` can use. Without this call it is the chain without terms.
    #[must_use]
    pub fn accepting<D: Build>(self) -> ParameterSlots<F, D> {
        ParameterSlots {
            flash: self.flash,
            offsets: self.offsets,
            unit: self.unit,
            build: PhantomData,
        }
    }
}

impl<F: ReadNorFlash, B: Build> ParameterSlots<F, B> {
    const READ_UNIT_FITS: () = assert!(LARGEST_UNIT_BYTES.is_multiple_of(F::READ_SIZE));

    /// Gives the flash back.
    pub fn release(self) -> F {
        self.flash
    }

    /// Restricts good slots to parameters of this unit, and those that name none.
    #[must_use]
    pub fn of_unit(self, unit: UnitNumber) -> Self {
        Self {
            unit: Some(unit),
            ..self
        }
    }

    /// The unit that parameters name, if it is another than the one that reads.
    pub(super) fn foreign(&self, parameters: &Parameters) -> Option<UnitNumber> {
        let named = parameters.identity.map(|identity| identity.unit);
        named.filter(|named| self.unit.is_some_and(|unit| unit != *named))
    }

    /// The unit that the next parameters must name, if they name one: the one that reads, or that of the parameters in
    /// force. `scratch` takes those.
    pub(super) fn unit_in_force(
        &mut self,
        scratch: &mut Parameters,
    ) -> Result<Option<UnitNumber>, F::Error> {
        if self.unit.is_some() {
            return Ok(self.unit);
        }
        let Some((slot, _)) = self.survey_with(scratch)?.chosen() else {
            return Ok(None);
        };
        let found = self.read(slot, scratch)?;
        Ok(found.and_then(|_| scratch.identity.map(|identity| identity.unit)))
    }

    /// The newest good parameters. A slot that cannot be read counts as not good.
    pub fn load(&mut self) -> Loaded {
        let mut loaded = Loaded::none();
        self.load_into(&mut loaded);
        loaded
    }

    /// As [`load`](Self::load), in place: parameters are large, and copies of them would lie on the stack.
    pub fn load_into(&mut self, loaded: &mut Loaded) {
        let found = Slot::BOTH.map(|slot| self.read(slot, &mut loaded.parameters).unwrap_or(None));
        let survey = Survey(found);
        let chosen = survey.chosen();
        // The newer slot, and the other one where that does not read a second time as it did.
        let other = chosen.and_then(|(slot, _)| survey.good(slot.other()));
        for (slot, generation) in [chosen, other].into_iter().flatten() {
            let read = self.read(slot, &mut loaded.parameters).unwrap_or(None);
            if read == Some(generation) {
                (loaded.generation, loaded.slot) = (generation, Some(slot));
                loaded.slot_bad = survey.one_is_bad() || chosen != Some((slot, generation));
                loaded.foreign = None;
                return;
            }
        }
        loaded.foreign = None;
        for slot in Slot::BOTH {
            if let Ok(Some(_)) = self.parse(slot, &mut loaded.parameters) {
                loaded.foreign = loaded.foreign.or(self.foreign(&loaded.parameters));
            }
        }
        loaded.parameters = Parameters::default();
        (loaded.generation, loaded.slot) = (0, None);
        loaded.slot_bad = false;
    }

    /// Generations of the good slots. A slot that cannot be read is an error: before a slot is overwritten, the content
    /// of the other one must be known and not guessed.
    #[inline(never)]
    fn survey(&mut self) -> Result<Survey, F::Error> {
        self.survey_with(&mut Parameters::default())
    }

    /// As [`survey`](Self::survey), with room for the slots' parameters.
    fn survey_with(&mut self, scratch: &mut Parameters) -> Result<Survey, F::Error> {
        let first = self.read(Slot::First, scratch)?;
        Ok(Survey([first, self.read(Slot::Second, scratch)?]))
    }

    /// Reads a slot's parameters; gives their generation if they are good. If not, they are of no use.
    fn read(&mut self, slot: Slot, parameters: &mut Parameters) -> Result<Option<u32>, F::Error> {
        let found = self.parse(slot, parameters)?;
        let usable = || self.foreign(parameters).is_none() && B::check(parameters).is_ok();
        Ok(found.filter(|_| usable()))
    }

    /// Reads a slot's parameters, if it holds a block. The buffer is off the stack when this returns.
    #[inline(never)]
    fn parse(&mut self, slot: Slot, parameters: &mut Parameters) -> Result<Option<u32>, F::Error> {
        let mut buffer = [0; BUFFER_BYTES];
        self.read_bytes(slot, &mut buffer)?;
        Ok(parameters.read_block(&buffer).ok())
    }

    fn read_bytes(&mut self, slot: Slot, buffer: &mut [u8; BUFFER_BYTES]) -> Result<(), F::Error> {
        const { Self::READ_UNIT_FITS };
        self.flash.read(self.offset(slot), buffer)
    }

    fn offset(&self, slot: Slot) -> u32 {
        let [first, second] = self.offsets;
        match slot {
            Slot::First => first,
            Slot::Second => second,
        }
    }
}

impl<F: NorFlash, B: Build> ParameterSlots<F, B> {
    const WRITE_UNIT_FITS: () = assert!(LARGEST_UNIT_BYTES.is_multiple_of(F::WRITE_SIZE));

    /// Size of a slot in whole sectors \[bytes\].
    const SLOT_BYTES: u32 = (BUFFER_BYTES + MARKS_BYTES).next_multiple_of(F::ERASE_SIZE) as u32;

    /// Makes `parameters` those of the next boot; returns their generation. If it fails, the block in use stays so.
    ///
    /// # Errors
    /// The parameters are of another unit or cannot be used; or flash did not take them.
    pub fn store(&mut self, parameters: &Parameters) -> Result<u32, SlotError<F::Error>> {
        if let Some(unit) = self.foreign(parameters) {
            return Err(SlotError::Foreign(unit));
        }
        B::check(parameters).map_err(SlotError::Parameter)?;
        self.store_block(&parameters.to_block(0), &mut Parameters::default())
    }

    /// As [`store`](Self::store), of parameters that stand in a block already and that the build can use; the block's
    /// own generation does not count. `scratch` takes the slots' parameters: they are large, and the caller has some to
    /// spare.
    pub(super) fn store_block(
        &mut self,
        block: &[u8],
        scratch: &mut Parameters,
    ) -> Result<u32, SlotError<F::Error>> {
        self.check_layout()?;
        let survey = self.survey_with(scratch).map_err(SlotError::Flash)?;
        let (target, generation) = match survey.chosen() {
            Some((slot, generation)) => (slot.other(), generation.wrapping_add(1)),
            None => (Slot::First, 1),
        };
        self.write_as(target, block, generation)?;
        Ok(generation)
    }

    /// Writes a block to a slot under this generation. The buffer is off the stack when this returns.
    #[inline(never)]
    fn write_as(
        &mut self,
        slot: Slot,
        block: &[u8],
        generation: u32,
    ) -> Result<(), SlotError<F::Error>> {
        let mut buffer = [ERASED; BUFFER_BYTES];
        for (byte, of_block) in buffer.iter_mut().zip(block) {
            *byte = *of_block;
        }
        if let Some(block) = buffer.get_mut(..block.len()) {
            set_generation(block, generation);
        }
        self.write(slot, &buffer, block.len())
    }

    /// Copies the good slot's block to the one that is not good, if there is such a pair.
    ///
    /// # Inputs
    /// `supply_suffices`: the supply is known to be high enough for erasing and programming.
    ///
    /// # Errors
    /// The attempt failed and is counted; or it could not be counted, and nothing was erased. The good slot's
    /// block is untouched in any case.
    pub fn mend(&mut self, supply_suffices: bool) -> Result<Mending, SlotError<F::Error>> {
        self.check_layout()?;
        let survey = self.survey().map_err(SlotError::Flash)?;
        let (Some((good, _)), true) = (survey.chosen(), survey.one_is_bad()) else {
            return Ok(Mending::NotNeeded);
        };
        if !supply_suffices {
            return Ok(Mending::SupplyLow);
        }
        if !self.count_attempt(good)? {
            return Ok(Mending::Exhausted);
        }
        self.copy(good)?;
        Ok(Mending::Done)
    }

    /// Copies a good slot's block, byte for byte, to the other one.
    #[inline(never)]
    fn copy(&mut self, good: Slot) -> Result<(), SlotError<F::Error>> {
        let mut buffer = [ERASED; BUFFER_BYTES];
        self.read_bytes(good, &mut buffer)
            .map_err(SlotError::Flash)?;
        // The surveyed slot holds a block; anything else would be refused by its reader.
        let length = buffer.first_chunk().map_or(BUFFER_BYTES, block_length);
        for byte in buffer.iter_mut().skip(length) {
            *byte = ERASED;
        }
        self.write(good.other(), &buffer, length)
    }

    /// Writes the next mark behind `good`'s block; `false` if none was free.
    fn count_attempt(&mut self, good: Slot) -> Result<bool, SlotError<F::Error>> {
        let free = [ERASED; LARGEST_UNIT_BYTES];
        for attempt in 0..MEND_ATTEMPTS {
            let at = self.offset(good) + MEND_MARKS_OFFSET + (attempt * LARGEST_UNIT_BYTES) as u32;
            let mut mark = free;
            self.flash.read(at, &mut mark).map_err(SlotError::Flash)?;
            if mark != free {
                continue;
            }
            self.flash
                .write(at, &[0; LARGEST_UNIT_BYTES])
                .map_err(SlotError::Flash)?;
            self.flash.read(at, &mut mark).map_err(SlotError::Flash)?;
            // An attempt that is not counted would come again at every boot.
            return if mark == free {
                Err(SlotError::Verify)
            } else {
                Ok(true)
            };
        }
        Ok(false)
    }

    /// Writes the first `length` bytes of the buffer, followed by erased bytes.
    fn write(
        &mut self,
        slot: Slot,
        buffer: &[u8; BUFFER_BYTES],
        length: usize,
    ) -> Result<(), SlotError<F::Error>> {
        const { Self::WRITE_UNIT_FITS };
        let begin = self.offset(slot);
        // The last step begins with the unit, or the few units, that hold the CRC.
        let crc_at = length.saturating_sub(CRC_BYTES) / F::WRITE_SIZE * F::WRITE_SIZE;
        let written = length.next_multiple_of(F::WRITE_SIZE);
        let parts = buffer.split_at_checked(crc_at);
        let parts = parts.and_then(|(body, rest)| Some((body, rest.get(..written - crc_at)?)));
        let Some((body, last)) = parts else {
            // No block is longer than the buffer.
            return Err(SlotError::Verify);
        };

        self.flash
            .erase(begin, begin + Self::SLOT_BYTES)
            .map_err(SlotError::Flash)?;
        self.flash.write(begin, body).map_err(SlotError::Flash)?;
        self.flash
            .write(begin + crc_at as u32, last)
            .map_err(SlotError::Flash)?;

        for (at, expected) in buffer
            .as_chunks::<LARGEST_UNIT_BYTES>()
            .0
            .iter()
            .enumerate()
        {
            let mut found = [0; LARGEST_UNIT_BYTES];
            let offset = begin + (at * LARGEST_UNIT_BYTES) as u32;
            self.flash
                .read(offset, &mut found)
                .map_err(SlotError::Flash)?;
            if found != *expected {
                return Err(SlotError::Verify);
            }
        }
        Ok(())
    }

    fn check_layout(&self) -> Result<(), SlotError<F::Error>> {
        let [first, second] = self.offsets;
        let capacity = u32::try_from(self.flash.capacity()).unwrap_or(u32::MAX);
        let fits = |offset: u32| {
            offset.is_multiple_of(F::ERASE_SIZE as u32)
                && offset
                    .checked_add(Self::SLOT_BYTES)
                    .is_some_and(|end| end <= capacity)
        };
        if fits(first) && fits(second) && first.abs_diff(second) >= Self::SLOT_BYTES {
            Ok(())
        } else {
            Err(SlotError::Layout)
        }
    }
}

/// Generations of the good slots, first and second.
#[derive(Debug, Clone, Copy)]
struct Survey([Option<u32>; 2]);

impl Survey {
    /// The slot that counts, with its generation.
    fn chosen(&self) -> Option<(Slot, u32)> {
        match self.0 {
            [Some(first), Some(second)] if is_newer(second, first) => Some((Slot::Second, second)),
            [Some(first), _] => Some((Slot::First, first)),
            [None, Some(second)] => Some((Slot::Second, second)),
            [None, None] => None,
        }
    }

    /// The slot with its generation, if it is good.
    fn good(&self, slot: Slot) -> Option<(Slot, u32)> {
        let [first, second] = self.0;
        let generation = match slot {
            Slot::First => first,
            Slot::Second => second,
        };
        generation.map(|generation| (slot, generation))
    }

    /// True if one slot is good and the other is not.
    fn one_is_bad(&self) -> bool {
        self.0[0].is_some() != self.0[1].is_some()
    }
}

/// True if generation `a` is ahead of `b`, by less than half the range.
fn is_newer(a: u32, b: u32) -> bool {
    (a.wrapping_sub(b) as i32) > 0
}
