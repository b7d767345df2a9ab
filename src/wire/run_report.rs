//! Encodes the image's account of one run: the file `report.bin` that it leaves beside its outputs.
//!
//! The image fills a [`RunReport`] with counters and costs; the host reads the same from a fixed little-endian layout
//! with a magic word and a version. No unit is converted on the way.
//!
//! "Instructions" are those that the emulator executed. It models no cycles, flash wait states or caches,
//! so none of these numbers is a time on the board.

use crate::unit::health::HEALTH_ITEMS;

/// "RLGR", so that a wrong file is seen at once.
const MAGIC: [u8; 4] = *b"RLGR";

/// Raised with every change of the layout.
pub const RUN_REPORT_VERSION: u16 = 7;

/// Least, most and sum over a set of measurements \[instructions\].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CostRecord {
    /// Measurements.
    pub count: u32,
    /// Least; `u32::MAX` before the first.
    pub minimum: u32,
    /// Most.
    pub maximum: u32,
    /// Sum of all.
    pub sum: u64,
}

impl CostRecord {
    /// Nothing measured yet.
    pub const EMPTY: Self = Self {
        count: 0,
        minimum: u32::MAX,
        maximum: 0,
        sum: 0,
    };

    /// Takes one measurement in.
    pub fn record(&mut self, cost: u32) {
        self.count = self.count.saturating_add(1);
        self.minimum = self.minimum.min(cost);
        self.maximum = self.maximum.max(cost);
        self.sum = self.sum.saturating_add(u64::from(cost));
    }
}

/// Outcome of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub enum RunOutcome {
    /// Every record was played.
    Complete = 0,
    /// A file of the run is missing or cannot be written.
    FileFault = 1,
}

/// Every health item at the end, in the order of [`HEALTH_ITEMS`].
pub type HealthTable = [u32; HEALTH_ITEMS.len()];

/// The image's account of one run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunReport {
    /// Outcome of the run.
    pub outcome: RunOutcome,
    /// Interrupts served.
    pub periods: u32,
    /// Telemetry frames sent.
    pub frames: u32,
    /// Cost of the chain for samples that completed no output.
    pub between_outputs: CostRecord,
    /// Cost of the chain for samples that completed one.
    pub with_output: CostRecord,
    /// Cost of the chain for samples that completed none and followed a start or a gap.
    pub beginning: CostRecord,
    /// Cost of the processor: the chain, the health around it, the telemetry frame.
    pub processor: CostRecord,
    /// Cost of the whole interrupt body: bus, processor, queue, bookkeeping.
    pub interrupt: CostRecord,
    /// Already subtracted from the costs above: cost of reading the counter itself \[instructions\].
    pub reading_overhead: u32,
    /// Deepest use of the one stack, measured by painting \[bytes\]: a lower bound of the worst case.
    pub stack_used_bytes: u32,
    /// Memory that the stack may use \[bytes\].
    pub stack_size_bytes: u32,
    /// The processor's health.
    pub health: HealthTable,
}

impl RunReport {
    /// Bytes in the file.
    pub const BYTES: usize = 128 + 4 * HEALTH_ITEMS.len();

    /// A report of a run in which nothing was played.
    pub const fn empty(outcome: RunOutcome) -> Self {
        Self {
            outcome,
            periods: 0,
            frames: 0,
            between_outputs: CostRecord::EMPTY,
            with_output: CostRecord::EMPTY,
            beginning: CostRecord::EMPTY,
            processor: CostRecord::EMPTY,
            interrupt: CostRecord::EMPTY,
            reading_overhead: 0,
            stack_used_bytes: 0,
            stack_size_bytes: 0,
            health: [0; HEALTH_ITEMS.len()],
        }
    }

    /// The file's content: the fields in the order of their declaration.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let mut writer = Writer {
            bytes: &mut bytes,
            at: 0,
        };
        writer.put(MAGIC);
        writer.put(RUN_REPORT_VERSION.to_le_bytes());
        writer.put((self.outcome as u16).to_le_bytes());
        writer.put(self.periods.to_le_bytes());
        writer.put(self.frames.to_le_bytes());
        for cost in [
            &self.between_outputs,
            &self.with_output,
            &self.beginning,
            &self.processor,
            &self.interrupt,
        ] {
            writer.put(cost.count.to_le_bytes());
            writer.put(cost.minimum.to_le_bytes());
            writer.put(cost.maximum.to_le_bytes());
            writer.put(cost.sum.to_le_bytes());
        }
        writer.put(self.reading_overhead.to_le_bytes());
        writer.put(self.stack_used_bytes.to_le_bytes());
        writer.put(self.stack_size_bytes.to_le_bytes());
        for value in self.health {
            writer.put(value.to_le_bytes());
        }
        bytes
    }

    /// The report in `bytes`; `None` unless of this version.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; Self::BYTES] = bytes.try_into().ok()?;
        let mut reader = Reader { bytes, at: 0 };
        if reader.take() != MAGIC || u16::from_le_bytes(reader.take()) != RUN_REPORT_VERSION {
            return None;
        }
        let outcome = match u16::from_le_bytes(reader.take()) {
            0 => RunOutcome::Complete,
            1 => RunOutcome::FileFault,
            _ => return None,
        };
        let mut report = Self::empty(outcome);
        report.periods = reader.word();
        report.frames = reader.word();
        for cost in [
            &mut report.between_outputs,
            &mut report.with_output,
            &mut report.beginning,
            &mut report.processor,
            &mut report.interrupt,
        ] {
            cost.count = reader.word();
            cost.minimum = reader.word();
            cost.maximum = reader.word();
            cost.sum = u64::from_le_bytes(reader.take());
        }
        report.reading_overhead = reader.word();
        report.stack_used_bytes = reader.word();
        report.stack_size_bytes = reader.word();
        for value in &mut report.health {
            *value = reader.word();
        }
        Some(report)
    }

    /// The health item of `index`; `None` for another index.
    pub fn health_item(&self, index: u8) -> Option<u32> {
        let place = HEALTH_ITEMS.iter().position(|item| *item == index)?;
        self.health.get(place).copied()
    }
}

/// Appends arrays to a buffer that is known to hold them all.
struct Writer<'a> {
    bytes: &'a mut [u8],
    at: usize,
}

impl Writer<'_> {
    fn put<const N: usize>(&mut self, value: [u8; N]) {
        self.bytes[self.at..self.at + N].copy_from_slice(&value);
        self.at += N;
    }
}

/// Takes arrays from a buffer that is known to hold them all.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let value = core::array::from_fn(|byte| self.bytes[self.at + byte]);
        self.at += N;
        value
    }

    fn word(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }
}
