//! Faults found at boot: in the parameter slots or the oscillator.
//!
//! From a good parameter block it makes the content of both slots, damaged at random places or erased, and the status
//! of every frame then.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use trueaxis::Status;

/// Faults of a boot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BootFault {
    /// Nothing wrong.
    None,
    /// One slot, either, is damaged or empty.
    OneSlot,
    /// Both slots are damaged or empty.
    BothSlots,
    /// The external oscillator does not answer.
    NoOscillator,
}

impl BootFault {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::OneSlot,
        Self::BothSlots,
        Self::NoOscillator,
        Self::None,
    ];

    /// The bits of all boot faults: every frame must show this fault's and no other.
    pub const ANY: Status = Status::PARAMETER_SLOT_BAD
        .union(Status::PARAMETERS_DEFAULT)
        .union(Status::CLOCK_FALLBACK);

    /// The fault's name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::OneSlot => "one slot bad",
            Self::BothSlots => "both slots bad",
            Self::NoOscillator => "no oscillator",
        }
    }

    /// The status bit that every frame must show.
    pub fn status(self) -> Status {
        match self {
            Self::None => Status::default(),
            Self::OneSlot => Status::PARAMETER_SLOT_BAD,
            Self::BothSlots => Status::PARAMETERS_DEFAULT,
            Self::NoOscillator => Status::CLOCK_FALLBACK,
        }
    }

    /// The content of both slots of a unit that was given `block`.
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
