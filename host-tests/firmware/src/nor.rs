//! NOR flash that loses power at any step.
//!
//! It keeps NOR's rules: erasing sets bits of whole sectors, programming clears bits of whole units. Each byte that is
//! programmed or erased is a step; when power fails at a step, that byte is left with any part of its bits changed, and
//! nothing works until the next boot.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Two sectors.
pub const SLOTS: usize = 2;

/// Smaller than a real sector (128 KiB), so that every byte of an erasure can be a place to lose power;
/// larger than a block.
pub const SECTOR: usize = 2048;

/// The byte of a worn-out sector that stays 0: of the block's magic word.
pub const WORN_BYTE: usize = 0;

/// Content of the bytes that an interrupted erasure had not finished.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Leftover {
    /// As they were: erased byte after byte.
    Old,
    /// Some bits set already: a whole sector is erased at once, bits at their own pace.
    SomeBitsSet,
    /// Bits without any rule: between two voltages, a bit may read as either.
    Anything,
}

/// All of them.
pub const LEFTOVERS: [Leftover; 3] = [Leftover::Old, Leftover::SomeBitsSet, Leftover::Anything];

/// NOR flash with units of `UNIT` bytes.
#[derive(Clone)]
pub struct Nor<const UNIT: usize> {
    /// Both sectors.
    pub content: Vec<u8>,
    /// Steps until power fails; `None`: it does not.
    pub steps_left: Option<usize>,
    /// Result of an erasure that is cut off.
    pub leftover: Leftover,
    /// State of the random bits.
    pub seed: u64,
    /// Steps so far.
    pub steps: usize,
    /// Erasures begun of each sector, over all boots.
    pub erasures: [usize; SLOTS],
    /// A sector of which a byte stays 0 despite erasures.
    pub worn: Option<usize>,
}

/// The flash has no power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PowerLost;

impl NorFlashError for PowerLost {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<const UNIT: usize> Nor<UNIT> {
    /// Erased throughout.
    pub fn erased() -> Self {
        Self::holding(vec![0xFF; SLOTS * SECTOR])
    }

    /// With this content.
    pub fn holding(content: Vec<u8>) -> Self {
        Self {
            content,
            steps_left: None,
            leftover: Leftover::Old,
            seed: 1,
            steps: 0,
            erasures: [0; SLOTS],
            worn: None,
        }
    }

    /// The same content after the next boot.
    pub fn rebooted(&self) -> Self {
        Self {
            erasures: self.erasures,
            worn: self.worn,
            ..Self::holding(self.content.clone())
        }
    }

    /// The same content, with power for so many steps.
    pub fn failing_after(&self, steps: usize, leftover: Leftover, seed: u64) -> Self {
        Self {
            steps_left: Some(steps),
            leftover,
            seed,
            ..self.rebooted()
        }
    }

    /// Pseudo-random bits (SplitMix64).
    fn random(&mut self) -> u8 {
        self.seed = self.seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.seed;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (mixed ^ (mixed >> 31)) as u8
    }

    /// True if power lasts for one more step.
    fn step(&mut self) -> bool {
        self.steps += 1;
        match &mut self.steps_left {
            None => true,
            Some(0) => false,
            Some(left) => {
                *left -= 1;
                true
            }
        }
    }

    fn powered(&self) -> Result<(), PowerLost> {
        if self.steps_left == Some(0) && self.steps > 0 {
            return Err(PowerLost);
        }
        Ok(())
    }
}

impl<const UNIT: usize> ErrorType for Nor<UNIT> {
    type Error = PowerLost;
}

impl<const UNIT: usize> ReadNorFlash for Nor<UNIT> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerLost> {
        self.powered()?;
        let begin = offset as usize;
        bytes.copy_from_slice(&self.content[begin..begin + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.content.len()
    }
}

impl<const UNIT: usize> NorFlash for Nor<UNIT> {
    const WRITE_SIZE: usize = UNIT;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerLost> {
        let (from, to) = (from as usize, to as usize);
        assert!(from.is_multiple_of(SECTOR) && to.is_multiple_of(SECTOR));
        self.powered()?;
        for sector in from / SECTOR..to / SECTOR {
            self.erasures[sector] += 1;
        }
        for at in from..to {
            if self.step() {
                let worn = self.worn == Some(at / SECTOR) && at % SECTOR == WORN_BYTE;
                self.content[at] = if worn { 0 } else { 0xFF };
                continue;
            }
            for unfinished in at..to {
                let random = self.random();
                match self.leftover {
                    Leftover::Old => {}
                    Leftover::SomeBitsSet => self.content[unfinished] |= random,
                    Leftover::Anything => self.content[unfinished] = random,
                }
            }
            return Err(PowerLost);
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerLost> {
        let begin = offset as usize;
        assert!(begin.is_multiple_of(UNIT) && bytes.len().is_multiple_of(UNIT));
        self.powered()?;
        for (at, byte) in (begin..).zip(bytes) {
            let worn = self.worn == Some(at / SECTOR) && at % SECTOR == WORN_BYTE;
            assert!(
                self.content[at] == 0xFF || worn,
                "programmed twice at {at:#x}"
            );
            if !self.step() {
                // Any part of the bits to clear is cleared.
                self.content[at] &= byte | self.random();
                return Err(PowerLost);
            }
            self.content[at] &= byte;
        }
        Ok(())
    }
}
