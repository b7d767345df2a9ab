//! The power controller (RM0090 section 5): regulator scale and supply detector.

use crate::Named;

/// Thresholds of the supply detector with a rising supply, levels 0 to 7, at most \[mV\] (DS8626 table 19).
const LEVELS_MV: [u32; 8] = [2_190, 2_370, 2_510, 2_650, 2_820, 2_990, 3_100, 3_210];

const CR: u32 = 0x00;
const CSR: u32 = 0x04;
const PVDE: u32 = 1 << 4;
const VOS: u32 = 1 << 14;
const PLS: u32 = 0b111 << 5;
const VOSRDY: u32 = 1 << 14;
const PVDO: u32 = 1 << 2;

/// The fastest core at regulator scale 2 \[Hz\] (DS8626 revision 12, table 14).
const SCALE_2_LIMIT_HZ: u32 = 144_000_000;

/// Registers and bits by the maker's names.
pub const NAMED: Named = &[
    ("CR1", CR, &[("PVDE", PVDE), ("PLS", PLS), ("VOS", VOS)]),
    ("CSR1", CSR, &[("PVDO", PVDO), ("VOSRDY", VOSRDY)]),
];

/// Registers and the supply.
#[derive(Debug)]
pub struct Power {
    /// The supply \[mV\].
    pub supply_mv: u32,
    cr: u32,
}

impl Power {
    /// After a reset.
    pub fn new(supply_mv: u32) -> Self {
        Self { supply_mv, cr: VOS }
    }

    /// Judges the regulator's scale against the core's clock.
    pub fn check(&self, core_hz: u32) -> Option<String> {
        (self.cr & VOS == 0 && core_hz > SCALE_2_LIMIT_HZ)
            .then(|| format!("regulator scale 2 at {core_hz} Hz (DS8626 table 14)"))
    }

    /// Reads a register.
    pub fn read(&self, offset: u32) -> Option<u32> {
        let level_mv = LEVELS_MV[((self.cr & PLS) >> 5) as usize];
        let is_low = self.cr & PVDE != 0 && self.supply_mv < level_mv;
        match offset {
            CR => Some(self.cr),
            CSR => Some(if is_low { PVDO } else { 0 } | VOSRDY),
            _ => None,
        }
    }

    /// Writes a register; returns a sentence on a violation.
    pub fn write(&mut self, offset: u32, value: u32) -> Vec<String> {
        match offset {
            CR => self.cr = value,
            CSR => {}
            _ => return vec![format!("PWR has no register at {offset:#x}")],
        }
        Vec::new()
    }
}
