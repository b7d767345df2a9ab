//! Encodes the telemetry frame that leaves by the serial port, and finds frames in a byte stream.
//!
//! A [`TelemetryFrame`], an [`OutputFrame`] and one [`HealthItem`], has 43 bytes, little-endian:
//!
//! | bytes | holds |
//! |---|---|
//! | 0..2 | sync, 0xEB 0x90 |
//! | 2 | [`TELEMETRY_VERSION`] |
//! | 3 | length of the whole frame, 43 |
//! | 4..8 | sequence, u32: output periods since start, wraps |
//! | 8..20 | rotation x, y, z, i32, codes of [`OUTPUT_RAD_PER_CODE`](crate::OUTPUT_RAD_PER_CODE) |
//! | 20..32 | velocity x, y, z, i32, codes of [`OUTPUT_M_S_PER_CODE`](crate::OUTPUT_M_S_PER_CODE) |
//! | 32..36 | status, u32, bits of [`Status`] |
//! | 36 | index of the health item, u8, table in [`health`](crate::unit::health) |
//! | 37..41 | its value, u32 |
//! | 41..43 | CRC-16/IBM-3740 of bytes 0..41, the counter bank's too, so that one table serves both |
//!
//! On the wire, 8 data bits, 1 start and 1 stop bit, none for parity:
//!
//! | frames a second | bytes/s | baud needed | of the board's 1 000 000 baud |
//! |---|---|---|---|
//! | 200 | 8 600 | 86 000 | 9 % |
//! | 400 | 17 200 | 172 000 | 17 % |
//! | 1000 | 43 000 | 430 000 | 43 % |
//!
//! A frame goes whole or not at all: where the queue to the port is full it is dropped and counted, and the
//! sequence number shows the gap. [`Decoder`] finds the frames in any byte stream. A random 43 bytes pass sync, version, length and check sum together with probability 2⁻⁴⁸.
//!
//! Answers to requests stand between frames ([`service_frame`](crate::wire::service_frame)). There are no time stamps: the
//! sequence number is the time, and its period is a health item. Frames with a time against a pulse per second are those of
//! [`inertial_message`](crate::wire::inertial_message).

use core::fmt;

use crc::{CRC_16_IBM_3740, Crc};

use crate::chain::faults::Status;
use crate::chain::sample::OutputFrame;
use crate::unit::health::HealthItem;
use crate::unit::telemetry_frame::TelemetryFrame;
use crate::wire::frame_finder::{FrameFinder, WireFrame};

pub use crate::wire::frame_finder::StreamStatistics;

/// Raised with every change of the layout.
pub const TELEMETRY_VERSION: u8 = 1;

/// Bytes in a frame.
pub const TELEMETRY_BYTES: usize = 43;

/// Bytes that the CRC covers.
const CHECKED_BYTES: usize = 41;

/// Beginning of every frame. 0xEB90 is the sync word that telemetry standards chose for its low correlation with itself
/// shifted (IRIG 106 appendix C).
const HEADER: [u8; 4] = [0xEB, 0x90, TELEMETRY_VERSION, TELEMETRY_BYTES as u8];

/// Finds every error of up to 3 bits and every burst up to 16.
const FRAME_CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// Reason that 43 bytes are not a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TelemetryError {
    /// They do not begin with sync, version and length.
    Header,
    /// The check sum does not match.
    Checksum,
}

impl fmt::Display for TelemetryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Header => write!(
                f,
                "no telemetry frame: expected sync EB 90, version {TELEMETRY_VERSION} and length {TELEMETRY_BYTES}"
            ),
            Self::Checksum => f.write_str("the telemetry frame's CRC-16 does not match"),
        }
    }
}

impl core::error::Error for TelemetryError {}

impl TelemetryFrame {
    /// The frame on the wire.
    pub fn to_bytes(&self) -> [u8; TELEMETRY_BYTES] {
        let mut bytes = [0; TELEMETRY_BYTES];
        let OutputFrame {
            sequence,
            dtheta_codes: [x, y, z],
            dvel_codes: [u, v, w],
            status,
        } = self.output;
        let words = [
            HEADER,
            sequence.to_le_bytes(),
            x.to_le_bytes(),
            y.to_le_bytes(),
            z.to_le_bytes(),
            u.to_le_bytes(),
            v.to_le_bytes(),
            w.to_le_bytes(),
            status.bits().to_le_bytes(),
        ];
        for (place, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *place = word;
        }
        let value = self.health.value.to_le_bytes();
        bytes[36] = self.health.index;
        [bytes[37], bytes[38], bytes[39], bytes[40]] = value;
        [bytes[41], bytes[42]] = checksum(&bytes).to_le_bytes();
        bytes
    }

    /// The inverse of [`TelemetryFrame::to_bytes`].
    pub fn from_bytes(bytes: &[u8; TELEMETRY_BYTES]) -> Result<Self, TelemetryError> {
        if !bytes.starts_with(&HEADER) {
            return Err(TelemetryError::Header);
        }
        if checksum(bytes).to_le_bytes() != [bytes[41], bytes[42]] {
            return Err(TelemetryError::Checksum);
        }
        let mut words = [[0; 4]; 9];
        for (word, chunk) in words.iter_mut().zip(bytes.as_chunks::<4>().0) {
            *word = *chunk;
        }
        let [_, sequence, x, y, z, u, v, w, status] = words;
        Ok(Self::new(
            OutputFrame {
                sequence: u32::from_le_bytes(sequence),
                dtheta_codes: [x, y, z].map(i32::from_le_bytes),
                dvel_codes: [u, v, w].map(i32::from_le_bytes),
                status: Status::from_bits(u32::from_le_bytes(status)),
            },
            HealthItem {
                index: bytes[36],
                value: u32::from_le_bytes([bytes[37], bytes[38], bytes[39], bytes[40]]),
            },
        ))
    }
}

fn checksum(bytes: &[u8; TELEMETRY_BYTES]) -> u16 {
    let covered = bytes.first_chunk::<CHECKED_BYTES>();
    FRAME_CRC.checksum(covered.unwrap_or(&[0; CHECKED_BYTES]))
}

impl WireFrame<TELEMETRY_BYTES> for TelemetryFrame {
    const HEADER: [u8; 4] = HEADER;

    fn decode(bytes: &[u8; TELEMETRY_BYTES]) -> Option<Self> {
        Self::from_bytes(bytes).ok()
    }

    fn number(&self) -> u32 {
        self.output.sequence
    }
}

/// Finds telemetry frames in a stream of bytes.
pub type Decoder = FrameFinder<TelemetryFrame, TELEMETRY_BYTES>;
