//! Encodes the play list of an emulated counter bank: one record for each sampling interrupt of the emulator's image.
//!
//! A record has [`BankRecord::BYTES`] bytes, little-endian: a `u32` of control bits (table below), then the frame that
//! the bank puts on the wire. A file `frames.bin` is a sequence of records.
//!
//! | bits of control | effect |
//! |---|---|
//! | 0..8 | the bus holds the interrupt until this many 1/32 of a period have gone since it began |
//! | 8 | the serial link takes no frame from here until a record without this bit |
//! | 9 | the bus reports an error |
//!
//! A hold of 32/32 or more makes the next interrupt late, 64/32 or more makes it miss one:
//! [`BankRecord::timing_of_the_next`]. Only the emulator's image knows these records; the board's has a bus.

use crate::chain::design_parameters::LATE_SHARE;
use crate::unit::counter_bank::FRAME_BYTES;
use crate::unit::processor::Timing;

/// Parts of a period that a hold is counted in.
pub const HOLD_PARTS: u32 = 32;

/// One interrupt's worth of the bank.
// The frame first and aligned: the interrupt moves it by words instead of calling a copy of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C, align(4))]
pub struct BankRecord {
    /// The frame's bytes on the wire.
    pub frame: [u8; FRAME_BYTES],
    /// Time that the bus takes \[1/32 of a period\]; 0 for as long as it needs.
    pub hold: u8,
    /// The serial link stands still.
    pub link_held: bool,
    /// The bus reports an error.
    pub bus_error: bool,
}

const LINK_HELD: u32 = 1 << 8;
const BUS_ERROR: u32 = 1 << 9;

impl BankRecord {
    /// Bytes of a record.
    pub const BYTES: usize = 4 + FRAME_BYTES;

    /// The record of a frame without any fault.
    pub const fn ordinary(frame: [u8; FRAME_BYTES]) -> Self {
        Self {
            hold: 0,
            link_held: false,
            bus_error: false,
            frame,
        }
    }

    /// The record's bytes in the file.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let control = u32::from(self.hold)
            | if self.link_held { LINK_HELD } else { 0 }
            | if self.bus_error { BUS_ERROR } else { 0 };
        let mut bytes = [0; Self::BYTES];
        let (head, rest) = bytes.split_at_mut(4);
        head.copy_from_slice(&control.to_le_bytes());
        rest.copy_from_slice(&self.frame);
        bytes
    }

    /// Decodes a record from the file's bytes.
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let [a, b, c, d, frame @ ..] = *bytes;
        let control = u32::from_le_bytes([a, b, c, d]);
        Self {
            hold: a,
            link_held: control & LINK_HELD != 0,
            bus_error: control & BUS_ERROR != 0,
            frame,
        }
    }

    /// The timing of the interrupt after this record's, where this one was entered in time and takes well below 1/32 of
    /// a period beside the hold. Holds that end within 1/32 of a limit must not be used: the interrupt's own cost
    /// decides them.
    pub fn timing_of_the_next(&self) -> Timing {
        let periods = u32::from(self.hold) / HOLD_PARTS;
        let rest = u32::from(self.hold) % HOLD_PARTS;
        Timing {
            missed: periods.saturating_sub(1),
            late: periods > 0 && rest * LATE_SHARE >= HOLD_PARTS,
        }
    }
}
