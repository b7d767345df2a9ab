//! The parameter slots through the image's own flash driver: uploads and mends with power cut at every operation, controllers
//! that refuse or hang, supplies that sag.

use rlg_registers::board::Behaviour;
use rlg_registers::flash::{Cut, Leftover};
use rlg_registers::host::{Telemetry, block, upload};
use rlg_registers::image::{CORES, Image};
use rlg_registers::machine::{Ending, Machine};
use rlg_registers::ticks;
use trueaxis::health::item;
use trueaxis::{PARAMETER_BLOCK_BYTES, Status};

/// The request to stop, as the image leaves it in memory for the boot that follows (`src/hardware/service_mode.rs`).
const STOP: (&str, u32) = ("STOP_REQUEST", u32::from_le_bytes(*b"STOP"));

/// Largest time of a boot until it has sent its generation, with a mend \[ms\].
const TOLD_MS: u64 = 200;

/// Both slots good, generation 2 in force.
fn in_use(machine: &mut Machine) {
    for (place, generation) in [(0, 1), (1, 2)] {
        let flash = &mut machine.board().flash;
        flash.store(place, &block(generation, generation));
    }
}

/// A unit that waits for requests, with generation 2 in force.
fn stopped(machine: &mut Machine, behaviour: Behaviour) {
    machine.board().behaviour = behaviour;
    in_use(machine);
    machine.power_on_with(7, STOP.0, STOP.1);
    assert_eq!(machine.run_for(ticks::of_ms(12)), Ending::Time);
}

/// Boots and reads the generation in force; 0 with none.
fn generation(machine: &mut Machine, what: &str) -> u32 {
    Telemetry::take(machine);
    let end = machine.board().now + ticks::of_ms(TOLD_MS);
    loop {
        assert_eq!(machine.run_for(ticks::of_ms(5)), Ending::Time, "{what}");
        let telemetry = Telemetry::of(&machine.board().usarts[0].sent);
        if let Some(generation) = telemetry.health.get(&item::GENERATION) {
            let board = machine.board();
            assert!(board.wrong.is_empty(), "{what}: {:?}", board.wrong);
            let has_none = telemetry.all_have(Status::PARAMETERS_DEFAULT);
            assert_eq!(has_none, *generation == 0, "{what}");
            return *generation;
        }
        assert!(machine.board().now < end, "{what}: silent");
    }
}

/// True if a slot begins with exactly this block.
fn holds(machine: &mut Machine, place: usize, block: &[u8]) -> bool {
    machine.board().flash.slot(place).starts_with(block)
}

/// Fast enough for thousands of operations; the times of the data sheet have a test of their own.
fn fast() -> Behaviour {
    let mut behaviour = Behaviour::SOUND;
    behaviour.flash.erasing = ticks::of_us(500);
    behaviour.flash.programming = ticks::of_us(16);
    behaviour
}

/// Every place to lose power in so many operations: before each, within it, and behind the last.
fn cuts(operations: usize) -> Vec<Cut> {
    let kinds = [Leftover::Nothing, Leftover::SomeBits];
    let within = (0..operations).flat_map(|operation| {
        kinds.map(|leftover| Cut {
            operation,
            leftover,
        })
    });
    let last = Cut {
        operation: operations - 1,
        leftover: Leftover::Whole,
    };
    within.chain([last]).collect()
}

#[test]
fn upload_cut_at_every_operation() {
    let mut found = [0; 2];
    for core in CORES {
        let image = Image::build(core, &[]);
        let mut machine = Machine::new(&image, fast(), [&[], &[]]);
        stopped(&mut machine, fast());
        let answer = upload(&mut machine, &block(3, 0)).expect("power holds");
        assert_eq!((answer.outcome, answer.detail), (0, 3));
        let operations = machine.board().flash.operations;
        // One erasure, and the words of a block.
        assert_eq!(operations, 1 + PARAMETER_BLOCK_BYTES.div_ceil(4));
        assert!(holds(&mut machine, 0, &block(3, 3)));
        for cut in cuts(operations) {
            let what = format!("{core}: {cut:?}");
            let mut behaviour = fast();
            behaviour.flash.cut = Some(cut);
            stopped(&mut machine, behaviour);
            let outcome = upload(&mut machine, &block(3, 0));
            assert_eq!(outcome, Err(Ending::PowerLost), "{what}");
            machine.board().behaviour = fast();
            machine.power_on(cut.operation as u64);
            let generation = generation(&mut machine, &what);
            // The slot that was in force is untouched; the other one was mended from it, if it was not whole.
            assert!(holds(&mut machine, 1, &block(2, 2)), "{what}");
            assert!(generation == 2 || generation == 3, "{what}: {generation}");
            let other = if (cut.operation, cut.leftover) == (0, Leftover::Nothing) {
                block(1, 1)
            } else {
                block(generation, generation)
            };
            assert!(holds(&mut machine, 0, &other), "{what}");
            found[generation as usize - 2] += 1;
        }
    }
    let [old, new] = found;
    println!(
        "uploads cut: {} (in front of and within every erasure and word, both cores); the old block in force after {old}, the new one after {new}, neither after 0",
        old + new
    );
}

#[test]
fn mend_cut_at_every_operation() {
    let mut cut_boots = 0;
    for core in CORES {
        let image = Image::build(core, &[]);
        let mut machine = Machine::new(&image, fast(), [&[], &[]]);
        let ill = |machine: &mut Machine, cut: Option<Cut>| {
            in_use(machine);
            // One bit of the block is wrong, and its check sum does not match.
            machine.board().flash.content[200] ^= 1;
            machine.board().behaviour = fast();
            machine.board().behaviour.flash.cut = cut;
            machine.power_on(3);
        };
        ill(&mut machine, None);
        assert_eq!(generation(&mut machine, core), 2);
        let operations = machine.board().flash.operations;
        for cut in cuts(operations) {
            let what = format!("{core}: {cut:?}");
            ill(&mut machine, Some(cut));
            assert_eq!(
                machine.run_for(ticks::of_ms(TOLD_MS)),
                Ending::PowerLost,
                "{what}"
            );
            assert!(holds(&mut machine, 1, &block(2, 2)), "{what}");
            machine.board().behaviour = fast();
            machine.power_on(cut.operation as u64);
            assert_eq!(generation(&mut machine, &what), 2, "{what}");
            for place in 0..2 {
                assert!(
                    holds(&mut machine, place, &block(2, 2)),
                    "{what}: slot {place}"
                );
            }
            cut_boots += 1;
        }
    }
    println!(
        "mends cut: {cut_boots} (as above); the good block in force after every one, and both slots whole after the next boot"
    );
}
