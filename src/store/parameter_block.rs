//! Encodes and decodes the parameter block, written by `rlg params` and read from flash by the firmware.
//!
//! Little-endian.
//!
//! | offset | holds |
//! |---|---|
//! | 0 | magic `RLGP` |
//! | 4 | `u16` version (5 with items, 4 without; older ones are read too, below) |
//! | 6 | `u16` length of the whole block |
//! | 8 | `u16` samples per output |
//! | 10 | `u8` response of the flexure: 1 its block's mode, 0 static |
//! | 11 | `u8` 1 with accelerometers, 0 without |
//! | 12 | `u32` generation: of two whole blocks the later one counts |
//! | 16 | 60 `f64`: pulse weight ×3, bias ×3, scale ×3, installation ×6, flexure ×6, pickoff gain ×3, pickoff weight, sample rate, pickoff delay ×3, dither frequency ×3, dither amplitude ×3, adaptation time; accelerometers: weight ×3, bias ×3, scale ×3, misalignment ×6, lever arms ×9 (zeros without) |
//! | 496 | `f64` damping of that mode; 0 where the response is static |
//! | 504 | items of the unit, below; none in version 4 |
//! | then | records of optional terms, each its kind, its bytes and its values ([`records`](crate::chain::terms::records)) |
//! | last 4 | `u32` CRC-32 (ISO-HDLC, as zip) of everything before it |
//!
//! An item is its kind, `u16`, the bytes that follow, `u16`, its own version, `u16`, and its content. Each kind stands at
//! most once, before all records:
//!
//! | kind | version | content |
//! |---|---|---|
//! | 0x8001 | 1 | limits of health, 11 `f64`: temperature least, largest \[K\]; intensity least ×3; step of the path-length control; dither drive least, largest; dither amplitude least, largest; silence of the pulse per second \[s\]; 0 where not watched ([`HealthLimits`]) |
//! | 0x8002 | 1 | identity: number of the unit, 12 bytes; date of the calibration, `u32`; first 8 bytes of the model's SHA-256 ([`Identity`]) |
//! | 0x8003 | 1 | output: `u16` number of its form, 1 ([`OutputFormat`]); not there for 0, the telemetry frames |
//!
//! A block without items is written as version 4, so that firmware before items reads it. A block without an identity is one
//! of any unit: blocks of older versions are read as before. A block with one is used by the unit that it names, and by
//! firmware that does not know its own number ([`ParameterSlots::of_unit`](crate::store::parameter_slots::ParameterSlots::of_unit));
//! such firmware still takes by upload no block of another unit than the one in force names.
//!
//! Version 3 has no damping, so that its records begin at 496, and version 2 has no records either. Both have an
//! acceleration order at 10, which no longer means anything; their flexure is static, as they were calibrated.
//!
//! Choosing between two blocks is the task of [`parameter_slots`](crate::store::parameter_slots).

use core::fmt;
use core::ops::Deref;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use crate::chain::health_limits::HealthLimits;
use crate::chain::identity::{Identity, UnitNumber};
use crate::chain::output_format::OutputFormat;
use crate::chain::parameters::{
    AccelerometerParameters, FlexureResponse, ParameterError, Parameters,
};
use crate::chain::terms::records::RECORD_BYTES;
use crate::chain::triad::CrossAxis;

const MAGIC: [u8; 4] = *b"RLGP";
const VERSION: u16 = 5;
/// The version before items.
const VERSION_WITHOUT_ITEMS: u16 = 4;
/// The version before responses of the flexure.
const VERSION_WITHOUT_RESPONSE: u16 = 3;
/// The version before records.
const VERSION_WITHOUT_RECORDS: u16 = 2;
const HEADER_BYTES: usize = 16;
const NUMBERS: usize = 61;
const RECORDS_OFFSET: usize = HEADER_BYTES + 8 * NUMBERS;
/// The same without a response.
const RECORDS_OFFSET_BEFORE: usize = RECORDS_OFFSET - 8;
const CRC_BYTES: usize = 4;

/// Size of a block without records \[bytes\].
pub const PARAMETER_BLOCK_BYTES: usize = RECORDS_OFFSET + CRC_BYTES;

/// Size of a block of an older version without records \[bytes\].
const SMALLEST_BLOCK_BYTES: usize = RECORDS_OFFSET_BEFORE + CRC_BYTES;

/// Kind of the item of limits, and of the lowest item: kinds of terms are below.
const LIMITS: u16 = 0x8001;
/// Kind of the identity's item.
const IDENTITY: u16 = 0x8002;
/// Kind of the output's item.
const OUTPUT: u16 = 0x8003;
/// Version of each.
const ITEM_VERSION: u16 = 1;
/// Kind, bytes and version of an item.
const ITEM_HEADER_BYTES: usize = 6;
const LIMITS_BYTES: usize = 8 * HealthLimits::NUMBERS;
const IDENTITY_BYTES: usize = 24;
const OUTPUT_BYTES: usize = 2;
/// All items.
const ITEM_BYTES: usize = 3 * ITEM_HEADER_BYTES + LIMITS_BYTES + IDENTITY_BYTES + OUTPUT_BYTES;

/// Size of the largest block without items \[bytes\].
const LARGEST_WITHOUT_ITEMS: usize = PARAMETER_BLOCK_BYTES + RECORD_BYTES;

/// Size of the largest block \[bytes\].
pub const LARGEST_BLOCK_BYTES: usize = LARGEST_WITHOUT_ITEMS + ITEM_BYTES;

/// Bitwise: it runs once at boot, and a table would cost 1 KiB of flash.
const CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Reason that bytes are not a parameter block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BlockError {
    /// Fewer bytes than the block's own length, or than the smallest; or a length above the largest \[bytes found\].
    Length(usize),
    /// It does not begin with `RLGP`.
    Magic,
    /// A version this chain does not know.
    Version(u16),
    /// Stored and computed CRC-32 differ.
    Checksum {
        /// As stored.
        stored: u32,
        /// As computed.
        computed: u32,
    },
    /// The byte of the flexure's response is neither 0 nor 1.
    Response(u8),
    /// The byte for accelerometers is neither 0 nor 1.
    Accelerometers(u8),
    /// An item of this kind is not known, is of another version or length, or stands twice.
    Item(u16),
    /// The block is whole, but a parameter is out of range.
    Parameter(ParameterError),
}

impl fmt::Display for BlockError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(found) => write!(
                f,
                "parameter block of {found} bytes, expected {SMALLEST_BLOCK_BYTES} to {LARGEST_BLOCK_BYTES}, as it says"
            ),
            Self::Magic => f.write_str("parameter block does not begin with RLGP"),
            Self::Version(found) => {
                write!(
                    f,
                    "parameter block of version {found}, expected 2 to {VERSION}"
                )
            }
            Self::Checksum { stored, computed } => write!(
                f,
                "parameter block CRC-32 is {stored:#010x}, computed {computed:#010x}"
            ),
            Self::Response(found) => write!(
                f,
                "parameter block says {found} of its flexure's response, expected 0 (static) or 1 (mode)"
            ),
            Self::Accelerometers(found) => write!(
                f,
                "parameter block says {found} of its accelerometers, expected 0 or 1"
            ),
            Self::Item(kind) => write!(
                f,
                "parameter block has an item {kind:#06x} that is unknown, of another version or length, or there twice; \
                 expected {LIMITS:#06x}, {IDENTITY:#06x} or {OUTPUT:#06x} of version {ITEM_VERSION}"
            ),
            Self::Parameter(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for BlockError {}

/// The bytes of a parameter block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParameterBlock {
    bytes: [u8; LARGEST_BLOCK_BYTES],
    length: usize,
}

impl Deref for ParameterBlock {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or(&self.bytes)
    }
}

impl Parameters {
    /// The block of these parameters, even if they fail [`Parameters::check`].
    pub fn to_block(&self, generation: u32) -> ParameterBlock {
        let records = self.terms.bytes();
        let (items, items_length) = self.items();
        let items = items.get(..items_length).unwrap_or(&[]);
        let crc_offset = RECORDS_OFFSET + items.len() + records.len();
        let length = crc_offset + CRC_BYTES;
        let version = if items.is_empty() {
            VERSION_WITHOUT_ITEMS
        } else {
            VERSION
        };
        let mut block = [0; LARGEST_BLOCK_BYTES];
        block[0..4].copy_from_slice(&MAGIC);
        block[4..6].copy_from_slice(&version.to_le_bytes());
        block[6..8].copy_from_slice(&(length as u16).to_le_bytes());
        block[8..10].copy_from_slice(&self.samples_per_output.to_le_bytes());
        block[10] = u8::from(self.flexure_response.damping().is_some());
        block[11] = u8::from(self.accelerometers.is_some());
        block[12..16].copy_from_slice(&generation.to_le_bytes());
        let chunks = block[HEADER_BYTES..RECORDS_OFFSET].chunks_exact_mut(8);
        for (chunk, number) in chunks.zip(self.numbers()) {
            chunk.copy_from_slice(&number.to_le_bytes());
        }
        let rest = block[RECORDS_OFFSET..].iter_mut();
        for (byte, of_rest) in rest.zip(items.iter().chain(records)) {
            *byte = *of_rest;
        }
        // Without an index that is known at run time only: its panic would bring formatting into the image.
        let crc = CHECKSUM.checksum(block.get(..crc_offset).unwrap_or(&[]));
        for (byte, of_crc) in block.iter_mut().skip(crc_offset).zip(crc.to_le_bytes()) {
            *byte = of_crc;
        }
        ParameterBlock {
            bytes: block,
            length,
        }
    }

    /// The bytes of the items, and how many they are.
    fn items(&self) -> ([u8; ITEM_BYTES], usize) {
        let mut bytes = [0; ITEM_BYTES];
        let mut places = bytes.iter_mut();
        let mut length = 0;
        let mut put = |content: &[u8]| {
            length += content.len();
            // The content first: `zip` takes one of its first part more than of its second.
            for (byte, place) in content.iter().zip(places.by_ref()) {
                *place = *byte;
            }
        };
        let header = |kind: u16, content: usize, put: &mut dyn FnMut(&[u8])| {
            put(&kind.to_le_bytes());
            put(&(content as u16 + 2).to_le_bytes());
            put(&ITEM_VERSION.to_le_bytes());
        };
        if let Some(limits) = &self.limits {
            header(LIMITS, LIMITS_BYTES, &mut put);
            for number in limits.numbers() {
                put(&number.to_le_bytes());
            }
        }
        if let Some(identity) = &self.identity {
            header(IDENTITY, IDENTITY_BYTES, &mut put);
            put(&identity.unit.0);
            put(&identity.calibrated.to_le_bytes());
            put(&identity.model);
        }
        if self.output != OutputFormat::Frames {
            header(OUTPUT, OUTPUT_BYTES, &mut put);
            put(&(self.output as u16).to_le_bytes());
        }
        (bytes, length)
    }

    /// Replaces limits, identity and output by those of the items at the bytes' beginning; gives the bytes behind them.
    fn read_items<'a>(&mut self, mut bytes: &'a [u8]) -> Result<&'a [u8], BlockError> {
        while let Some((&[k0, k1, b0, b1], rest)) = bytes.split_first_chunk() {
            let kind = u16::from_le_bytes([k0, k1]);
            if kind < LIMITS {
                break;
            }
            let length = usize::from(u16::from_le_bytes([b0, b1]));
            let Some((item, rest)) = rest.split_at_checked(length) else {
                return Err(BlockError::Item(kind));
            };
            let content = item.strip_prefix(&ITEM_VERSION.to_le_bytes());
            match (kind, content.unwrap_or(&[])) {
                (LIMITS, content) if content.len() == LIMITS_BYTES && self.limits.is_none() => {
                    let mut numbers = content
                        .as_chunks::<8>()
                        .0
                        .iter()
                        .map(|chunk| f64::from_le_bytes(*chunk));
                    self.limits = Some(HealthLimits::of_numbers(take(&mut numbers)));
                }
                (IDENTITY, content)
                    if content.len() == IDENTITY_BYTES && self.identity.is_none() =>
                {
                    let mut bytes = content.iter().copied();
                    self.identity = Some(Identity {
                        unit: UnitNumber(take(&mut bytes)),
                        calibrated: u32::from_le_bytes(take(&mut bytes)),
                        model: take(&mut bytes),
                    });
                }
                (OUTPUT, &[low, high]) if self.output == OutputFormat::Frames => {
                    // The default has no item.
                    let number = u16::from_le_bytes([low, high]);
                    self.output = OutputFormat::from_number(number)
                        .filter(|output| *output != OutputFormat::Frames)
                        .ok_or(BlockError::Item(kind))?;
                }
                _ => return Err(BlockError::Item(kind)),
            }
            bytes = rest;
        }
        Ok(bytes)
    }

    /// Reads and checks a block, and gives its generation too; bytes after it are ignored.
    pub fn from_block(bytes: &[u8]) -> Result<(Self, u32), BlockError> {
        let mut parameters = Self::default();
        let generation = parameters.read_block(bytes)?;
        Ok((parameters, generation))
    }

    /// Replaces these parameters by those of a block, and gives its generation; bytes after it are ignored.
    ///
    /// # Errors
    /// The bytes are no block, or a parameter is out of range. The parameters are then of no use.
    pub fn read_block(&mut self, bytes: &[u8]) -> Result<u32, BlockError> {
        let Some((block, _)) = bytes.split_first_chunk::<RECORDS_OFFSET_BEFORE>() else {
            return Err(BlockError::Length(bytes.len()));
        };
        if block[0..4] != MAGIC {
            return Err(BlockError::Magic);
        }
        let version = u16::from_le_bytes([block[4], block[5]]);
        let (records, longest) = match version {
            VERSION_WITHOUT_RECORDS => (RECORDS_OFFSET_BEFORE, SMALLEST_BLOCK_BYTES),
            VERSION_WITHOUT_RESPONSE => (RECORDS_OFFSET_BEFORE, LARGEST_WITHOUT_ITEMS),
            VERSION_WITHOUT_ITEMS => (RECORDS_OFFSET, LARGEST_WITHOUT_ITEMS),
            VERSION => (RECORDS_OFFSET, LARGEST_BLOCK_BYTES),
            _ => return Err(BlockError::Version(version)),
        };
        let length = usize::from(u16::from_le_bytes([block[6], block[7]]));
        if !(records + CRC_BYTES..=longest).contains(&length) {
            return Err(BlockError::Length(length));
        }
        let Some((body, stored)) = bytes
            .get(..length)
            .and_then(|whole| whole.split_last_chunk::<CRC_BYTES>())
        else {
            return Err(BlockError::Length(bytes.len()));
        };
        let stored = stored
            .iter()
            .rev()
            .fold(0, |word, byte| word << 8 | u32::from(*byte));
        let computed = CHECKSUM.checksum(body);
        if stored != computed {
            return Err(BlockError::Checksum { stored, computed });
        }
        let mut numbers = block[HEADER_BYTES..]
            .as_chunks::<8>()
            .0
            .iter()
            .map(|chunk| f64::from_le_bytes(*chunk));
        let numbers = &mut numbers;
        // Fields in the order in which they are written below.
        self.pulse_weight_rad = take(numbers);
        self.bias_rad_s = take(numbers);
        self.scale_error = take(numbers);
        self.installation_rad = CrossAxis::from_array(take(numbers));
        self.flexure_s2 = CrossAxis::from_array(take(numbers));
        self.pickoff_gain = take(numbers);
        self.pickoff_weight_rad = take::<_, 1>(numbers)[0];
        self.sample_rate_hz = take::<_, 1>(numbers)[0];
        self.samples_per_output = u16::from_le_bytes([block[8], block[9]]);
        self.flexure_response = FlexureResponse::Static;
        if version >= VERSION_WITHOUT_ITEMS {
            self.flexure_response = match (block[10], body.get(RECORDS_OFFSET_BEFORE..)) {
                (0, _) => FlexureResponse::Static,
                (1, Some([a, b, c, d, e, f, g, h, ..])) => FlexureResponse::Mode {
                    damping: f64::from_le_bytes([*a, *b, *c, *d, *e, *f, *g, *h]),
                },
                (other, _) => return Err(BlockError::Response(other)),
            };
        }
        self.pickoff_delay_s = take(numbers);
        self.dither_frequency_hz = take(numbers);
        self.dither_amplitude_rad = take(numbers);
        self.adaptation_time_s = take::<_, 1>(numbers)[0];
        self.accelerometers = match block[11] {
            0 => None,
            1 => Some(AccelerometerParameters {
                weight_m_s: take(numbers),
                bias_m_s2: take(numbers),
                scale_error: take(numbers),
                misalignment_rad: CrossAxis::from_array(take(numbers)),
                lever_arm_m: [take(numbers), take(numbers), take(numbers)],
            }),
            other => return Err(BlockError::Accelerometers(other)),
        };
        (self.limits, self.identity, self.output) = (None, None, OutputFormat::Frames);
        let mut rest = body.get(records..).unwrap_or(&[]);
        if version >= VERSION {
            rest = self.read_items(rest)?;
        }
        self.terms
            .read(rest)
            .map_err(|error| BlockError::Parameter(ParameterError::Records(error)))?;
        self.check().map_err(BlockError::Parameter)?;
        Ok(u32::from_le_bytes([
            block[12], block[13], block[14], block[15],
        ]))
    }

    fn numbers(&self) -> impl Iterator<Item = f64> {
        let accelerometers = self.accelerometers.unwrap_or(AccelerometerParameters {
            weight_m_s: [0.0; 3],
            bias_m_s2: [0.0; 3],
            scale_error: [0.0; 3],
            misalignment_rad: CrossAxis::default(),
            lever_arm_m: [[0.0; 3]; 3],
        });
        self.pulse_weight_rad
            .into_iter()
            .chain(self.bias_rad_s)
            .chain(self.scale_error)
            .chain(self.installation_rad.to_array())
            .chain(self.flexure_s2.to_array())
            .chain(self.pickoff_gain)
            .chain([self.pickoff_weight_rad, self.sample_rate_hz])
            .chain(self.pickoff_delay_s)
            .chain(self.dither_frequency_hz)
            .chain(self.dither_amplitude_rad)
            .chain([self.adaptation_time_s])
            .chain(accelerometers.weight_m_s)
            .chain(accelerometers.bias_m_s2)
            .chain(accelerometers.scale_error)
            .chain(accelerometers.misalignment_rad.to_array())
            .chain(accelerometers.lever_arm_m.into_iter().flatten())
            .chain([self.flexure_response.damping().unwrap_or(0.0)])
    }
}

/// Length of a block by its own field \[bytes\].
pub(super) fn block_length(block: &[u8; LARGEST_BLOCK_BYTES]) -> usize {
    usize::from(u16::from_le_bytes([block[6], block[7]]))
}

/// Gives a whole block another generation, and the check sum that belongs to it.
pub(super) fn set_generation(block: &mut [u8], generation: u32) {
    for (byte, of_generation) in block.iter_mut().skip(12).zip(generation.to_le_bytes()) {
        *byte = of_generation;
    }
    if let Some((body, sum)) = block.split_last_chunk_mut::<CRC_BYTES>() {
        *sum = CHECKSUM.checksum(body).to_le_bytes();
    }
}

/// The next numbers; 0 beyond the last, which the block's length excludes.
fn take<T: Default, const N: usize>(numbers: &mut impl Iterator<Item = T>) -> [T; N] {
    core::array::from_fn(|_| numbers.next().unwrap_or_default())
}
