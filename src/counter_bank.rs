//! The gyro counter bank: the logic device that counts three gyros' pulses and latches three pickoffs.
//!
//! Enters: one frame a period over SPI. Leaves: [`Sample`]: pulses over the period \[1\], pickoff codes at
//! its end \[1\], block frame, axes x, y, z.
//!
//! The frame, 28 bytes, little-endian; the bank latches it when chip select falls:
//!
//! | bytes | holds |
//! |---|---|
//! | 0..2 | sequence number, u16, one more each period, wraps |
//! | 2..14 | pulse counters x, y, z, i32, free-running, wrap |
//! | 14..26 | pickoff codes x, y, z, i32 |
//! | 26..28 | CRC-16/IBM-3740 (polynomial 0x1021, initial 0xFFFF) of bytes 0..26 |
//!
//! The counters run freely instead of being cleared on reading, so a lost frame loses no angle: the next
//! difference holds both periods. A wrap is exact, since the difference is taken modulo 2³² and a period's
//! count is far below 2³¹ (100 °/s of dither at 2 µrad a pulse: 220).
//!
//! Assumes fewer than 65 536 lost frames in a row (16 s); the outage itself has long been counted by then.
//! Deliberately not here: what to do about a fault. The caller counts it.

use crc::{CRC_16_IBM_3740, Crc};
use embedded_hal::spi::SpiDevice;

use crate::Sample;
use crate::sample_source::{Reading, SampleSource, SourceFault};

/// Bytes in a frame.
pub const FRAME_BYTES: usize = 28;

/// Bytes that the CRC covers.
const CHECKED_BYTES: usize = 26;

/// Finds every error of up to 3 bits in frames below 4 KiB (Hamming distance 4), and every burst up to 16.
const FRAME_CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// The bank behind `SPI`; the bus driver owns chip select, mode and clock.
#[derive(Debug)]
pub struct CounterBank<SPI> {
    spi: SPI,
    previous: Option<Latched>,
}

/// The part of the last good frame that the next one is compared with.
#[derive(Debug, Clone, Copy)]
struct Latched {
    sequence: u16,
    counters: [i32; 3],
}

impl<SPI: SpiDevice> CounterBank<SPI> {
    /// A bank that has not been read yet. The first good frame only primes the differences.
    pub fn new(spi: SPI) -> Self {
        Self {
            spi,
            previous: None,
        }
    }

    /// Gives the bus back.
    pub fn release(self) -> SPI {
        self.spi
    }
}

impl<SPI: SpiDevice> SampleSource for CounterBank<SPI> {
    fn take(&mut self) -> Reading {
        let mut frame = [0; FRAME_BYTES];
        if self.spi.read(&mut frame).is_err() {
            return Reading {
                sample: None,
                fault: Some(SourceFault::Bus),
            };
        }
        if checksum(&frame) != u16_at::<CHECKED_BYTES>(&frame) {
            return Reading {
                sample: None,
                fault: Some(SourceFault::Checksum),
            };
        }
        let latched = Latched {
            sequence: u16_at::<0>(&frame),
            counters: axes_at::<2>(&frame),
        };
        let pickoff_codes = axes_at::<14>(&frame);
        let Some(previous) = self.previous.replace(latched) else {
            return Reading::default();
        };
        match latched.sequence.wrapping_sub(previous.sequence) {
            0 => Reading {
                sample: None,
                fault: Some(SourceFault::Repeated),
            },
            periods => Reading {
                sample: Some(Sample {
                    pulse_counts: core::array::from_fn(|axis| {
                        latched.counters[axis].wrapping_sub(previous.counters[axis])
                    }),
                    pickoff_codes,
                    accelerometer_codes: [0; 3],
                }),
                fault: match periods - 1 {
                    0 => None,
                    missing => Some(SourceFault::Skipped(missing)),
                },
            },
        }
    }
}

/// The CRC that belongs at the end of `frame`.
pub fn checksum(frame: &[u8; FRAME_BYTES]) -> u16 {
    FRAME_CRC.checksum(frame.first_chunk::<CHECKED_BYTES>().unwrap_or(&[0; 26]))
}

/// The number at byte `AT`: a constant, so that the bounds are settled when the code is compiled.
fn u16_at<const AT: usize>(frame: &[u8; FRAME_BYTES]) -> u16 {
    u16::from_le_bytes([frame[AT], frame[AT + 1]])
}

/// Three consecutive i32 from byte `AT`.
fn axes_at<const AT: usize>(frame: &[u8; FRAME_BYTES]) -> [i32; 3] {
    core::array::from_fn(|axis| core::array::from_fn(|byte| frame[AT + 4 * axis + byte]))
        .map(i32::from_le_bytes)
}
