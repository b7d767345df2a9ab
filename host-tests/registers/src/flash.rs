//! The flash interface (RM0090 section 3): wait states, keys, erasing and programming of the two sectors that hold the
//! parameter slots and, behind a boot selector, of its records and both images; the data cache, and power that fails
//! meanwhile. The cache is modelled over the parameter slots alone.

use std::collections::BTreeMap;

use crate::Named;
use crate::random::Random;
use crate::ticks;

/// Beginning of the slots: sector 10 (RM0090 table 5).
pub const SLOTS_BEGIN: u32 = 0x080C_0000;

/// Size of a sector \[bytes\].
pub const SECTOR_BYTES: usize = 128 * 1024;

/// Beginning and size of the sectors in front of the parameter slots (RM0090 table 5).
const CODE_BEGIN: u32 = 0x0800_0000;
const CODE_BYTES: usize = 768 * 1024;

/// Sectors that the firmware may erase: the parameter slots, and behind a selector its records and both images.
const OF_PARAMETERS: &[u32] = &[10, 11];
const BEHIND_SELECTOR: &[u32] = &[1, 2, 5, 6, 7, 8, 10, 11];

/// Beginning of a sector from the beginning of flash, and its size (RM0090 table 5) \[bytes\].
const fn sector_range(sector: u32) -> (usize, usize) {
    let sector = sector as usize;
    match sector {
        0..=3 => (sector * 16 * 1024, 16 * 1024),
        4 => (64 * 1024, 64 * 1024),
        _ => ((sector - 4) * SECTOR_BYTES, SECTOR_BYTES),
    }
}

/// Bytes of a line of the data cache (RM0090 3.5.2).
const LINE_BYTES: u32 = 16;

/// Wait states that the flash needs with the core at `core_hz` and 2.7 V to 3.6 V (RM0090 table 10).
pub fn wait_states_needed(core_hz: u32) -> u32 {
    core_hz.saturating_sub(1) / 30_000_000
}

/// Result of an operation that lost its power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Leftover {
    /// The old content.
    Nothing,
    /// Each bit that it would have changed is changed or not, without order.
    SomeBits,
    /// All of it is done.
    Whole,
}

/// Power fails in the operation of this number, the first being 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cut {
    /// Number of the erasure or the programmed word since power-on.
    pub operation: usize,
    /// Result of that operation.
    pub leftover: Leftover,
}

/// Behaviour of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Behaviour {
    /// Time for a word \[ticks\].
    pub programming: u64,
    /// Time for a sector \[ticks\].
    pub erasing: u64,
    /// True if the processor stands meanwhile, as when it fetches from flash; false for a loop in the instruction cache.
    pub stalls: bool,
    /// True if the written wait states are shown.
    pub shows_wait_states: bool,
    /// Operations from this number on never end.
    pub hangs_from: Option<usize>,
    /// The operation of this number reports a write protection error and changes nothing.
    pub refuses: Option<usize>,
    /// Power fails.
    pub cut: Option<Cut>,
    /// The brown-out level of the option bytes, as they encode it: 0 is level 3, 3 is off.
    pub brown_out: u32,
    /// Bits of the access register that stay.
    pub access_stays: u32,
}

impl Behaviour {
    /// The most that DS8626 table 41 allows at 32 bits: 100 µs for a word, 2 s for a sector.
    pub const SOUND: Self = Self {
        programming: ticks::of_us(100),
        erasing: ticks::of_ms(2000),
        stalls: true,
        shows_wait_states: true,
        hangs_from: None,
        refuses: None,
        cut: None,
        brown_out: 0,
        access_stays: u32::MAX,
    };
}

/// Registers, sectors and data cache.
#[derive(Debug)]
pub struct Flash {
    /// Both sectors of the parameter slots.
    pub content: Vec<u8>,
    /// The sectors in front of them.
    pub code: Vec<u8>,
    /// Parts of those that changed, beginning and size, which the processor's memory does not show yet.
    pub changed: Vec<(usize, usize)>,
    may_erase: &'static [u32],
    /// Behaviour of the controller.
    pub behaviour: Behaviour,
    /// Operations since power-on.
    pub operations: usize,
    /// Erasures since power-on.
    pub erasures: usize,
    /// True once power has failed in an operation.
    pub has_lost_power: bool,
    random: Random,
    acr: u32,
    shown_wait_states: u32,
    keys: u32,
    locked_for_good: bool,
    sr: u32,
    cr: u32,
    busy_until: u64,
    cached: BTreeMap<u32, [u8; LINE_BYTES as usize]>,
}

const ACR: u32 = 0x00;
const KEYR: u32 = 0x04;
const SR: u32 = 0x0C;
const CR: u32 = 0x10;
const OPTCR: u32 = 0x14;

/// The option bytes as they leave the factory (RM0090 3.9.6), without the brown-out level.
const OPTIONS: u32 = 0x0FFF_AAE1;
const BOR_LEV: u32 = 0b11 << 2;
const PRFTEN: u32 = 1 << 8;
const ICEN: u32 = 1 << 9;
const SNB: u32 = 0xF << 3;
const PSIZE: u32 = 0b11 << 8;

const LATENCY: u32 = 0b111;
const DCEN: u32 = 1 << 10;
const DCRST: u32 = 1 << 12;

const WRPERR: u32 = 1 << 4;
const PGPERR: u32 = 1 << 6;
const PGSERR: u32 = 1 << 7;
const ERRORS: u32 = 0b1111_0010;
const BSY: u32 = 1 << 16;

const PG: u32 = 1 << 0;
const SER: u32 = 1 << 1;
const STRT: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;

/// Registers and bits by the maker's names.
pub const NAMED: Named = &[
    (
        "ACR",
        ACR,
        &[
            ("LATENCY", LATENCY),
            ("PRFTEN", PRFTEN),
            ("ICEN", ICEN),
            ("DCEN", DCEN),
            ("DCRST", DCRST),
        ],
    ),
    ("KEYR", KEYR, &[]),
    (
        "SR",
        SR,
        &[
            ("WRPERR", WRPERR),
            ("PGPERR", PGPERR),
            ("PGSERR", PGSERR),
            ("BSY", BSY),
        ],
    ),
    (
        "CR",
        CR,
        &[
            ("PG", PG),
            ("SER", SER),
            ("SNB", SNB),
            ("PSIZE", PSIZE),
            ("STRT", STRT),
            ("LOCK", LOCK),
        ],
    ),
    ("OPTCR", OPTCR, &[("BOR_LEV", BOR_LEV)]),
];

const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

impl Flash {
    /// Both sectors erased.
    pub fn new(behaviour: Behaviour) -> Self {
        Self {
            content: vec![0xFF; 2 * SECTOR_BYTES],
            code: Vec::new(),
            changed: Vec::new(),
            may_erase: OF_PARAMETERS,
            behaviour,
            operations: 0,
            erasures: 0,
            has_lost_power: false,
            random: Random::new(1),
            acr: 0,
            shown_wait_states: 0,
            keys: 0,
            locked_for_good: false,
            sr: 0,
            cr: LOCK,
            busy_until: 0,
            cached: BTreeMap::new(),
        }
    }

    /// A reset: registers and caches, but not the stored content.
    pub fn reset(&mut self) {
        let content = std::mem::take(&mut self.content);
        let code = std::mem::take(&mut self.code);
        *self = Self {
            content,
            code,
            changed: std::mem::take(&mut self.changed),
            may_erase: self.may_erase,
            random: self.random.clone(),
            operations: self.operations,
            erasures: self.erasures,
            ..Self::new(self.behaviour)
        };
    }

    /// A sector, first or second.
    pub fn slot(&self, place: usize) -> &[u8] {
        &self.content[place * SECTOR_BYTES..(place + 1) * SECTOR_BYTES]
    }

    /// Stores bytes at a slot's beginning, as a programming tool does.
    pub fn store(&mut self, place: usize, bytes: &[u8]) {
        let begin = place * SECTOR_BYTES;
        self.content[begin..begin + SECTOR_BYTES].fill(0xFF);
        self.content[begin..begin + bytes.len()].copy_from_slice(bytes);
    }

    /// Lets the firmware write records and images behind a selector; `code`: the content in front of the parameter slots.
    pub fn open_behind_selector(&mut self, code: &[u8]) {
        (self.code, self.may_erase) = (code.to_vec(), BEHIND_SELECTOR);
        self.code.resize(CODE_BYTES, 0xFF);
    }

    /// Content from an address on, in front of the parameter slots.
    pub fn code_at(&self, address: u32) -> &[u8] {
        &self.code[(address - CODE_BEGIN) as usize..]
    }

    /// Stores bytes in front of the parameter slots, as a programming tool does.
    pub fn store_code(&mut self, address: u32, bytes: &[u8]) {
        let at = (address - CODE_BEGIN) as usize;
        self.code[at..at + bytes.len()].copy_from_slice(bytes);
        self.changed.push((at, bytes.len()));
    }

    /// The wait states that are in force.
    pub fn wait_states(&self) -> u32 {
        self.acr & LATENCY
    }

    /// True if both caches and the prefetch are on.
    pub fn caches_are_on(&self) -> bool {
        let all = PRFTEN | ICEN | DCEN;
        self.acr & all == all
    }

    /// True while an operation runs; with the time at which it ends.
    fn is_busy(&self, now: u64) -> bool {
        now < self.busy_until
    }

    /// Reads a register.
    pub fn read(&self, offset: u32, now: u64) -> Option<u32> {
        Some(match offset {
            ACR => self.acr & !LATENCY | self.shown_wait_states,
            SR => self.sr | if self.is_busy(now) { BSY } else { 0 },
            CR => self.cr,
            OPTCR => OPTIONS | self.behaviour.brown_out << 2,
            _ => return None,
        })
    }

    /// Writes a register; returns sentences on violations of RM0090. The time may have moved on: the bus stands while
    /// an operation
    /// runs.
    pub fn write(&mut self, offset: u32, value: u32, now: &mut u64) -> Vec<String> {
        let mut wrong = Vec::new();
        match offset {
            ACR => {
                if value & DCRST != 0 {
                    if value & DCEN != 0 {
                        wrong.push("the data cache is reset while it is on (3.5.2)".to_owned());
                    } else {
                        self.cached.clear();
                    }
                }
                self.acr = value & self.behaviour.access_stays;
                if self.behaviour.shows_wait_states {
                    self.shown_wait_states = value & LATENCY;
                }
            }
            KEYR => self.take_key(value, &mut wrong),
            SR => self.sr &= !(value & (ERRORS | 1)),
            CR => self.write_control(value, now, &mut wrong),
            _ => wrong.push(format!(
                "the flash interface has no register at {offset:#x}"
            )),
        }
        wrong
    }

    /// RM0090 3.6.1: both keys in their order unlock; anything else locks until the next reset.
    fn take_key(&mut self, value: u32, wrong: &mut Vec<String>) {
        let due = KEYS[usize::from(self.keys == KEYS[0])];
        if self.cr & LOCK == 0 || self.locked_for_good || value != due {
            self.locked_for_good = true;
            self.cr |= LOCK;
            wrong.push(format!(
                "key {value:#010x} locks the flash until the next reset (3.6.1)"
            ));
            return;
        }
        if value == KEYS[1] {
            self.cr &= !LOCK;
            self.keys = 0;
        } else {
            self.keys = value;
        }
    }

    fn write_control(&mut self, value: u32, now: &mut u64, wrong: &mut Vec<String>) {
        // The bus stands until the operation ends (RM0090 3.9.5).
        if self.is_busy(*now) && self.busy_until != u64::MAX {
            *now = self.busy_until;
        }
        if self.cr & LOCK != 0 {
            wrong.push("the control register is written while it is locked (3.6.1)".to_owned());
            return;
        }
        self.cr = value & !STRT;
        if value & STRT == 0 {
            return;
        }
        if self.sr & ERRORS != 0 {
            wrong.push("an erasure is started while error flags stand (3.6.3)".to_owned());
        }
        let sector = (value & SNB) >> 3;
        if value & SER == 0 || value & PG != 0 || !self.may_erase.contains(&sector) {
            wrong.push(format!(
                "an erasure of sector {sector} with control {value:#x} (3.6.3)"
            ));
            return;
        }
        self.erasures += 1;
        let (begin, bytes) = sector_range(sector);
        // A sector of 16 KiB takes a quarter of the time at most (DS8626 table 41).
        let duration = if bytes < SECTOR_BYTES {
            self.behaviour.erasing / 4
        } else {
            self.behaviour.erasing
        };
        self.operate(begin, &vec![0xFF; bytes], duration, now);
    }

    /// Reads the slots as the processor does: through the data cache, and standing while an operation runs.
    pub fn load(&mut self, address: u32, bytes: usize, now: &mut u64) -> u64 {
        if self.is_busy(*now) && self.busy_until != u64::MAX {
            *now = self.busy_until;
        }
        let at = address - SLOTS_BEGIN;
        let byte = |flash: &mut Self, at: u32| {
            let (line, within) = (at / LINE_BYTES, (at % LINE_BYTES) as usize);
            if flash.acr & DCEN == 0 {
                return flash.content[at as usize];
            }
            let begin = (line * LINE_BYTES) as usize;
            let content = &flash.content;
            let held = flash
                .cached
                .entry(line)
                .or_insert_with(|| std::array::from_fn(|within| content[begin + within]));
            held[within]
        };
        (0..bytes as u32).fold(0, |word, place| {
            word | u64::from(byte(self, at + place)) << (8 * place)
        })
    }

    /// A store of the processor to flash: programming, where it is allowed (RM0090 3.6.4).
    pub fn program(
        &mut self,
        address: u32,
        bytes: usize,
        value: u64,
        now: &mut u64,
    ) -> Vec<String> {
        if self.is_busy(*now) && self.busy_until != u64::MAX {
            *now = self.busy_until;
        }
        let error = if self.cr & LOCK != 0 || self.cr & PG == 0 {
            PGSERR
        } else if bytes != 1 << ((self.cr >> 8) & 0b11) {
            PGPERR
        } else {
            0
        };
        if error != 0 {
            self.sr |= error;
            return vec![format!(
                "a store of {bytes} bytes to {address:#x} with control {:#x} (3.6.4)",
                self.cr
            )];
        }
        let mut wrong = Vec::new();
        if !address.is_multiple_of(bytes as u32) {
            wrong.push(format!("a store to {address:#x} is not aligned (3.6.4)"));
        }
        let at = (address - CODE_BEGIN) as usize;
        let old = self.place(at, bytes).to_vec();
        // Programming clears bits alone.
        let new: Vec<u8> = (0..bytes)
            .map(|place| old[place] & (value >> (8 * place)) as u8)
            .collect();
        self.operate(at, &new, self.behaviour.programming, now);
        let Some(at) = at.checked_sub(CODE_BYTES) else {
            return wrong;
        };
        // The cache is written too (RM0090 3.5.2); erasing leaves it as it was.
        for place in at..at + bytes {
            let (line, within) = (place as u32 / LINE_BYTES, place % LINE_BYTES as usize);
            if let Some(held) = self.cached.get_mut(&line) {
                held[within] = self.content[place];
            }
        }
        wrong
    }

    /// Content from an offset in flash on.
    fn place(&mut self, at: usize, bytes: usize) -> &mut [u8] {
        match at.checked_sub(CODE_BYTES) {
            Some(at) => &mut self.content[at..at + bytes],
            None => &mut self.code[at..at + bytes],
        }
    }

    /// Changes flash to `new`, or to the result of a failure.
    fn operate(&mut self, at: usize, new: &[u8], duration: u64, now: &mut u64) {
        let operation = self.operations;
        self.operations += 1;
        if self
            .behaviour
            .hangs_from
            .is_some_and(|first| operation >= first)
        {
            self.busy_until = u64::MAX;
            return;
        }
        if self.behaviour.refuses == Some(operation) {
            self.sr |= WRPERR;
            return;
        }
        let cut = self.behaviour.cut.filter(|cut| cut.operation == operation);
        let mut left = self.place(at, new.len()).to_vec();
        match cut.map(|cut| cut.leftover) {
            None | Some(Leftover::Whole) => left.copy_from_slice(new),
            Some(Leftover::Nothing) => {}
            Some(Leftover::SomeBits) => {
                for (byte, new) in left.iter_mut().zip(new) {
                    let changed = (*byte ^ new) & self.random.bits() as u8;
                    *byte ^= changed;
                }
            }
        }
        self.place(at, new.len()).copy_from_slice(&left);
        if at < CODE_BYTES {
            self.changed.push((at, new.len()));
        }
        self.has_lost_power |= cut.is_some();
        self.busy_until = *now + duration;
        if self.behaviour.stalls {
            *now = self.busy_until;
        }
    }
}
