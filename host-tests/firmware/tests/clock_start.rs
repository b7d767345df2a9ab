//! The start of the clock tree over registers of which any may answer late or never.
//!
//! The model counts polls and knows at every moment the core's true clock. After each access it compares wait states
//! and buses with the needs of that frequency: RM0090 table 10 and the data sheet's limits of APB1 and APB2, written
//! out here a second time.

use trueaxis::clock_start::{
    BusDividers, CRYSTAL_POLLS, ClockRegisters, ClockSource, Clocks, CoreClock, DIVIDER_CYCLES,
    MOST_POLLS, PLL_POLLS, PllSettings, REGISTER_POLLS, start, start_without_crystal,
};

/// Time at which a register shows a requested value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Answer {
    /// After so many polls.
    After(u32),
    Never,
}

impl Answer {
    /// At once, with the last poll that is waited for, one too late, never.
    fn around(bound: u32) -> [Self; 4] {
        [
            Self::After(0),
            Self::After(bound - 1),
            Self::After(bound),
            Self::Never,
        ]
    }

    fn has_come(self, polls: u32) -> bool {
        matches!(self, Self::After(due) if polls >= due)
    }
}

/// Response of the flash to the number of wait states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WaitStateRegister {
    Takes,
    /// It keeps the 0 that it has after a reset.
    Stuck,
    /// It takes the number and shows another one.
    ShowsOther,
}

/// Responses of one board.
#[derive(Debug, Clone, Copy)]
struct Board {
    crystal: Answer,
    /// The PLL's lock, with the crystal and with the internal oscillator behind it.
    locks: [Answer; 2],
    /// The PLL stops on request.
    pll_stops: bool,
    /// From the request until the core runs from the PLL.
    to_pll: Answer,
    /// Back again.
    to_internal: Answer,
    /// The register shows which clock runs; else it shows none that is known.
    switch_is_shown: bool,
    wait_states: WaitStateRegister,
}

struct Model {
    board: Board,
    polls: u32,
    /// Poll at which the crystal was turned on.
    crystal_since: Option<u32>,
    pll_since: Option<u32>,
    pll_stuck_on: bool,
    settings: Option<PllSettings>,
    core: CoreClock,
    requested: (CoreClock, u32),
    wait_states: u8,
    /// Those that act, and before them those that may still act.
    dividers: [BusDividers; 2],
    crystal_is_watched: bool,
}

impl Model {
    /// After a reset.
    fn new(board: Board) -> Self {
        Self {
            board,
            polls: 0,
            crystal_since: None,
            pll_since: None,
            pll_stuck_on: false,
            settings: None,
            core: CoreClock::Internal,
            requested: (CoreClock::Internal, 0),
            wait_states: 0,
            dividers: [BusDividers::NONE; 2],
            crystal_is_watched: false,
        }
    }

    fn poll(&mut self) {
        self.polls += 1;
        self.check();
    }

    fn since(&self, begin: u32) -> u32 {
        self.polls - begin
    }

    fn is_locked(&self) -> bool {
        let Some(settings) = self.settings else {
            return false;
        };
        let lock = self.board.locks[usize::from(!settings.from_crystal)];
        self.pll_stuck_on
            || self
                .pll_since
                .is_some_and(|begin| lock.has_come(self.since(begin)))
    }

    /// Lets the requested clock come, if it is time.
    fn settle(&mut self) {
        let (clock, begin) = self.requested;
        let answer = match clock {
            CoreClock::Internal => self.board.to_internal,
            CoreClock::Pll => self.board.to_pll,
        };
        if clock != self.core && answer.has_come(self.since(begin)) {
            assert!(clock == CoreClock::Internal || self.is_locked());
            let from_crystal = self.settings.is_some_and(|settings| settings.from_crystal);
            let depends = clock == CoreClock::Pll && from_crystal;
            assert!(!depends || self.crystal_is_watched, "{:?}", self.board);
            self.core = clock;
        }
    }

    /// Nominally.
    fn core_hz(&self) -> u32 {
        match self.core {
            CoreClock::Internal => 16_000_000,
            CoreClock::Pll => {
                let settings = self.settings.expect("a PLL that runs was set up");
                let input = if settings.from_crystal { 8 } else { 16 };
                input * 1_000_000 / u32::from(settings.input_divider)
                    * u32::from(settings.multiplier)
                    / 2
            }
        }
    }

    /// With the internal oscillator at its fastest, 4.5 % above.
    fn fastest_hz(&self) -> u32 {
        let from_crystal = self.settings.is_some_and(|settings| settings.from_crystal);
        match self.core {
            CoreClock::Pll if from_crystal => self.core_hz(),
            _ => self.core_hz() / 1000 * 1045,
        }
    }

    /// Nothing runs faster than it may, at this moment.
    fn check(&mut self) {
        self.settle();
        let core_hz = self.fastest_hz();
        let needed = match core_hz {
            0..=30_000_000 => 0,
            30_000_001..=60_000_000 => 1,
            60_000_001..=90_000_000 => 2,
            90_000_001..=120_000_000 => 3,
            120_000_001..=150_000_000 => 4,
            150_000_001..=168_000_000 => 5,
            _ => panic!("{core_hz} Hz, {:?}", self.board),
        };
        assert!(
            self.wait_states >= needed,
            "{} wait states at {core_hz} Hz, {:?}",
            self.wait_states,
            self.board
        );
        for dividers in self.dividers {
            assert!(core_hz / u32::from(dividers.apb1) <= 42_000_000);
            assert!(core_hz / u32::from(dividers.apb2) <= 84_000_000);
        }
        assert!(self.polls <= MOST_POLLS, "{:?}", self.board);
    }
}

impl ClockRegisters for Model {
    fn turn_crystal(&mut self, on: bool) {
        let behind_core =
            self.core == CoreClock::Pll && self.settings.expect("set up").from_crystal;
        assert!(on || !behind_core, "the core loses its clock");
        assert!(on || !self.crystal_is_watched, "its end would be an alarm");
        self.crystal_since = on.then_some(self.polls);
    }

    fn crystal_is_ready(&mut self) -> bool {
        let crystal = self.board.crystal;
        let ready = self
            .crystal_since
            .is_some_and(|begin| crystal.has_come(self.since(begin)));
        self.poll();
        ready
    }

    fn watch_crystal(&mut self, on: bool) {
        // Not before it oscillates, and as long as the core may run from it.
        assert!(self.crystal_since.is_some());
        self.crystal_is_watched = on;
    }

    fn set_up_pll(&mut self, settings: PllSettings) {
        assert!(self.pll_since.is_none() && !self.pll_stuck_on);
        let input_mhz = if settings.from_crystal { 1 } else { 2 };
        assert_eq!(settings.input_divider, 8, "of 8 or of 16 MHz");
        assert_eq!(
            input_mhz * u32::from(settings.multiplier),
            48 * u32::from(settings.usb_divider)
        );
        self.settings = Some(settings);
    }

    fn turn_pll(&mut self, on: bool) {
        assert!(
            on || self.core != CoreClock::Pll,
            "the core loses its clock"
        );
        self.pll_stuck_on = self.pll_stuck_on || (!on && !self.board.pll_stops && self.is_locked());
        self.pll_since = on.then_some(self.polls);
    }

    fn pll_is_ready(&mut self) -> bool {
        let ready = self.is_locked();
        self.poll();
        ready
    }

    fn set_wait_states(&mut self, wait_states: u8) {
        if self.board.wait_states != WaitStateRegister::Stuck {
            self.wait_states = wait_states;
        }
        self.check();
    }

    fn wait_states(&mut self) -> u8 {
        self.poll();
        match self.board.wait_states {
            WaitStateRegister::ShowsOther => self.wait_states ^ 7,
            _ => self.wait_states,
        }
    }

    fn set_bus_dividers(&mut self, dividers: BusDividers) {
        self.dividers[1] = dividers;
        self.check();
    }

    fn select(&mut self, clock: CoreClock) {
        self.requested = (clock, self.polls);
        self.check();
    }

    fn selected(&mut self) -> Option<CoreClock> {
        self.settle();
        let shown = self.core;
        self.poll();
        self.board.switch_is_shown.then_some(shown)
    }

    fn pass_cycles(&mut self, cycles: u32) {
        if cycles >= DIVIDER_CYCLES {
            self.dividers[0] = self.dividers[1];
        }
        self.check();
    }
}

/// Every combination of answers.
fn boards() -> impl Iterator<Item = Board> {
    let registers = [
        WaitStateRegister::Takes,
        WaitStateRegister::Stuck,
        WaitStateRegister::ShowsOther,
    ];
    let mut boards = Vec::new();
    for crystal in Answer::around(CRYSTAL_POLLS) {
        for with_crystal in Answer::around(PLL_POLLS) {
            for with_internal in Answer::around(PLL_POLLS) {
                for to_pll in Answer::around(REGISTER_POLLS) {
                    for wait_states in registers {
                        for pll_stops in [true, false] {
                            boards.push(Board {
                                crystal,
                                locks: [with_crystal, with_internal],
                                pll_stops,
                                to_pll,
                                to_internal: Answer::After(0),
                                switch_is_shown: true,
                                wait_states,
                            });
                        }
                    }
                }
            }
        }
    }
    boards.into_iter()
}

/// The clock source that the table promises for this board.
fn promised(board: &Board) -> ClockSource {
    let in_time = |answer: Answer, bound| matches!(answer, Answer::After(polls) if polls < bound);
    let runs = |lock| {
        in_time(lock, PLL_POLLS)
            && in_time(board.to_pll, REGISTER_POLLS)
            && board.wait_states == WaitStateRegister::Takes
    };
    let [with_crystal, with_internal] = board.locks;
    let crystal = in_time(board.crystal, CRYSTAL_POLLS);
    // A PLL that locked on the crystal and does not stop cannot be set up anew.
    let blocked = crystal && with_crystal != Answer::Never && !board.pll_stops;
    if crystal && runs(with_crystal) {
        ClockSource::Crystal
    } else if !blocked && runs(with_internal) {
        ClockSource::InternalPll
    } else {
        ClockSource::Internal
    }
}

#[test]
fn every_board_gets_the_row_of_the_table_that_it_can_run() {
    let mut rows = [0; 3];
    let mut most = 0;
    for board in boards() {
        let mut model = Model::new(board);
        let clocks = start(&mut model);
        assert_eq!(clocks.source, promised(&board), "{board:?}");
        let full_speed = |source| {
            let core_hz = if source == ClockSource::Crystal {
                168_000_000
            } else {
                144_000_000
            };
            Clocks {
                source,
                core_hz,
                apb2_hz: core_hz / 2,
                timer_hz: core_hz / 2,
                wait_states: 5,
            }
        };
        let (expected, dividers) = match clocks.source {
            ClockSource::Internal => {
                let clocks = Clocks {
                    source: ClockSource::Internal,
                    core_hz: 16_000_000,
                    apb2_hz: 16_000_000,
                    timer_hz: 16_000_000,
                    wait_states: 0,
                };
                (clocks, BusDividers::NONE)
            }
            source => (full_speed(source), BusDividers { apb1: 4, apb2: 2 }),
        };
        assert_eq!(clocks, expected);
        assert_eq!(model.core_hz(), expected.core_hz, "{board:?}");
        assert_eq!(model.wait_states, expected.wait_states, "{board:?}");
        assert_eq!(model.dividers, [dividers; 2], "{board:?}");
        let crystal_runs = clocks.source == ClockSource::Crystal;
        assert_eq!(clocks.is_fallback(), !crystal_runs);
        assert_eq!(model.crystal_is_watched, crystal_runs);
        assert_eq!(model.crystal_since.is_some(), crystal_runs);
        rows[clocks.source as usize] += 1;
        most = most.max(model.polls);
    }
    println!("crystal, internal with PLL, internal: {rows:?} boards; at most {most} polls");
    assert!(rows.iter().all(|boards| *boards > 0));
}

#[test]
fn a_switch_that_shows_no_known_clock_leaves_what_is_safe_at_either_frequency() {
    for board in boards() {
        for to_internal in [Answer::After(0), Answer::Never] {
            let board = Board {
                to_internal,
                switch_is_shown: false,
                ..board
            };
            // The model checks every moment, and the number of polls.
            let mut model = Model::new(board);
            start(&mut model);
            model.check();
        }
    }
}

#[test]
fn without_the_crystal_that_is_not_even_turned_on() {
    for board in boards() {
        let mut model = Model::new(board);
        let clocks = start_without_crystal(&mut model);
        let dead = Board {
            crystal: Answer::Never,
            ..board
        };
        assert_eq!(clocks.source, promised(&dead), "{board:?}");
        assert!(clocks.is_fallback());
        assert!(model.crystal_since.is_none() && !model.crystal_is_watched);
    }
}

#[test]
fn registers_that_read_as_zero_end_on_the_last_row() {
    // As in the emulator.
    let mut model = Model::new(Board {
        crystal: Answer::Never,
        locks: [Answer::Never; 2],
        pll_stops: true,
        to_pll: Answer::Never,
        to_internal: Answer::After(0),
        switch_is_shown: true,
        wait_states: WaitStateRegister::Stuck,
    });
    let clocks = start(&mut model);
    assert_eq!(clocks.source, ClockSource::Internal);
    assert!(model.polls < CRYSTAL_POLLS + PLL_POLLS + 10);
}
