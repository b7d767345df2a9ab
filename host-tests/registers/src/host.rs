//! The other end of the serial lines: telemetry, health items, and a sender of requests.

use std::collections::BTreeMap;

use trueaxis::frame_finder::StreamStatistics;
use trueaxis::health::HEALTH_ITEMS;
use trueaxis::image::{HEADER_BYTES, PIECE_BYTES};
use trueaxis::image_layout::IMAGE_HEADER_BYTES;
use trueaxis::service_frame::{Answer, AnswerFinder, DATA_BYTES, Request, RequestKind};
use trueaxis::{Parameters, Status, TelemetryFrame, telemetry};

use crate::machine::{Ending, Machine};
use crate::ticks;

/// Decoded bytes of the telemetry line.
#[derive(Debug, Clone, Default)]
pub struct Telemetry {
    /// Every frame.
    pub frames: Vec<TelemetryFrame>,
    /// Latest health items.
    pub health: BTreeMap<u8, u32>,
    /// Statistics of the other bytes.
    pub statistics: StreamStatistics,
}

impl Telemetry {
    /// Decodes sent bytes.
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

    /// Decodes the bytes sent since the last call.
    pub fn take(machine: &mut Machine) -> Self {
        Self::of(&std::mem::take(&mut machine.board().usarts[0].sent))
    }

    /// True if every health item was sent.
    pub fn is_whole(&self) -> bool {
        HEALTH_ITEMS
            .iter()
            .all(|index| self.health.contains_key(index))
    }

    /// A health item.
    ///
    /// # Panics
    /// The item was not sent.
    pub fn item(&self, index: u8) -> u32 {
        *self
            .health
            .get(&index)
            .unwrap_or_else(|| panic!("health item {index} was not told"))
    }

    /// True if every frame has these status bits, false if none has.
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
/// The answer, or the run's ending before it came.
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

/// A parameter block of this generation, distinguishable by its `number`.
pub fn block(number: u32, generation: u32) -> Vec<u8> {
    let bias_rad_s = [1e-6 * f64::from(number), -2e-6, 3e-6];
    let parameters = Parameters::default().with(|p| p.bias_rad_s = bias_rad_s);
    parameters.to_block(generation).to_vec()
}

/// Sends a block to a stopped unit and asks it to store it.
///
/// # Returns
/// The answer to that, or the run's ending before it came.
///
/// # Panics
/// The unit does not answer, or does not take a piece of the block.
pub fn upload(machine: &mut Machine, block: &[u8]) -> Result<Answer, Ending> {
    let begin = Request::new(2, RequestKind::Begin, block.len() as u16);
    let pieces = block.chunks(DATA_BYTES).enumerate();
    let data =
        pieces.map(|(at, piece)| Request::data(3 + at as u8, (at * DATA_BYTES) as u16, piece));
    for request in std::iter::once(begin).chain(data) {
        let answer = ask(machine, &request, 0, 20)?.expect("a stopped unit answers");
        assert_eq!((answer.outcome, answer.stopped), (0, true), "{request:?}");
    }
    let store = Request::new(200, RequestKind::Store, 0);
    // Erasing takes up to 2 s.
    let answer = ask(machine, &store, 0, 5_000)?;
    Ok(answer.expect("a stopped unit answers"))
}

/// Sends a firmware image to a stopped unit and asks it to store it.
///
/// # Returns
/// The answer to that, or to the first request that is refused; or the run's ending before it came.
///
/// # Panics
/// The unit does not answer.
pub fn upload_image(machine: &mut Machine, file: &[u8]) -> Result<Answer, Ending> {
    let (block, code) = file.split_at(IMAGE_HEADER_BYTES as usize);
    let header = &block[..HEADER_BYTES];
    let begin = Request::with_bytes(2, RequestKind::ImageBegin, 0, header);
    // Two sectors and one of records, 2 s each at most.
    let mut answer = ask(machine, &begin, 0, 10_000)?.expect("a stopped unit answers");
    for (at, piece) in code.chunks(PIECE_BYTES).enumerate() {
        if answer.outcome != 0 {
            return Ok(answer);
        }
        // Answers to pieces before are of no more use, and would be searched again.
        machine.board().usarts[0].sent.clear();
        let number = 3 + (at % 200) as u8;
        let data = Request::with_bytes(number, RequestKind::ImageData, at as u16, piece);
        answer = ask(machine, &data, 0, 50)?.expect("a stopped unit answers");
    }
    if answer.outcome != 0 {
        return Ok(answer);
    }
    let store = Request::new(255, RequestKind::ImageStore, 0);
    let answer = ask(machine, &store, 0, 5_000)?;
    Ok(answer.expect("a stopped unit answers"))
}
