//! Encodes the unit's raw stream: a frame each sampling period with the chain's whole input, so that the unit can be
//! recorded, diagnosed and replayed.
//!
//! A [`RawFrame`] has 54 bytes, little-endian:
//!
//! | bytes | holds |
//! |---|---|
//! | 0..2 | sync, 0x1A 0xCF |
//! | 2 | [`RAW_VERSION`] |
//! | 3 | length of the whole frame, 54 |
//! | 4..8 | number, u32: sampling periods since start, this one included, wraps |
//! | 8..20 | pulses of gyros x, y, z since start, i32, wrap |
//! | 20..32 | pickoff codes x, y, z, i32 |
//! | 32..44 | sums of accelerometer codes x, y, z since start, i32, wrap |
//! | 44 | sampling periods before this one without an interrupt, u8 |
//! | 45 | sampling periods that the counts cover, u8 |
//! | 46 | origin of the reading: fault (bits 0 to 3), sample (bit 4), late interrupt (bit 5) |
//! | 47 | index of an item, u8, below |
//! | 48..52 | its value, u32 |
//! | 52..54 | CRC-16/IBM-3740 of bytes 0..52, as telemetry has it |
//!
//! Items take turns, so each is sent every 26 periods, 6.5 ms at 4 kHz:
//!
//! | item | value |
//! |---|---|
//! | 0 | sample rate \[Hz\], bits of an f32 |
//! | 1 | generation of the parameters |
//! | 2 | frames dropped in the unit since start |
//! | 3, 4 | pickoff weight \[rad\], low and high word of an f64 |
//! | 5 to 10 | accelerometer weights x, y, z \[m/s\], likewise; 0 without accelerometers |
//! | 11 to 16 | pulse weights x, y, z \[rad\], likewise |
//! | 17 to 25 | temperatures \[K\], their derivatives \[K/s\], magnetic flux densities \[T\], x, y, z, bits of an f32; 0 if not measured |
//!
//! On the wire, 8 data bits, 1 start and 1 stop bit:
//!
//! | frames a second | bytes/s | baud needed | of the board's 3 000 000 baud |
//! |---|---|---|---|
//! | 4000 | 216 000 | 2 160 000 | 72 % |
//! | 5000 | 270 000 | 2 700 000 | 90 % |
//!
//! A frame goes whole or not at all: one that finds no room is dropped and counted, and the numbers show the gap.
//! Counts are running sums, so the next frame includes the counts meanwhile.

use crc::{CRC_16_IBM_3740, Crc};

use crate::chain::parameters::Parameters;
use crate::chain::terms::SlowReadings;
use crate::unit::raw_period::{RawPeriod, RawSource};
use crate::wire::frame_finder::{FrameFinder, WireFrame};

/// Raised with every change of the layout.
pub const RAW_VERSION: u8 = 1;

/// Bytes in a frame.
pub const RAW_BYTES: usize = 54;

/// Bytes that the CRC covers.
const CHECKED_BYTES: usize = 52;

/// The sync word is the first half of the attached sync marker of CCSDS 131.0-B.
const HEADER: [u8; 4] = [0x1A, 0xCF, RAW_VERSION, RAW_BYTES as u8];

/// Finds every error of up to 3 bits and every burst up to 16.
const FRAME_CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// Numbers of the items.
pub mod item {
    /// Sample rate \[Hz\], bits of an f32.
    pub const SAMPLE_RATE: u8 = 0;
    /// Generation of the parameters.
    pub const GENERATION: u8 = 1;
    /// Frames dropped in the unit.
    pub const DROPPED: u8 = 2;
    /// Pickoff weight \[rad\], first of two words.
    pub const PICKOFF_WEIGHT: u8 = 3;
    /// Accelerometer weight x \[m/s\], first of six words.
    pub const VELOCITY_WEIGHT: u8 = 5;
    /// Pulse weight x \[rad\], first of six words.
    pub const PULSE_WEIGHT: u8 = 11;
    /// Temperature x \[K\], first of three.
    pub const TEMPERATURE: u8 = 17;
    /// Derivative of temperature x \[K/s\], first of three.
    pub const TEMPERATURE_RATE: u8 = 20;
    /// Magnetic flux density x \[T\], first of three.
    pub const MAGNETIC_FIELD: u8 = 23;
    /// Number of items.
    pub const COUNT: u8 = 26;
}

/// Items that do not change in service.
const SETTINGS: usize = item::TEMPERATURE as usize;

/// The item whose turn it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RawItem {
    /// Its index.
    pub index: u8,
    /// Its value.
    pub value: u32,
}

/// The items and whose turn it is.
#[derive(Debug, Clone)]
pub struct RawItems {
    settings: [u32; SETTINGS],
    /// Slowly changing readings, as the chain's terms last had them.
    pub slow: SlowReadings,
    /// Frames dropped so far.
    pub dropped: u32,
    next: u8,
}

impl RawItems {
    /// Of a unit that runs with `parameters` of this generation.
    pub fn new(parameters: &Parameters, generation: u32) -> Self {
        let velocity_weights = parameters
            .accelerometers
            .map_or([0.0; 3], |known| known.weight_m_s);
        let words = [(parameters.sample_rate_hz as f32).to_bits(), generation, 0];
        let weights = [parameters.pickoff_weight_rad]
            .into_iter()
            .chain(velocity_weights)
            .chain(parameters.pulse_weight_rad)
            .flat_map(|weight| {
                let bits = weight.to_bits();
                [bits as u32, (bits >> 32) as u32]
            });
        let mut settings = [0; SETTINGS];
        for (place, word) in settings.iter_mut().zip(words.into_iter().chain(weights)) {
            *place = word;
        }
        Self {
            settings,
            slow: SlowReadings::default(),
            dropped: 0,
            next: 0,
        }
    }

    /// The item whose turn it is; the next one is next.
    pub fn turn(&mut self) -> RawItem {
        let index = self.next;
        self.next = if index + 1 < item::COUNT {
            index + 1
        } else {
            0
        };
        let slow = [
            self.slow.temperature_k,
            self.slow.temperature_rate_k_s,
            self.slow.magnetic_field_t,
        ];
        let value = if index == item::DROPPED {
            self.dropped
        } else if let Some(setting) = self.settings.get(usize::from(index)) {
            *setting
        } else {
            let place = usize::from(index).saturating_sub(SETTINGS);
            let reading = slow.iter().flatten().nth(place);
            reading.map_or(0, |reading| reading.to_bits())
        };
        RawItem { index, value }
    }
}

/// One sampling period on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RawFrame {
    /// The chain's input.
    pub period: RawPeriod,
    /// The item whose turn it is.
    pub item: RawItem,
}

impl RawFrame {
    /// The frame on the wire.
    pub fn to_bytes(&self) -> [u8; RAW_BYTES] {
        let mut bytes = [0; RAW_BYTES];
        let period = &self.period;
        let flags = [
            period.missed,
            period.covered,
            period.source.bits(),
            self.item.index,
        ];
        let counts = period
            .pulse_counters
            .iter()
            .chain(&period.pickoff_codes)
            .chain(&period.velocity_counters)
            .map(|word| word.to_le_bytes());
        let words = [HEADER, period.number.to_le_bytes()]
            .into_iter()
            .chain(counts)
            .chain([flags, self.item.value.to_le_bytes()]);
        for (place, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *place = word;
        }
        [bytes[CHECKED_BYTES], bytes[CHECKED_BYTES + 1]] = checksum(&bytes).to_le_bytes();
        bytes
    }
}

impl WireFrame<RAW_BYTES> for RawFrame {
    const HEADER: [u8; 4] = HEADER;

    fn decode(bytes: &[u8; RAW_BYTES]) -> Option<Self> {
        let whole = bytes.starts_with(&HEADER)
            && checksum(bytes).to_le_bytes() == [bytes[CHECKED_BYTES], bytes[CHECKED_BYTES + 1]];
        if !whole {
            return None;
        }
        let mut words = [[0; 4]; 13];
        for (word, chunk) in words.iter_mut().zip(bytes.as_chunks::<4>().0) {
            *word = *chunk;
        }
        let [_, number, a, b, c, p, q, r, u, v, w, flags, value] = words;
        let [missed, covered, source, index] = flags;
        Some(Self {
            period: RawPeriod {
                number: u32::from_le_bytes(number),
                pulse_counters: [a, b, c].map(i32::from_le_bytes),
                pickoff_codes: [p, q, r].map(i32::from_le_bytes),
                velocity_counters: [u, v, w].map(i32::from_le_bytes),
                missed,
                covered,
                source: RawSource::from_bits(source),
            },
            item: RawItem {
                index,
                value: u32::from_le_bytes(value),
            },
        })
    }

    fn number(&self) -> u32 {
        self.period.number
    }

    fn skipped(&self) -> u32 {
        u32::from(self.period.missed)
    }
}

/// Finds raw frames in a stream of bytes.
pub type RawFinder = FrameFinder<RawFrame, RAW_BYTES>;

fn checksum(bytes: &[u8; RAW_BYTES]) -> u16 {
    let covered = bytes.first_chunk::<CHECKED_BYTES>();
    FRAME_CRC.checksum(covered.unwrap_or(&[0; CHECKED_BYTES]))
}
