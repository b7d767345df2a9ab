//! The independent watchdog (RM0090 section 21), on its own oscillator.

use crate::{Named, ticks};

/// The fastest and the slowest that its oscillator may be \[Hz\] (DS8626 table 36).
pub const OSCILLATOR_HZ: [u32; 2] = [17_000, 47_000];

/// Periods of the oscillator that a new prescaler or reload value takes to act (RM0090 21.4.4).
const UPDATE_PERIODS: u64 = 5;

/// Registers and the counter.
#[derive(Debug, Clone)]
pub struct Watchdog {
    oscillator_hz: u32,
    started: bool,
    unlocked: bool,
    /// Value in force, value written, and the time at which that comes into force.
    prescaler: (u32, u32, u64),
    reload: (u32, u32, u64),
    fed_at: u64,
    /// Ticks from the last feed to the reset.
    allowance: u64,
    /// Longest time between two feeds so far \[ticks\].
    pub longest: u64,
    /// Feeds so far, its start included.
    pub feeds: u64,
}

const KR: u32 = 0x00;
const PR: u32 = 0x04;
const RLR: u32 = 0x08;
const SR: u32 = 0x0C;

/// Registers by the maker's names.
pub const NAMED: Named = &[
    ("KR", KR, &[]),
    ("PR", PR, &[]),
    ("RLR", RLR, &[]),
    ("SR", SR, &[]),
];

impl Watchdog {
    /// After a reset: off.
    pub fn new(oscillator_hz: u32) -> Self {
        Self {
            oscillator_hz,
            started: false,
            unlocked: false,
            prescaler: (0, 0, 0),
            reload: (0xFFF, 0xFFF, 0),
            fed_at: 0,
            allowance: 0,
            longest: 0,
            feeds: 0,
        }
    }

    /// After a reset, with the earlier measurements.
    pub fn reset(&mut self) {
        *self = Self {
            longest: self.longest,
            feeds: self.feeds,
            ..Self::new(self.oscillator_hz)
        };
    }

    /// True if it runs.
    pub fn is_started(&self) -> bool {
        self.started
    }

    /// Time at which it resets the board, if it runs.
    pub fn expires_at(&self) -> Option<u64> {
        self.started.then_some(self.fed_at + self.allowance)
    }

    /// Ticks from a feed to the reset, as it is set up.
    pub fn allowance(&self) -> u64 {
        self.allowance
    }

    fn update_ticks(&self) -> u64 {
        UPDATE_PERIODS * ticks::PER_SECOND / u64::from(self.oscillator_hz)
    }

    fn in_force((old, new, from): (u32, u32, u64), now: u64) -> u32 {
        if now >= from { new } else { old }
    }

    fn feed(&mut self, now: u64) {
        if self.feeds > 0 && self.started {
            self.longest = self.longest.max(now - self.fed_at);
        }
        self.feeds += 1;
        self.fed_at = now;
        // A prescaler on its way is taken for the one that leaves less time.
        let (old, new, from) = self.prescaler;
        let prescaler = if now >= from { new } else { old.min(new) };
        let counts = u64::from(Self::in_force(self.reload, now)) + 1;
        let divider = 4u64 << prescaler.min(6);
        self.allowance = counts * divider * ticks::PER_SECOND / u64::from(self.oscillator_hz);
    }

    /// Reads a register.
    pub fn read(&self, offset: u32, now: u64) -> Option<u32> {
        let updating = |(_, _, from): (u32, u32, u64), bit: u32| if now < from { bit } else { 0 };
        Some(match offset {
            KR => 0,
            PR => self.prescaler.1,
            RLR => self.reload.1,
            SR => updating(self.prescaler, 1) | updating(self.reload, 2),
            _ => return None,
        })
    }

    /// Writes a register; returns sentences on violations of RM0090.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) -> Vec<String> {
        let from = now + self.update_ticks();
        match (offset, value) {
            (KR, 0x5555) => self.unlocked = true,
            (KR, 0xAAAA) => {
                self.unlocked = false;
                self.feed(now);
            }
            (KR, 0xCCCC) => {
                self.unlocked = false;
                if !self.started {
                    self.feed(now);
                    self.started = true;
                }
            }
            (PR | RLR, _) if !self.unlocked => {
                return vec!["the watchdog is set up while it is locked (21.3.2)".to_owned()];
            }
            (PR, _) if now >= self.prescaler.2 => {
                self.prescaler = (self.prescaler.1, value & 7, from)
            }
            (RLR, _) if now >= self.reload.2 => self.reload = (self.reload.1, value & 0xFFF, from),
            _ => {
                return vec![format!(
                    "the watchdog's register {offset:#x} takes no {value:#x} now (21.4)"
                )];
            }
        }
        Vec::new()
    }
}
