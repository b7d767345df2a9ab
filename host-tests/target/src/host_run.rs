//! Runs the image's interrupt on the host: the same bank driver and processor over the same records.
//!
//! From parameter slots and bank records it gives a [`HostRun`]: the telemetry frames as they leave the serial port,
//! byte for byte, and every health item at the end. Only these are imitated and not shared: an `SpiDevice` over a
//! slice, the interrupts' timing ([`BankRecord::timing_of_the_next`]), and the queue's room.

use std::cell::Cell;

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use trueaxis::bank_bus::CounterBank;
use trueaxis::bank_record::{BankRecord, HOLD_PARTS};
use trueaxis::counter_bank::{AccelerometerInput, FRAME_BYTES};
use trueaxis::processor::{BootReport, Processor, Timing};
use trueaxis::run_report::HealthTable;
use trueaxis::sample_source::SampleSource;
use trueaxis::terms::{AllTerms, TermKinds};
use trueaxis::{F32, Fixed, NumberSystem, ParameterError, Term};

use super::TargetCore;
use super::slots::SlotImages;

/// Frames that the image's queue holds (FRAME_QUEUE in src/hardware/sampling.rs, less the empty slot).
const QUEUED_FRAMES: usize = 15;

/// The host's result for the records.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HostRun {
    /// The serial port's bytes.
    pub telemetry: Vec<u8>,
    /// The health items at the end.
    pub health: HealthTable,
}

/// Runs `records` through `core` on this machine, with no optional terms or with all of them.
pub fn run(
    core: TargetCore,
    slots: &SlotImages,
    records: &[BankRecord],
    terms: TermKinds,
) -> Result<HostRun, ParameterError> {
    match (core, terms == TermKinds::NONE) {
        (TargetCore::F32, true) => run_in::<F32, ()>(slots, records, terms),
        (TargetCore::F32, false) => run_in::<F32, AllTerms<F32>>(slots, records, terms),
        (TargetCore::Fixed, true) => run_in::<Fixed, ()>(slots, records, terms),
        (TargetCore::Fixed, false) => run_in::<Fixed, AllTerms<Fixed>>(slots, records, terms),
    }
}

fn run_in<N: NumberSystem, T: Term<N>>(
    slots: &SlotImages,
    records: &[BankRecord],
    terms: TermKinds,
) -> Result<HostRun, ParameterError> {
    let loaded = slots.load(terms);
    let boot = BootReport::default().with(|report| {
        // The emulator does not model the clock tree, so its image always falls back.
        report.clock_fallback = true;
        report.parameters_default = loaded.parameters_default();
        report.slot_bad = loaded.slot_bad;
        report.generation = loaded.generation;
    });
    let mut processor = Processor::<N, T>::with_terms(&loaded.parameters, boot)?;
    let wire = Cell::new(None);
    let mut bank = CounterBank::new(Wire(&wire), AccelerometerInput::Counters);
    let mut timing = Timing::default();
    let mut queued = 0;
    let mut telemetry = Vec::new();
    for record in records {
        wire.set((!record.bus_error).then_some(record.frame));
        if let Some(frame) = processor.period(bank.take(timing.missed + 1), timing) {
            if queued < QUEUED_FRAMES {
                queued += 1;
                telemetry.extend_from_slice(&frame.to_bytes());
            } else {
                processor.output_overrun();
            }
        }
        // The main loop empties the queue before the next interrupt, unless that is already waiting.
        if !record.link_held && u32::from(record.hold) < HOLD_PARTS {
            queued = 0;
        }
        timing = record.timing_of_the_next();
    }
    Ok(HostRun {
        telemetry,
        health: processor.health_items(),
    })
}

/// A bus that delivers one record's frame, once.
#[derive(Debug)]
struct Wire<'a>(&'a Cell<Option<[u8; FRAME_BYTES]>>);

impl ErrorType for Wire<'_> {
    type Error = ErrorKind;
}

impl SpiDevice for Wire<'_> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let frame = self.0.take().ok_or(ErrorKind::Other)?;
        for operation in operations {
            if let Operation::Read(bytes) = operation {
                for (byte, wire) in bytes.iter_mut().zip(frame) {
                    *byte = wire;
                }
            }
        }
        Ok(())
    }
}
