//! The processor's own registers (PM0214 section 4): interrupt controller, vector table, reset request, system timer, debug.

/// Number of TIM2 among the interrupts (RM0090 table 62).
pub const TIM2: u32 = 28;

/// Exception number of the non-maskable interrupt.
pub const NMI: u32 = 2;

/// Exception number of interrupt 0.
pub const FIRST_INTERRUPT: u32 = 16;

const SYST_CSR: u32 = 0x010;
const SYST_RVR: u32 = 0x014;
const SYST_CVR: u32 = 0x018;
const ISER0: u32 = 0x100;
const ICER0: u32 = 0x180;
const VTOR: u32 = 0xD08;
const AIRCR: u32 = 0xD0C;
const CPACR: u32 = 0xD88;
const FPCCR: u32 = 0xF34;
const DHCSR: u32 = 0xDF0;

/// The key of AIRCR with SYSRESETREQ.
const RESET_REQUEST: u32 = 0x05FA_0004;

/// Registers of the system control space.
#[derive(Debug, Clone, Default)]
pub struct System {
    enabled: u32,
    vtor: u32,
    cpacr: u32,
    fpccr: u32,
    csr: u32,
    reload: u32,
    /// Time at which the system timer last began to count down, and duration of a cycle of the core \[ticks\].
    begun: u64,
    cycle_ticks: u64,
    /// Wraps that were reported.
    told: u64,
    /// True once the program asked for a reset.
    pub wants_reset: bool,
}

impl System {
    /// After a reset, with the vectors at address `vectors`.
    pub fn new(vectors: u32) -> Self {
        Self {
            vtor: vectors,
            fpccr: 0xC000_0000,
            cycle_ticks: 63_000,
            ..Self::default()
        }
    }

    /// True if an interrupt is enabled.
    pub fn is_enabled(&self, interrupt: u32) -> bool {
        self.enabled & (1 << interrupt) != 0
    }

    /// Address of the vector table.
    pub fn vectors(&self) -> u32 {
        self.vtor
    }

    /// True if the floating-point unit is on.
    pub fn has_floating_point(&self) -> bool {
        self.cpacr >> 20 & 0xF == 0xF
    }

    /// Sets the ticks of a cycle of the core.
    pub fn set_cycle(&mut self, cycle_ticks: u64) {
        self.cycle_ticks = cycle_ticks;
    }

    fn wraps(&self, now: u64) -> u64 {
        let period = (u64::from(self.reload) + 1) * self.cycle_ticks;
        if self.csr & 1 == 0 {
            0
        } else {
            (now - self.begun) / period
        }
    }

    /// Reads a register.
    pub fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        Some(match offset {
            SYST_CSR => {
                let wraps = self.wraps(now);
                let has_wrapped = wraps > self.told;
                self.told = wraps;
                self.csr | u32::from(has_wrapped) << 16
            }
            SYST_RVR => self.reload,
            SYST_CVR => 0,
            ISER0 | ICER0 => self.enabled,
            VTOR => self.vtor,
            // VECTKEYSTAT.
            AIRCR => 0xFA05_0000,
            CPACR => self.cpacr,
            FPCCR => self.fpccr,
            // No debugger.
            DHCSR => 0,
            // Priorities: one interrupt, at the highest.
            0x400..0x4F0 => 0,
            _ => return None,
        })
    }

    /// Writes a register; returns a sentence on a violation.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) -> Vec<String> {
        match offset {
            SYST_CSR => {
                (self.csr, self.begun, self.told) = (value & 0b111, now, 0);
            }
            SYST_RVR => self.reload = value & 0x00FF_FFFF,
            SYST_CVR => (self.begun, self.told) = (now, 0),
            ISER0 => self.enabled |= value,
            ICER0 => self.enabled &= !value,
            VTOR => self.vtor = value,
            AIRCR if value & 0xFFFF_0004 == RESET_REQUEST => self.wants_reset = true,
            CPACR => self.cpacr = value,
            FPCCR => self.fpccr = value,
            _ => {
                return vec![format!(
                    "the system register {offset:#x} takes no {value:#x} here"
                )];
            }
        }
        Vec::new()
    }
}
