//! A unit that is stopped over its serial port, with the times of the data sheet; and its refusals.

use rlg_registers::board::Behaviour;
use rlg_registers::host::{Telemetry, ask, block, upload};
use rlg_registers::image::{CORES, Image};
use rlg_registers::machine::{Ending, Machine};
use rlg_registers::ticks;
use trueaxis::Status;
use trueaxis::health::{item, reset_cause};
use trueaxis::parameter_slots::MEND_MARKS_OFFSET;
use trueaxis::service_frame::{Answer, Request, RequestKind};

/// A unit that samples, with generations 1 and 2 in its slots, of which the older stands in front of bytes of a longer
/// block: erased bytes must not be read from the data cache.
fn sampling(image: &Image, behaviour: Behaviour) -> Machine {
    let mut older = block(1, 1);
    older.resize(MEND_MARKS_OFFSET as usize, 0);
    let mut machine = Machine::new(image, behaviour, [&older, &block(2, 2)]);
    assert_eq!(machine.run_for(ticks::of_ms(40)), Ending::Time);
    machine
}

/// Asks a unit that samples to stop: it answers, resets, and waits.
fn stop(machine: &mut Machine) -> Answer {
    let request = Request::new(1, RequestKind::Stop, 0);
    // A running unit polls its receiver once a period.
    let answer = ask(machine, &request, 1_000, 100).expect("no reset in front of the answer");
    let ending = machine.run_for(ticks::of_ms(5));
    assert_eq!(ending, Ending::Software);
    machine.follow(&ending);
    assert_eq!(machine.run_for(ticks::of_ms(10)), Ending::Time);
    answer.expect("a running unit answers")
}

/// Stores a block; the answer, and the time that all of it took \[ms\].
fn store(machine: &mut Machine, block: &[u8]) -> (Answer, f64) {
    let begun = machine.board().now;
    let answer = upload(machine, block).expect("no reset");
    (answer, ticks::to_ms(machine.board().now - begun))
}

/// Asks to start anew, and reads the telemetry of the next boot.
fn restart(machine: &mut Machine) -> Telemetry {
    let asked = ask(machine, &Request::new(201, RequestKind::Restart, 0), 0, 20);
    assert_eq!(
        asked
            .expect("no reset in front of the answer")
            .expect("an answer")
            .outcome,
        0
    );
    let ending = machine.run_for(ticks::of_ms(5));
    assert_eq!(ending, Ending::Software);
    machine.follow(&ending);
    Telemetry::take(machine);
    // A slot that was left bad is mended first, in up to 2 s.
    let end = machine.board().now + ticks::of_ms(2_500);
    while !Telemetry::of(&machine.board().usarts[0].sent).is_whole() {
        assert_eq!(machine.run_for(ticks::of_ms(50)), Ending::Time);
        assert!(machine.board().now < end, "silent");
    }
    let board = machine.board();
    assert!(board.wrong.is_empty(), "{:?}", board.wrong);
    assert_eq!(board.usarts[0].overrun_bytes, 0);
    Telemetry::take(machine)
}

#[test]
fn stopped_and_given_parameters() {
    for core in CORES {
        let mut machine = sampling(&Image::build(core, &[]), Behaviour::SOUND);
        assert_eq!(
            (
                stop(&mut machine).outcome,
                machine.board().watchdog.is_started()
            ),
            (0, false)
        );
        let (answer, ms) = store(&mut machine, &block(9, 0));
        assert_eq!(
            (answer.outcome, answer.detail, answer.stopped),
            (0, 3, true)
        );
        let telemetry = restart(&mut machine);
        assert_eq!(telemetry.item(item::GENERATION), 3);
        assert_eq!(
            telemetry.item(item::RESET_CAUSE),
            reset_cause::SOFTWARE | reset_cause::PIN
        );
        assert_eq!(telemetry.item(item::LAST_FAILURE_KIND), 0);
        println!(
            "{core}: stopped by a reset, a block uploaded and stored in {ms:.0} ms with the longest times of the data sheet, in force after the restart, no byte lost"
        );
    }
}

/// Changes the behaviour of a stopped unit's flash or supply, and tries to store a block. Returns the outcome, the
/// generation in force after, and the flash operations.
fn refused(core: &str, change: impl Fn(&mut Behaviour)) -> (u8, u32, usize) {
    let mut machine = sampling(&Image::build(core, &[]), Behaviour::SOUND);
    stop(&mut machine);
    let mut changed = Behaviour::SOUND;
    change(&mut changed);
    let board = machine.board();
    (board.flash.behaviour, board.power.supply_mv) = (changed.flash, changed.supply_mv);
    let (answer, _) = store(&mut machine, &block(9, 0));
    let operations = machine.board().flash.operations;
    let telemetry = restart(&mut machine);
    assert!(!telemetry.all_have(Status::PARAMETERS_DEFAULT));
    (answer.outcome, telemetry.item(item::GENERATION), operations)
}

#[test]
fn a_flash_that_refuses_and_a_supply_that_sags() {
    for core in CORES {
        let protected = refused(core, |board| board.flash.refuses = Some(0));
        assert_eq!(
            (protected.0, protected.1),
            (14, 2),
            "{core}: sector protected"
        );
        let word = refused(core, |board| board.flash.refuses = Some(20));
        assert_eq!((word.0, word.1), (14, 2), "{core}: word refused");
        let hung = refused(core, |board| board.flash.hangs_from = Some(5));
        assert_eq!((hung.0, hung.1), (14, 2), "{core}: controller hangs");
        let low = refused(core, |board| board.supply_mv = 2_800);
        assert_eq!(low, (13, 2, 0), "{core}: supply at 2.8 V");
        println!(
            "{core}: erasure refused, word refused, controller hung (outcome 14), supply at 2.8 V (outcome 13, flash untouched): the old block in force after each"
        );
    }
}

#[test]
fn a_bad_slot_with_a_low_supply_stays_as_it_is() {
    for core in CORES {
        let mut behaviour = Behaviour::SOUND;
        behaviour.supply_mv = 2_800;
        let mut machine = Machine::new(&Image::build(core, &[]), behaviour, [&[], &block(2, 2)]);
        assert_eq!(machine.run_for(ticks::of_ms(200)), Ending::Time);
        let telemetry = Telemetry::take(&mut machine);
        assert!(telemetry.all_have(Status::PARAMETER_SLOT_BAD));
        assert_eq!(telemetry.item(item::GENERATION), 2);
        assert_eq!(machine.board().flash.operations, 0);
        // The same board with its supply back: mended, which takes the longest erasure, before the watchdog is started.
        machine.board().behaviour = Behaviour::SOUND;
        machine.power_on(2);
        assert_eq!(machine.run_for(ticks::of_ms(2_400)), Ending::Time);
        assert_eq!(machine.board().flash.erasures, 1);
        machine.power_on(3);
        assert_eq!(machine.run_for(ticks::of_ms(60)), Ending::Time);
        Telemetry::take(&mut machine);
        assert_eq!(machine.run_for(ticks::of_ms(60)), Ending::Time);
        assert!(!Telemetry::take(&mut machine).all_have(Status::PARAMETER_SLOT_BAD));
        assert!(
            machine.board().wrong.is_empty(),
            "{:?}",
            machine.board().wrong
        );
        println!(
            "{core}: a bad slot is left alone at 2.8 V and mended at 3.3 V in an erasure of 2 s, without the watchdog"
        );
    }
}
