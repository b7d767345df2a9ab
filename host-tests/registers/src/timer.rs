//! A general-purpose timer that counts up (RM0090 section 18): TIM2 and TIM5, 32 bits wide.

use crate::{Named, flag};

/// Registers and the counter.
#[derive(Debug, Clone, Default)]
pub struct Timer {
    /// The time from which on it no longer counts; `None`: it goes on.
    pub stops_at: Option<u64>,
    cr1: u32,
    dier: u32,
    psc: u32,
    arr: u32,
    ccr1: u32,
    ccmr1: u32,
    ccer: u32,
    /// Ticks of a count, and the time and value at which the counter was last known.
    count_ticks: u64,
    known_at: u64,
    known: u64,
    /// Overflows before that.
    overflows: u64,
    /// Overflows acknowledged at the update flag.
    acknowledged: u64,
    ccmr2: u32,
    option: u32,
    /// Period of the oscillator at channel 4's input \[ticks\], if it runs.
    low_speed_period: Option<u64>,
    /// Time and counter of the last edge that was captured; none before the channel is on.
    capture: Option<(u64, u32)>,
    /// A capture that was not read, and one that was overwritten.
    captured: (bool, bool),
}

const CR1: u32 = 0x00;
const DIER: u32 = 0x0C;
const SR: u32 = 0x10;
const CCMR1: u32 = 0x18;
const CCER: u32 = 0x20;
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
const ARR: u32 = 0x2C;
const CCR1: u32 = 0x34;
const CCMR2: u32 = 0x1C;
const CCR4: u32 = 0x40;
const OR: u32 = 0x50;
const CC4E: u32 = 1 << 12;
const UIF: u32 = 1 << 0;
const CC4IF: u32 = 1 << 4;
const CC4OF: u32 = 1 << 12;
/// Channel 4 is an input of its own pin; of every eighth edge.
const CC4S: u32 = 0b11 << 8;
const CC4S_OWN: u32 = 0b01 << 8;
const IC4PSC_EIGHT: u32 = 0b11 << 10;
/// TI4_RMP: the low-speed oscillator.
const TI4_LOW_SPEED: u32 = 0b01 << 6;
const OC1M: u32 = 0b111 << 4;

/// Registers and bits by the maker's names.
pub const NAMED: Named = &[
    ("CR1", CR1, &[("CEN", CEN)]),
    ("DIER", DIER, &[("UIE", UIE)]),
    (
        "SR",
        SR,
        &[("UIF", UIF), ("CCIF[3]", CC4IF), ("CCOF[3]", CC4OF)],
    ),
    ("CCMR_Output[0]", CCMR1, &[("OCM[0]", OC1M)]),
    (
        "CCMR_Input[1]",
        CCMR2,
        &[("CCS[1]", CC4S), ("ICPSC[1]", IC4PSC_EIGHT)],
    ),
    ("CCER", CCER, &[("CCE[0]", CC1E), ("CCE[3]", CC4E)]),
    ("CNT", CNT, &[]),
    ("PSC", PSC, &[]),
    ("ARR", ARR, &[]),
    ("CCR[0]", CCR1, &[]),
    ("CCR[3]", CCR4, &[]),
    ("OR", OR, &[]),
];

const CEN: u32 = 1 << 0;
const UIE: u32 = 1 << 0;
const CC1E: u32 = 1 << 0;
/// OC1M: PWM mode 1.
const PWM_MODE_1: u32 = 0b110 << 4;

impl Timer {
    /// After a reset.
    pub fn new() -> Self {
        Self {
            arr: u32::MAX,
            count_ticks: 1,
            ..Self::default()
        }
    }

    /// The timer's clock has now a period of so many ticks.
    pub fn set_clock(&mut self, period: Option<u64>, now: u64) {
        if let Some(count_ticks) = period {
            self.settle(now);
            self.count_ticks = count_ticks * (u64::from(self.psc) + 1);
        }
    }

    /// True if it counts.
    pub fn is_on(&self) -> bool {
        self.cr1 & CEN != 0
    }

    fn period(&self) -> u64 {
        u64::from(self.arr) + 1
    }

    /// Length of a period \[ticks\].
    pub fn period_ticks(&self) -> u64 {
        self.period() * self.count_ticks
    }

    /// Counts since the counter was last known.
    fn since(&self, now: u64) -> u64 {
        let end = self.stops_at.map_or(now, |stops| stops.min(now));
        if self.is_on() {
            end.saturating_sub(self.known_at) / self.count_ticks
        } else {
            0
        }
    }

    /// The oscillator at channel 4 has this period \[ticks\], or does not run.
    pub fn set_low_speed(&mut self, period: Option<u64>) {
        self.low_speed_period = period;
    }

    /// Captures the counter at every eighth edge up to now; the counter is known at an earlier time.
    fn capture(&mut self, now: u64) {
        let set_up = self.ccer & CC4E != 0
            && self.ccmr2 & (CC4S | IC4PSC_EIGHT) == CC4S_OWN | IC4PSC_EIGHT
            && self.option == TI4_LOW_SPEED
            && self.is_on();
        let Some(period) = self.low_speed_period.filter(|_| set_up) else {
            self.capture = None;
            return;
        };
        let (mut at, mut value) = self.capture.unwrap_or((now, 0));
        while at + 8 * period <= now {
            at += 8 * period;
            let counts = at.saturating_sub(self.known_at) / self.count_ticks;
            value = ((self.known + counts) % self.period()) as u32;
            self.captured = (true, self.captured.0);
        }
        self.capture = Some((at, value));
    }

    fn settle(&mut self, now: u64) {
        self.capture(now);
        let counts = self.since(now);
        let total = self.known + counts;
        self.overflows += total / self.period();
        self.known = total % self.period();
        self.known_at = if self.is_on() {
            self.known_at + counts * self.count_ticks
        } else {
            now
        };
    }

    /// Overflows since the reset.
    pub fn overflows(&self, now: u64) -> u64 {
        self.overflows + (self.known + self.since(now)) / self.period()
    }

    /// True if channel 1 puts out a pulse at each period's beginning.
    pub fn makes_pulses(&self) -> bool {
        self.is_on()
            && self.ccer & CC1E != 0
            && self.ccmr1 & PWM_MODE_1 == PWM_MODE_1
            && self.ccr1 > 0
    }

    /// True if it requests its interrupt.
    pub fn requests(&self, now: u64) -> bool {
        self.dier & UIE != 0 && self.overflows(now) > self.acknowledged
    }

    /// Time of its next interrupt request, if any.
    pub fn next_request(&self, now: u64) -> Option<u64> {
        if self.dier & UIE == 0 {
            return None;
        }
        if self.requests(now) {
            return Some(now);
        }
        let left = self.period() - self.known;
        let at = self.known_at + left * self.count_ticks;
        (self.is_on() && self.stops_at.is_none_or(|stops| at <= stops)).then_some(at)
    }

    /// Reads a register.
    pub fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        self.settle(now);
        Some(match offset {
            CR1 => self.cr1,
            DIER => self.dier,
            SR => {
                flag(UIF, self.overflows > self.acknowledged)
                    | flag(CC4IF, self.captured.0)
                    | flag(CC4OF, self.captured.1)
            }
            CCMR2 => self.ccmr2,
            CCR4 => {
                self.captured.0 = false;
                self.capture.map_or(0, |(_, value)| value)
            }
            OR => self.option,
            CCMR1 => self.ccmr1,
            CCER => self.ccer,
            CNT => self.known as u32,
            PSC => self.psc,
            ARR => self.arr,
            CCR1 => self.ccr1,
            _ => return None,
        })
    }

    /// Writes a register; returns a sentence on a violation.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) -> Vec<String> {
        self.settle(now);
        match offset {
            CR1 => self.cr1 = value,
            DIER => self.dier = value,
            // Writing 0 clears a flag (RM0090 18.4.5).
            SR => {
                if value & 1 == 0 {
                    self.acknowledged = self.overflows;
                }
            }
            CCMR1 => self.ccmr1 = value,
            CCMR2 => self.ccmr2 = value,
            OR => self.option = value,
            CCER => self.ccer = value,
            CNT => self.known = u64::from(value),
            PSC if value == self.psc => {}
            ARR => self.arr = value,
            CCR1 => self.ccr1 = value,
            _ => {
                return vec![format!(
                    "a timer's register {offset:#x} takes no {value:#x} here"
                )];
            }
        }
        Vec::new()
    }
}
