//! The other end of the serial lines: telemetry, health items, and a sender of requests.

use std::collections::BTreeMap;

use trueaxis::frame_finder::StreamStatistics;
use trueaxis::health::HEALTH_ITEMS;
use trueaxis::service_frame::{Answer, AnswerFinder, Request};
use trueaxis::{Status, TelemetryFrame, telemetry};

use crate::machine::{Ending, Machine};
use crate::ticks;

/// Bytes on the telemetry line, and what they say.
#[derive(Debug, Clone, Default)]
pub struct Telemetry {
    /// Every frame.
    pub frames: Vec<TelemetryFrame>,
    /// Health items as they were last told.
    pub health: BTreeMap<u8, u32>,
    /// What the bytes were besides.
    pub statistics: StreamStatistics,
}

impl Telemetry {
    /// Reads what was sent.
    pub fn of(bytes: &[u8]) -> Self {
        let mut finder = telemetry::Decoder::new();
        let frames: Vec<_> = bytes.iter().filter_map(|byte| finder.push(*byte)).collect();
        let health = frames
            .iter()
            .map(|frame| (frame.health.index, frame.health.value));
        Self {
            health: health.collect(),
            frames,
            statistics: *finder.statistics(),
        }
    }

    /// Reads what was sent since it was last taken.
    pub fn take(machine: &mut Machine) -> Self {
        Self::of(&std::mem::take(&mut machine.board().usarts[0].sent))
    }

    /// Whether every health item was told.
    pub fn is_whole(&self) -> bool {
        HEALTH_ITEMS
            .iter()
            .all(|index| self.health.contains_key(index))
    }

    /// A health item.
    ///
    /// # Panics
    /// It was not told.
    pub fn item(&self, index: u8) -> u32 {
        *self
            .health
            .get(&index)
            .unwrap_or_else(|| panic!("health item {index} was not told"))
    }

    /// Whether every frame has these status bits, or none has.
    ///
    /// # Panics
    /// Some have and some have not, or there is no frame.
    pub fn all_have(&self, status: Status) -> bool {
        let with = self
            .frames
            .iter()
            .filter(|frame| frame.output.status.bits() & status.bits() != 0);
        match with.count() {
            0 if !self.frames.is_empty() => false,
            count if count == self.frames.len() && count > 0 => true,
            count => panic!("{count} of {} frames have {status:?}", self.frames.len()),
        }
    }
}

/// Sends a request to a unit and waits for the answer, at most `ms`; `pause_us` between two bytes.
///
/// # Returns
/// The answer, or how the run ended before it came.
pub fn ask(
    machine: &mut Machine,
    request: &Request,
    pause_us: u64,
    ms: u64,
) -> Result<Option<Answer>, Ending> {
    let begun = machine.board().now;
    let usart = &mut machine.board().usarts[0];
    let already = usart.sent.len();
    let bytes = (1..).zip(request.to_bytes());
    usart
        .coming
        .extend(bytes.map(|(place, byte)| (begun + place * ticks::of_us(10 + pause_us), byte)));
    let end = begun + ticks::of_ms(ms);
    while machine.board().now < end {
        let ending = {
            let until = machine.board().now + ticks::of_us(200);
            machine.run(until)
        };
        let mut finder = AnswerFinder::new();
        let sent = &machine.board().usarts[0].sent[already..];
        let answer = sent.iter().find_map(|byte| {
            finder
                .push(*byte)
                .filter(|answer| answer.number == request.number)
        });
        match (answer, ending) {
            (Some(answer), _) => return Ok(Some(answer)),
            (None, Ending::Time) => {}
            (None, ending) => return Err(ending),
        }
    }
    Ok(None)
}
