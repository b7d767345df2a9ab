//! The watchdog: fed in time on the longest path that there is, and a reset when loop or sampling stops.

use rlg_registers::bank::Fault;
use rlg_registers::board::Behaviour;
use rlg_registers::host::Telemetry;
use rlg_registers::image::{CORES, Image};
use rlg_registers::machine::{Ending, Machine};
use rlg_registers::ticks;
use rlg_registers::watchdog::OSCILLATOR_HZ;
use trueaxis::health::{item, reset_cause};

/// Periods of a second.
const PERIODS: u64 = 4_000;

/// A board whose watchdog's oscillator is as fast as it may be.
fn hasty() -> Behaviour {
    Behaviour {
        watchdog_hz: OSCILLATOR_HZ[1],
        ..Behaviour::SOUND
    }
}

/// Neither crystal nor PLL.
fn slow_clock(cycles_per_ten: u64) -> Behaviour {
    let mut behaviour = hasty();
    behaviour.clocks.crystal_starts = None;
    behaviour.clocks.locks_to_internal = None;
    behaviour.cycles_per_ten = cycles_per_ten;
    behaviour
}

/// Runs for longer than a second, for the log of once a second. `fault`: of every frame of the bank.
fn run(image: &Image, behaviour: Behaviour, fault: Option<&Fault>) -> (Machine, Ending) {
    let mut machine = Machine::new(image, behaviour, [&[], &[]]);
    if let Some(fault) = fault {
        let faults = (0..2 * PERIODS).map(|latch| (latch, fault.clone()));
        machine.board().spi.bank.faults = faults.collect();
    }
    let ending = machine.run_for(ticks::of_ms(1_200));
    let board = machine.board();
    assert!(board.wrong.is_empty(), "{:?}", board.wrong);
    (machine, ending)
}

#[test]
fn fed_in_time() {
    let full_speed = |cycles_per_ten| Behaviour {
        cycles_per_ten,
        ..hasty()
    };
    let boards = [
        ("168 MHz, 1 cycle an instruction", full_speed(10)),
        ("168 MHz, 6 cycles an instruction", full_speed(60)),
        ("16 MHz, 1 cycle an instruction", slow_clock(10)),
    ];
    // A byte that never ends: the interrupt waits as long as it may, at a frame's end after all the rest.
    let banks = [("sound", None), ("dead", Some(Fault::Unfinished(39)))];
    for core in CORES {
        for features in [&[][..], &["raw"]] {
            let image = Image::build(core, features);
            let (mut longest, mut least) = ((0, String::new()), u64::MAX);
            for (board, behaviour) in boards {
                for (bank, fault) in &banks {
                    let what = format!("{board}, bank {bank}");
                    let (mut machine, ending) = run(&image, behaviour, fault.as_ref());
                    assert_eq!(ending, Ending::Time, "{core} {features:?}, {what}");
                    let interrupt_us = 1e3 * ticks::to_ms(machine.longest_interrupt);
                    println!("{core} {features:?}, {what}: interrupt {interrupt_us:.0} of 250 µs");
                    let watchdog = &machine.board().watchdog;
                    assert!(watchdog.is_started() && watchdog.feeds > 100, "{what}");
                    assert!(watchdog.longest < watchdog.allowance(), "{what}");
                    longest = longest.max((watchdog.longest, what));
                    least = least.min(watchdog.allowance());
                }
            }
            println!(
                "watchdog, {core} {features:?}: longest time between two feeds {:.2} ms ({}), shortest allowed {:.0} ms",
                ticks::to_ms(longest.0),
                longest.1,
                ticks::to_ms(least)
            );
        }
    }
}

/// Finds the cycles per instruction on the last row of the clocks at which the main loop no longer feeds the watchdog.
#[test]
fn room_on_the_internal_oscillator() {
    for core in CORES {
        let image = Image::build(core, &[]);
        let lives = |cycles_per_ten: &u64| {
            let (_, ending) = run(&image, slow_clock(*cycles_per_ten), None);
            assert!(
                matches!(ending, Ending::Time | Ending::Watchdog),
                "{ending:?}"
            );
            ending == Ending::Time
        };
        let most = (10..=30).take_while(lives).last();
        let most = most.expect("one cycle an instruction leaves the main loop room");
        println!(
            "{core} on the internal oscillator alone: the watchdog is fed with up to {:.1} cycles an instruction",
            most as f64 / 10.0
        );
    }
}

/// Runs until the watchdog resets the board; the time that took \[ms\]. The boot that follows is sound, and reports its
/// cause.
fn resets(machine: &mut Machine, what: &str) -> f64 {
    let begun = machine.board().now;
    let ending = machine.run_for(ticks::of_ms(2_000));
    assert_eq!(ending, Ending::Watchdog, "{what}");
    let ms = ticks::to_ms(machine.board().now - begun);
    machine.mend_main_loop();
    machine.board().behaviour.sampling_stops = None;
    Telemetry::take(machine);
    machine.follow(&ending);
    assert_eq!(machine.run_for(ticks::of_ms(200)), Ending::Time, "{what}");
    let telemetry = Telemetry::take(machine);
    let cause = reset_cause::INDEPENDENT_WATCHDOG | reset_cause::PIN;
    assert_eq!(telemetry.item(item::RESET_CAUSE), cause, "{what}");
    assert_eq!(telemetry.item(item::LAST_FAILURE_KIND), 0, "{what}");
    let board = machine.board();
    assert!(board.wrong.is_empty(), "{what}: {:?}", board.wrong);
    ms
}

#[test]
fn resets_what_stands() {
    for core in CORES {
        let image = Image::build(core, &[]);
        let mut bounds = (f64::MAX, 0.0_f64);
        for watchdog_hz in [OSCILLATOR_HZ[0], 32_000, OSCILLATOR_HZ[1]] {
            let behaviour = Behaviour {
                watchdog_hz,
                ..Behaviour::SOUND
            };
            let what = format!("{core}, watchdog at {watchdog_hz} Hz");
            let mut machine = Machine::new(&image, behaviour, [&[], &[]]);
            assert_eq!(machine.run_for(ticks::of_ms(100)), Ending::Time, "{what}");
            let served = machine.board().spi.bank.transfers.len();
            machine.hang_main_loop();
            let hung = resets(&mut machine, &format!("{what}, main loop hangs"));
            let periods = machine.board().spi.bank.transfers.len() - served;
            // Sampling went on meanwhile, so it is the loop that was missed.
            assert!(periods > 1_000, "{what}: {periods} periods");
            let stops = machine.board().now + ticks::of_ms(50);
            let behaviour = &mut machine.board().behaviour;
            behaviour.sampling_stops = Some(stops);
            // The main loop goes round all the same.
            behaviour.wakes_after = Some(ticks::of_us(250));
            machine.power_on(5);
            assert_eq!(machine.run_for(ticks::of_ms(50)), Ending::Time, "{what}");
            let silent = resets(&mut machine, &format!("{what}, sampling stops"));
            bounds = (
                bounds.0.min(hung).min(silent),
                bounds.1.max(hung).max(silent),
            );
        }
        // `src/hardware/board/watchdog.rs`: 0.35 s to 0.96 s over the oscillator's tolerance.
        assert!(
            bounds.0 > 340.0 && bounds.1 < 970.0,
            "{core}: {bounds:?} ms"
        );
        println!(
            "watchdog, {core}: main loop hung and sampling stopped, with the oscillator at 17, 32 and 47 kHz: reset after {:.0} to {:.0} ms, and the next boot says so",
            bounds.0, bounds.1
        );
    }
}
