//! The start of the clock tree: its source, dividers and flash wait states, and their order.
//!
//! | source | core | APB1, its timers | APB2 | wait states | flag |
//! |---|---|---|---|---|---|
//! | crystal 8 MHz → PLL | 168 MHz | 42, 84 MHz | 84 MHz | 5 | none |
//! | internal RC 16 MHz → PLL | 144 MHz | 36, 72 MHz | 72 MHz | 5 | `CLOCK_FALLBACK` |
//! | internal RC 16 MHz | 16 MHz | 16, 16 MHz | 16 MHz | 0 | `CLOCK_FALLBACK` |
//!
//! The rows are tried in this order (RM0090 section 7.2). Every wait is bounded, because a dead crystal must
//! become a flag and not a hang; [`MOST_POLLS`] bounds all of them together.
//!
//! On the last row a period of 250 µs has 4 000 cycles. With the five wait states of 168 MHz every fetch that
//! misses the flash's caches would cost six of them: the interrupt might take all of the period, the main loop
//! would then never feed the watchdog, and the board would reset for ever. Hence wait states and dividers
//! always follow the clock that runs: raised before the clock rises, lowered after it has fallen.
//!
//! [`start`] knows no register: the image implements [`ClockRegisters`] with those of the STM32F405, and
//! `host-tests/firmware/tests/clock_start.rs` with a model in which each of them may fail to answer.
//!
//! # Assumptions
//! After a reset: the internal oscillator runs the core, the PLL is off, every divider is 1, 0 wait states.
//! The supply is 2.7 V to 3.6 V (the wait states below depend on it).

/// Polls before the crystal counts as dead, [`CRYSTAL_PAUSE_CYCLES`] apart. Crystals start within about 2 ms (t_SU(HSE),
/// DS8626 revision 12, table 32), but the time depends on the crystal and its load, and grows in the cold: this waits at
/// least 101 ms, on the internal oscillator at its fastest, and on the board 240 ms at most, at its slowest. The watchdog is not started until later; an option byte that starts it at power-on allows 349 ms at least.
pub const CRYSTAL_POLLS: u32 = 1_700;

/// Cycles between two looks at the crystal.
pub const CRYSTAL_PAUSE_CYCLES: u32 = 1_000;

/// Polls before the PLL counts as not locking: 1 ms; it locks within 300 µs (t_LOCK, data sheet 5.3.10).
pub const PLL_POLLS: u32 = 4_000;

/// Polls for a register to show a written value: it takes a few bus cycles.
pub const REGISTER_POLLS: u32 = 1_000;

/// Polls of a whole start, at most: the crystal, and for each of the two attempts with the PLL its lock and
/// five registers.
pub const MOST_POLLS: u32 = CRYSTAL_POLLS + 2 * (PLL_POLLS + 5 * REGISTER_POLLS);

/// Cycles that a new bus divider takes to act, at most (RM0090 7.3.3).
pub const DIVIDER_CYCLES: u32 = 16;

/// The internal RC oscillator \[Hz\].
pub const INTERNAL_HZ: u32 = 16_000_000;

/// Range of the internal oscillator from -40 to 105 °C \[‰ of [`INTERNAL_HZ`]\]: -8 % to +4.5 % (DS8626 revision 12, table
/// 34; characterised, not tested in production).
pub const INTERNAL_RANGE_PER_MILLE: [u32; 2] = [920, 1045];

/// The core behind the PLL and the crystal \[Hz\]: the fastest that it may run.
pub const PLL_HZ: u32 = 168_000_000;

/// The core behind the PLL and the internal oscillator \[Hz\]: 150.5 MHz at the oscillator's fastest, 132.5 MHz at its
/// slowest. A multiple of every rate that is divided from it: 1 and 3 Mbaud, 4 kHz.
pub const INTERNAL_PLL_HZ: u32 = 144_000_000;

const _: () = assert!(INTERNAL_PLL_HZ / 1000 * INTERNAL_RANGE_PER_MILLE[1] <= 160_000_000);

/// VCO input over PLL input. The allowed input is 0.95 to 2.10 MHz (DS8626 revision 12, table 36): 1 MHz from the crystal,
/// and 1.84 to 2.09 MHz from the internal oscillator, which at 1 MHz could fall below.
const CRYSTAL_DIVIDER: u8 = 8;
const INTERNAL_DIVIDER: u8 = 8;

/// VCO over its input: 336 MHz from the crystal, 288 MHz from the internal oscillator, halved to the core's clock.
const CRYSTAL_MULTIPLIER: u16 = 336;
const INTERNAL_MULTIPLIER: u16 = 144;

/// VCO over USB's 48 MHz, unused here.
const CRYSTAL_USB_DIVIDER: u8 = 7;
const INTERNAL_USB_DIVIDER: u8 = 6;

/// A wait state more for each of these \[Hz\] (RM0090 table 10, 2.7 V to 3.6 V).
const HZ_PER_WAIT_STATE: u32 = 30_000_000;

/// Sources of the system's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ClockSource {
    /// The crystal, through the PLL.
    Crystal,
    /// The internal RC oscillator, through the PLL.
    InternalPll,
    /// The internal RC oscillator itself.
    Internal,
}

/// The running clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Clocks {
    /// The source of the clocks.
    pub source: ClockSource,
    /// The core \[Hz\].
    pub core_hz: u32,
    /// SPI1 and USART1 \[Hz\].
    pub apb2_hz: u32,
    /// TIM2 and TIM5 \[Hz\]: twice APB1 where that is divided.
    pub timer_hz: u32,
    /// Wait states of a flash access.
    pub wait_states: u8,
}

impl Clocks {
    /// True if the clocks run from another source than the crystal.
    pub fn is_fallback(&self) -> bool {
        self.source != ClockSource::Crystal
    }

    const fn of(source: ClockSource) -> Self {
        let (core_hz, fastest_hz, buses) = match source {
            ClockSource::Crystal => (PLL_HZ, PLL_HZ, BusDividers::FULL_SPEED),
            ClockSource::InternalPll => (
                INTERNAL_PLL_HZ,
                INTERNAL_PLL_HZ / 1000 * INTERNAL_RANGE_PER_MILLE[1],
                BusDividers::FULL_SPEED,
            ),
            ClockSource::Internal => (
                INTERNAL_HZ,
                INTERNAL_HZ / 1000 * INTERNAL_RANGE_PER_MILLE[1],
                BusDividers::NONE,
            ),
        };
        let apb1_hz = core_hz / buses.apb1 as u32;
        Self {
            source,
            core_hz,
            apb2_hz: core_hz / buses.apb2 as u32,
            timer_hz: if buses.apb1 == 1 {
                apb1_hz
            } else {
                2 * apb1_hz
            },
            wait_states: wait_states_for(fastest_hz),
        }
    }

    /// Clocks as measured by the low-speed oscillator.
    ///
    /// # Inputs
    /// `reference_hz`: that oscillator as the crystal measured it \[Hz\]. `measured_hz`: the same as these clocks measure it,
    /// taken for nominal \[Hz\].
    ///
    /// # Returns
    /// `self` where the crystal runs, where either is unknown (0), or where the ratio is beyond
    /// [`INTERNAL_RANGE_PER_MILLE`] by more than 2 %: then it is not the internal oscillator that has moved.
    #[must_use]
    pub fn corrected(self, reference_hz: u32, measured_hz: u32) -> Self {
        let [slowest, fastest] = INTERNAL_RANGE_PER_MILLE;
        let per_mille = u64::from(reference_hz) * 1000 / u64::from(measured_hz.max(1));
        let is_known = (u64::from(slowest) - 20..=u64::from(fastest) + 20).contains(&per_mille);
        if !self.is_fallback() || measured_hz == 0 || !is_known {
            return self;
        }
        let scaled =
            |hz: u32| (u64::from(hz) * u64::from(reference_hz) / u64::from(measured_hz)) as u32;
        Self {
            core_hz: scaled(self.core_hz),
            apb2_hz: scaled(self.apb2_hz),
            timer_hz: scaled(self.timer_hz),
            ..self
        }
    }
}

/// Core clock over bus clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BusDividers {
    /// Divider of APB1: 1, 2, 4, 8 or 16.
    pub apb1: u8,
    /// Divider of APB2: 1, 2, 4, 8 or 16.
    pub apb2: u8,
}

impl BusDividers {
    /// Both buses at the core's clock.
    pub const NONE: Self = Self { apb1: 1, apb2: 1 };
    /// Behind the PLL. At 168 MHz: 42 and 84 MHz, the fastest that the buses may run.
    pub const FULL_SPEED: Self = Self { apb1: 4, apb2: 2 };
}

/// The PLL: core = input / `input_divider` × `multiplier` / 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PllSettings {
    /// True if the input is the crystal; else it is the internal oscillator.
    pub from_crystal: bool,
    /// Divider of the input, to 1 or 2 MHz.
    pub input_divider: u8,
    /// Output of the oscillator over its input.
    pub multiplier: u16,
    /// Output of the oscillator over the USB clock.
    pub usb_divider: u8,
}

impl PllSettings {
    const fn from(source: ClockSource) -> Self {
        let from_crystal = matches!(source, ClockSource::Crystal);
        Self {
            from_crystal,
            input_divider: if from_crystal {
                CRYSTAL_DIVIDER
            } else {
                INTERNAL_DIVIDER
            },
            multiplier: if from_crystal {
                CRYSTAL_MULTIPLIER
            } else {
                INTERNAL_MULTIPLIER
            },
            usb_divider: if from_crystal {
                CRYSTAL_USB_DIVIDER
            } else {
                INTERNAL_USB_DIVIDER
            },
        }
    }
}

/// Sources of the core's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CoreClock {
    /// The internal oscillator.
    Internal,
    /// The PLL.
    Pll,
}

/// The registers of clock tree and flash. Each function is one access; none waits.
pub trait ClockRegisters {
    /// Turns the crystal's oscillator on or off.
    fn turn_crystal(&mut self, on: bool);
    /// True if the crystal oscillates.
    fn crystal_is_ready(&mut self) -> bool;
    /// Turns the clock security system on or off: while it is on, a crystal that stops raises the NMI.
    fn watch_crystal(&mut self, on: bool);
    /// Sets the PLL up. It must be off.
    fn set_up_pll(&mut self, settings: PllSettings);
    /// Turns the PLL on or off.
    fn turn_pll(&mut self, on: bool);
    /// True if the PLL has locked.
    fn pll_is_ready(&mut self) -> bool;
    /// Sets the wait states of a flash access and turns its caches on.
    fn set_wait_states(&mut self, wait_states: u8);
    /// The wait states that the flash shows.
    fn wait_states(&mut self) -> u8;
    /// Sets the dividers of the two buses.
    fn set_bus_dividers(&mut self, dividers: BusDividers);
    /// Asks for another clock of the core.
    fn select(&mut self, clock: CoreClock);
    /// The clock that the core runs from; `None` for any other.
    fn selected(&mut self) -> Option<CoreClock>;
    /// Lets `cycles` of the core pass.
    fn pass_cycles(&mut self, cycles: u32);
}

/// Starts the best clock that there is. Runs once, after a reset.
///
/// # Returns
/// The clocks that run. If the crystal does not answer, or the PLL does not run from it: a row of the table with
/// `CLOCK_FALLBACK`.
pub fn start(registers: &mut impl ClockRegisters) -> Clocks {
    registers.turn_crystal(true);
    if crystal_starts(registers) {
        // Before the core may depend on it: without a clock nothing would run that could notice.
        registers.watch_crystal(true);
        if runs_from_pll(registers, ClockSource::Crystal) {
            return Clocks::of(ClockSource::Crystal);
        }
        registers.watch_crystal(false);
    }
    registers.turn_crystal(false);
    start_without_crystal(registers)
}

/// Starts the best clock that needs no crystal, for a run that follows one in which the crystal stopped: a crystal that starts
/// at each boot and stops again would reset the unit for ever. Runs once, after a reset.
///
/// # Returns
/// The clocks that run: a row of the table with `CLOCK_FALLBACK`.
pub fn start_without_crystal(registers: &mut impl ClockRegisters) -> Clocks {
    if runs_from_pll(registers, ClockSource::InternalPll) {
        return Clocks::of(ClockSource::InternalPll);
    }
    Clocks::of(ClockSource::Internal)
}

/// Waits for the crystal, at most [`CRYSTAL_POLLS`] times.
fn crystal_starts(registers: &mut impl ClockRegisters) -> bool {
    (0..CRYSTAL_POLLS).any(|_| {
        let is_ready = registers.crystal_is_ready();
        if !is_ready {
            registers.pass_cycles(CRYSTAL_PAUSE_CYCLES);
        }
        is_ready
    })
}

/// Tries to run from the PLL behind `source`. If it fails, the internal oscillator runs as after reset.
fn runs_from_pll(registers: &mut impl ClockRegisters, source: ClockSource) -> bool {
    // The PLL's configuration may be written only when it has stopped (RM0090 7.3.2).
    if !within(REGISTER_POLLS, || !registers.pll_is_ready()) {
        return false;
    }
    registers.set_up_pll(PllSettings::from(source));
    registers.turn_pll(true);
    let runs =
        within(PLL_POLLS, || registers.pll_is_ready()) && goes_to_full_speed(registers, source);
    runs || !goes_back_to_internal(registers)
}

/// Switches the core to the PLL, which has locked; returns whether it runs from there.
fn goes_to_full_speed(registers: &mut impl ClockRegisters, source: ClockSource) -> bool {
    // First the wait states, and only when the flash shows them the clock that needs them (RM0090 3.5.1).
    let wait_states = Clocks::of(source).wait_states;
    registers.set_wait_states(wait_states);
    if !within(REGISTER_POLLS, || registers.wait_states() == wait_states) {
        return false;
    }
    // The dividers before the clock: they take up to 16 cycles to act (RM0090 7.3.3), and the buses must not
    // be driven beyond their limits meanwhile.
    registers.set_bus_dividers(BusDividers::FULL_SPEED);
    registers.pass_cycles(DIVIDER_CYCLES);
    registers.select(CoreClock::Pll);
    within(REGISTER_POLLS, || {
        registers.selected() == Some(CoreClock::Pll)
    })
}

/// Undoes [`goes_to_full_speed`] in the reverse order: the clock, then the settings that only a faster one needs.
///
/// # Returns
/// True if the internal oscillator runs. If the register does not show it, against RM0090, the PLL must be taken to
/// run: wait states and dividers stay as they are, safe at either frequency.
fn goes_back_to_internal(registers: &mut impl ClockRegisters) -> bool {
    registers.select(CoreClock::Internal);
    if !within(REGISTER_POLLS, || {
        registers.selected() == Some(CoreClock::Internal)
    }) {
        return false;
    }
    registers.set_bus_dividers(BusDividers::NONE);
    registers.pass_cycles(DIVIDER_CYCLES);
    let wait_states = Clocks::of(ClockSource::Internal).wait_states;
    registers.set_wait_states(wait_states);
    // Too many wait states cost time and harm nothing, so a flash that does not show them changes nothing.
    within(REGISTER_POLLS, || registers.wait_states() == wait_states);
    registers.turn_pll(false);
    true
}

/// The wait states that a flash access needs with the core at `core_hz` and 2.7 V to 3.6 V.
pub const fn wait_states_for(core_hz: u32) -> u8 {
    (core_hz.saturating_sub(1) / HZ_PER_WAIT_STATE) as u8
}

/// Polls until `ready`, at most `polls` times.
fn within(polls: u32, mut ready: impl FnMut() -> bool) -> bool {
    (0..polls).any(|_| ready())
}
