//! The clock tree, in every way that crystal, PLL, switch and wait states may answer: the image ends on a row of
//! docs/board.md and reports it, within its bound.

use rlg_registers::board::{Behaviour, Board};
use rlg_registers::host::{Telemetry, ask};
use rlg_registers::image::{CORES, Image};
use rlg_registers::machine::{Ending, Machine};
use rlg_registers::{rcc, ticks};
use trueaxis::Status;
use trueaxis::board_state::BoardState;
use trueaxis::clock_start::MOST_POLLS;
use trueaxis::health::{HEALTH_ITEMS, item, reset_cause};
use trueaxis::service_frame::{Request, RequestKind};

/// A row of the table of clocks in docs/board.md: core, APB1, APB2, timers \[Hz\], wait states.
type Row = (u32, [u32; 2], u32, u32);
const FULL_SPEED: Row = (168_000_000, [42_000_000, 84_000_000], 84_000_000, 5);
const INTERNAL_PLL: Row = (144_000_000, [36_000_000, 72_000_000], 72_000_000, 5);
const INTERNAL: Row = (16_000_000, [16_000_000; 2], 16_000_000, 0);

/// Reads of the registers of clocks and flash that are no polls of the start: of bits to be changed and clock enables to be
/// confirmed, of the reset's cause, and until the low-speed oscillator is ready, 40 µs.
const OTHER_READS: u64 = 1_100;

fn row(board: &Board) -> Row {
    let (rcc, now) = (&board.rcc, board.now);
    let wait_states = board.flash.wait_states();
    (
        rcc.core_hz(now),
        rcc.apb_hz(now),
        rcc.timer_hz(now),
        wait_states,
    )
}

fn boot(
    image: &Image,
    clocks: rcc::Behaviour,
    shows_wait_states: bool,
    ms: u64,
) -> (Machine, Telemetry) {
    let mut behaviour = Behaviour {
        clocks,
        ..Behaviour::SOUND
    };
    behaviour.flash.shows_wait_states = shows_wait_states;
    let mut machine = Machine::new(image, behaviour, [&[], &[]]);
    assert_eq!(machine.run(ticks::of_ms(ms)), Ending::Time, "{clocks:?}");
    let telemetry = Telemetry::of(&machine.board().usarts[0].sent);
    (machine, telemetry)
}

/// Checks of every row: nothing forbidden was done, and line and sampling have the rates of docs/board.md.
fn check_rates(machine: &mut Machine, what: &str) {
    let board = machine.board();
    assert!(board.wrong.is_empty(), "{what}: {:?}", board.wrong);
    let [_, apb2_hz] = board.rcc.apb_hz(board.now);
    assert_eq!(board.usarts[0].baud(apb2_hz), 1_000_000, "{what}");
    assert_eq!(board.timers[0].period_ticks(), ticks::of_us(250), "{what}");
    let reads = board.clock_reads;
    assert!(
        reads <= u64::from(MOST_POLLS) + OTHER_READS,
        "{what}: {reads} reads"
    );
}

#[test]
fn every_row_with_every_answer() {
    let us = |us: u64| Some(ticks::of_us(us));
    let crystals = [
        ("lives", us(2_000)),
        ("late", us(100_000)),
        ("too late", us(300_000)),
        ("dead", None),
    ];
    let plls = [
        ("locks", us(200), us(200)),
        ("late", us(300), us(300)),
        ("not to the crystal", None, us(200)),
        ("dead", None, None),
    ];
    let mut worst = 0;
    let mut rows = [0; 3];
    for core in CORES {
        let image = Image::build(core, &[]);
        for (crystal, starts) in crystals {
            for (pll, locks_to_crystal, locks_to_internal) in plls {
                for (switches, shows) in
                    [(true, true), (true, false), (false, true), (false, false)]
                {
                    let what = format!(
                        "{core}: crystal {crystal}, PLL {pll}, switch {switches}, wait states {shows}"
                    );
                    let clocks = rcc::Behaviour {
                        crystal_starts: starts,
                        crystal_stops: None,
                        locks_to_crystal,
                        locks_to_internal,
                        switches,
                        ..rcc::Behaviour::SOUND
                    };
                    let (mut machine, telemetry) = boot(&image, clocks, shows, 170);
                    let from_crystal = starts.is_some_and(|after| after <= ticks::of_us(100_000))
                        && locks_to_crystal.is_some();
                    let from_pll =
                        switches && shows && (from_crystal || locks_to_internal.is_some());
                    let expected = match (from_pll, from_crystal) {
                        (true, true) => FULL_SPEED,
                        (true, false) => INTERNAL_PLL,
                        (false, _) => INTERNAL,
                    };
                    assert_eq!(row(machine.board()), expected, "{what}");
                    let is_first = from_pll && from_crystal;
                    assert_eq!(
                        telemetry.all_have(Status::CLOCK_FALLBACK),
                        !is_first,
                        "{what}"
                    );
                    assert_eq!(machine.board().rcc.watches_crystal(), is_first, "{what}");
                    check_rates(&mut machine, &what);
                    worst = worst.max(machine.board().clock_reads);
                    rows[if is_first {
                        0
                    } else if from_pll {
                        1
                    } else {
                        2
                    }] += 1;
                }
            }
        }
    }
    let [crystal, internal_pll, internal] = rows;
    println!(
        "boots: {} in all, {crystal} on crystal and PLL, {internal_pll} on the internal oscillator and PLL, {internal} on the internal oscillator; at most {} reads of clock registers, bound {MOST_POLLS} polls",
        crystal + internal_pll + internal,
        worst
    );
}

/// Between two delays that are tried \[µs\].
const STEP_US: u64 = 5_000;

#[test]
fn a_crystal_of_any_delay() {
    let image = Image::build(CORES[0], &[]);
    let mut latest_us = 0;
    let mut boots = 0;
    for us in (0..=200_000).step_by(STEP_US as usize) {
        let clocks = rcc::Behaviour {
            crystal_starts: Some(ticks::of_us(us)),
            ..rcc::Behaviour::SOUND
        };
        let (mut machine, telemetry) = boot(&image, clocks, true, 170);
        let is_fallback = telemetry.all_have(Status::CLOCK_FALLBACK);
        let expected = if is_fallback {
            INTERNAL_PLL
        } else {
            FULL_SPEED
        };
        assert_eq!(row(machine.board()), expected, "{us} µs");
        assert_eq!(
            machine.board().rcc.watches_crystal(),
            !is_fallback,
            "{us} µs"
        );
        assert!(
            !is_fallback || us > 100_000,
            "{us} µs: taken for dead, docs/board.md waits 100 ms"
        );
        check_rates(&mut machine, &format!("{us} µs"));
        if !is_fallback {
            assert!(
                us == 0 || us - latest_us == STEP_US,
                "{us} µs: taken, but not {latest_us} µs"
            );
            latest_us = us;
        }
        boots += 1;
    }
    assert!(
        latest_us < 200_000,
        "a late crystal is waited for without an end"
    );
    println!(
        "crystals: {boots} delays from 0 to 200 ms, taken up to {:.1} ms",
        latest_us as f64 * 1e-3
    );
}

/// The crystal stops `stops` ticks after power-on and stays dead: the boot that follows is on the second row and
/// reports the reason.
///
/// # Returns
/// True if the clock security system noticed it.
fn lose_crystal(machine: &mut Machine, stops: u64, what: &str) -> bool {
    let clocks = &mut machine.board().behaviour.clocks;
    *clocks = rcc::Behaviour {
        crystal_stops: Some(stops),
        ..rcc::Behaviour::SOUND
    };
    machine.power_on(stops);
    let ending = machine.run_for(stops + ticks::of_ms(130));
    let was_lost = ending == Ending::Software;
    if was_lost {
        let clocks = &mut machine.board().behaviour.clocks;
        (clocks.crystal_starts, clocks.crystal_stops) = (None, None);
        Telemetry::take(machine);
        machine.follow(&ending);
        assert_eq!(machine.run_for(ticks::of_ms(40)), Ending::Time, "{what}");
    } else {
        assert_eq!(ending, Ending::Time, "{what}");
    }
    let board = machine.board();
    assert!(board.wrong.is_empty(), "{what}: {:?}", board.wrong);
    assert_eq!(row(board), INTERNAL_PLL, "{what}");
    was_lost
}

#[test]
fn a_crystal_that_stops_in_service() {
    let mut moments = 0;
    for core in CORES {
        let image = Image::build(core, &[]);
        let mut machine = Machine::new(&image, Behaviour::SOUND, [&[], &[]]);
        // Through a whole sampling period: in the interrupt, on the bus, in the main loop, asleep.
        for step in 0..25 {
            let stops = ticks::of_ms(40) + step * ticks::of_us(10) + step * ticks::of_ns(3);
            let what = format!("{core}, {} ms", ticks::to_ms(stops));
            assert!(lose_crystal(&mut machine, stops, &what), "{what}: not seen");
            // Until every health item was sent, one with each output of 20 periods.
            let round = HEALTH_ITEMS.len() as u64 * ticks::of_ms(5);
            assert_eq!(machine.run_for(round), Ending::Time, "{what}");
            let telemetry = Telemetry::take(&mut machine);
            assert!(telemetry.is_whole(), "{what}");
            assert!(telemetry.all_have(Status::CLOCK_FALLBACK), "{what}");
            assert_eq!(telemetry.item(item::LAST_FAILURE_KIND), 3, "{what}");
            let cause = reset_cause::SOFTWARE | reset_cause::PIN;
            assert_eq!(telemetry.item(item::RESET_CAUSE), cause, "{what}");
            moments += 1;
        }
    }
    println!(
        "crystals that stop in service: {moments} moments of a sampling period, each told as lost clock by the boot that followed"
    );
}

#[test]
fn a_crystal_that_stops_after_each_start() {
    for core in CORES {
        let mut behaviour = Behaviour::SOUND;
        behaviour.clocks.crystal_stops = Some(ticks::of_ms(10));
        let mut machine = Machine::new(&Image::build(core, &[]), behaviour, [&[], &[]]);
        let ending = machine.run_for(ticks::of_ms(200));
        assert_eq!(ending, Ending::Software, "{core}");
        machine.follow(&ending);
        Telemetry::take(&mut machine);
        assert_eq!(
            machine.run_for(ticks::of_ms(200)),
            Ending::Time,
            "{core}: reset again"
        );
        let telemetry = Telemetry::take(&mut machine);
        assert!(telemetry.all_have(Status::CLOCK_FALLBACK), "{core}");
        assert_eq!(telemetry.item(item::LAST_FAILURE_KIND), 3, "{core}");
        check_rates(&mut machine, core);
        println!(
            "{core}: a crystal that stops 10 ms after each start: one reset, then service on the internal oscillator"
        );
    }
}

/// Time at which the core goes over to the PLL \[ticks since power-on\], to a microsecond.
fn full_speed_at(machine: &mut Machine) -> u64 {
    let mut microseconds = (1..10_000).map(ticks::of_us);
    let found = microseconds.find(|until| {
        machine.run(*until);
        let board = machine.board();
        board.rcc.core_hz(board.now) == FULL_SPEED.0
    });
    found.expect("a sound board comes to full speed")
}

#[test]
fn a_crystal_that_stops_while_the_clock_starts() {
    let image = Image::build(CORES[0], &[]);
    let mut machine = Machine::new(&image, Behaviour::SOUND, [&[], &[]]);
    let mut seen = [0; 2];
    let full_speed = full_speed_at(&mut machine);
    // Coarsely from power-on on, then by 24 ns about the time when the core goes over to the PLL.
    let coarse = (0..40).map(|step| step * ticks::of_us(100));
    let fine = (0..500).map(|step| full_speed - ticks::of_us(8) + step * ticks::of_ns(24));
    for stops in coarse.chain(fine) {
        let what = format!("stopped {:.5} ms after power-on", ticks::to_ms(stops));
        Telemetry::take(&mut machine);
        let was_lost = lose_crystal(&mut machine, stops, &what);
        let telemetry = Telemetry::take(&mut machine);
        assert!(!telemetry.frames.is_empty(), "{what}: the unit is silent");
        assert!(telemetry.all_have(Status::CLOCK_FALLBACK), "{what}");
        seen[usize::from(was_lost)] += 1;
    }
    let [waited, watched] = seen;
    assert!(
        waited > 0 && watched > 0,
        "full speed at {full_speed} ticks, outside of what was tried"
    );
    println!(
        "crystals that stop while the clock starts: {} moments; {watched} seen by the clock security system, {waited} by a wait that ended; every one ends on the internal oscillator",
        waited + watched
    );
}

/// Rates at which a receiver is set to read a line of unknown clock \[bits/s\], and what a receiver of 8N1 takes: the tenth
/// bit may be off by half a bit, with margin for edges and sampling, 3.6 %.
const RECEIVERS: [f64; 2] = [952_000.0, 1_010_000.0];
const RECEIVER_TOLERANCE: f64 = 0.036;

/// Periods of the internal oscillator \[‰ of nominal\]: +4.5 % to -8 % of its rate (DS8626 revision 12, table 34).
fn periods() -> impl Iterator<Item = u64> {
    (957..=1087).step_by(13)
}

/// The word that answers a request for the state.
fn state(machine: &mut Machine) -> BoardState {
    let request = Request::new(9, RequestKind::State, 0);
    let answer = ask(machine, &request, 1_000, 100).expect("no reset");
    BoardState::from_word(answer.expect("an answer").detail)
}

#[test]
fn the_internal_oscillator_over_temperature() {
    let image = Image::build(CORES[0], &[]);
    let (mut fastest_hz, mut cold_bauds, mut boots) = (0, [f64::MAX, 0.0_f64], 0);
    let (mut worst_baud, mut worst_period, mut worst_told) = (0.0_f64, 0.0_f64, 0.0_f64);
    for internal_period_per_mille in periods() {
        let what = format!("{internal_period_per_mille} ‰");
        let mut behaviour = Behaviour::SOUND;
        behaviour.clocks.internal_period_per_mille = internal_period_per_mille;
        // Never a crystal: on the PLL, and without a PLL.
        for locks in [Some(ticks::of_us(200)), None] {
            let mut cold = behaviour;
            (cold.clocks.crystal_starts, cold.clocks.locks_to_internal) = (None, locks);
            let mut machine = Machine::new(&image, cold, [&[], &[]]);
            assert_eq!(machine.run_for(ticks::of_ms(260)), Ending::Time, "{what}");
            let told = state(&mut machine);
            assert!(told.clock_fallback && told.low_speed_hz > 17_000 && told.reference_hz == 0);
            let board = machine.board();
            assert!(board.wrong.is_empty(), "{what}: {:?}", board.wrong);
            let [_, apb2_hz] = board.rcc.apb_hz(board.now);
            let baud = f64::from(board.usarts[0].baud(apb2_hz));
            let can_read = RECEIVERS
                .iter()
                .any(|receiver| (baud / receiver - 1.0).abs() < RECEIVER_TOLERANCE);
            assert!(can_read, "{what}: {baud}");
            cold_bauds = [cold_bauds[0].min(baud), cold_bauds[1].max(baud)];
            fastest_hz = fastest_hz.max(board.fastest_hz);
            boots += 1;
        }
        // A crystal that ran and stopped: the low-speed oscillator shows what the clock is.
        behaviour.clocks.crystal_stops = Some(ticks::of_ms(60));
        let mut machine = Machine::new(&image, behaviour, [&[], &[]]);
        let ending = machine.run_for(ticks::of_ms(100));
        assert_eq!(ending, Ending::Software, "{what}");
        fastest_hz = fastest_hz.max(machine.board().fastest_hz);
        let clocks = &mut machine.board().behaviour.clocks;
        (clocks.crystal_starts, clocks.crystal_stops) = (None, None);
        machine.follow(&ending);
        assert_eq!(machine.run_for(ticks::of_ms(60)), Ending::Time, "{what}");
        let told = state(&mut machine).deviation().expect("both were measured");
        let board = machine.board();
        assert!(board.wrong.is_empty(), "{what}: {:?}", board.wrong);
        let [_, apb2_hz] = board.rcc.apb_hz(board.now);
        let baud = f64::from(board.usarts[0].baud(apb2_hz)) / 1e6 - 1.0;
        let period = ticks::to_ms(board.timers[0].period_ticks()) / 0.25 - 1.0;
        let deviation = 1000.0 / internal_period_per_mille as f64 - 1.0;
        worst_baud = worst_baud.max(baud.abs());
        worst_period = worst_period.max(period.abs());
        worst_told = worst_told.max((told - deviation).abs());
        fastest_hz = fastest_hz.max(board.fastest_hz);
        boots += 2;
    }
    assert!(fastest_hz <= 168_000_000, "{fastest_hz} Hz");
    assert!(worst_baud < 0.01 && worst_period < 1e-3 && worst_told < 1e-3);
    println!(
        "internal oscillator, -8 to +4.5 %: {boots} boots, core at most {:.2} MHz; line without a reference {:.0} to {:.0} kbaud, read at 952 or 1010 kbaud; with the reference of an earlier run: line to {:.2} %, sampling period to {:.3} %, deviation told to {:.3} %",
        f64::from(fastest_hz) * 1e-6,
        cold_bauds[0] * 1e-3,
        cold_bauds[1] * 1e-3,
        1e2 * worst_baud,
        1e2 * worst_period,
        1e2 * worst_told
    );
}

#[test]
fn supply_caches_and_enables_are_told() {
    let image = Image::build(CORES[0], &[]);
    let told = |change: &dyn Fn(&mut Behaviour)| {
        let mut behaviour = Behaviour::SOUND;
        change(&mut behaviour);
        let mut machine = Machine::new(&image, behaviour, [&[], &[]]);
        assert_eq!(machine.run_for(ticks::of_ms(60)), Ending::Time);
        let state = state(&mut machine);
        (state.brown_out_low, state.caches_off)
    };
    assert_eq!(told(&|_| {}), (false, false));
    for level in 1..=3 {
        assert_eq!(told(&|board| board.flash.brown_out = level), (true, false));
    }
    for bit in [8, 9, 10] {
        assert_eq!(
            told(&|board| board.flash.access_stays = !(1 << bit)),
            (false, true)
        );
    }
}
