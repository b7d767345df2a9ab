//! Decodes the frames of the gyro counter bank: the logic device that counts the pulses of three gyros and three
//! accelerometers and latches three pickoffs.
//!
//! [`BankDecoder`] takes the bytes of one frame a period, or the fault of the bus that should have brought them, and
//! gives a [`Reading`] with a [`Sample`]: pulses over the period, pickoff codes at its end and accelerometer codes
//! \[1\]; block frame, axes x, y, z. Buses are in [`bank_bus`](crate::unit::bank_bus).
//!
//! The frame, version 3, 48 bytes, little-endian; the bank latches it once a period and shifts it out while
//! chip select is low:
//!
//! | bytes | holds |
//! |---|---|
//! | 0..2 | sequence number, u16, one more each period, wraps |
//! | 2..14 | pulse counters x, y, z, i32, free-running, wrap |
//! | 14..26 | pickoff codes x, y, z, i32 |
//! | 26..38 | accelerometers x, y, z, i32: free-running pulse counters, or converter codes (below); zeros without |
//! | 38 | slow channel, u8, table in [`slow_channels`](crate::unit::slow_channels); 255 for none |
//! | 39..41 | its reading, i16 |
//! | 41..44 | time from the last pulse per second to the latch, u24 \[1/16 µs\]; 0xFFFFFF for 1.05 s or more, or without pulses |
//! | 44..46 | zeros: whole words are copied and compared in fewer instructions |
//! | 46..48 | CRC-16/IBM-3740 (polynomial 0x1021, initial 0xFFFF) of bytes 0..46 |
//!
//! Version 2 has 40 bytes: the first 38, and the CRC of them. The length of the buffer that the bus fills decides which of
//! the two is read ([`WireBytes`]); a bank of version 2 brings no slow channel and no time.
//!
//! The slow channels take turns, so each comes round within 16 periods, 4 ms at 4 kHz. They share the frame's check sum
//! instead of having frames of their own: 8 bytes more are 6.1 µs of the bus.
//!
//! The counters run freely instead of being cleared on reading, so a lost frame loses no angle: the next
//! difference holds both periods. A wrap is exact, since the difference is taken modulo 2³² and a period's
//! count is far below 2³¹ (100 °/s of dither at 2 µrad a pulse: 220).
//! [`AccelerometerInput`] selects the accelerometers' kind of the two. A converter's codes show one period only; for
//! those that were lost the last one stands, since none would lose 2.5 mm/s at 1 g each.
//!
//! # Sequence number
//! The board's own timer is the only latch of the bank: it makes one frame a sampling period, whether it is read
//! or not. So of e periods since the last good frame, by the caller's clock, the number must have grown by e, less at
//! most one for each frame of these periods that came again (the bank did not latch, or latched late).
//!
//! | step s | reading |
//! |---|---|
//! | e − repeats ≤ s ≤ e, modulo 2¹⁶ | good: the counts since the last good frame |
//! | 0, and the same counters | [`SourceFault::Repeated`], no sample: the bank did not latch |
//! | anything else | [`SourceFault::Restarted`]: the bank has started anew, and a difference of its counters would be a rotation that never was; the sample has zero counts and this frame's pickoffs |
//!
//! A bank that starts anew with just the number that is due, one time in 65 536, is not seen: its counts are held at
//! their limit for the time that passed.
//!
//! A frame with all bits equal is reported as [`SourceFault::StuckLine`], whatever its CRC: it shows a broken wire and
//! not noise.
//!
//! The handling of a fault is the caller's.

use core::fmt;

use crc::{CRC_16_IBM_3740, Crc};

use crate::chain::sample::Sample;
use crate::chain::triad::are_equal;
use crate::unit::sample_source::{Reading, SourceFault};
pub use crate::unit::slow_channels::BankService;

/// Version of the frame's layout.
pub const BANK_FRAME_VERSION: u16 = 3;

/// Bytes in a frame.
pub const FRAME_BYTES: usize = 48;

/// Bytes in a frame of version 2, which has neither slow channels nor time.
pub const FRAME_BYTES_V2: usize = 40;

/// Bytes that the CRC covers.
const CHECKED_BYTES: usize = FRAME_BYTES - 2;

/// Bytes of a frame of version 2 that its CRC covers.
const CHECKED_BYTES_V2: usize = FRAME_BYTES_V2 - 2;

/// Finds every error of up to 3 bits in frames below 4 KiB (Hamming distance 4), and every burst up to 16.
const FRAME_CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// Content of a frame without its check sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct BankFrame {
    /// Sequence number: one more each period, wrapping.
    pub sequence: u16,
    /// Free-running pulse counters x, y, z.
    pub counters: [i32; 3],
    /// Block angle relative to the case at the period's end, x, y, z.
    pub pickoff_codes: [i32; 3],
    /// Free-running counters or codes of the accelerometers x, y, z.
    pub accelerometers: [i32; 3],
    /// The slow channel whose turn it is, and the time of the latch.
    pub service: BankService,
}

/// The bytes of one frame as a bus fills them: of this version or of version 2, by their number.
pub trait WireBytes: sealed::Sealed {
    /// Decodes the bytes from the wire.
    ///
    /// # Errors
    /// [`SourceFault::StuckLine`] if every bit is the same, [`SourceFault::Checksum`] if the CRC differs.
    fn decode(&self) -> Result<BankFrame, SourceFault>;
}

mod sealed {
    /// No other number of bytes is a frame.
    pub trait Sealed {}
    impl Sealed for [u8; super::FRAME_BYTES] {}
    impl Sealed for [u8; super::FRAME_BYTES_V2] {}
}

impl WireBytes for [u8; FRAME_BYTES] {
    #[inline]
    fn decode(&self) -> Result<BankFrame, SourceFault> {
        BankFrame::from_bytes(self)
    }
}

impl WireBytes for [u8; FRAME_BYTES_V2] {
    #[inline]
    fn decode(&self) -> Result<BankFrame, SourceFault> {
        if is_stuck(self) {
            return Err(SourceFault::StuckLine);
        }
        let covered = self.first_chunk().unwrap_or(&[0; CHECKED_BYTES_V2]);
        if FRAME_CRC.checksum(covered) != u16_at::<CHECKED_BYTES_V2, _>(self) {
            return Err(SourceFault::Checksum);
        }
        Ok(BankFrame::of_sample(covered, BankService::NONE))
    }
}

impl BankFrame {
    /// A frame without a slow channel and without time: for a bank's firmware and for tests. Fields are public.
    pub const fn new(sequence: u16, counters: [i32; 3], pickoff_codes: [i32; 3]) -> Self {
        Self {
            sequence,
            counters,
            pickoff_codes,
            accelerometers: [0; 3],
            service: BankService::NONE,
        }
    }

    /// Returns this frame after `change`.
    #[must_use]
    pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }

    /// The frame on the wire of version 2.
    pub fn to_bytes_v2(&self) -> [u8; FRAME_BYTES_V2] {
        let whole = self.to_bytes();
        let mut bytes = [0; FRAME_BYTES_V2];
        for (byte, of_whole) in bytes.iter_mut().take(CHECKED_BYTES_V2).zip(whole) {
            *byte = of_whole;
        }
        let covered = bytes.first_chunk().unwrap_or(&[0; CHECKED_BYTES_V2]);
        let crc = FRAME_CRC.checksum(covered).to_le_bytes();
        [bytes[CHECKED_BYTES_V2], bytes[CHECKED_BYTES_V2 + 1]] = crc;
        bytes
    }

    /// The frame on the wire: for a bank's firmware, for tests, and for the stream of an emulated bank.
    pub fn to_bytes(&self) -> [u8; FRAME_BYTES] {
        let mut bytes = [0; FRAME_BYTES];
        let words = self
            .counters
            .iter()
            .chain(&self.pickoff_codes)
            .chain(&self.accelerometers);
        let (sequence, rest) = bytes.split_at_mut(2);
        sequence.copy_from_slice(&self.sequence.to_le_bytes());
        for (place, word) in rest.as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
        let BankService {
            channel,
            value,
            since_pulse,
        } = self.service;
        let [low, high] = value.to_le_bytes();
        let [t0, t1, t2, _] = since_pulse.min(BankService::NO_PULSE).to_le_bytes();
        [bytes[38], bytes[39], bytes[40]] = [channel, low, high];
        [bytes[41], bytes[42], bytes[43]] = [t0, t1, t2];
        let crc = checksum(&bytes).to_le_bytes();
        [bytes[CHECKED_BYTES], bytes[CHECKED_BYTES + 1]] = crc;
        bytes
    }

    /// Decodes the bytes from the wire.
    ///
    /// # Errors
    /// [`SourceFault::StuckLine`] if every bit is the same, [`SourceFault::Checksum`] if the CRC differs.
    #[inline]
    pub fn from_bytes(bytes: &[u8; FRAME_BYTES]) -> Result<Self, SourceFault> {
        if is_stuck(bytes) {
            return Err(SourceFault::StuckLine);
        }
        if checksum(bytes) != u16_at::<CHECKED_BYTES, _>(bytes) {
            return Err(SourceFault::Checksum);
        }
        let covered = bytes.first_chunk().unwrap_or(&[0; CHECKED_BYTES_V2]);
        let service = BankService {
            channel: bytes[38],
            value: i16::from_le_bytes([bytes[39], bytes[40]]),
            since_pulse: u32::from_le_bytes([bytes[41], bytes[42], bytes[43], 0]),
        };
        Ok(Self::of_sample(covered, service))
    }

    /// The frame of the bytes that both versions begin with.
    #[inline(always)]
    fn of_sample(bytes: &[u8; CHECKED_BYTES_V2], service: BankService) -> Self {
        Self {
            sequence: u16_at::<0, _>(bytes),
            counters: axes_at::<2>(bytes),
            pickoff_codes: axes_at::<14>(bytes),
            accelerometers: axes_at::<26>(bytes),
            service,
        }
    }

    /// The frame that a bank sends one period after this one if that period brought `sample`; slow channel and time stay
    /// those of this one.
    #[must_use]
    pub fn followed_by(&self, sample: &Sample, accelerometers: AccelerometerInput) -> Self {
        Self {
            sequence: self.sequence.wrapping_add(1),
            counters: sum(self.counters, sample.pulse_counts),
            pickoff_codes: sample.pickoff_codes,
            accelerometers: match accelerometers {
                AccelerometerInput::Counters => {
                    sum(self.accelerometers, sample.accelerometer_codes)
                }
                AccelerometerInput::Codes => sample.accelerometer_codes,
            },
            service: self.service,
        }
    }
}

/// Meaning of the accelerometers' words of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AccelerometerInput {
    /// Free-running counters of velocity pulses, as the gyros'.
    #[default]
    Counters,
    /// A converter's mean over the period.
    Codes,
}

/// The bus did not deliver a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BusFault;

impl fmt::Display for BusFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the bus did not deliver a frame")
    }
}

impl core::error::Error for BusFault {}

/// Makes readings of frames, however these came.
///
/// It does no input or output and holds no bus: a transfer by a blocking bus
/// ([`CounterBank`](crate::unit::bank_bus::CounterBank)), by an asynchronous one or by DMA ends in one call of
/// [`reading`](Self::reading).
#[derive(Debug, Clone)]
pub struct BankDecoder {
    accelerometers: AccelerometerInput,
    previous: Option<Latched>,
    /// Periods since the last good frame, by the caller's clock.
    elapsed: u32,
    /// Of these, periods in which that frame came again.
    repeats: u16,
}

/// The part of the last good frame that the next one is compared with.
#[derive(Debug, Clone, Copy)]
struct Latched {
    sequence: u16,
    counters: [i32; 3],
    accelerometers: [i32; 3],
}

impl BankDecoder {
    /// A bank that has not been read yet. The first good frame gives a sample of zero counts, which lets
    /// the chain begin with that frame's pickoffs.
    pub const fn new(accelerometers: AccelerometerInput) -> Self {
        Self {
            accelerometers,
            previous: None,
            elapsed: 0,
            repeats: 0,
        }
    }

    /// Counts sampling periods that have passed before the bus delivers any data of them, so that a transfer which is
    /// given up loses none.
    #[inline]
    pub fn elapse(&mut self, periods: u32) {
        self.elapsed = self.elapsed.saturating_add(periods);
    }

    /// Makes the reading of the period that just ended. Cannot panic, whatever the bytes are.
    ///
    /// # Inputs
    /// `transfer`: the bytes that the bus delivered, or its fault. `elapsed`: sampling periods since the previous call,
    /// by the caller's clock; 1 as a rule, more after periods without a call, less those given to
    /// [`elapse`](Self::elapse).
    #[inline]
    #[must_use = "the sample of this period is in it"]
    pub fn reading(
        &mut self,
        transfer: Result<&impl WireBytes, BusFault>,
        elapsed: u32,
    ) -> Reading {
        self.elapse(elapsed);
        let Ok(bytes) = transfer else {
            return Reading::without_sample(SourceFault::Bus);
        };
        let frame = match bytes.decode() {
            Ok(frame) => frame,
            Err(fault) => return Reading::without_sample(fault),
        };
        let Some(previous) = self.previous else {
            return self.begin(&frame, None);
        };
        let step = frame.sequence.wrapping_sub(previous.sequence);
        if step == 0 && are_equal(frame.counters, previous.counters) {
            self.repeats = self.repeats.saturating_add(1);
            return Reading::without_sample(SourceFault::Repeated);
        }
        let periods = self.elapsed;
        if (periods as u16).wrapping_sub(step) > self.repeats {
            return self.begin(&frame, Some(SourceFault::Restarted));
        }
        self.latch(&frame);
        Reading {
            sample: Some(Sample {
                pulse_counts: difference(frame.counters, previous.counters),
                pickoff_codes: frame.pickoff_codes,
                accelerometer_codes: match self.accelerometers {
                    AccelerometerInput::Counters => {
                        difference(frame.accelerometers, previous.accelerometers)
                    }
                    AccelerometerInput::Codes => {
                        let several = i32::try_from(periods).unwrap_or(i32::MAX);
                        frame
                            .accelerometers
                            .map(|code| code.saturating_mul(several))
                    }
                },
            }),
            periods,
            fault: None,
            service: frame.service,
        }
    }

    /// Remembers this frame as the last good one.
    fn latch(&mut self, frame: &BankFrame) {
        self.previous = Some(Latched::of(frame));
        self.elapsed = 0;
        self.repeats = 0;
    }

    /// Gives a reading with zero counts, and remembers the frame as the one from which the next counts are taken.
    #[cold]
    #[inline(never)]
    fn begin(&mut self, frame: &BankFrame, fault: Option<SourceFault>) -> Reading {
        self.latch(frame);
        Reading {
            sample: Some(Sample {
                pulse_counts: [0; 3],
                pickoff_codes: frame.pickoff_codes,
                accelerometer_codes: match self.accelerometers {
                    AccelerometerInput::Counters => [0; 3],
                    AccelerometerInput::Codes => frame.accelerometers,
                },
            }),
            periods: 0,
            fault,
            service: frame.service,
        }
    }
}

impl Latched {
    fn of(frame: &BankFrame) -> Self {
        Self {
            sequence: frame.sequence,
            counters: frame.counters,
            accelerometers: frame.accelerometers,
        }
    }
}

/// The CRC that belongs at the end of `frame`.
pub fn checksum(frame: &[u8; FRAME_BYTES]) -> u16 {
    let covered = frame.first_chunk::<CHECKED_BYTES>();
    let (fours, two) = covered.unwrap_or(&[0; CHECKED_BYTES]).as_chunks::<4>();
    let mut crc = 0xFFFF_u16;
    for [a, b, c, d] in fours {
        let [high, low] = crc.to_be_bytes();
        crc = sum_of(3, a ^ high) ^ sum_of(2, b ^ low) ^ sum_of(1, *c) ^ sum_of(0, *d);
    }
    for byte in two {
        let [high, low] = crc.to_be_bytes();
        crc = u16::from(low) << 8 ^ sum_of(0, byte ^ high);
    }
    crc
}

/// The CRC of a byte and `behind` bytes of zeros after it, at most 3.
#[inline(always)]
fn sum_of(behind: usize, byte: u8) -> u16 {
    let table = SUMS.get(behind).unwrap_or(&[0; 256]);
    *table.get(usize::from(byte)).unwrap_or(&0)
}

/// Table n has the CRC of each byte with n bytes of zeros behind it: four bytes of a frame are checked at a time (Kounavis and
/// Berry 2008, *Novel Table Lookup-Based Algorithms for High-Performance CRC Generation*).
static SUMS: [[u16; 256]; 4] = sums();

const fn sums() -> [[u16; 256]; 4] {
    let mut tables = [[0; 256]; 4];
    let mut byte = 0;
    while byte < 256 {
        let mut sum = (byte as u16) << 8;
        let mut behind = 0;
        while behind < 4 {
            let mut bit = 0;
            while bit < 8 {
                sum = sum << 1 ^ if sum & 0x8000 != 0 { 0x1021 } else { 0 };
                bit += 1;
            }
            tables[behind][byte] = sum;
            behind += 1;
        }
        byte += 1;
    }
    tables
}

/// True if every bit of `frame` is 0, or every bit is 1.
#[inline]
fn is_stuck<const BYTES: usize>(frame: &[u8; BYTES]) -> bool {
    const { assert!(BYTES.is_multiple_of(4)) };
    let words = frame.as_chunks::<4>().0.iter().copied();
    let (any, all) = words
        .map(u32::from_le_bytes)
        .fold((0, u32::MAX), |(any, all), word| (any | word, all & word));
    any == 0 || all == u32::MAX
}

fn difference(new: [i32; 3], old: [i32; 3]) -> [i32; 3] {
    core::array::from_fn(|axis| new[axis].wrapping_sub(old[axis]))
}

fn sum(old: [i32; 3], increment: [i32; 3]) -> [i32; 3] {
    core::array::from_fn(|axis| old[axis].wrapping_add(increment[axis]))
}

/// The number at byte `AT`: a constant, so that the compiler checks the bounds.
fn u16_at<const AT: usize, const BYTES: usize>(frame: &[u8; BYTES]) -> u16 {
    u16::from_le_bytes([frame[AT], frame[AT + 1]])
}

/// Three consecutive i32 from byte `AT`.
fn axes_at<const AT: usize>(frame: &[u8; CHECKED_BYTES_V2]) -> [i32; 3] {
    core::array::from_fn(|axis| core::array::from_fn(|byte| frame[AT + 4 * axis + byte]))
        .map(i32::from_le_bytes)
}
