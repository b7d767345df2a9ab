//! Encodes requests to the unit over the telemetry port, and its answers.
//!
//! A [`Request`] has 44 bytes, little-endian:
//!
//! | bytes | holds |
//! |---|---|
//! | 0..2 | sync, 0x9A 0x5C |
//! | 2 | [`SERVICE_VERSION`] |
//! | 3 | length of the whole frame, 44 |
//! | 4 | number, u8, which the answer repeats |
//! | 5 | kind ([`RequestKind`]) |
//! | 6..8 | u16: of `begin` the bytes of the block, of `data` where its bytes belong, of `image_data` the number of the piece |
//! | 8 | of `data`, `image_begin` and `image_data` number of valid bytes that follow |
//! | 9 | 0 |
//! | 10..42 | of `data` bytes of the block, of `image_begin` the image's header, of `image_data` a piece of its code |
//! | 42..44 | CRC-16/IBM-3740 of bytes 0..42 |
//!
//! An [`Answer`] has 18 bytes:
//!
//! | bytes | holds |
//! |---|---|
//! | 0..2 | sync, 0x9A 0x5D |
//! | 2 | [`SERVICE_VERSION`] |
//! | 3 | length of the whole frame, 18 |
//! | 4 | number of the request |
//! | 5 | its kind |
//! | 6 | outcome, 0 for done ([`service`](crate::service) has the others) |
//! | 7 | 1 while the unit is stopped, 0 while it samples |
//! | 8..12 | u32: detail of the outcome |
//! | 12..16 | u32: the kinds of terms that the build has, bit n for kind n |
//! | 16..18 | CRC-16/IBM-3740 of bytes 0..16 |
//!
//! While the unit samples it looks at its receiver once a period: bytes must then come no faster, so a sender leaves a
//! millisecond between them until an answer reports the unit stopped. An answer stands between two telemetry frames,
//! never within one.

use crc::{CRC_16_IBM_3740, Crc, NoTable};

use crate::wire::frame_finder::{FrameFinder, WireFrame};

/// Raised with every change of the layouts.
pub const SERVICE_VERSION: u8 = 1;

/// Bytes of a request.
pub const REQUEST_BYTES: usize = 44;

/// Bytes of an answer.
pub const ANSWER_BYTES: usize = 18;

/// Bytes of a block that one request holds.
pub const DATA_BYTES: usize = 32;

const REQUEST_HEADER: [u8; 4] = [0x9A, 0x5C, SERVICE_VERSION, REQUEST_BYTES as u8];
const ANSWER_HEADER: [u8; 4] = [0x9A, 0x5D, SERVICE_VERSION, ANSWER_BYTES as u8];

/// Finds every error of up to 3 bits and every burst up to 16. Bitwise: requests are few, and a table takes 512 bytes of flash.
const FRAME_CRC: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_IBM_3740);

/// Kinds of requests to the unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum RequestKind {
    /// To report its state: stopped or sampling.
    State = 0,
    /// To stop sampling.
    Stop = 1,
    /// To take a parameter block of so many bytes.
    Begin = 2,
    /// To take these bytes of it.
    Data = 3,
    /// To check the block and to store it.
    Store = 4,
    /// To start anew, with the parameters in force.
    Restart = 5,
    /// To take a firmware image with this header, and to erase its slot.
    ImageBegin = 6,
    /// To take this piece of its code.
    ImageData = 7,
    /// To check the image and to try it at the next start.
    ImageStore = 8,
    /// To report the running image.
    ImageState = 9,
    /// To report the results of the built-in test.
    SelfTest = 10,
    /// To start anew with the whole built-in test, and to stay stopped.
    RunSelfTest = 11,
}

impl RequestKind {
    /// The kind of this number, if it is one.
    pub const fn from_number(number: u8) -> Option<Self> {
        Some(match number {
            0 => Self::State,
            1 => Self::Stop,
            2 => Self::Begin,
            3 => Self::Data,
            4 => Self::Store,
            5 => Self::Restart,
            6 => Self::ImageBegin,
            7 => Self::ImageData,
            8 => Self::ImageStore,
            9 => Self::ImageState,
            10 => Self::SelfTest,
            11 => Self::RunSelfTest,
            _ => return None,
        })
    }

    /// True of requests about firmware images.
    pub const fn is_about_images(self) -> bool {
        matches!(
            self,
            Self::ImageBegin | Self::ImageData | Self::ImageStore | Self::ImageState
        )
    }
}

/// One request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Request {
    /// Its number, which the answer repeats.
    pub number: u8,
    /// Number of its [`RequestKind`].
    pub kind: u8,
    /// Bytes of the block, or where the data belong.
    pub word: u16,
    /// Number of valid data bytes.
    pub count: u8,
    /// Bytes of the block.
    pub data: [u8; DATA_BYTES],
}

impl Request {
    /// A request without data; `word`: of [`RequestKind::Begin`] the bytes of the block, else 0.
    pub fn new(number: u8, kind: RequestKind, word: u16) -> Self {
        Self {
            number,
            kind: kind as u8,
            word,
            ..Self::default()
        }
    }

    /// A request with the first [`DATA_BYTES`] of `bytes`, which belong at `offset` of the block.
    pub fn data(number: u8, offset: u16, bytes: &[u8]) -> Self {
        Self::with_bytes(number, RequestKind::Data, offset, bytes)
    }

    /// A request with the first [`DATA_BYTES`] of `bytes`.
    pub fn with_bytes(number: u8, kind: RequestKind, word: u16, bytes: &[u8]) -> Self {
        let mut request = Self::new(number, kind, word);
        for (place, byte) in request.data.iter_mut().zip(bytes) {
            *place = *byte;
        }
        request.count = bytes.len().min(DATA_BYTES) as u8;
        request
    }

    /// The valid bytes.
    pub fn bytes(&self) -> &[u8] {
        self.data
            .get(..usize::from(self.count))
            .unwrap_or(&self.data)
    }

    /// The request on the wire.
    pub fn to_bytes(&self) -> [u8; REQUEST_BYTES] {
        let [low, high] = self.word.to_le_bytes();
        let head = [self.number, self.kind, low, high, self.count, 0];
        let content = REQUEST_HEADER.into_iter().chain(head).chain(self.data);
        sealed::<REQUEST_BYTES, { REQUEST_BYTES - 2 }>(content)
    }
}

impl WireFrame<REQUEST_BYTES> for Request {
    const HEADER: [u8; 4] = REQUEST_HEADER;

    fn decode(bytes: &[u8; REQUEST_BYTES]) -> Option<Self> {
        if !is_whole::<{ REQUEST_BYTES - 2 }>(bytes, REQUEST_HEADER) {
            return None;
        }
        let mut data = [0; DATA_BYTES];
        for (place, byte) in data.iter_mut().zip(bytes.iter().skip(10)) {
            *place = *byte;
        }
        Some(Self {
            number: bytes[4],
            kind: bytes[5],
            word: u16::from_le_bytes([bytes[6], bytes[7]]),
            count: bytes[8],
            data,
        })
    }

    fn number(&self) -> u32 {
        u32::from(self.number)
    }
}

/// One answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Answer {
    /// Number of the request.
    pub number: u8,
    /// Its kind.
    pub kind: u8,
    /// 0 for done, else the refusal's code.
    pub outcome: u8,
    /// True if the unit is stopped.
    pub stopped: bool,
    /// Detail of the outcome.
    pub detail: u32,
    /// The kinds of terms that the build has ([`TermKinds::bits`](crate::chain::terms::TermKinds::bits)).
    pub term_kinds: u32,
}

impl Answer {
    /// The answer on the wire.
    pub fn to_bytes(&self) -> [u8; ANSWER_BYTES] {
        let head = [self.number, self.kind, self.outcome, u8::from(self.stopped)];
        let content = ANSWER_HEADER
            .into_iter()
            .chain(head)
            .chain(self.detail.to_le_bytes())
            .chain(self.term_kinds.to_le_bytes());
        sealed::<ANSWER_BYTES, { ANSWER_BYTES - 2 }>(content)
    }
}

impl WireFrame<ANSWER_BYTES> for Answer {
    const HEADER: [u8; 4] = ANSWER_HEADER;

    fn decode(bytes: &[u8; ANSWER_BYTES]) -> Option<Self> {
        if !is_whole::<{ ANSWER_BYTES - 2 }>(bytes, ANSWER_HEADER) {
            return None;
        }
        let word = |at: [u8; 4]| u32::from_le_bytes(at);
        Some(Self {
            number: bytes[4],
            kind: bytes[5],
            outcome: bytes[6],
            stopped: bytes[7] != 0,
            detail: word([bytes[8], bytes[9], bytes[10], bytes[11]]),
            term_kinds: word([bytes[12], bytes[13], bytes[14], bytes[15]]),
        })
    }

    fn number(&self) -> u32 {
        u32::from(self.number)
    }
}

/// Takes requests from a line that brings nothing else. It does not search the bytes of a damaged one again, as
/// [`FrameFinder`] would: the sender gets no answer and sends it again.
#[derive(Debug, Clone)]
pub struct RequestReceiver {
    buffer: [u8; REQUEST_BYTES],
    filled: usize,
}

impl Default for RequestReceiver {
    fn default() -> Self {
        Self {
            buffer: [0; REQUEST_BYTES],
            filled: 0,
        }
    }
}

impl RequestReceiver {
    /// Before the first byte.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes one byte; gives a request when it was the request's last.
    #[inline(never)]
    pub fn push(&mut self, byte: u8) -> Option<Request> {
        if REQUEST_HEADER
            .get(self.filled)
            .is_some_and(|due| *due != byte)
        {
            self.filled = 0;
        }
        if self.filled == 0 && byte != REQUEST_HEADER[0] {
            return None;
        }
        if let Some(place) = self.buffer.get_mut(self.filled) {
            *place = byte;
            self.filled += 1;
        }
        if self.filled < REQUEST_BYTES {
            return None;
        }
        self.filled = 0;
        Request::decode(&self.buffer)
    }
}

/// Finds answers in a stream of bytes, such as that of the telemetry port.
pub type AnswerFinder = FrameFinder<Answer, ANSWER_BYTES>;

/// A frame of `COVERED` bytes of content and their CRC.
fn sealed<const BYTES: usize, const COVERED: usize>(
    content: impl Iterator<Item = u8>,
) -> [u8; BYTES] {
    let mut bytes = [0; BYTES];
    for (place, byte) in bytes.iter_mut().zip(content) {
        *place = byte;
    }
    let sum = checksum::<COVERED>(&bytes);
    for (place, byte) in bytes.iter_mut().skip(COVERED).zip(sum) {
        *place = byte;
    }
    bytes
}

/// True if bytes begin with a header and end with the CRC of the first `COVERED` of them.
fn is_whole<const COVERED: usize>(bytes: &[u8], header: [u8; 4]) -> bool {
    bytes.starts_with(&header) && bytes.get(COVERED..) == Some(&checksum::<COVERED>(bytes)[..])
}

/// The CRC of the first `COVERED` bytes, as it stands in the frame.
#[inline(never)]
fn checksum<const COVERED: usize>(bytes: &[u8]) -> [u8; 2] {
    let covered = bytes.first_chunk::<COVERED>();
    FRAME_CRC
        .checksum(covered.unwrap_or(&[0; COVERED]))
        .to_le_bytes()
}
