//! The built-in test in machine code: stuck bits of RAM, flipped bits of flash and wrong results of the floating-point unit, a
//! hundred of each, none on a sound board; the command; and the times of all that.

use rlg_registers::board::Behaviour;
use rlg_registers::host::{Telemetry, ask, block};
use rlg_registers::image::{CORES, FLASH_BEGIN, Image};
use rlg_registers::machine::{Ending, Machine};
use rlg_registers::random::Random;
use rlg_registers::ticks;
use trueaxis::SelfTest;
use trueaxis::flash_check::Seal;
use trueaxis::health::{item, reset_cause};
use trueaxis::service::{DONE, RUNNING};
use trueaxis::service_frame::{Answer, Request, RequestKind};

/// Placements of each fault.
const TIMES: usize = 100;

const RAM_BEGIN: u32 = 0x2000_0000;
const RAM_BYTES: u32 = 128 * 1024;

/// Latest time from power-on until the first frame \[ms\].
const STARTED_MS: u64 = 120;

/// A unit with two equal parameter blocks: nothing to mend.
fn machine(image: &Image) -> Machine {
    let block = block(2, 2);
    Machine::new(image, Behaviour::SOUND, [&block, &block])
}

/// The last results that frames show, if any does.
fn shown(machine: &mut Machine) -> Option<SelfTest> {
    let word = Telemetry::take(machine)
        .health
        .get(&item::SELF_TEST)
        .copied();
    word.map(SelfTest::from_word)
}

/// A number below `end`.
fn below(random: &mut Random, end: u32) -> u32 {
    (random.bits() % u64::from(end)) as u32
}

fn request(machine: &mut Machine, kind: RequestKind) -> Answer {
    let answer = ask(machine, &Request::new(7, kind, 0), 1_000, 200);
    answer.expect("no reset").expect("an answer")
}

#[test]
fn a_sound_unit_passes() {
    for core in CORES {
        let image = Image::build(core, &[]).with_ram_test();
        for image in [image.with_seal(), image] {
            let mut machine = machine(&image);
            let mut first_frame = None;
            while first_frame.is_none() {
                assert_eq!(machine.run_for(ticks::of_us(100)), Ending::Time);
                let now = machine.board().now;
                first_frame = (!machine.board().usarts[0].sent.is_empty()).then_some(now);
                assert!(ticks::to_ms(now) < STARTED_MS as f64, "no frame");
            }
            let mut passes = Vec::new();
            for _ in 0..4 {
                assert_eq!(machine.run_for(ticks::of_ms(400)), Ending::Time);
                let results = shown(&mut machine).expect("a round of health items");
                let is_sealed = results.flash_tested;
                assert!(!results.has_failed() && results.ram_tested && results.float_tested);
                passes.push((results.scrub_passes, is_sealed));
            }
            let is_sealed = passes[0].1;
            let pass_ms = 1_200.0 / f64::from(passes[3].0 - passes[0].0);
            let board = machine.board();
            assert!(board.wrong.is_empty(), "{:?}", board.wrong);
            let longest_us = ticks::to_ms(machine.longest_interrupt) * 1e3;
            println!(
                "{core}, check sum {is_sealed}: first frame {:.1} ms after power-on; in service a pass over {} bytes takes {pass_ms:.1} ms, the longest interrupt {longest_us:.1} us",
                ticks::to_ms(first_frame.expect("a frame")),
                image.end(),
            );
        }
    }
}

#[test]
fn a_stuck_bit_of_ram_shows() {
    for core in CORES {
        let image = Image::build(core, &[]).with_ram_test();
        let mut random = Random::new(61);
        for _ in 0..TIMES {
            let address = RAM_BEGIN + 4 * below(&mut random, RAM_BYTES / 4);
            let (bit, level) = (below(&mut random, 32), below(&mut random, 2) == 1);
            let what = format!("{core}: {address:#x}, bit {bit} always {level}");
            let mut machine = machine(&image);
            machine.stick(address, bit, level);
            assert_eq!(
                machine.run_for(ticks::of_ms(STARTED_MS)),
                Ending::Time,
                "{what}"
            );
            let telemetry = Telemetry::take(&mut machine);
            let results = SelfTest::from_word(telemetry.item(item::SELF_TEST));
            assert!(results.ram_failed, "{what}: {results:?}");
            assert!(telemetry.frames.len() >= 2, "{what}");
            let wrong = &machine.board().wrong;
            assert!(wrong.is_empty(), "{what}: {wrong:?}");
        }
        println!("{core}: stuck bits of RAM seen: {TIMES} of {TIMES}");
    }
}

/// Outcome of a bit of flash that is flipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Seen {
    /// Frames name it.
    Named,
    /// The unit has failed openly: it sends nothing, resets, or its frames do not follow each other.
    Failed,
    /// Frames that name nothing.
    No,
}

/// True if frames came, each a period behind the one before.
fn is_a_stream(telemetry: &Telemetry) -> bool {
    let sequences = telemetry.frames.iter().map(|frame| frame.output.sequence);
    let follows = sequences.clone().zip(sequences.skip(1));
    !telemetry.frames.is_empty() && follows.into_iter().all(|(one, next)| next == one + 1)
}

/// Runs for `ms`; `bit` is true of results that name the fault.
fn seen(machine: &mut Machine, ms: u64, bit: impl Fn(SelfTest) -> bool) -> Seen {
    let ending = machine.run_for(ticks::of_ms(ms));
    let telemetry = Telemetry::take(machine);
    let word = telemetry.health.get(&item::SELF_TEST).copied();
    if word.is_some_and(|word| bit(SelfTest::from_word(word))) {
        Seen::Named
    } else if ending != Ending::Time || !is_a_stream(&telemetry) {
        Seen::Failed
    } else {
        Seen::No
    }
}

/// A place of the image, and a bit, outside the check sum itself.
fn place(random: &mut Random, image: &Image) -> (u32, u32) {
    let seal = image.symbol(&["IMAGE_SEAL"]);
    loop {
        let address = FLASH_BEGIN + below(random, image.end() as u32);
        if !(seal..seal + Seal::BYTES).contains(&address) {
            return (address, below(random, 8));
        }
    }
}

#[test]
fn a_flipped_bit_of_flash_shows_at_power_up() {
    for core in CORES {
        let image = Image::build(core, &[]).with_ram_test().with_seal();
        let mut random = Random::new(62);
        let mut found = [0; 2];
        for _ in 0..TIMES {
            let (address, bit) = place(&mut random, &image);
            let mut machine = machine(&image);
            machine.flip_flash(address, bit);
            // A bit of this test's own code may spoil it: then the test in service names it.
            let seen = seen(&mut machine, STARTED_MS + 100, |results| {
                results.flash_failed || results.scrub_failed
            });
            assert_ne!(seen, Seen::No, "{core}: {address:#x}, bit {bit}");
            found[usize::from(seen == Seen::Failed)] += 1;
        }
        let [named, failed] = found;
        println!(
            "{core}: flipped bits of flash at power-up: {named} named, {failed} end the stream of frames, 0 unseen"
        );
        assert!(named > TIMES / 2);
    }
}

#[test]
fn a_bit_of_flash_that_flips_in_service_shows() {
    for core in CORES {
        let image = Image::build(core, &[]).with_ram_test().with_seal();
        let mut random = Random::new(63);
        let mut found = [0; 3];
        let recorder = image.range(&["BuiltInTest", "conclude"]);
        for _ in 0..TIMES {
            let (address, bit) = place(&mut random, &image);
            let mut machine = machine(&image);
            let moment_ms = STARTED_MS + u64::from(below(&mut random, 80));
            assert_eq!(machine.run_for(ticks::of_ms(moment_ms)), Ending::Time);
            let before = shown(&mut machine);
            assert!(before.is_none_or(|results| !results.has_failed()));
            machine.flip_flash(address, bit);
            let seen = seen(&mut machine, 100, |results| results.scrub_failed);
            // A bit of the code that records the result can hide it.
            let is_own = recorder.contains(&address);
            assert!(
                seen != Seen::No || is_own,
                "{core}: {address:#x}, bit {bit}"
            );
            found[seen as usize] += 1;
        }
        let [named, failed, hidden] = found;
        println!(
            "{core}: bits of flash flipped in service, within 100 ms: {named} named, {failed} end the stream of frames, {hidden} hidden"
        );
        assert!(named > TIMES / 2);
    }
}

#[test]
fn a_brown_out_is_named_by_the_first_frame_after_it() {
    for core in CORES {
        let image = Image::build(core, &[]).with_ram_test().with_seal();
        let mut random = Random::new(65);
        let mut machine = machine(&image);
        let mut latest = 0;
        for time in 0..TIMES {
            let moment_ms = STARTED_MS + u64::from(below(&mut random, 30));
            assert_eq!(machine.run_for(ticks::of_ms(moment_ms)), Ending::Time);
            machine.brown_out(time as u64);
            machine.board().usarts[0].sent.clear();
            let begun = machine.board().now;
            let mut frames = Vec::new();
            while frames.is_empty() {
                assert_eq!(machine.run_for(ticks::of_us(200)), Ending::Time);
                let sent = &machine.board().usarts[0].sent;
                frames = Telemetry::of(sent).frames;
            }
            let first = &frames[0];
            assert_eq!(
                (first.output.sequence, first.health.index),
                (0, item::RESET_CAUSE)
            );
            assert_eq!(
                first.health.value & reset_cause::BROWN_OUT,
                reset_cause::BROWN_OUT
            );
            assert_eq!(first.health.value & reset_cause::POWER_ON, 0);
            latest = latest.max(machine.board().now - begun);
        }
        let latest_ms = ticks::to_ms(latest);
        assert!(latest_ms <= 100.0);
        println!(
            "{core}: brown-outs named {TIMES} of {TIMES}, at most {latest_ms:.1} ms after the supply is back"
        );
    }
}

/// Instructions of the floating-point unit in code: the address behind each, and its destination.
fn float_instructions(image: &Image) -> Vec<(u32, u32)> {
    let range = image.range(&["float_unit_is_right"]);
    let (mut at, mut found) = (range.start, Vec::new());
    let halfword = |at: u32| {
        let place = (at - FLASH_BEGIN) as usize;
        u16::from_le_bytes([image.flash[place], image.flash[place + 1]])
    };
    while at < range.end {
        let (first, second) = (halfword(at), halfword(at + 2));
        let is_wide = first >> 11 >= 0b11101;
        // Data processing of single precision (ARMv7-M manual A6.4): 0xEE with bit 4 of the second halfword clear.
        if is_wide && first >> 8 == 0xEE && second >> 8 & 0xF == 0xA && second & 0x10 == 0 {
            let destination = u32::from(second >> 12) << 1 | u32::from(first >> 6 & 1);
            found.push((at + 4, destination));
        }
        at += if is_wide { 4 } else { 2 };
    }
    found
}

#[test]
fn a_wrong_result_of_the_floating_point_unit_shows() {
    for core in CORES {
        let image = Image::build(core, &[]).with_ram_test();
        let instructions = float_instructions(&image);
        assert_eq!(instructions.len(), 16, "{instructions:x?}");
        let mut random = Random::new(64);
        for _ in 0..TIMES {
            let place = below(&mut random, instructions.len() as u32) as usize;
            let (address, register) = instructions[place];
            let bit = below(&mut random, 32);
            let what = format!("{core}: s{register} in front of {address:#x}, bit {bit}");
            let mut machine = machine(&image);
            machine.upset_float(address, register, bit);
            let seen = seen(&mut machine, STARTED_MS, |results| results.float_failed);
            assert_eq!(seen, Seen::Named, "{what}");
        }
        println!(
            "{core}: wrong results of the floating-point unit, one bit of one instruction: named {TIMES} of {TIMES}"
        );
    }
}

#[test]
fn a_stopped_unit_tests_itself_on_request() {
    for core in CORES {
        let image = Image::build(core, &[]).with_ram_test().with_seal();
        let mut machine = machine(&image);
        assert_eq!(machine.run_for(ticks::of_ms(STARTED_MS + 20)), Ending::Time);
        // In service: results are there, and no test is run.
        let told = request(&mut machine, RequestKind::SelfTest);
        assert_eq!((told.outcome, told.stopped), (DONE, false));
        assert!(!SelfTest::from_word(told.detail).commanded);
        let refused = request(&mut machine, RequestKind::RunSelfTest);
        assert_eq!((refused.outcome, refused.stopped), (RUNNING, false));
        assert_eq!(machine.run_for(ticks::of_ms(20)), Ending::Time);
        assert_eq!(request(&mut machine, RequestKind::Stop).outcome, DONE);
        let follow = |machine: &mut Machine, ms| {
            let ending = machine.run_for(ticks::of_ms(5));
            assert_eq!(ending, Ending::Software);
            machine.follow(&ending);
            assert_eq!(machine.run_for(ticks::of_ms(ms)), Ending::Time);
        };
        follow(&mut machine, 20);
        let told = SelfTest::from_word(request(&mut machine, RequestKind::SelfTest).detail);
        assert!(!told.ram_tested && !told.flash_tested && told.float_tested);
        let accepted = request(&mut machine, RequestKind::RunSelfTest);
        assert_eq!((accepted.outcome, accepted.stopped), (DONE, true));
        follow(&mut machine, STARTED_MS);
        let told = request(&mut machine, RequestKind::SelfTest);
        assert!(told.stopped);
        let results = SelfTest::from_word(told.detail);
        assert!(results.commanded && results.ram_tested && results.flash_tested);
        assert!(results.float_tested && !results.has_failed());
        assert_eq!(request(&mut machine, RequestKind::Restart).outcome, DONE);
        follow(&mut machine, 20);
        let frames = Telemetry::take(&mut machine).frames;
        assert!(!frames.is_empty(), "{core}: samples again");
        let wrong = &machine.board().wrong;
        assert!(wrong.is_empty(), "{wrong:?}");
    }
}
