//! Stream 6 of DMA2 (RM0090 section 10), from memory to the transmitter of USART6 on channel 5.

use crate::Named;

/// Registers of the stream.
#[derive(Debug, Clone, Default)]
pub struct Stream {
    cr: u32,
    left: u32,
    par: u32,
    m0ar: u32,
    /// Bytes moved since it was enabled.
    moved: u32,
    flags: u32,
    /// Batches that were begun.
    pub batches: usize,
    /// Bytes of all of them.
    pub bytes: usize,
}

const HISR: u32 = 0x04;
const HIFCR: u32 = 0x0C;
const CR: u32 = 0x10 + 0x18 * 6;
const NDTR: u32 = CR + 0x04;
const PAR: u32 = CR + 0x08;
const M0AR: u32 = CR + 0x0C;

const EN: u32 = 1 << 0;

/// Registers and bits by the maker's names.
pub const NAMED: Named = &[
    (
        "ISR[1]",
        HISR,
        &[("TCIF[2]", 1 << 21), ("HTIF[2]", 1 << 20)],
    ),
    (
        "IFCR[1]",
        HIFCR,
        &[("TCIF[2]", 1 << 21), ("FEIF[2]", 1 << 16)],
    ),
    (
        "ST[6].CR",
        CR,
        &[
            ("EN", EN),
            ("DIR", 0b11 << 6),
            ("MINC", 1 << 10),
            ("CHSEL", 0b111 << 25),
        ],
    ),
    ("ST[6].NDTR", NDTR, &[]),
    ("ST[6].PAR", PAR, &[]),
    ("ST[6].M0AR", M0AR, &[]),
];
/// TCIF6 and HTIF6 (RM0090 10.5.2).
const COMPLETE: u32 = 1 << 21 | 1 << 20;
const OF_STREAM: u32 = 0b11_1101 << 16;
/// Channel 5, memory to peripheral, memory incremented, bytes (RM0090 10.5.5).
const EXPECTED: u32 = 5 << 25 | 1 << 10 | 0b01 << 6;

/// The data register of USART6.
const USART6_DR: u32 = 0x4001_1404;

impl Stream {
    /// A reset: registers, but not the counts.
    pub fn reset(&mut self) {
        *self = Self {
            batches: self.batches,
            bytes: self.bytes,
            ..Self::default()
        };
    }

    /// The address of the byte to move next, if there is one.
    pub fn next(&self) -> Option<u32> {
        (self.cr & EN != 0).then_some(self.m0ar + self.moved)
    }

    /// A byte was moved.
    pub fn advance(&mut self) {
        self.moved += 1;
        self.left -= 1;
        if self.left == 0 {
            self.cr &= !EN;
            self.flags |= COMPLETE;
        }
    }

    /// Reads a register.
    pub fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            HISR => self.flags,
            CR => self.cr,
            NDTR => self.left,
            PAR => self.par,
            M0AR => self.m0ar,
            _ => return None,
        })
    }

    /// Writes a register; returns sentences on violations of RM0090.
    pub fn write(&mut self, offset: u32, value: u32) -> Vec<String> {
        let is_on = self.cr & EN != 0;
        match offset {
            HIFCR => self.flags &= !(value & OF_STREAM),
            NDTR | PAR | M0AR if is_on => {
                return vec!["a stream is set up while it is on (10.3.17)".to_owned()];
            }
            NDTR => self.left = value & 0xFFFF,
            PAR => self.par = value,
            M0AR => self.m0ar = value,
            CR => return self.write_control(value, is_on),
            _ => {
                return vec![format!(
                    "DMA2's register {offset:#x} takes no {value:#x} here"
                )];
            }
        }
        Vec::new()
    }

    fn write_control(&mut self, value: u32, is_on: bool) -> Vec<String> {
        let begins = value & EN != 0 && !is_on;
        if begins && (self.flags != 0 || self.left == 0) {
            return vec![
                "a stream is begun with flags of the last one, or with nothing to move (10.3.17)"
                    .to_owned(),
            ];
        }
        if begins && (value & !EN != EXPECTED || self.par != USART6_DR) {
            return vec![format!(
                "stream 6 is begun as {value:#x} to {:#x} (10.5.5)",
                self.par
            )];
        }
        if begins {
            self.moved = 0;
            self.batches += 1;
            self.bytes += self.left as usize;
        }
        self.cr = value;
        Vec::new()
    }
}
