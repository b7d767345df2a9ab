//! Keeps the last samples before and after the first fault, for a debugger.
//!
//! It records one [`TraceEntry`] a period. After the first entry with a latched fault it records half a ring more and
//! then stops: half of the entries led to the fault and half followed it, whenever a probe reads the memory.
//!
//! Layout in memory, little-endian, words of 32 bits (`repr(C)`):
//!
//! | offset | holds |
//! |---|---|
//! | 0 | magic `RLGT` |
//! | 4 | u16 layout version (1), u16 bytes of an entry (52) |
//! | 8 | entries in the ring, L |
//! | 12 | entries recorded since start, L after 2³² − 1; the next one goes to this number modulo L |
//! | 16 | entries still to record: `0xFFFF_FFFF` before a fault, 0 when frozen |
//! | 20 | L entries: sampling period, status, cost, pulse counts x y z, pickoffs x y z, accelerometers x y z, 1 if a sample came |
//!
//! Put it into a static with `#[unsafe(no_mangle)]`, so that the name is there for the probe and the
//! compiler may not drop stores that no code reads back:
//! `probe-rs read b32 $(nm -C image | awk '/ TRACE$/{print "0x"$1}') 3333` for 256 entries.
//!
//! There is one trace and no restart in service: the first fault is the cause. A reset arms the ring again.

use crate::chain::faults::Status;
use crate::chain::sample::Sample;

/// Record of one sampling period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C)]
pub struct TraceEntry {
    /// Sampling period since start.
    pub period: u32,
    /// The processor's bits of this period; with the whole frame's where one ended here.
    pub status: u32,
    /// Cost of the period in the caller's unit: instructions under emulation, cycles on a board.
    pub cost: u32,
    /// Pulse counts of the sample; zeros without one.
    pub pulse_counts: [i32; 3],
    /// Pickoff codes of the sample; zeros without one.
    pub pickoff_codes: [i32; 3],
    /// Accelerometer codes of the sample; zeros without one.
    pub accelerometer_codes: [i32; 3],
    /// 1 if a sample came, else 0.
    pub with_sample: u32,
}

impl TraceEntry {
    /// An entry before anything is recorded.
    pub const EMPTY: Self = Self {
        period: 0,
        status: 0,
        cost: 0,
        pulse_counts: [0; 3],
        pickoff_codes: [0; 3],
        accelerometer_codes: [0; 3],
        with_sample: 0,
    };

    /// The entry of one period.
    #[inline]
    pub fn new(period: u32, status: Status, cost: u32, sample: Option<Sample>) -> Self {
        let with_sample = u32::from(sample.is_some());
        let sample = sample.unwrap_or_default();
        Self {
            period,
            status: status.bits(),
            cost,
            pulse_counts: sample.pulse_counts,
            pickoff_codes: sample.pickoff_codes,
            accelerometer_codes: sample.accelerometer_codes,
            with_sample,
        }
    }
}

/// A ring of `L` entries, a power of two.
#[derive(Debug)]
#[repr(C)]
pub struct TraceRing<const L: usize> {
    magic: [u8; 4],
    version: u16,
    entry_bytes: u16,
    length: u32,
    recorded: u32,
    to_record: u32,
    entries: [TraceEntry; L],
}

/// Value of `to_record` before a fault.
const ENDLESS: u32 = u32::MAX;

impl<const L: usize> TraceRing<L> {
    /// All zeros, which a static takes from no flash: no ring yet, until [`start`](Self::start).
    pub const fn blank() -> Self {
        Self {
            magic: [0; 4],
            version: 0,
            entry_bytes: 0,
            length: 0,
            recorded: 0,
            to_record: 0,
            entries: [TraceEntry::EMPTY; L],
        }
    }

    /// Makes a blank ring an empty one.
    pub fn start(&mut self) {
        let Self {
            magic,
            version,
            entry_bytes,
            length,
            recorded,
            to_record,
            entries: _,
        } = self;
        *magic = Self::MAGIC;
        *version = Self::VERSION;
        *entry_bytes = Self::ENTRY_BYTES;
        *length = L as u32;
        *recorded = 0;
        *to_record = ENDLESS;
    }

    const MAGIC: [u8; 4] = *b"RLGT";
    const VERSION: u16 = 1;
    const ENTRY_BYTES: u16 = size_of::<TraceEntry>() as u16;

    /// An empty ring.
    pub const fn new() -> Self {
        // A power of two keeps the place continuous when the count of entries wraps, and is no division.
        const { assert!(L.is_power_of_two() && L >= 2 && L <= 1 << 16) };
        Self {
            magic: Self::MAGIC,
            version: Self::VERSION,
            entry_bytes: Self::ENTRY_BYTES,
            length: L as u32,
            recorded: 0,
            to_record: ENDLESS,
            entries: [TraceEntry::EMPTY; L],
        }
    }

    /// Records one period, unless the ring is frozen; `fault_latched` once the first fault in service has come. Each
    /// recorded entry costs the same.
    #[inline]
    pub fn record(&mut self, entry: TraceEntry, fault_latched: bool) {
        if self.to_record == 0 {
            return;
        }
        if let Some(place) = self.entries.get_mut(self.recorded as usize & (L - 1)) {
            *place = entry;
        }
        // A count that wraps goes on at L, which is the same place and still marks a full ring.
        self.recorded = match self.recorded.wrapping_add(1) {
            0 => L as u32,
            recorded => recorded,
        };
        if self.to_record != ENDLESS {
            self.to_record -= 1;
        } else if fault_latched {
            self.to_record = (L / 2) as u32;
        }
    }

    /// True once a fault has been seen and its half ring is full.
    pub fn is_frozen(&self) -> bool {
        self.to_record == 0
    }

    /// The entries, oldest first.
    pub fn entries(&self) -> impl Iterator<Item = &TraceEntry> {
        let begin = self.recorded as usize & (L - 1);
        let (newer, older) = self.entries.split_at(begin);
        let whole = self.recorded as usize >= L;
        let older = if whole { older } else { &[] };
        older.iter().chain(newer)
    }
}

impl<const L: usize> Default for TraceRing<L> {
    fn default() -> Self {
        Self::new()
    }
}
