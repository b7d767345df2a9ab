//! The parameter block: what `rlg params` writes and the firmware reads from flash.
//!
//! Little-endian. Offset 0: magic `RLGP`; 4: `u16` version (1); 6: `u16` length of the whole block; 8:
//! `u16` samples per output; 10: `u8` acceleration order; 11: `u8` zero; 12: 26 `f64` in the order of
//! [`Parameters`]' fields (pulse weight ×3, bias ×3, scale ×3, installation ×6, flexure ×6, pickoff gain ×3,
//! pickoff weight, sample rate); last: `u32` CRC-32 (ISO-HDLC, as zip) of everything before it.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use crate::parameters::{ParameterError, Parameters};
use crate::triad::CrossAxis;

const MAGIC: [u8; 4] = *b"RLGP";
const VERSION: u16 = 1;
const HEADER_BYTES: usize = 12;
const NUMBERS: usize = 26;
const CRC_OFFSET: usize = HEADER_BYTES + 8 * NUMBERS;

/// Size of the block \[bytes\].
pub const PARAMETER_BLOCK_BYTES: usize = CRC_OFFSET + 4;

/// Bitwise: it runs once at boot, and a table would cost 1 KiB of flash.
const CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Why bytes are not a parameter block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BlockError {
    /// Fewer bytes than a block, or its length field is another \[bytes found\].
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
    /// The block is whole, but a parameter is out of range.
    Parameter(ParameterError),
}

impl fmt::Display for BlockError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(found) => write!(
                f,
                "parameter block of {found} bytes, expected {PARAMETER_BLOCK_BYTES}"
            ),
            Self::Magic => f.write_str("parameter block does not begin with RLGP"),
            Self::Version(found) => {
                write!(f, "parameter block of version {found}, expected {VERSION}")
            }
            Self::Checksum { stored, computed } => write!(
                f,
                "parameter block CRC-32 is {stored:#010x}, computed {computed:#010x}"
            ),
            Self::Parameter(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for BlockError {}

impl Parameters {
    /// The block of these parameters, whether or not they pass [`Parameters::check`].
    pub fn to_block(&self) -> [u8; PARAMETER_BLOCK_BYTES] {
        let mut block = [0; PARAMETER_BLOCK_BYTES];
        block[0..4].copy_from_slice(&MAGIC);
        block[4..6].copy_from_slice(&VERSION.to_le_bytes());
        block[6..8].copy_from_slice(&(PARAMETER_BLOCK_BYTES as u16).to_le_bytes());
        block[8..10].copy_from_slice(&self.samples_per_output.to_le_bytes());
        block[10] = self.acceleration_order;
        let chunks = block[HEADER_BYTES..CRC_OFFSET].chunks_exact_mut(8);
        for (chunk, number) in chunks.zip(self.numbers()) {
            chunk.copy_from_slice(&number.to_le_bytes());
        }
        let crc = CHECKSUM.checksum(&block[..CRC_OFFSET]);
        block[CRC_OFFSET..].copy_from_slice(&crc.to_le_bytes());
        block
    }

    /// Reads and checks a block; bytes after it are ignored.
    pub fn from_block(bytes: &[u8]) -> Result<Self, BlockError> {
        let Some((block, _)) = bytes.split_first_chunk::<PARAMETER_BLOCK_BYTES>() else {
            return Err(BlockError::Length(bytes.len()));
        };
        if block[0..4] != MAGIC {
            return Err(BlockError::Magic);
        }
        let version = u16::from_le_bytes([block[4], block[5]]);
        if version != VERSION {
            return Err(BlockError::Version(version));
        }
        let length = usize::from(u16::from_le_bytes([block[6], block[7]]));
        if length != PARAMETER_BLOCK_BYTES {
            return Err(BlockError::Length(length));
        }
        let (body, stored) = block.split_at(CRC_OFFSET);
        let stored = stored
            .iter()
            .rev()
            .fold(0, |word, byte| word << 8 | u32::from(*byte));
        let computed = CHECKSUM.checksum(body);
        if stored != computed {
            return Err(BlockError::Checksum { stored, computed });
        }
        let mut numbers = [0.0; NUMBERS];
        for (number, chunk) in numbers
            .iter_mut()
            .zip(body[HEADER_BYTES..].as_chunks::<8>().0)
        {
            *number = f64::from_le_bytes(*chunk);
        }
        let n = numbers;
        let parameters = Self {
            pulse_weight_rad: [n[0], n[1], n[2]],
            bias_rad_s: [n[3], n[4], n[5]],
            scale_error: [n[6], n[7], n[8]],
            installation_rad: CrossAxis::from_array([n[9], n[10], n[11], n[12], n[13], n[14]]),
            flexure_s2: CrossAxis::from_array([n[15], n[16], n[17], n[18], n[19], n[20]]),
            pickoff_gain: [n[21], n[22], n[23]],
            pickoff_weight_rad: n[24],
            sample_rate_hz: n[25],
            samples_per_output: u16::from_le_bytes([block[8], block[9]]),
            acceleration_order: block[10],
        };
        parameters.check().map_err(BlockError::Parameter)?;
        Ok(parameters)
    }

    fn numbers(&self) -> impl Iterator<Item = f64> {
        self.pulse_weight_rad
            .into_iter()
            .chain(self.bias_rad_s)
            .chain(self.scale_error)
            .chain(self.installation_rad.to_array())
            .chain(self.flexure_s2.to_array())
            .chain(self.pickoff_gain)
            .chain([self.pickoff_weight_rad, self.sample_rate_hz])
    }
}
