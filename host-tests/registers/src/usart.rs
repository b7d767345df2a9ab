//! A serial port (RM0090 section 30): transmitter with one byte of buffer, receiver with overrun.

use crate::{Named, flag};
use std::collections::VecDeque;

use crate::ticks;

/// Bits of a byte on the line: start, eight of data, stop.
const BITS: u64 = 10;

/// Registers and the line.
#[derive(Debug, Clone, Default)]
pub struct Usart {
    /// Every byte that left.
    pub sent: Vec<u8>,
    /// Bytes on their way to the receiver, each with the time at which its stop bit ends.
    pub coming: VecDeque<(u64, u8)>,
    /// Bytes that the receiver lost by an overrun.
    pub overrun_bytes: usize,
    brr: u32,
    cr1: u32,
    cr3: u32,
    /// Time at which the buffer is free again, and that of the line.
    buffer_free_at: u64,
    line_free_at: u64,
    received: Option<u8>,
    last: u8,
    overrun: bool,
    overrun_seen: bool,
    /// The receiver's pin is connected to it, and pulled up.
    listens: (bool, bool),
}

const SR: u32 = 0x00;
const DR: u32 = 0x04;
const BRR: u32 = 0x08;
const CR1: u32 = 0x0C;
const CR3: u32 = 0x14;

const ORE: u32 = 1 << 3;
const RXNE: u32 = 1 << 5;
const TC: u32 = 1 << 6;
const TXE: u32 = 1 << 7;
const UE: u32 = 1 << 13;
const TE: u32 = 1 << 3;
const RE: u32 = 1 << 2;
const DMAT: u32 = 1 << 7;
const OVER8: u32 = 1 << 15;

/// Registers and bits by the maker's names.
pub const NAMED: Named = &[
    (
        "SR",
        SR,
        &[("ORE", ORE), ("RXNE", RXNE), ("TC", TC), ("TXE", TXE)],
    ),
    ("DR", DR, &[]),
    ("BRR", BRR, &[]),
    (
        "CR1",
        CR1,
        &[("UE", UE), ("TE", TE), ("RE", RE), ("OVER8", OVER8)],
    ),
    ("CR3", CR3, &[("DMAT", DMAT)]),
];

impl Usart {
    /// A reset: bytes on their way to the board go on, bytes that the board was sending do not.
    pub fn reset(&mut self) {
        *self = Self {
            sent: std::mem::take(&mut self.sent),
            coming: std::mem::take(&mut self.coming),
            overrun_bytes: self.overrun_bytes,
            ..Self::default()
        };
    }

    /// Ratio of the bus clock and the rate (RM0090 30.3.4): the register itself with 16-fold oversampling, eighths with the
    /// fraction in three bits with 8-fold.
    fn ratio(&self) -> u32 {
        if self.cr1 & OVER8 == 0 {
            self.brr
        } else {
            (self.brr >> 4) * 8 + (self.brr & 0b111)
        }
    }

    /// Bits a second, with the bus at `apb_hz`.
    pub fn baud(&self, apb_hz: u32) -> u32 {
        apb_hz / self.ratio().max(1)
    }

    /// The receiver's pin: connected to it, and pulled up.
    pub fn set_listening(&mut self, connected: bool, pulled_up: bool) {
        self.listens = (connected, pulled_up);
    }

    fn byte_ticks(&self, apb_hz: u32) -> u64 {
        BITS * u64::from(self.ratio()) * ticks::PER_SECOND / u64::from(apb_hz.max(1))
    }

    /// Time at which the transmitter takes a byte from the DMA stream, if it asks for any.
    pub fn wants_byte_at(&self) -> Option<u64> {
        (self.cr3 & DMAT != 0 && self.can_send()).then_some(self.buffer_free_at)
    }

    fn can_send(&self) -> bool {
        self.cr1 & (UE | TE) == UE | TE
    }

    /// Puts a byte into the transmitter at `now`.
    pub fn send(&mut self, byte: u8, now: u64, apb_hz: u32) {
        self.buffer_free_at = self.line_free_at.max(now);
        self.line_free_at = self.buffer_free_at + self.byte_ticks(apb_hz);
        self.sent.push(byte);
    }

    /// Time at which the last stop bit has left.
    pub fn line_free_at(&self) -> u64 {
        self.line_free_at
    }

    fn settle(&mut self, now: u64) {
        while let Some((_, byte)) = self.coming.pop_front_if(|(at, _)| *at <= now) {
            if self.cr1 & (UE | RE) != UE | RE || !self.listens.0 {
                continue;
            }
            if self.received.is_some() {
                self.overrun = true;
                self.overrun_bytes += 1;
            } else {
                self.received = Some(byte);
            }
        }
    }

    /// Reads a register.
    pub fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        self.settle(now);
        Some(match offset {
            SR => {
                self.overrun_seen = self.overrun;
                flag(TXE, now >= self.buffer_free_at)
                    | flag(TC, now >= self.line_free_at)
                    | flag(RXNE, self.received.is_some())
                    | flag(ORE, self.overrun)
            }
            DR => {
                if self.overrun_seen {
                    (self.overrun, self.overrun_seen) = (false, false);
                }
                self.last = self.received.take().unwrap_or(self.last);
                u32::from(self.last)
            }
            BRR => self.brr,
            CR1 => self.cr1,
            CR3 => self.cr3,
            _ => return None,
        })
    }

    /// Writes a register; returns sentences on violations. `connected`: the pin is the transmitter's.
    pub fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: u64,
        apb_hz: u32,
        connected: bool,
    ) -> Vec<String> {
        match offset {
            DR if !self.can_send() || !connected => {
                return vec![
                    "a byte is sent by a transmitter that is off or has no pin".to_owned(),
                ];
            }
            DR if now < self.buffer_free_at => {
                return vec!["a byte is written into a full transmitter".to_owned()];
            }
            DR => self.send(value as u8, now, apb_hz),
            BRR => self.brr = value,
            CR1 => {
                self.cr1 = value;
                let least = if value & OVER8 == 0 { 16 } else { 8 };
                if value & UE != 0 && self.ratio() < least {
                    return vec![format!(
                        "a ratio of {} with control {value:#x} (30.3.4)",
                        self.ratio()
                    )];
                }
                if value & (UE | RE) == UE | RE && self.listens != (true, true) {
                    return vec![
                        "a receiver is turned on whose pin is not its own, or not pulled up"
                            .to_owned(),
                    ];
                }
            }
            CR3 => self.cr3 = value,
            _ => {
                return vec![format!(
                    "a serial port's register {offset:#x} takes no {value:#x} here"
                )];
            }
        }
        Vec::new()
    }
}
