//! Reset and clock control (RM0090 section 7): oscillators, PLL, switch, bus clocks, clock security system, reset flags.

use crate::flag;
use crate::flash::wait_states_needed;
use crate::ticks;

mod names;

pub use names::NAMED;

/// The crystal of the board \[Hz\] (docs/board.md).
const CRYSTAL_HZ: u32 = 8_000_000;

/// The internal oscillator \[Hz\].
const INTERNAL_HZ: u32 = 16_000_000;

/// The fastest that the core may run \[Hz\] (DS8626 revision 12, table 14).
const CORE_LIMIT_HZ: u32 = 168_000_000;

/// Least and largest input of the PLL \[Hz\] (DS8626 revision 12, table 36).
const PLL_INPUT_HZ: [u32; 2] = [950_000, 2_100_000];

/// Until the low-speed oscillator is ready \[ticks\] (DS8626 revision 12, table 35).
const LOW_SPEED_STARTS: u64 = ticks::of_us(40);

/// The fastest that APB1 and APB2 may run \[Hz\] (DS8626 table 17).
const APB_LIMITS_HZ: [u32; 2] = [42_000_000, 84_000_000];

/// Flags of resets in the clock control and status register, bits 25 to 31 (RM0090 7.3.21).
pub mod reset_flag {
    /// The reset pin, which every reset from inside pulls too.
    pub const PIN: u32 = 1 << 26;
    /// Power-on, which sets the brown-out's flag too.
    pub const POWER_ON: u32 = 1 << 27 | 1 << 25;
    /// The supply was below the brown-out level.
    pub const BROWN_OUT: u32 = 1 << 25;
    /// Software.
    pub const SOFTWARE: u32 = 1 << 28;
    /// The independent watchdog.
    pub const WATCHDOG: u32 = 1 << 29;
}

/// Behaviour of oscillators, PLL and switch. Times in ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Behaviour {
    /// Until the crystal oscillates; `None`: never.
    pub crystal_starts: Option<u64>,
    /// Time since power-on or reset at which it stops; `None`: it does not.
    pub crystal_stops: Option<u64>,
    /// Until the PLL locks behind the crystal; `None`: never.
    pub locks_to_crystal: Option<u64>,
    /// Until it locks behind the internal oscillator; `None`: never.
    pub locks_to_internal: Option<u64>,
    /// True if the switch goes over to the PLL.
    pub switches: bool,
    /// The period of the internal oscillator \[‰ of nominal\]: 957 to 1087 over temperature (DS8626 revision 12, table 34).
    pub internal_period_per_mille: u64,
    /// The bits of clock enables that stay: all ones, or less.
    pub enables_stay: u32,
}

impl Behaviour {
    /// As the data sheet has it: 2 ms for the crystal, 200 µs for the PLL (DS8626 tables 34 and 39).
    pub const SOUND: Self = Self {
        crystal_starts: Some(ticks::of_us(2000)),
        crystal_stops: None,
        locks_to_crystal: Some(ticks::of_us(200)),
        locks_to_internal: Some(ticks::of_us(200)),
        switches: true,
        internal_period_per_mille: 1000,
        enables_stay: u32::MAX,
    };
}

/// Registers and the state behind them.
#[derive(Debug)]
pub struct Rcc {
    /// Behaviour of the clocks.
    pub behaviour: Behaviour,
    /// Ticks at the last reset.
    reset_at: u64,
    crystal_on: Option<u64>,
    pll_on: Option<u64>,
    watches_crystal: bool,
    crystal_lost: bool,
    pllcfgr: u32,
    cfgr: u32,
    /// SWS: true if the PLL runs the core.
    runs_from_pll: bool,
    cir: u32,
    enables: [u32; 5],
    /// Bits of them that were set and not read back since: the clock may not run yet.
    fresh: [u32; 5],
    low_speed_on: Option<u64>,
    csr: u32,
}

const CR: u32 = 0x00;
const PLLCFGR: u32 = 0x04;
const CFGR: u32 = 0x08;
const CIR: u32 = 0x0C;
const ENABLES: u32 = 0x30;
const ENABLES_END: u32 = 0x44;
const CSR: u32 = 0x74;

const HSION: u32 = 1 << 0;
const HSIRDY: u32 = 1 << 1;
const HSEON: u32 = 1 << 16;
const HSERDY: u32 = 1 << 17;
const CSSON: u32 = 1 << 19;
const PLLON: u32 = 1 << 24;
const PLLRDY: u32 = 1 << 25;
const PLLSRC: u32 = 1 << 22;
const SWITCH: u32 = 0b11;
const CSSF: u32 = 1 << 7;
const CSSC: u32 = 1 << 23;
const RMVF: u32 = 1 << 24;
const LSION: u32 = 1 << 0;
const LSIRDY: u32 = 1 << 1;
const PLLM: u32 = 0x3F;
const PLLN: u32 = 0x1FF << 6;
const PLLP: u32 = 0b11 << 16;
const PPRE1: u32 = 0b111 << 10;
const PPRE2: u32 = 0b111 << 13;
const SWS: u32 = 0b11 << 2;

/// True if a bit is set in the words of the enable registers, which have no place 3: register (0 to 2 AHB, 4 APB1,
/// 5 APB2, from offset 0x30 on) and bit.
fn is_set(words: &[u32], register: usize, bit: u32) -> bool {
    let place = if register >= 4 {
        register - 1
    } else {
        register
    };
    words.get(place).is_some_and(|word| word & (1 << bit) != 0)
}

impl Rcc {
    /// After power-on.
    pub fn new(behaviour: Behaviour) -> Self {
        let mut rcc = Self {
            behaviour,
            reset_at: 0,
            crystal_on: None,
            pll_on: None,
            watches_crystal: false,
            crystal_lost: false,
            pllcfgr: 0,
            cfgr: 0,
            runs_from_pll: false,
            cir: 0,
            enables: [0; 5],
            fresh: [0; 5],
            low_speed_on: None,
            csr: 0,
        };
        rcc.reset(reset_flag::POWER_ON | reset_flag::PIN, 0);
        rcc
    }

    /// A reset: every register but the flags of resets, which gather until they are cleared.
    pub fn reset(&mut self, flags: u32, now: u64) {
        *self = Self {
            behaviour: self.behaviour,
            reset_at: now,
            crystal_on: None,
            pll_on: None,
            watches_crystal: false,
            crystal_lost: false,
            pllcfgr: 0x2400_3010,
            cfgr: 0,
            runs_from_pll: false,
            cir: 0,
            enables: [0x0010_0000, 0, 0, 0, 0],
            fresh: [0; 5],
            low_speed_on: None,
            csr: self.csr | flags,
        };
    }

    /// Time at which the crystal stops \[ticks\]; `None` if it does not, or is off.
    pub fn crystal_stops_at(&self) -> Option<u64> {
        self.crystal_on?;
        self.behaviour
            .crystal_stops
            .map(|after| self.reset_at + after)
    }

    fn crystal_is_ready(&self, now: u64) -> bool {
        let (Some(on), Some(after)) = (self.crystal_on, self.behaviour.crystal_starts) else {
            return false;
        };
        now >= on + after && self.crystal_stops_at().is_none_or(|stops| now < stops)
    }

    fn pll_is_ready(&self, now: u64) -> bool {
        let Some(on) = self.pll_on else {
            return false;
        };
        let (has_input, locks) = if self.pllcfgr & PLLSRC != 0 {
            (self.crystal_is_ready(now), self.behaviour.locks_to_crystal)
        } else {
            (true, self.behaviour.locks_to_internal)
        };
        has_input && locks.is_some_and(|after| now >= on + after)
    }

    /// The clock security system (RM0090 7.2.7): if it watches, a lost crystal raises the NMI and the hardware goes over to
    /// the internal oscillator.
    pub fn notice_lost_crystal(&mut self, now: u64) {
        let (Some(on), Some(stops)) = (self.crystal_on, self.crystal_stops_at()) else {
            return;
        };
        let has_started = self
            .behaviour
            .crystal_starts
            .is_some_and(|after| on + after < stops);
        if !has_started || now < stops || !self.watches_crystal {
            return;
        }
        self.crystal_lost = true;
        self.watches_crystal = false;
        self.crystal_on = None;
        self.cir |= CSSF;
        if self.pllcfgr & PLLSRC != 0 {
            (self.pll_on, self.runs_from_pll) = (None, false);
            self.cfgr &= !SWITCH;
        }
    }

    /// True if the non-maskable interrupt is requested.
    pub fn requests_nmi(&self) -> bool {
        self.cir & CSSF != 0
    }

    /// True if the clock security system watches the crystal.
    pub fn watches_crystal(&self) -> bool {
        self.watches_crystal
    }

    /// The core's clock with the internal oscillator at its nominal rate \[Hz\]; 0 if the PLL that runs it has lost its
    /// input.
    pub fn nominal_hz(&self, now: u64) -> u32 {
        if !self.runs_from_pll {
            return INTERNAL_HZ;
        }
        if !self.pll_is_ready(now) {
            return 0;
        }
        self.pll_hz()
    }

    /// The period of the running clock \[‰ of nominal\].
    fn period_per_mille(&self) -> u64 {
        if self.runs_from_pll && self.pllcfgr & PLLSRC != 0 {
            1000
        } else {
            self.behaviour.internal_period_per_mille
        }
    }

    /// Ticks of a period of `nominal_hz` as the running clock makes it; `None` for no whole number, or no clock.
    pub fn ticks_of(&self, nominal_hz: u32) -> Option<u64> {
        let scaled = ticks::of_period(nominal_hz)? * self.period_per_mille();
        scaled.is_multiple_of(1000).then_some(scaled / 1000)
    }

    /// A rate as the running clock makes it \[Hz\].
    fn actual(&self, nominal_hz: u32) -> u32 {
        (u64::from(nominal_hz) * 1000 / self.period_per_mille()) as u32
    }

    /// The core's clock as it is \[Hz\].
    pub fn core_hz(&self, now: u64) -> u32 {
        self.actual(self.nominal_hz(now))
    }

    /// Output of the PLL for its input \[Hz\] (RM0090 7.3.2).
    fn pll_hz(&self) -> u32 {
        let [_, vco_hz] = self.vco_hz();
        vco_hz / (2 * (((self.pllcfgr >> 16) & 0b11) + 1))
    }

    /// Input and output of the PLL's oscillator \[Hz\].
    fn vco_hz(&self) -> [u32; 2] {
        let source_hz = if self.pllcfgr & PLLSRC != 0 {
            CRYSTAL_HZ
        } else {
            INTERNAL_HZ
        };
        let input_hz = source_hz / (self.pllcfgr & PLLM).max(1);
        [
            input_hz,
            input_hz.saturating_mul((self.pllcfgr & PLLN) >> 6),
        ]
    }

    /// Dividers of APB1 and APB2.
    fn dividers(&self) -> [u32; 2] {
        [10, 13].map(|at| match (self.cfgr >> at) & 0b111 {
            bits if bits < 4 => 1,
            bits => 2 << (bits - 4),
        })
    }

    /// Clocks of APB1 and APB2 \[Hz\].
    pub fn apb_hz(&self, now: u64) -> [u32; 2] {
        self.dividers().map(|divider| self.core_hz(now) / divider)
    }

    /// The clock of TIM2 and TIM5, nominally \[Hz\]: twice APB1 where that is divided (RM0090 7.2).
    pub fn timer_hz(&self, now: u64) -> u32 {
        let [divider, _] = self.dividers();
        self.nominal_hz(now) / divider * if divider == 1 { 1 } else { 2 }
    }

    /// True if the clock of a peripheral was turned on and not yet shown to be: an access now may come too early.
    pub fn is_fresh(&self, register: usize, bit: u32) -> bool {
        is_set(&self.fresh, register, bit)
    }

    /// True if the low-speed oscillator runs.
    pub fn low_speed_runs(&self, now: u64) -> bool {
        self.low_speed_on
            .is_some_and(|on| now >= on + LOW_SPEED_STARTS)
    }

    /// True if the clock of a peripheral is on: register (0 to 2 AHB, 4 APB1, 5 APB2, from offset 0x30 on) and bit.
    pub fn is_enabled(&self, register: usize, bit: u32) -> bool {
        is_set(&self.enables, register, bit)
    }

    /// Reads a register.
    pub fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        self.settle(now);
        Some(match offset {
            CR => {
                HSION
                    | HSIRDY
                    | flag(HSEON, self.crystal_on.is_some())
                    | flag(HSERDY, self.crystal_is_ready(now))
                    | flag(CSSON, self.watches_crystal)
                    | flag(PLLON, self.pll_on.is_some())
                    | flag(PLLRDY, self.pll_is_ready(now))
            }
            PLLCFGR => self.pllcfgr,
            CFGR => self.cfgr & !SWS | flag(0b1000, self.runs_from_pll),
            CIR => self.cir,
            CSR => {
                self.csr
                    | flag(LSION, self.low_speed_on.is_some())
                    | flag(LSIRDY, self.low_speed_runs(now))
            }
            _ => {
                let place = Self::enable_at(offset)?;
                *self.fresh.get_mut(place)? = 0;
                *self.enables.get(place)?
            }
        })
    }

    fn enable_at(offset: u32) -> Option<usize> {
        let place = (offset.checked_sub(ENABLES)? / 4) as usize;
        // Nothing stands at 0x3C.
        (offset <= ENABLES_END && place != 3).then_some(if place > 3 { place - 1 } else { place })
    }

    /// Goes over to the clock that was asked for, if it runs.
    fn settle(&mut self, now: u64) {
        let wants_pll = self.cfgr & SWITCH == 0b10;
        if wants_pll && !self.runs_from_pll && self.behaviour.switches && self.pll_is_ready(now) {
            self.runs_from_pll = true;
        }
        if self.cfgr & SWITCH == 0 {
            self.runs_from_pll = false;
        }
    }

    /// Writes a register; returns sentences on violations of RM0090. `wait_states`: those of the flash.
    pub fn write(&mut self, offset: u32, value: u32, now: u64, wait_states: u32) -> Vec<String> {
        let mut wrong = Vec::new();
        match offset {
            CR => self.write_control(value, now, &mut wrong),
            PLLCFGR => {
                if self.pll_on.is_some() {
                    wrong.push("the PLL is set up while it is on (7.3.2)".to_owned());
                }
                self.pllcfgr = value;
            }
            CFGR => {
                // A crystal that has stopped since the program looked is not the program's fault.
                let has_stopped = self.crystal_stops_at().is_some_and(|stops| now >= stops);
                if value & SWITCH == 0b10 && !self.pll_is_ready(now) && !has_stopped {
                    wrong.push(
                        "the core is to run from a PLL that has not locked (7.2.6)".to_owned(),
                    );
                }
                self.cfgr = value;
            }
            CIR => {
                if value & CSSC != 0 {
                    self.cir &= !CSSF;
                }
            }
            CSR => {
                self.low_speed_on = (value & LSION != 0).then(|| self.low_speed_on.unwrap_or(now));
                if value & RMVF != 0 {
                    self.csr &= 0x01FF_FFFF & !RMVF;
                }
            }
            _ => match Self::enable_at(offset) {
                Some(place) => {
                    let value = value & self.behaviour.enables_stay;
                    self.fresh[place] |= value & !self.enables[place];
                    self.enables[place] = value;
                }
                None => wrong.push(format!("RCC has no register at {offset:#x}")),
            },
        }
        self.settle(now);
        self.check(now, wait_states, &mut wrong);
        wrong
    }

    fn write_control(&mut self, value: u32, now: u64, wrong: &mut Vec<String>) {
        let on = |since: Option<u64>, bit: u32| (value & bit != 0).then(|| since.unwrap_or(now));
        if self.runs_from_pll && value & PLLON == 0 {
            wrong.push("the PLL is turned off while the core runs from it (7.3.1)".to_owned());
            return;
        }
        if self.runs_from_pll && self.pllcfgr & PLLSRC != 0 && value & HSEON == 0 {
            wrong.push("the crystal is turned off while the core runs from it (7.3.1)".to_owned());
            return;
        }
        if value & HSION == 0 {
            wrong.push("the internal oscillator is turned off".to_owned());
        }
        // The detector itself waits for the crystal (RM0090 7.2.7).
        self.watches_crystal = value & CSSON != 0;
        self.crystal_on = on(self.crystal_on, HSEON);
        self.pll_on = on(self.pll_on, PLLON);
    }

    /// Limits of frequencies, at every step.
    pub fn check(&self, now: u64, wait_states: u32, wrong: &mut Vec<String>) {
        let core_hz = self.core_hz(now);
        if core_hz > CORE_LIMIT_HZ {
            wrong.push(format!("the core runs at {core_hz} Hz (DS8626 table 14)"));
        }
        let needed = wait_states_needed(core_hz);
        if wait_states < needed {
            wrong.push(format!(
                "{wait_states} wait states at {core_hz} Hz need {needed} (3.5.1)"
            ));
        }
        let buses = self.apb_hz(now).into_iter().zip(APB_LIMITS_HZ);
        for (place, (hz, limit_hz)) in buses.enumerate() {
            if hz > limit_hz {
                wrong.push(format!(
                    "APB{} at {hz} Hz, at most {limit_hz} Hz (7.2)",
                    place + 1
                ));
            }
        }
        if self.pll_on.is_some() {
            let from_crystal = self.pllcfgr & PLLSRC != 0;
            let per_mille = if from_crystal {
                1000
            } else {
                self.behaviour.internal_period_per_mille
            };
            let actual = |hz: u32| (u64::from(hz) * 1000 / per_mille) as u32;
            let [input_hz, output_hz] = self.vco_hz().map(actual);
            let sound = (PLL_INPUT_HZ[0]..=PLL_INPUT_HZ[1]).contains(&input_hz)
                && (100_000_000..=432_000_000).contains(&output_hz)
                && actual(self.pll_hz()) <= CORE_LIMIT_HZ;
            if !sound {
                wrong.push(format!(
                    "the PLL is fed {input_hz} Hz and makes {output_hz} Hz (7.3.2)"
                ));
            }
        }
    }
}
