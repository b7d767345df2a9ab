//! SPI1 as a master (RM0090 section 28), 8 bits wide, with the bank behind it.

use crate::bank::{Answer, Bank};
use crate::ticks;
use crate::{Named, flag};

/// Additional time of a late byte: longer than the driver waits, shorter than a sampling period.
const LATE_TICKS: u64 = ticks::of_us(60);

/// The fastest clock for the bank \[Hz\] (docs/board.md).
const LIMIT_HZ: u32 = 10_500_000;

/// Registers and the shift register.
#[derive(Debug, Default)]
pub struct Spi {
    /// The bank.
    pub bank: Bank,
    cr1: u32,
    cr2: u32,
    /// The byte that is being shifted in, and the time at which its last bit ends.
    shifting: Option<(u8, u64)>,
    /// Half a bit: a byte has come so long before its last bit ends \[ticks\].
    half_bit: u64,
    /// The byte has come already, and its last bit has not ended.
    has_come: bool,
    /// The program has seen that no bit is on its way since the last byte was written.
    idle_seen: bool,
    received: Option<u8>,
    last: u8,
    overrun: bool,
    /// The data register was read while the overrun stood: reading the status clears it (RM0090 28.3.10).
    data_read: bool,
    selected: bool,
}

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SR: u32 = 0x08;
const DR: u32 = 0x0C;

const SPE: u32 = 1 << 6;
/// Master, with the slave select by software and high; else it falls back to slave (RM0090 28.3.10).
const MASTER: u32 = 1 << 2 | 1 << 9 | 1 << 8;
/// CPHA, CPOL, LSBFIRST, RXONLY, DFF, CRCEN, BIDIMODE: mode 0, most significant bit first, 8 bits, both directions.
const OTHERS: u32 = 0b11 | 1 << 7 | 1 << 10 | 1 << 11 | 1 << 13 | 1 << 15;

const RXNE: u32 = 1 << 0;
const TXE: u32 = 1 << 1;
const OVR: u32 = 1 << 6;
const BSY: u32 = 1 << 7;
const BR: u32 = 0b111 << 3;

/// Registers and bits by the maker's names.
pub const NAMED: Named = &[
    (
        "CR1",
        CR1,
        &[
            ("CPHA", 1),
            ("CPOL", 1 << 1),
            ("MSTR", 1 << 2),
            ("BR", BR),
            ("SPE", SPE),
            ("LSBFIRST", 1 << 7),
            ("SSI", 1 << 8),
            ("SSM", 1 << 9),
            ("RXONLY", 1 << 10),
            ("DFF", 1 << 11),
            ("CRCEN", 1 << 13),
            ("BIDIMODE", 1 << 15),
        ],
    ),
    ("CR2", CR2, &[]),
    (
        "SR",
        SR,
        &[("RXNE", RXNE), ("TXE", TXE), ("OVR", OVR), ("BSY", BSY)],
    ),
    ("DR", DR, &[]),
];

impl Spi {
    /// A reset: the bank goes on.
    pub fn reset(&mut self) {
        *self = Self {
            bank: std::mem::take(&mut self.bank),
            ..Self::default()
        };
    }

    /// The level of chip select, low is selected, and the number of the last latch pulse; returns a sentence on a violation.
    pub fn set_select(&mut self, is_selected: bool, latch: u64, now: u64) -> Option<String> {
        self.settle(now);
        // A byte that does not come, or comes late, is given up with its transfer.
        let is_given_up = self
            .shifting
            .is_some_and(|(_, at)| at > now + LATE_TICKS / 2);
        let too_early = self.selected && !is_selected && !self.idle_seen && !is_given_up;
        if is_selected && !self.selected {
            // An unfinished transfer ends here, without a byte.
            if self.shifting.is_some_and(|(_, at)| at == u64::MAX) {
                self.shifting = None;
            }
            self.bank.select(latch);
        }
        self.selected = is_selected;
        too_early
            .then(|| "chip select rises before the bus was seen to be idle (28.3.7)".to_owned())
    }

    fn settle(&mut self, now: u64) {
        if let Some((byte, at)) = self.shifting
            && now >= at.saturating_sub(self.half_bit)
            && !self.has_come
        {
            self.has_come = true;
            if self.received.is_some() {
                self.overrun = true;
            } else {
                self.received = Some(byte);
            }
        }
        self.shifting.take_if(|(_, at)| now >= *at);
    }

    /// Reads a register.
    pub fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        self.settle(now);
        Some(match offset {
            CR1 => self.cr1,
            CR2 => self.cr2,
            SR => {
                self.idle_seen |= self.shifting.is_none();
                let status = flag(TXE, self.shifting.is_none() || self.has_come)
                    | flag(RXNE, self.received.is_some())
                    | flag(OVR, self.overrun)
                    | flag(BSY, self.shifting.is_some());
                if self.data_read {
                    (self.overrun, self.data_read) = (false, false);
                }
                status
            }
            DR => {
                self.data_read = self.overrun;
                self.last = self.received.take().unwrap_or(self.last);
                u32::from(self.last)
            }
            _ => return None,
        })
    }

    /// Writes a register; returns sentences on violations. `pins`: all of clock, in and out are connected.
    /// `pads_hz`: the fastest that the slower pad of clock and out makes.
    pub fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: u64,
        apb_hz: u32,
        pins: bool,
        pads_hz: u32,
    ) -> Vec<String> {
        self.settle(now);
        match offset {
            CR1 => self.cr1 = value,
            CR2 => self.cr2 = value,
            DR => return self.send(now, apb_hz, pins, pads_hz),
            _ => {
                return vec![format!(
                    "SPI1's register {offset:#x} takes no {value:#x} here"
                )];
            }
        }
        Vec::new()
    }

    fn send(&mut self, now: u64, apb_hz: u32, pins: bool, pads_hz: u32) -> Vec<String> {
        let sound = self.cr1 & (SPE | MASTER | OTHERS) == SPE | MASTER;
        if !sound || !pins || !self.selected {
            return vec![format!(
                "SPI1 sends with control {:#x}, selected {}",
                self.cr1, self.selected
            )];
        }
        // The buffer is empty while the last bit ends; the byte begins with the next.
        if self.shifting.is_some() && !self.has_come {
            return vec!["a byte is written into a full transmitter".to_owned()];
        }
        let divider = 2 << ((self.cr1 & BR) >> 3);
        let clock_hz = apb_hz / divider;
        if clock_hz > LIMIT_HZ {
            return vec![format!("SPI1 at {clock_hz} Hz, at most {LIMIT_HZ} Hz")];
        }
        if clock_hz > pads_hz {
            return vec![format!(
                "SPI1 at {clock_hz} Hz through pads for {pads_hz} Hz"
            )];
        }
        let begins = self.shifting.map_or(now, |(_, ended)| ended);
        let (byte, answer) = self.bank.exchange();
        self.half_bit = ticks::PER_SECOND / u64::from(clock_hz.max(1)) / 2;
        (self.has_come, self.idle_seen) = (false, false);
        let bits = 8 * ticks::PER_SECOND / u64::from(clock_hz.max(1));
        let at = match answer {
            Answer::InTime => begins + bits,
            Answer::Late => begins + bits + LATE_TICKS,
            Answer::Never => u64::MAX,
        };
        self.shifting = Some((byte, at));
        Vec::new()
    }
}
