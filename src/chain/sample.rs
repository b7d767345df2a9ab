//! Defines the chain's input and output, samples and output frames, and their bytes.
//!
//! All integers little-endian. A stream of samples carries [`Sample::LAYOUT_VERSION`] once, in its own header; every
//! frame carries [`OutputFrame::LAYOUT_VERSION`] itself, because frames are stored and sent one by one.

use core::fmt;

use crate::chain::faults::Status;

/// The readings of one period T.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sample {
    /// Pulses counted over the period, gyros x, y, z \[1\]; the block's own dither included.
    pub pulse_counts: [i32; 3],
    /// Block angle relative to the case at the period's end, x, y, z \[codes of `pickoff_weight_rad`\].
    pub pickoff_codes: [i32; 3],
    /// Velocity pulses over the period, or converter codes (mean specific force times the period),
    /// accelerometers x, y, z \[codes of `accelerometers.weight_m_s`\]; zeros where there are none.
    pub accelerometer_codes: [i32; 3],
}

impl Sample {
    /// Version of the byte layout.
    pub const LAYOUT_VERSION: u16 = 2;
    /// Size of one sample \[bytes\].
    pub const BYTES: usize = 36;

    /// Nine `i32`: pulse counts x, y, z, pickoff codes x, y, z, accelerometer codes x, y, z.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let words = self
            .pulse_counts
            .iter()
            .chain(&self.pickoff_codes)
            .chain(&self.accelerometer_codes);
        for (chunk, word) in bytes.chunks_exact_mut(4).zip(words) {
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    /// The inverse of [`Sample::to_bytes`]; every bit pattern is a sample.
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let mut sample = Self::default();
        let words = sample
            .pulse_counts
            .iter_mut()
            .chain(&mut sample.pickoff_codes)
            .chain(&mut sample.accelerometer_codes);
        for (word, chunk) in words.zip(bytes.as_chunks::<4>().0) {
            *word = i32::from_le_bytes(*chunk);
        }
        sample
    }
}

/// The case's rotation and velocity increment over one output period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OutputFrame {
    /// Number of the frame since start, wrapping.
    pub sequence: u32,
    /// Rotation vector over the period, in the body frame at its start \[codes of
    /// [`OUTPUT_RAD_PER_CODE`](crate::OUTPUT_RAD_PER_CODE)\]. The rounding residual is carried into the next frame.
    pub dtheta_codes: [i32; 3],
    /// Velocity increment by specific force over the period, in the body frame at its start
    /// \[codes of [`OUTPUT_M_S_PER_CODE`](crate::OUTPUT_M_S_PER_CODE)\], carried likewise; zeros without
    /// accelerometers.
    pub dvel_codes: [i32; 3],
    /// Status bits of the period.
    pub status: Status,
}

/// Increments of one sample, for a controller that cannot wait for the output period's end.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct SampleIncrement {
    /// Rotation of the case over the sample, in the body frame at the sample \[rad\].
    pub dtheta_rad: [f32; 3],
    /// Velocity increment by specific force as the accelerometers sensed it, in the same frame \[m/s\]; zeros without
    /// accelerometers.
    pub dvel_m_s: [f32; 3],
}

/// Reason that bytes are not an output frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FrameError {
    /// The frame has this layout version, which is not [`OutputFrame::LAYOUT_VERSION`].
    Version(u16),
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Version(found) => write!(
                f,
                "output frame of layout version {found}, expected {}",
                OutputFrame::LAYOUT_VERSION
            ),
        }
    }
}

impl core::error::Error for FrameError {}

impl OutputFrame {
    /// Version of the byte layout.
    pub const LAYOUT_VERSION: u16 = 2;
    /// Size of one frame \[bytes\].
    pub const BYTES: usize = 36;

    /// `u32` sequence, three `i32` rotation codes, three `i32` velocity codes, `u32` status, `u16` layout
    /// version, `u16` zero.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let [x, y, z] = self.dtheta_codes.map(i32::to_le_bytes);
        let [u, v, w] = self.dvel_codes.map(i32::to_le_bytes);
        let status = self.status.bits().to_le_bytes();
        let version = u32::from(Self::LAYOUT_VERSION).to_le_bytes();
        let mut bytes = [0; Self::BYTES];
        let words = [
            self.sequence.to_le_bytes(),
            x,
            y,
            z,
            u,
            v,
            w,
            status,
            version,
        ];
        for (chunk, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *chunk = word;
        }
        bytes
    }

    /// The inverse of [`OutputFrame::to_bytes`].
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Result<Self, FrameError> {
        let mut words = [[0u8; 4]; Self::BYTES / 4];
        for (word, chunk) in words.iter_mut().zip(bytes.as_chunks::<4>().0) {
            *word = *chunk;
        }
        let [sequence, x, y, z, u, v, w, status, version] = words;
        let version = u16::from_le_bytes([version[0], version[1]]);
        if version != Self::LAYOUT_VERSION {
            return Err(FrameError::Version(version));
        }
        Ok(Self {
            sequence: u32::from_le_bytes(sequence),
            dtheta_codes: [x, y, z].map(i32::from_le_bytes),
            dvel_codes: [u, v, w].map(i32::from_le_bytes),
            status: Status::from_bits(u32::from_le_bytes(status)),
        })
    }
}
