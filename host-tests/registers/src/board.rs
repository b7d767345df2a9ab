//! The board around the processor: every peripheral at its address (RM0090 table 1), and the time.

use std::collections::{BTreeMap, BTreeSet};

use crate::dma::Stream;
use crate::flash::{self, Flash};
use crate::line_driver::LineDriver;
use crate::port::Port;
use crate::power::Power;
use crate::rcc::{self, Rcc, reset_flag};
use crate::spi::Spi;
use crate::system::{self, System};
use crate::ticks;
use crate::timer::Timer;
use crate::usart::Usart;
use crate::watchdog::Watchdog;

/// Behaviour of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Behaviour {
    /// Clocks.
    pub clocks: rcc::Behaviour,
    /// Flash controller.
    pub flash: flash::Behaviour,
    /// Supply \[mV\].
    pub supply_mv: u32,
    /// The low-speed oscillator, which the watchdog counts \[Hz\].
    pub watchdog_hz: u32,
    /// Cycles of the core for ten instructions.
    pub cycles_per_ten: u64,
    /// The time from which on TIM2 stands \[ticks since power-on\].
    pub sampling_stops: Option<u64>,
    /// A sleep ends after so many ticks even without an interrupt, as it may for any reason (ARMv7-M manual B1.5.19).
    pub wakes_after: Option<u64>,
}

impl Behaviour {
    /// A board as in the data sheet, with one cycle for an instruction.
    pub const SOUND: Self = Self {
        clocks: rcc::Behaviour::SOUND,
        flash: flash::Behaviour::SOUND,
        supply_mv: 3_300,
        watchdog_hz: 32_000,
        cycles_per_ten: 10,
        sampling_stops: None,
        wakes_after: None,
    };
}

/// Additional cycles of an access to a peripheral.
const ACCESS_CYCLES: u64 = 2;

/// The peripherals.
#[derive(Debug)]
pub struct Board {
    /// Time since power-on \[ticks\].
    pub now: u64,
    /// Behaviour of the board.
    pub behaviour: Behaviour,
    /// Clocks.
    pub rcc: Rcc,
    /// Flash.
    pub flash: Flash,
    /// Supply detector.
    pub power: Power,
    /// Port A, and port C.
    pub ports: [Port; 2],
    /// TIM2 and TIM5.
    pub timers: [Timer; 2],
    /// The watchdog.
    pub watchdog: Watchdog,
    /// SPI1 and the bank.
    pub spi: Spi,
    /// USART1 and USART6.
    pub usarts: [Usart; 2],
    /// The driver of USART1's line.
    pub line_driver: LineDriver,
    /// The stream that feeds USART6.
    pub stream: Stream,
    /// The processor's own registers.
    pub system: System,
    debug: [u32; 4],
    /// Ticks of a cycle of the core; `None` while its clock stands.
    pub cycle_ticks: Option<u64>,
    /// Sentences on forbidden actions, each once.
    pub wrong: BTreeSet<String>,
    /// The fastest that the core has run \[Hz\].
    pub fastest_hz: u32,
    /// Addresses of the peripherals' registers that the program used, each with every bit that it set.
    pub used: BTreeMap<u32, u32>,
    /// Instructions since power-on.
    pub instructions: u64,
    /// Reads of the registers of clocks and flash since power-on.
    pub clock_reads: u64,
    vectors: u32,
    /// Part of a cycle that has not passed yet.
    tenths: u64,
    /// The time at which the processor is stopped, for a request due then; and true once it stopped.
    pub(crate) stop_at: u64,
    pub(crate) has_stopped: bool,
}

/// A peripheral, by its place in [`PERIPHERALS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Peripheral {
    Tim2,
    Tim5,
    Iwdg,
    Pwr,
    Usart1,
    Usart6,
    Spi1,
    GpioA,
    GpioC,
    Rcc,
    Flash,
    Dma2,
    Debug,
    System,
}

/// Beginning, registers and name of each peripheral, by the maker's names, with its clock's enable bit.
pub fn named() -> [(&'static str, u32, crate::Named, Option<ClockBit>); 13] {
    use crate::{dma, port, power, spi, timer, usart, watchdog};
    let of = |name: &'static str, place: usize, registers: crate::Named| {
        let (begin, _, clock) = PERIPHERALS[place];
        (name, begin, registers, clock)
    };
    [
        of("TIM2", 0, timer::NAMED),
        of("TIM5", 1, timer::NAMED),
        of("IWDG", 2, watchdog::NAMED),
        of("PWR", 3, power::NAMED),
        of("USART1", 4, usart::NAMED),
        of("USART6", 5, usart::NAMED),
        of("SPI1", 6, spi::NAMED),
        of("GPIOA", 7, port::NAMED),
        of("GPIOC", 8, port::NAMED),
        of("RCC", 9, rcc::NAMED),
        of("FLASH", 10, flash::NAMED),
        of("DMA2", 11, dma::NAMED),
        of("DBGMCU", 12, &[("CR", 4, &[("DBG_SLEEP", 1)])]),
    ]
}

/// Register and bit of RCC that turn a clock on.
pub type ClockBit = (usize, u32);

/// Beginning of each, and the register and bit of RCC that gives it a clock (RM0090 7.3.10 to 7.3.14).
const PERIPHERALS: [(u32, Peripheral, Option<ClockBit>); 14] = [
    (0x4000_0000, Peripheral::Tim2, Some((4, 0))),
    (0x4000_0C00, Peripheral::Tim5, Some((4, 3))),
    (0x4000_3000, Peripheral::Iwdg, None),
    (0x4000_7000, Peripheral::Pwr, Some((4, 28))),
    (0x4001_1000, Peripheral::Usart1, Some((5, 4))),
    (0x4001_1400, Peripheral::Usart6, Some((5, 5))),
    (0x4001_3000, Peripheral::Spi1, Some((5, 12))),
    (0x4002_0000, Peripheral::GpioA, Some((0, 0))),
    (0x4002_0800, Peripheral::GpioC, Some((0, 2))),
    (0x4002_3800, Peripheral::Rcc, None),
    (0x4002_3C00, Peripheral::Flash, None),
    (0x4002_6400, Peripheral::Dma2, Some((0, 22))),
    (0xE004_2000, Peripheral::Debug, None),
    (0xE000_E000, Peripheral::System, None),
];

impl Board {
    /// After power-on, with the vectors at address `vectors`.
    pub fn new(behaviour: Behaviour, vectors: u32) -> Self {
        let mut board = Self {
            now: 0,
            behaviour,
            rcc: Rcc::new(behaviour.clocks),
            flash: Flash::new(behaviour.flash),
            power: Power::new(behaviour.supply_mv),
            ports: [Port::a(), Port::default()],
            timers: [Timer::new(), Timer::new()],
            watchdog: Watchdog::new(behaviour.watchdog_hz),
            spi: Spi::default(),
            usarts: [Usart::default(), Usart::default()],
            line_driver: LineDriver::default(),
            stream: Stream::default(),
            system: System::new(vectors),
            debug: [0; 4],
            cycle_ticks: None,
            wrong: BTreeSet::new(),
            fastest_hz: 0,
            used: BTreeMap::new(),
            instructions: 0,
            clock_reads: 0,
            vectors,
            tenths: 0,
            stop_at: 0,
            has_stopped: false,
        };
        board.follow_clocks();
        board
    }

    /// A reset: every register, but neither flash, bank nor the state of others.
    pub fn reset(&mut self, flags: u32) {
        self.rcc.behaviour = self.behaviour.clocks;
        self.rcc.reset(flags | reset_flag::PIN, self.now);
        self.flash.behaviour = self.behaviour.flash;
        self.flash.reset();
        self.power = Power::new(self.behaviour.supply_mv);
        self.ports = [Port::a(), Port::default()];
        self.timers = [Timer::new(), Timer::new()];
        self.watchdog.reset();
        self.spi.reset();
        self.usarts.iter_mut().for_each(Usart::reset);
        // Its pin is open, and pulled down.
        self.line_driver = LineDriver::default();
        self.stream.reset();
        self.system = System::new(self.vectors);
        self.follow_clocks();
    }

    /// Lets `instructions` pass.
    pub fn pass(&mut self, instructions: u64) {
        self.instructions += instructions;
        let tenths = instructions * self.behaviour.cycles_per_ten + self.tenths;
        self.tenths = tenths % 10;
        self.now += tenths / 10 * self.cycle_ticks.unwrap_or(0);
    }

    /// Sets every counter's clock to the running one.
    fn follow_clocks(&mut self) {
        let core_hz = self.rcc.nominal_hz(self.now);
        self.cycle_ticks = self.rcc.ticks_of(core_hz);
        if core_hz > 0 && self.cycle_ticks.is_none() {
            self.wrong.insert(format!("the core runs at {core_hz} Hz"));
        }
        let core_hz = self.rcc.core_hz(self.now);
        self.wrong.extend(self.power.check(core_hz));
        self.fastest_hz = self.fastest_hz.max(core_hz);
        let timer_period = self.rcc.ticks_of(self.rcc.timer_hz(self.now));
        for timer in &mut self.timers {
            timer.set_clock(timer_period, self.now);
        }
        let low_speed = ticks::PER_SECOND / u64::from(self.behaviour.watchdog_hz);
        let low_speed = self.rcc.low_speed_runs(self.now).then_some(low_speed);
        self.timers[1].set_low_speed(low_speed);
        self.timers[0].stops_at = self.behaviour.sampling_stops;
        if let Some(cycle_ticks) = self.cycle_ticks {
            self.system.set_cycle(cycle_ticks);
        }
    }

    /// Advances every peripheral to the present time.
    pub fn settle(&mut self) {
        if self
            .rcc
            .crystal_stops_at()
            .is_some_and(|stops| self.now >= stops)
        {
            self.rcc.notice_lost_crystal(self.now);
            self.follow_clocks();
        }
    }

    /// True if the sampling interrupt is requested and enabled.
    pub fn requests_sampling(&self) -> bool {
        self.system.is_enabled(system::TIM2) && self.timers[0].requests(self.now)
    }

    /// Time of the next event that the program did not cause just now.
    pub fn next_event(&self) -> u64 {
        let sampling = self.timers[0].next_request(self.now);
        // Without a crystal the core stands, or the clock security system acts.
        let crystal = self
            .rcc
            .crystal_stops_at()
            .filter(|at| *at > self.now || self.rcc.watches_crystal());
        let events = [
            sampling.filter(|_| self.system.is_enabled(system::TIM2)),
            self.watchdog.expires_at(),
            crystal,
        ];
        events.into_iter().flatten().min().unwrap_or(u64::MAX)
    }

    /// The peripheral at an address and the register's offset; `None` without a clock.
    fn find(&mut self, address: u32, bits: u32) -> Option<(Peripheral, u32)> {
        *self.used.entry(address).or_default() |= bits;
        let (peripheral, offset, is_fresh) = self.place(address)?;
        if is_fresh {
            self.wrong.insert(format!(
                "an access at {address:#010x} before its clock enable was read back (7.2.14)"
            ));
        }
        Some((peripheral, offset))
    }

    fn place(&self, address: u32) -> Option<(Peripheral, u32, bool)> {
        let (begin, found, clock) = PERIPHERALS.iter().find(|(begin, found, _)| {
            let size = if *found == Peripheral::System {
                0x1000
            } else {
                0x400
            };
            (*begin..begin + size).contains(&address)
        })?;
        let is_fresh = clock.is_some_and(|(register, bit)| self.rcc.is_fresh(register, bit));
        if is_fresh {
            return Some((*found, address - begin, true));
        }
        let has_clock = clock.is_none_or(|(register, bit)| self.rcc.is_enabled(register, bit));
        has_clock.then_some((*found, address - begin, false))
    }

    /// A read by the processor.
    pub fn read(&mut self, address: u32) -> u32 {
        self.now += ACCESS_CYCLES * self.cycle_ticks.unwrap_or(0);
        let now = self.now;
        let found = self
            .find(address, 0)
            .and_then(|(peripheral, offset)| match peripheral {
                Peripheral::Tim2 => self.timers[0].read(offset, now),
                Peripheral::Tim5 => self.timers[1].read(offset, now),
                Peripheral::Iwdg => self.watchdog.read(offset, now),
                Peripheral::Pwr => self.power.read(offset),
                Peripheral::Usart1 => self.usarts[0].read(offset, now),
                Peripheral::Usart6 => self.usarts[1].read(offset, now),
                Peripheral::Spi1 => self.spi.read(offset, now),
                Peripheral::GpioA => self.ports[0].read(offset),
                Peripheral::GpioC => self.ports[1].read(offset),
                Peripheral::Rcc => {
                    self.clock_reads += 1;
                    let value = self.rcc.read(offset, now);
                    self.follow_clocks();
                    value
                }
                Peripheral::Flash => {
                    self.clock_reads += 1;
                    self.flash.read(offset, now)
                }
                Peripheral::Dma2 => self.stream.read(offset),
                Peripheral::Debug => self.debug.get(offset as usize / 4).copied(),
                Peripheral::System => self.system.read(offset, now),
            });
        found.unwrap_or_else(|| {
            self.wrong.insert(format!(
                "a read at {address:#010x}: no register, or no clock"
            ));
            0
        })
    }

    /// A write by the processor.
    pub fn write(&mut self, address: u32, value: u32) {
        self.now += ACCESS_CYCLES * self.cycle_ticks.unwrap_or(0);
        let now = self.now;
        let [_, apb2_hz] = self.rcc.apb_hz(now);
        let wrong = match self.find(address, value) {
            None => vec![format!(
                "a write at {address:#010x}: no register, or no clock"
            )],
            Some((Peripheral::Tim2, offset)) => {
                let mut wrong = self.timers[0].write(offset, value, now);
                if self.timers[0].is_on() && !self.flash.caches_are_on() {
                    wrong.push("sampling begins without the flash's caches or prefetch".to_owned());
                }
                wrong
            }
            Some((Peripheral::Tim5, offset)) => self.timers[1].write(offset, value, now),
            Some((Peripheral::Iwdg, offset)) => self.watchdog.write(offset, value, now),
            Some((Peripheral::Pwr, offset)) => {
                let mut wrong = self.power.write(offset, value);
                wrong.extend(self.power.check(self.rcc.core_hz(now)));
                wrong
            }
            Some((Peripheral::Usart1, offset)) => {
                let connected = self.ports[0].is_alternate(9, 7);
                let port = &self.ports[0];
                self.usarts[0].set_listening(port.is_alternate(10, 7), port.is_pulled_up(10));
                let sent = self.usarts[0].sent.len();
                let begin = self.usarts[0].line_free_at().max(now);
                let mut wrong = self.usarts[0].write(offset, value, now, apb2_hz, connected);
                if self.usarts[0].sent.len() > sent {
                    wrong.extend(self.line_driver.send(begin));
                }
                wrong
            }
            Some((Peripheral::Usart6, offset)) => {
                let connected = self.ports[1].is_alternate(6, 8);
                self.usarts[1].write(offset, value, now, apb2_hz, connected)
            }
            Some((Peripheral::Spi1, offset)) => {
                let pins = (5..8).all(|pin| self.ports[0].is_alternate(pin, 5));
                let pads_hz = [5, 7].map(|pin| self.ports[0].speed_hz(pin));
                let pads_hz = pads_hz[0].min(pads_hz[1]);
                self.spi.write(offset, value, now, apb2_hz, pins, pads_hz)
            }
            Some((Peripheral::GpioA, offset)) => {
                let mut wrong = self.ports[0].write(offset, value);
                wrong.extend(self.watch_select());
                let is_high = self.ports[0].output(8) == Some(true);
                let line_free_at = self.usarts[0].line_free_at();
                wrong.extend(self.line_driver.set(is_high, now, line_free_at));
                wrong
            }
            Some((Peripheral::GpioC, offset)) => self.ports[1].write(offset, value),
            Some((Peripheral::Rcc, offset)) => {
                let wait_states = self.flash.wait_states();
                let wrong = self.rcc.write(offset, value, now, wait_states);
                self.follow_clocks();
                wrong
            }
            Some((Peripheral::Flash, offset)) => {
                let mut wrong = self.flash.write(offset, value, &mut self.now);
                self.rcc.check(now, self.flash.wait_states(), &mut wrong);
                wrong
            }
            Some((Peripheral::Dma2, offset)) => self.stream.write(offset, value),
            Some((Peripheral::Debug, offset)) => {
                if let Some(place) = self.debug.get_mut(offset as usize / 4) {
                    *place = value;
                }
                Vec::new()
            }
            Some((Peripheral::System, offset)) => self.system.write(offset, value, now),
        };
        self.wrong.extend(wrong);
        // The next event may differ now, and the processor may stand.
        let is_data = matches!(
            self.place(address)
                .map(|(peripheral, offset, _)| (peripheral, offset)),
            Some((Peripheral::Spi1 | Peripheral::Usart1 | Peripheral::GpioA, _))
        );
        if !is_data {
            self.stop_at = 0;
        }
    }

    /// The bank sees chip select, PA4, and the latch pulse on PA0.
    fn watch_select(&mut self) -> Option<String> {
        let is_selected = self.ports[0].output(4) == Some(false);
        let latches = self.timers[0].makes_pulses() && self.ports[0].is_alternate(0, 1);
        let latch = if latches {
            self.timers[0].overflows(self.now)
        } else {
            0
        };
        self.spi.set_select(is_selected, latch, self.now)
    }

    /// The address of the byte that the stream moves by now, if any.
    pub fn stream_address(&self) -> Option<(u32, u64)> {
        let at = self.usarts[1].wants_byte_at()?;
        (at <= self.now).then_some((self.stream.next()?, at))
    }

    /// Moves this byte by the stream.
    pub fn stream_byte(&mut self, byte: u8, at: u64) {
        let [_, apb2_hz] = self.rcc.apb_hz(self.now);
        if self.ports[1].is_alternate(6, 8) {
            self.usarts[1].send(byte, at, apb2_hz);
        }
        self.stream.advance();
    }
}
