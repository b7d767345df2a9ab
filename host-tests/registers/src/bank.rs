//! The counter bank on the other end of SPI1, as `src/unit/counter_bank.rs` documents its frame, and the faults on the
//! line between.
//!
//! It turns slowly and dithers with 150″ at three frequencies. Its frames are numbered by the latch pulses of TIM2.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use trueaxis::Parameters;
use trueaxis::counter_bank::{BankFrame, FRAME_BYTES};

/// Bits of a frame.
pub const FRAME_BITS: usize = 8 * FRAME_BYTES;

/// Dither amplitude \[rad\], frequencies \[Hz\], and angle of the block in a period \[rad\].
const DITHER_RAD: f64 = 150.0 / 3600.0 / 180.0 * std::f64::consts::PI;
const DITHER_HZ: [f64; 3] = [390.0, 410.0, 430.0];
const STEP_RAD: [f64; 3] = [3e-6, -2e-6, 1e-6];

/// Fault of one frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Fault {
    /// These bits arrive inverted.
    Inverted(Vec<usize>),
    /// The edges of these bits come late: the sampling edge finds the bit before.
    LateEdges(Vec<usize>),
    /// The bank sees one clock edge too many in front of this bit, so that it is left out.
    EdgeTooMany(usize),
    /// The bank misses the clock edge behind this bit, so that it comes twice.
    EdgeMissed(usize),
    /// The line stays at this level.
    Stuck(bool),
    /// The bank has not latched yet when it is selected: it shows the frame before.
    LatchedLate,
    /// The bank has started anew: numbers and counters begin at 0.
    Restarted,
    /// The peripheral never finishes this byte.
    Unfinished(usize),
    /// It finishes this byte long after the driver's bound.
    Delayed(usize),
}

/// One frame, from the bank's side.
#[derive(Debug, Clone)]
pub struct Transfer {
    /// Number of the latch pulse before it.
    pub latch: u64,
    /// Bytes sent by the bank.
    pub shown: [u8; FRAME_BYTES],
    /// Bytes sampled on the line so far.
    pub received: Vec<u8>,
    /// Fault of this frame, if any.
    pub fault: Option<Fault>,
}

/// The bank.
#[derive(Debug, Default)]
pub struct Bank {
    /// Faults, by number of the latch pulse.
    pub faults: BTreeMap<u64, Fault>,
    /// Every frame that was begun.
    pub transfers: Vec<Transfer>,
    /// Latch pulse at which it last started.
    origin: u64,
}

impl Bank {
    /// The bank's frame after the latch pulse `latch`.
    pub fn frame(&self, latch: u64) -> BankFrame {
        let since = latch.saturating_sub(self.origin);
        let parameters = Parameters::default();
        let dither_rad = |periods: u64, axis: usize| {
            DITHER_RAD * (TAU * DITHER_HZ[axis] * periods as f64 / parameters.sample_rate_hz).sin()
        };
        let counter = |axis: usize| {
            let turned_rad = dither_rad(latch, axis) - dither_rad(self.origin, axis)
                + STEP_RAD[axis] * since as f64;
            (turned_rad / parameters.pulse_weight_rad[axis]).round() as i32
        };
        let pickoff =
            |axis: usize| (dither_rad(latch, axis) / parameters.pickoff_weight_rad).round() as i32;
        BankFrame::new(
            since as u16,
            std::array::from_fn(counter),
            std::array::from_fn(pickoff),
        )
        .with(|frame| {
            frame.accelerometers = [since as i32, 2 * since as i32, -(since as i32)];
        })
    }

    /// Chip select falls: a frame begins.
    pub fn select(&mut self, latch: u64) {
        let fault = self.faults.get(&latch).cloned();
        let shown = match fault {
            Some(Fault::LatchedLate) => latch.saturating_sub(1),
            _ => latch,
        };
        if fault == Some(Fault::Restarted) {
            self.origin = latch;
        }
        self.transfers.push(Transfer {
            latch,
            shown: self.frame(shown).to_bytes(),
            received: Vec::new(),
            fault,
        });
    }

    /// Shifts out the next byte of the frame, as it is sampled; and its lateness.
    pub fn exchange(&mut self) -> (u8, Answer) {
        let Some(transfer) = self.transfers.last_mut() else {
            return (0, Answer::InTime);
        };
        let at = transfer.received.len();
        let bits = (8 * at..8 * at + 8).map(|bit| transfer.sampled(bit));
        let byte = bits.fold(0, |byte, bit| byte << 1 | u8::from(bit));
        transfer.received.push(byte);
        let answer = match transfer.fault {
            Some(Fault::Unfinished(byte)) if byte == at => Answer::Never,
            Some(Fault::Delayed(byte)) if byte == at => Answer::Late,
            _ => Answer::InTime,
        };
        (byte, answer)
    }
}

/// Time of a byte's arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// After its eight bits.
    InTime,
    /// Some tens of microseconds later.
    Late,
    /// Never.
    Never,
}

impl Transfer {
    /// A bit as the bank puts it on the line, the most significant of a byte first; low behind the frame's end.
    fn shown_bit(&self, bit: usize) -> bool {
        self.shown
            .get(bit / 8)
            .is_some_and(|byte| byte >> (7 - bit % 8) & 1 != 0)
    }

    /// A bit as it is sampled.
    fn sampled(&self, bit: usize) -> bool {
        match &self.fault {
            Some(Fault::Inverted(bits)) => self.shown_bit(bit) ^ bits.contains(&bit),
            Some(Fault::LateEdges(bits)) if bits.contains(&bit) => {
                // In front of the first bit the line rests low.
                bit > 0 && self.shown_bit(bit - 1)
            }
            Some(Fault::EdgeTooMany(at)) if bit >= *at => self.shown_bit(bit + 1),
            Some(Fault::EdgeMissed(at)) if bit > *at => self.shown_bit(bit - 1),
            Some(Fault::Stuck(level)) => *level,
            _ => self.shown_bit(bit),
        }
    }
}
