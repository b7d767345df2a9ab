//! Encodes increments in the style of common inertial units: short messages at the output rate in HDLC-like frames, and a
//! control message now and then.
//!
//! # Frame
//! As PPP's in octet-stuffed HDLC-like framing (RFC 1662, 4.2): 0x7E, the message and its check sum with every 0x7E and
//! 0x7D among them sent as 0x7D and the byte XOR 0x20, 0x7E. The flag that ends a frame may begin the next one; here each
//! frame has both. The check sum is the frame check sequence of that document, CRC-16/IBM-SDLC (polynomial 0x1021
//! reflected, initial 0xFFFF, inverted), low byte first, over the message before stuffing.
//!
//! # Messages
//! Little-endian.
//!
//! | bytes | increments, 36 bytes |
//! |---|---|
//! | 0 | 0x01 |
//! | 1 | [`INERTIAL_VERSION`] |
//! | 2..4 | counter, u16: output periods since start, wraps |
//! | 4..6 | pulses per second before the period's first sample, u16, wraps; 0 for no time yet |
//! | 6..10 | time from the last of them to the latch of that sample, u32 \[ns\]; 0xFFFF_FFFF for no time |
//! | 10 | summary, below |
//! | 11 | 0 |
//! | 12..24 | Δθ x, y, z, i32, codes of [`OUTPUT_RAD_PER_CODE`](crate::OUTPUT_RAD_PER_CODE) |
//! | 24..36 | Δv x, y, z, i32, codes of [`OUTPUT_M_S_PER_CODE`](crate::OUTPUT_M_S_PER_CODE) |
//!
//! | bytes | control, 20 bytes |
//! |---|---|
//! | 0 | 0x02 |
//! | 1 | [`INERTIAL_VERSION`] |
//! | 2 | index of the health item, table in [`health`](crate::unit::health) |
//! | 3 | 0 |
//! | 4..8 | its value, u32 |
//! | 8..12 | [`Status`] bits of every output period since the control message before, u32 |
//! | 12..16 | sequence of the last of these periods, u32 |
//! | 16..20 | the last second by the bank's clock, u32 \[1/16 µs\] |
//!
//! | summary bit | set while |
//! |---|---|
//! | 0 | a fault of service stands in this period |
//! | 1 | the boot had a finding: nominal or foreign parameters, a bad slot, the internal oscillator |
//! | 2 | the flexure term is off |
//! | 3 | the period lacks a sample, or is the stream's first |
//! | 4 | the time is known |
//!
//! Increments are those of the frame, in the body frame at the period's start, coning and sculling included; a receiver
//! that misses a counter has lost their angle.
//!
//! # Rates
//! The parameter block decides: sample rate over samples per output. A control message follows every
//! [`CONTROL_EVERY`]-th one of increments.
//!
//! | increments a second | from | bytes/s, at most with every byte stuffed | baud needed |
//! |---|---|---|---|
//! | 600 | 4200 Hz, 7 samples | 25 320, 49 680 | 253 200, 496 800 |
//! | 1000 | 4000 Hz, 4 samples | 42 200, 82 800 | 422 000, 828 000 |
//! | 1800 | 5400 Hz, 3 samples | 75 960, 149 040 | 759 600, 1 490 400 |
//!
//! One byte in 128 of random content is stuffed. `docs/inertial_message.py` decodes the messages, standard library alone.

use crc::{CRC_16_IBM_SDLC, Crc, NoTable};

use crate::chain::faults::Status;
use crate::unit::health::{HEALTH_ITEMS, HealthItem};
use crate::unit::telemetry_frame::TelemetryFrame;

/// Raised with every change of a message's layout.
pub const INERTIAL_VERSION: u8 = 1;

/// Messages of increments from one control message to the next.
pub const CONTROL_EVERY: u8 = 10;

/// Each health item has its turn in a control message, too: the two strides have no common factor.
const _: () = {
    let (mut a, mut b) = (HEALTH_ITEMS.len(), CONTROL_EVERY as usize);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    assert!(a == 1);
};

/// Bytes of the message of increments, without frame.
pub const INCREMENTS_BYTES: usize = 36;

/// Bytes of the control message, without frame.
pub const CONTROL_BYTES: usize = 20;

/// Most bytes that one output period gives: both messages with every byte stuffed, between flags.
pub const MOST_BYTES: usize = 2 * (INCREMENTS_BYTES + 2 + CONTROL_BYTES + 2) + 4;

const FLAG: u8 = 0x7E;
const ESCAPE: u8 = 0x7D;
const TOGGLE: u8 = 0x20;

const INCREMENTS: u8 = 1;
const CONTROL: u8 = 2;

/// Bitwise: 36 bytes an output period, in the main loop.
const FCS: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_IBM_SDLC);

/// Time of a message without one.
const NO_TIME: u32 = u32::MAX;

/// A message of increments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct IncrementsMessage {
    /// Output periods since start, wraps.
    pub counter: u16,
    /// Pulses per second before the period's first sample, wraps.
    pub pulses: u16,
    /// Time from the last of them to that sample's latch \[ns\]; `None` if it is not known.
    pub since_pulse_ns: Option<u32>,
    /// Summary of the status, bits of the table above.
    pub summary: u8,
    /// Δθ \[codes\].
    pub dtheta_codes: [i32; 3],
    /// Δv \[codes\].
    pub dvel_codes: [i32; 3],
}

/// A control message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ControlMessage {
    /// The health item whose turn it was.
    pub health: HealthItem,
    /// Status bits since the control message before.
    pub status: Status,
    /// Sequence of the last output period.
    pub sequence: u32,
    /// The last second by the bank's clock \[1/16 µs\].
    pub second: u32,
}

/// Either message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum InertialMessage {
    /// Increments of one output period.
    Increments(IncrementsMessage),
    /// State of the unit.
    Control(ControlMessage),
}

/// The summary of a status.
fn summary(status: Status, has_time: bool) -> u8 {
    let boot = Status::CLOCK_FALLBACK
        .union(Status::PARAMETERS_DEFAULT)
        .union(Status::PARAMETERS_FOREIGN)
        .union(Status::PARAMETER_SLOT_BAD);
    let gap = Status::GAP.union(Status::PRIMED);
    let any = |of: Status| status.bits() & of.bits() != 0;
    u8::from(any(Status::IN_SERVICE_FAULTS))
        | u8::from(any(boot)) << 1
        | u8::from(any(Status::DYNAMIC_TERM_OFF)) << 2
        | u8::from(any(gap)) << 3
        | u8::from(has_time) << 4
}

impl IncrementsMessage {
    /// The message of a frame.
    pub fn of(frame: &TelemetryFrame) -> Self {
        let since_pulse_ns = frame.time.nanoseconds();
        Self {
            counter: frame.output.sequence as u16,
            pulses: frame.time.pulses as u16,
            since_pulse_ns,
            summary: summary(frame.output.status, since_pulse_ns.is_some()),
            dtheta_codes: frame.output.dtheta_codes,
            dvel_codes: frame.output.dvel_codes,
        }
    }

    /// The message without its frame.
    pub fn to_bytes(&self) -> [u8; INCREMENTS_BYTES] {
        let mut bytes = [0; INCREMENTS_BYTES];
        let [c0, c1] = self.counter.to_le_bytes();
        let [p0, p1] = self.pulses.to_le_bytes();
        let [t0, t1, t2, t3] = self.since_pulse_ns.unwrap_or(NO_TIME).to_le_bytes();
        let head = [
            [INCREMENTS, INERTIAL_VERSION, c0, c1],
            [p0, p1, t0, t1],
            [t2, t3, self.summary, 0],
        ];
        let codes = self.dtheta_codes.iter().chain(&self.dvel_codes);
        let words = head.into_iter().chain(codes.map(|code| code.to_le_bytes()));
        for (place, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *place = word;
        }
        bytes
    }
}

impl ControlMessage {
    /// The message without its frame.
    pub fn to_bytes(&self) -> [u8; CONTROL_BYTES] {
        let mut bytes = [0; CONTROL_BYTES];
        let words = [
            [CONTROL, INERTIAL_VERSION, self.health.index, 0],
            self.health.value.to_le_bytes(),
            self.status.bits().to_le_bytes(),
            self.sequence.to_le_bytes(),
            self.second.to_le_bytes(),
        ];
        for (place, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *place = word;
        }
        bytes
    }
}

impl InertialMessage {
    /// Decodes a message without its frame; `None` where it is none of this version.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (words, rest) = bytes.as_chunks::<4>();
        if !rest.is_empty() {
            return None;
        }
        let word = |at: usize| words.get(at).copied().unwrap_or_default();
        let unsigned = |at: usize| u32::from_le_bytes(word(at));
        let [kind, version, a, b] = word(0);
        match (kind, version, bytes.len()) {
            (INCREMENTS, INERTIAL_VERSION, INCREMENTS_BYTES) => {
                let [p0, p1, t0, t1] = word(1);
                let [t2, t3, summary, _] = word(2);
                let since = u32::from_le_bytes([t0, t1, t2, t3]);
                let axes = |from: usize| {
                    core::array::from_fn(|axis| i32::from_le_bytes(word(from + axis)))
                };
                Some(Self::Increments(IncrementsMessage {
                    counter: u16::from_le_bytes([a, b]),
                    pulses: u16::from_le_bytes([p0, p1]),
                    since_pulse_ns: (since != NO_TIME).then_some(since),
                    summary,
                    dtheta_codes: axes(3),
                    dvel_codes: axes(6),
                }))
            }
            (CONTROL, INERTIAL_VERSION, CONTROL_BYTES) => Some(Self::Control(ControlMessage {
                health: HealthItem {
                    index: a,
                    value: unsigned(1),
                },
                status: Status::from_bits(unsigned(2)),
                sequence: unsigned(3),
                second: unsigned(4),
            })),
            _ => None,
        }
    }
}

/// Makes the messages of successive frames. It runs where the frames are sent, not in the interrupt.
#[derive(Debug, Clone, Default)]
pub struct InertialEncoder {
    since_control: u8,
    status: u32,
}

/// Bytes for the line.
#[derive(Debug, Clone)]
pub struct LineBytes {
    bytes: [u8; MOST_BYTES],
    length: usize,
}

impl LineBytes {
    /// The bytes, in the order of sending.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or(&self.bytes)
    }

    fn put(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
            self.length += 1;
        }
    }

    fn put_frame(&mut self, message: &[u8]) {
        self.put(FLAG);
        let fcs = FCS.checksum(message).to_le_bytes();
        for byte in message.iter().chain(&fcs) {
            if matches!(*byte, FLAG | ESCAPE) {
                self.put(ESCAPE);
                self.put(byte ^ TOGGLE);
            } else {
                self.put(*byte);
            }
        }
        self.put(FLAG);
    }
}

impl InertialEncoder {
    /// Before the first frame.
    pub const fn new() -> Self {
        Self {
            since_control: 0,
            status: 0,
        }
    }

    /// The frame's message of increments on the line, and every [`CONTROL_EVERY`]-th time a control message behind it.
    #[must_use = "a message that is not sent is lost with its angle"]
    pub fn encode(&mut self, frame: &TelemetryFrame) -> LineBytes {
        let mut line = LineBytes {
            bytes: [0; MOST_BYTES],
            length: 0,
        };
        line.put_frame(&IncrementsMessage::of(frame).to_bytes());
        self.status |= frame.output.status.bits();
        self.since_control += 1;
        if self.since_control >= CONTROL_EVERY {
            self.since_control = 0;
            let control = ControlMessage {
                health: frame.health,
                status: Status::from_bits(core::mem::take(&mut self.status)),
                sequence: frame.output.sequence,
                second: frame.time.second,
            };
            line.put_frame(&control.to_bytes());
        }
        line
    }
}

/// Finds messages in a stream of bytes.
#[derive(Debug, Clone)]
pub struct InertialDecoder {
    buffer: [u8; INCREMENTS_BYTES + 2],
    filled: usize,
    escaped: bool,
    /// The bytes since the last flag cannot be a frame.
    spoilt: bool,
    refused: u32,
}

impl Default for InertialDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl InertialDecoder {
    /// Before the first byte: bytes before the first flag belong to no frame.
    pub const fn new() -> Self {
        Self {
            buffer: [0; INCREMENTS_BYTES + 2],
            filled: 0,
            escaped: false,
            spoilt: true,
            refused: 0,
        }
    }

    /// Takes one byte; gives a message when it was the flag behind it.
    pub fn push(&mut self, byte: u8) -> Option<InertialMessage> {
        match byte {
            FLAG => return self.end(),
            ESCAPE if !self.escaped => self.escaped = true,
            _ => {
                let byte = if core::mem::take(&mut self.escaped) {
                    byte ^ TOGGLE
                } else {
                    byte
                };
                match self.buffer.get_mut(self.filled) {
                    Some(place) => {
                        *place = byte;
                        self.filled += 1;
                    }
                    None => self.spoilt = true,
                }
            }
        }
        None
    }

    /// Frames that were damaged, too long, or of another version.
    pub fn refused(&self) -> u32 {
        self.refused
    }

    fn end(&mut self) -> Option<InertialMessage> {
        let whole = self.buffer.get(..self.filled).unwrap_or(&[]);
        let message = whole
            .split_last_chunk::<2>()
            .filter(|(message, fcs)| FCS.checksum(message) == u16::from_le_bytes(**fcs))
            .and_then(|(message, _)| InertialMessage::from_bytes(message));
        // An escape before a flag gives the frame up (RFC 1662, 4.3).
        let good = message.filter(|_| !self.spoilt && !self.escaped);
        let was_empty = self.filled == 0 && !self.escaped;
        if good.is_none() && !was_empty {
            self.refused = self.refused.saturating_add(1);
        }
        (self.filled, self.escaped, self.spoilt) = (0, false, false);
        good
    }
}
