//! Plays a campaign into the firmware's own bank driver and processor, on this machine.
//!
//! It takes [`Interrupt`]s and gives [`Played`]: the frames that were sent, and the health items at moments that the
//! caller names. The bus and the queue's room are imitated, not shared with the image.

use std::cell::Cell;

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use trueaxis::bank_bus::CounterBank;
use trueaxis::counter_bank::{AccelerometerInput, FRAME_BYTES};
use trueaxis::health::HEALTH_ITEMS;
use trueaxis::processor::{BootReport, Processor};
use trueaxis::sample_source::{Reading, SampleSource, SourceFault};
use trueaxis::{NumberSystem, Parameters, TelemetryFrame};

use crate::campaign::{Interrupt, QUEUED_FRAMES, Wire};

/// Every health item, in the order of [`HEALTH_ITEMS`].
pub type HealthItems = [u32; HEALTH_ITEMS.len()];

/// The result of a campaign.
#[derive(Debug, Clone)]
pub struct Played {
    /// Every frame that found room.
    pub frames: Vec<TelemetryFrame>,
    /// The health items before the first interrupt of each period named.
    pub health_at: Vec<HealthItems>,
    /// The health items at the end.
    pub health: HealthItems,
}

/// Plays `interrupts` into a unit with `parameters`; `moments` are periods in rising order.
pub fn play<N: NumberSystem>(
    parameters: &Parameters,
    boot: BootReport,
    interrupts: &[Interrupt],
    moments: impl IntoIterator<Item = u32>,
) -> Played {
    let mut processor = Processor::<N>::new(parameters, boot).expect("parameters in range");
    let line = Cell::new(None);
    let mut bank = CounterBank::new(Line(&line), AccelerometerInput::Counters);
    let mut moments = moments.into_iter().peekable();
    let mut queued = 0;
    let mut unasked = 0;
    let mut frames = Vec::new();
    let mut health_at = Vec::new();
    for interrupt in interrupts {
        while moments.next_if(|at| *at <= interrupt.period).is_some() {
            health_at.push(processor.health_items());
        }
        let elapsed = unasked + interrupt.timing.missed + 1;
        let reading = match interrupt.wire {
            Wire::Starved => {
                unasked = elapsed;
                Reading::without_sample(SourceFault::Starved)
            }
            Wire::Error | Wire::Frame(_) => {
                line.set(match interrupt.wire {
                    Wire::Frame(bytes) => Some(bytes),
                    _ => None,
                });
                unasked = 0;
                bank.take(elapsed)
            }
        };
        if let Some(frame) = processor.period(reading, interrupt.timing) {
            if queued < QUEUED_FRAMES {
                queued += 1;
                frames.push(frame);
            } else {
                processor.output_overrun();
            }
        }
        if !interrupt.link_held {
            queued = 0;
        }
    }
    health_at.extend(moments.map(|_| processor.health_items()));
    Played {
        frames,
        health_at,
        health: processor.health_items(),
    }
}

/// A bus that gives one frame once, and an error without a frame.
struct Line<'a>(&'a Cell<Option<[u8; FRAME_BYTES]>>);

impl ErrorType for Line<'_> {
    type Error = ErrorKind;
}

impl SpiDevice for Line<'_> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let frame = self.0.take().ok_or(ErrorKind::Other)?;
        for operation in operations {
            if let Operation::Read(bytes) = operation {
                bytes.copy_from_slice(frame.get(..bytes.len()).ok_or(ErrorKind::Other)?);
            }
        }
        Ok(())
    }
}
