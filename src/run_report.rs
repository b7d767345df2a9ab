//! What the image says about one run: the file `report.bin` that it leaves beside its outputs.
//!
//! Enters: counters and costs from the image. Leaves: [`RunReport`], the same on the host, over a fixed
//! little-endian layout with a magic word and a version. No unit is converted on the way.
//!
//! "Instructions" are what the emulator executed. It knows nothing of cycles, flash wait states or caches,
//! so none of these numbers is a time on the board.

use crate::faults::{Faults, Status};

/// "RLGR", so that a wrong file is seen at once.
const MAGIC: [u8; 4] = *b"RLGR";

/// Raised with every change of the layout.
pub const RUN_REPORT_VERSION: u16 = 2;

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

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub enum RunOutcome {
    /// Every sample went through.
    Complete = 0,
    /// The parameter block was refused; nothing ran.
    ParameterFault = 1,
    /// A file of the run is missing or cannot be written.
    FileFault = 2,
}

/// The image's account of one run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunReport {
    /// How it ended.
    pub outcome: RunOutcome,
    /// 0 when the external oscillator answered; 1 on the internal one (always so in the emulator, which
    /// does not model the clock tree).
    pub clock_fallback: u16,
    /// Samples that went through the chain.
    pub samples: u32,
    /// Output frames written.
    pub frames: u32,
    /// Cost of the chain for samples that completed no output frame.
    pub between_outputs: CostRecord,
    /// Cost of the chain for samples that completed one.
    pub with_output: CostRecord,
    /// Cost of the whole interrupt body: source, chain, queue, bookkeeping.
    pub interrupt: CostRecord,
    /// Already subtracted from the costs above: what reading the counter itself costs \[instructions\].
    pub reading_overhead: u32,
    /// Periods in which the source had no sample ready.
    pub starved: u32,
    /// Periods that ended before the interrupt for the previous one had returned.
    pub late: u32,
    /// Output frames lost because the queue to the main loop was full.
    pub outputs_lost: u32,
    /// Other faults of the source: bus, check sum, repeated, skipped.
    pub source_faults: u32,
    /// Deepest use of the one stack, measured by painting \[bytes\]: a lower bound of the worst case.
    pub stack_used_bytes: u32,
    /// Memory that the stack may use \[bytes\].
    pub stack_size_bytes: u32,
    /// The chain's own fault counters at the end.
    pub faults: Faults,
}

impl RunReport {
    /// Bytes in the file.
    pub const BYTES: usize = 156;

    /// A report of a run in which no sample was processed.
    pub const fn empty(outcome: RunOutcome) -> Self {
        Self {
            outcome,
            clock_fallback: 0,
            samples: 0,
            frames: 0,
            between_outputs: CostRecord::EMPTY,
            with_output: CostRecord::EMPTY,
            interrupt: CostRecord::EMPTY,
            reading_overhead: 0,
            starved: 0,
            late: 0,
            outputs_lost: 0,
            source_faults: 0,
            stack_used_bytes: 0,
            stack_size_bytes: 0,
            faults: Faults::NONE,
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
        writer.put(u32::from(self.clock_fallback).to_le_bytes());
        writer.put(self.samples.to_le_bytes());
        writer.put(self.frames.to_le_bytes());
        for cost in [&self.between_outputs, &self.with_output, &self.interrupt] {
            writer.put(cost.count.to_le_bytes());
            writer.put(cost.minimum.to_le_bytes());
            writer.put(cost.maximum.to_le_bytes());
            writer.put(cost.sum.to_le_bytes());
        }
        for word in [
            self.reading_overhead,
            self.starved,
            self.late,
            self.outputs_lost,
            self.source_faults,
            self.stack_used_bytes,
            self.stack_size_bytes,
            self.faults.counts,
            self.faults.pickoff,
            self.faults.acceleration,
            self.faults.output,
            self.faults.pickoff_failed,
            self.faults.dither_stopped,
            self.faults.dither_out_of_band,
            self.faults.counter_stuck,
            self.faults.velocity,
            self.faults.gap,
            self.faults.first.stages.bits(),
            self.faults.first.sample,
        ] {
            writer.put(word.to_le_bytes());
        }
        bytes
    }

    /// The report in `bytes`; `None` where they are not one of this version.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; Self::BYTES] = bytes.try_into().ok()?;
        let mut reader = Reader { bytes, at: 0 };
        if reader.take() != MAGIC || u16::from_le_bytes(reader.take()) != RUN_REPORT_VERSION {
            return None;
        }
        let outcome = match u16::from_le_bytes(reader.take()) {
            0 => RunOutcome::Complete,
            1 => RunOutcome::ParameterFault,
            2 => RunOutcome::FileFault,
            _ => return None,
        };
        let mut report = Self::empty(outcome);
        report.clock_fallback = u16::try_from(reader.word()).ok()?;
        report.samples = reader.word();
        report.frames = reader.word();
        for cost in [
            &mut report.between_outputs,
            &mut report.with_output,
            &mut report.interrupt,
        ] {
            cost.count = reader.word();
            cost.minimum = reader.word();
            cost.maximum = reader.word();
            cost.sum = u64::from_le_bytes(reader.take());
        }
        for word in [
            &mut report.reading_overhead,
            &mut report.starved,
            &mut report.late,
            &mut report.outputs_lost,
            &mut report.source_faults,
            &mut report.stack_used_bytes,
            &mut report.stack_size_bytes,
            &mut report.faults.counts,
            &mut report.faults.pickoff,
            &mut report.faults.acceleration,
            &mut report.faults.output,
            &mut report.faults.pickoff_failed,
            &mut report.faults.dither_stopped,
            &mut report.faults.dither_out_of_band,
            &mut report.faults.counter_stuck,
            &mut report.faults.velocity,
            &mut report.faults.gap,
        ] {
            *word = reader.word();
        }
        report.faults.first.stages = Status::from_bits(reader.word());
        report.faults.first.sample = reader.word();
        Some(report)
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
