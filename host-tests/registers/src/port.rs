//! A port of pins (RM0090 section 8): the connection of a pin, and the level of those that the processor drives.

use crate::Named;

/// Registers of one port.
#[derive(Debug, Clone, Default)]
pub struct Port {
    moder: u32,
    others: [u32; 3],
    odr: u32,
    alternate: [u32; 2],
}

const MODER: u32 = 0x00;
const OSPEEDR: u32 = 0x08;
const PUPDR: u32 = 0x0C;
const ODR: u32 = 0x14;
const BSRR: u32 = 0x18;
const AFRL: u32 = 0x20;
const AFRH: u32 = 0x24;

/// The fastest output into 50 pF at 2.7 V, speeds 0 to 3 \[Hz\] (DS8626 revision 12, table 50).
const SPEEDS_HZ: [u32; 4] = [4_000_000, 25_000_000, 50_000_000, 100_000_000];

/// Registers by the maker's names.
pub const NAMED: Named = &[
    ("MODER", MODER, &[]),
    ("OSPEEDR", OSPEEDR, &[]),
    ("PUPDR", PUPDR, &[]),
    ("ODR", ODR, &[]),
    ("BSRR", BSRR, &[]),
    ("AFR[0]", AFRL, &[]),
    ("AFR[1]", AFRH, &[]),
];

impl Port {
    /// Port A after a reset: its pins 13 to 15 are the debugger's.
    pub fn a() -> Self {
        Self {
            moder: 0xA800_0000,
            others: [0, 0x0C00_0000, 0x6400_0000],
            ..Self::default()
        }
    }

    /// True if a pin is connected to this alternate function.
    pub fn is_alternate(&self, pin: u32, function: u32) -> bool {
        let chosen = self.alternate[pin as usize / 8] >> (4 * (pin % 8)) & 0xF;
        self.mode(pin) == 0b10 && chosen == function
    }

    /// Level of a pin that is an output; `None` for others.
    pub fn output(&self, pin: u32) -> Option<bool> {
        (self.mode(pin) == 0b01).then_some(self.odr & (1 << pin) != 0)
    }

    /// True if a pin is pulled up.
    pub fn is_pulled_up(&self, pin: u32) -> bool {
        self.others[2] >> (2 * pin) & 0b11 == 0b01
    }

    /// The fastest output that the pin's pad makes \[Hz\].
    pub fn speed_hz(&self, pin: u32) -> u32 {
        SPEEDS_HZ[(self.others[1] >> (2 * pin) & 0b11) as usize]
    }

    fn mode(&self, pin: u32) -> u32 {
        self.moder >> (2 * pin) & 0b11
    }

    /// Reads a register.
    pub fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            MODER => self.moder,
            0x04..=PUPDR => self.others[(offset as usize - 4) / 4],
            ODR => self.odr,
            AFRL | AFRH => self.alternate[usize::from(offset == AFRH)],
            _ => return None,
        })
    }

    /// Writes a register; returns a sentence on a violation.
    pub fn write(&mut self, offset: u32, value: u32) -> Vec<String> {
        match offset {
            MODER => self.moder = value,
            0x04..=PUPDR => self.others[(offset as usize - 4) / 4] = value,
            ODR => self.odr = value,
            // The upper half clears, the lower sets and wins (RM0090 8.4.7).
            BSRR => self.odr = self.odr & !(value >> 16) | value & 0xFFFF,
            AFRL | AFRH => self.alternate[usize::from(offset == AFRH)] = value,
            _ => return vec![format!("a port has no register at {offset:#x}")],
        }
        Vec::new()
    }
}
