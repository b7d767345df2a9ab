//! Faults that are found at boot: what the parameter slots hold, whether the oscillator answers.
//!
//! From a good parameter block it makes the content of both slots, damaged at random places or erased, and what every
//! frame must then say.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use trueaxis::Status;

/// What a boot may find.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BootFault {
    /// Nothing wrong.
    None,
    /// One slot, either, is damaged or empty.
    OneSlot,
    /// Both are.
    BothSlots,
    /// The external oscillator does not answer.
    NoOscillator,
}

impl BootFault {
    /// Every one.
    pub const ALL: [Self; 4] = [
        Self::OneSlot,
        Self::BothSlots,
        Self::NoOscillator,
        Self::None,
    ];

    /// The bits of which every frame must show this one's and no other.
    pub const ANY: Status = Status::PARAMETER_SLOT_BAD
        .union(Status::PARAMETERS_DEFAULT)
        .union(Status::CLOCK_FALLBACK);

    /// What people call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::OneSlot => "one slot bad",
            Self::BothSlots => "both slots bad",
            Self::NoOscillator => "no oscillator",
        }
    }

    /// The bit that every frame must show.
    pub fn status(self) -> Status {
        match self {
            Self::None => Status::default(),
            Self::OneSlot => Status::PARAMETER_SLOT_BAD,
            Self::BothSlots => Status::PARAMETERS_DEFAULT,
            Self::NoOscillator => Status::CLOCK_FALLBACK,
        }
    }

    /// What the slots hold, where the unit was given `block`.
    pub fn slots(self, block: &[u8], random: &mut ChaCha8Rng) -> [Vec<u8>; 2] {
        let only = random.random_range(0..2);
        [0, 1].map(|slot| {
            let bad = match self {
                Self::OneSlot => slot == only,
                Self::BothSlots => true,
                Self::None | Self::NoOscillator => false,
            };
            let mut content = block.to_vec();
            if bad {
                damage(&mut content, random);
            }
            content
        })
    }
}

/// Never written, one time in four; else one to three bits flipped, each in another byte: no CRC-32 misses
/// those.
fn damage(block: &mut [u8], random: &mut ChaCha8Rng) {
    if random.random_range(0..4) == 0 {
        block.fill(0xFF);
        return;
    }
    let third = block.len() / 3;
    for part in 0..random.random_range(1..=3) {
        let at = part * third + random.random_range(0..third);
        block[at] ^= 1 << random.random_range(0..8);
    }
}
