//! Firmware images behind the boot selector, in the machine code of both: updates with power cut at every operation, trials that
//! hang, fail or confirm themselves, and the times of all that.

use rlg_registers::bank::Fault;
use rlg_registers::board::Behaviour;
use rlg_registers::flash::{Cut, Leftover};
use rlg_registers::host::{Telemetry, ask, upload_image};
use rlg_registers::image::{CORES, Image, seal};
use rlg_registers::machine::{Ending, Machine};
use rlg_registers::ticks;
use trueaxis::health::{item, reset_cause};
use trueaxis::image::ImageSlot;
use trueaxis::image_layout::{IMAGE_HEADER_BYTES, IMAGE_SLOT_BYTES};
use trueaxis::image_state::{BootReason, ImageState};
use trueaxis::service_frame::{Answer, Request, RequestKind};

/// The request to stop, as an image leaves it in memory (`src/hardware/service_mode.rs`).
const STOP: (&str, u32) = ("STOP_REQUEST", u32::from_le_bytes(*b"STOP"));

/// Largest time from power-on until an image runs: two images to check at 16 MHz \[ms\].
const STARTED_MS: u64 = 600;

/// Fast enough for thousands of operations.
fn fast() -> Behaviour {
    let mut behaviour = Behaviour::SOUND;
    behaviour.flash.erasing = ticks::of_us(500);
    behaviour.flash.programming = ticks::of_us(16);
    behaviour
}

/// The slot whose image runs, if one does.
fn running(machine: &Machine) -> Option<ImageSlot> {
    ImageSlot::BOTH.into_iter().find(|slot| {
        let begin = slot.vector_table() - IMAGE_HEADER_BYTES;
        (begin..begin + IMAGE_SLOT_BYTES).contains(&machine.pc())
    })
}

/// Runs until an image runs; its slot and the time that it took \[ms\].
fn start(machine: &mut Machine, what: &str) -> (ImageSlot, f64) {
    let begun = machine.board().now;
    loop {
        assert_eq!(machine.run_for(ticks::of_us(200)), Ending::Time, "{what}");
        let ms = ticks::to_ms(machine.board().now - begun);
        if let Some(slot) = running(machine) {
            return (slot, ms);
        }
        assert!(
            ms < STARTED_MS as f64,
            "{what}: no image at {:#x}",
            machine.pc()
        );
    }
}

/// Lets the first image of flash run until it has confirmed itself.
fn confirmed(machine: &mut Machine) {
    start(machine, "first start");
    assert_eq!(machine.run_for(ticks::of_ms(60)), Ending::Time);
    pass_time(machine);
    assert_eq!(machine.run_for(ticks::of_ms(20)), Ending::Time);
    assert!(state(machine).is_confirmed);
    machine.board().usarts[0].sent.clear();
}

/// Puts the count of sampling periods to the last one before an image judges itself.
fn pass_time(machine: &mut Machine) {
    machine.set_word(&["sampling", "WATCH"], WATCH_SERVED, 30 * 4_000 - 2);
}

/// Offset of the count in `WATCH`: atomics stand in the order of the compiler.
const WATCH_SERVED: u32 = 0;

fn state(machine: &mut Machine) -> ImageState {
    let request = Request::new(77, RequestKind::ImageState, 0);
    let answer = ask(machine, &request, 1_000, 200)
        .expect("no reset")
        .expect("an answer");
    assert_eq!(answer.outcome, 0);
    ImageState::of_word(answer.detail)
}

/// A stopped unit: power-on with the request to stop in memory.
fn stopped(machine: &mut Machine, behaviour: Behaviour) {
    machine.board().behaviour = behaviour;
    machine.power_on_with(7, STOP.0, STOP.1);
    let (slot, _) = start(machine, "stopped");
    assert_eq!(slot, ImageSlot::A);
    assert_eq!(machine.run_for(ticks::of_ms(20)), Ending::Time);
}

/// An image that does nothing: a branch to itself.
fn idle_image(slot: ImageSlot) -> Vec<u8> {
    let mut code = vec![0x11; 256];
    code[..4].copy_from_slice(&0x2001_0000_u32.to_le_bytes());
    code[4..8].copy_from_slice(&(slot.vector_table() + 8 + 1).to_le_bytes());
    code[8..10].copy_from_slice(&0xE7FE_u16.to_le_bytes());
    seal(slot, &code)
}

/// Every place to lose power in so many operations: before each, within it, and behind the last.
fn cuts(operations: usize) -> Vec<Cut> {
    let kinds = [Leftover::Nothing, Leftover::SomeBits, Leftover::Whole];
    let within = (0..operations).flat_map(|operation| {
        kinds.map(|leftover| Cut {
            operation,
            leftover,
        })
    });
    within.collect()
}

/// Selector and image of a core for slot A, with its file.
fn unit(core: &str) -> (Image, Image, Vec<u8>) {
    let image = Image::build_alias("slot-a", core);
    let file = image.sealed(ImageSlot::A);
    let selector = Image::build_alias("selector", "selector");
    (selector, image, file)
}

#[test]
fn an_upload_cut_at_every_operation() {
    let mut found = [0; 2];
    for core in CORES {
        let (selector, image, old) = unit(core);
        let new = idle_image(ImageSlot::B);
        let joined = selector.with_images(&image, &[(ImageSlot::A, &old)]);
        let mut machine = Machine::new(&joined, fast(), [&[], &[]]);
        confirmed(&mut machine);
        let before = machine.board().flash.code.clone();
        stopped(&mut machine, fast());
        let answer = upload_image(&mut machine, &new).expect("power holds");
        assert_eq!((answer.outcome, answer.detail), (0, ImageSlot::B as u32));
        let operations = machine.board().flash.operations;
        // A sector, the words of code and header, and a record.
        assert_eq!(operations, 1 + (256 + 32 + 16) / 4);
        // Behind them the trial's record, by the selector.
        for cut in cuts(operations + 4) {
            let what = format!("{core}: {cut:?}");
            machine.board().flash.store_code(0x0800_0000, &before);
            let mut behaviour = fast();
            let of_selector = cut.operation.checked_sub(operations);
            behaviour.flash.cut = of_selector.is_none().then_some(cut);
            stopped(&mut machine, behaviour);
            let outcome = upload_image(&mut machine, &new);
            if let Some(operation) = of_selector {
                assert_eq!(outcome.expect("power holds").outcome, 0);
                machine.board().behaviour = fast();
                let leftover = cut.leftover;
                machine.board().behaviour.flash.cut = Some(Cut {
                    operation,
                    leftover,
                });
                machine.power_on(1);
                let ending = machine.run_for(ticks::of_ms(STARTED_MS));
                assert_eq!(ending, Ending::PowerLost, "{what}");
            } else {
                assert_eq!(outcome, Err(Ending::PowerLost), "{what}");
            }
            machine.board().behaviour = fast();
            machine.power_on(cut.operation as u64);
            let (slot, _) = start(&mut machine, &what);
            let board = machine.board();
            assert!(board.wrong.is_empty(), "{what}: {:?}", board.wrong);
            let file = if slot == ImageSlot::A { &old } else { &new };
            let begin = slot.vector_table() - IMAGE_HEADER_BYTES;
            assert!(board.flash.code_at(begin).starts_with(file), "{what}");
            found[usize::from(slot == ImageSlot::B)] += 1;
            if slot == ImageSlot::B {
                machine.power_on(9);
                let (slot, _) = start(&mut machine, &what);
                assert_eq!(slot, ImageSlot::A, "{what}: not rolled back");
            }
        }
    }
    let [old, new] = found;
    println!(
        "image uploads and trials cut: {} (in front of, within and behind every erasure and word, both cores); the old image started after {old}, the new one after {new}, neither after 0",
        old + new
    );
    assert!(new >= 4 && old > 400);
}

/// Stops a sampling unit by a request.
fn stop(machine: &mut Machine) -> Answer {
    let request = Request::new(1, RequestKind::Stop, 0);
    let answer = ask(machine, &request, 1_000, 200).expect("no reset in front of the answer");
    answer.expect("an answer")
}

fn follow_reset(machine: &mut Machine, ms: u64) {
    let ending = machine.run_for(ticks::of_ms(ms));
    assert_eq!(ending, Ending::Software);
    machine.follow(&ending);
}

/// Everything of an update with the times of the data sheet, between two real images.
#[test]
fn an_update_from_slot_a_to_slot_b() {
    for core in CORES {
        let (selector, image, old) = unit(core);
        let next = Image::build_alias("slot-b", core);
        let new = next.sealed(ImageSlot::B);
        let joined = selector.with_images(&image, &[(ImageSlot::A, &old)]);
        let mut machine = Machine::new(&joined, Behaviour::SOUND, [&[], &[]]);
        confirmed(&mut machine);
        assert_eq!(stop(&mut machine).outcome, 0);
        follow_reset(&mut machine, 5);
        let (_, selector_ms) = start(&mut machine, core);
        assert_eq!(machine.run_for(ticks::of_ms(20)), Ending::Time);
        let begun = machine.board().now;
        let answer = upload_image(&mut machine, &new).expect("power holds");
        assert_eq!((answer.outcome, answer.detail), (0, ImageSlot::B as u32));
        let upload_ms = ticks::to_ms(machine.board().now - begun);
        let restart = Request::new(201, RequestKind::Restart, 0);
        let asked = ask(&mut machine, &restart, 0, 20).expect("no reset in front of the answer");
        assert_eq!(asked.expect("an answer").outcome, 0);
        follow_reset(&mut machine, 5);
        machine.board().usarts[0].sent.clear();
        let (slot, trial_ms) = start(&mut machine, core);
        assert_eq!(slot, ImageSlot::B);
        let allowed_s = ticks::to_ms(machine.board().watchdog.allowance()) / 1e3;
        assert!(machine.board().watchdog.is_started() && (20.0..63.0).contains(&allowed_s));
        // The rest of its trial, at the time that it takes; it does not stop meanwhile.
        assert_eq!(machine.run_for(ticks::of_ms(400)), Ending::Time);
        assert_eq!(stop(&mut machine).outcome, 28);
        let trial = state(&mut machine);
        assert_eq!(
            (trial.running, trial.reason),
            (Some(ImageSlot::B), BootReason::Trial)
        );
        assert_eq!((trial.is_confirmed, trial.free), (false, None));
        let telemetry = Telemetry::take(&mut machine);
        assert_eq!(telemetry.item(item::IMAGE), trial.to_word());
        let served_ms = 30_000 - 500;
        machine.board().usarts[0].sent.clear();
        assert_eq!(machine.run_for(ticks::of_ms(served_ms)), Ending::Time);
        machine.board().usarts[0].sent.clear();
        let operations = machine.board().flash.operations;
        assert_eq!(machine.run_for(ticks::of_ms(400)), Ending::Time);
        assert_eq!(machine.board().flash.operations, operations + 4);
        let confirmed = state(&mut machine);
        assert!(confirmed.is_confirmed && confirmed.free == Some(ImageSlot::A));
        let telemetry = Telemetry::take(&mut machine);
        for (index, value) in [(16, 0), (17, 0), (item::FIRST_FAULT_STATUS, 0)] {
            assert_eq!(telemetry.item(index), value, "health item {index}");
        }
        machine.power_on(5);
        let (slot, _) = start(&mut machine, core);
        assert_eq!(slot, ImageSlot::B);
        let board = machine.board();
        assert!(board.wrong.is_empty(), "{:?}", board.wrong);
        println!(
            "{core}: {} bytes uploaded in {upload_ms:.0} ms with the longest times of the data sheet, started on trial, confirmed after 30 s in four words and no late interrupt; the selector takes {selector_ms:.1} ms to start an image ({trial_ms:.1} ms on trial), the trial's watchdog allows {allowed_s:.0} s",
            new.len()
        );
    }
}

/// A unit whose second image, good by every check, is about to be tried.
fn about_to_try(new: &[u8], behaviour: Behaviour) -> Machine {
    let (selector, image, old) = unit("firmware");
    let joined = selector.with_images(&image, &[(ImageSlot::A, &old)]);
    let mut machine = Machine::new(&joined, behaviour, [&[], &[]]);
    confirmed(&mut machine);
    stopped(&mut machine, behaviour);
    assert_eq!(
        upload_image(&mut machine, new)
            .expect("power holds")
            .outcome,
        0
    );
    machine.power_on(3);
    assert_eq!(start(&mut machine, "trial").0, ImageSlot::B);
    machine
}

/// The state after a reset that nobody asked for.
fn rolled_back(machine: &mut Machine) {
    assert_eq!(start(machine, "rolled back").0, ImageSlot::A);
    machine.board().usarts[0].sent.clear();
    assert_eq!(machine.run_for(ticks::of_ms(300)), Ending::Time);
    let state = state(machine);
    assert_eq!(
        (state.reason, state.is_confirmed),
        (BootReason::RolledBack, true)
    );
}

#[test]
fn an_image_that_hangs_is_rolled_back_by_the_watchdog() {
    for oscillator_hz in [17_000, 32_000, 47_000] {
        let mut behaviour = fast();
        behaviour.watchdog_hz = oscillator_hz;
        let mut machine = about_to_try(&idle_image(ImageSlot::B), behaviour);
        let begun = machine.board().now;
        let ending = machine.run_for(ticks::of_ms(70_000));
        assert_eq!(ending, Ending::Watchdog);
        let s = ticks::to_ms(machine.board().now - begun) / 1e3;
        machine.follow(&ending);
        rolled_back(&mut machine);
        let telemetry = Telemetry::take(&mut machine);
        assert_ne!(
            telemetry.item(item::RESET_CAUSE) & reset_cause::INDEPENDENT_WATCHDOG,
            0
        );
        println!(
            "an image that hangs from its first instruction on, oscillator at {oscillator_hz} Hz: rolled back after {s:.1} s"
        );
    }
}

#[test]
fn an_image_that_is_not_in_health_is_rolled_back_by_itself() {
    let new = Image::build_alias("slot-b", "firmware").sealed(ImageSlot::B);
    let mut machine = about_to_try(&new, fast());
    assert_eq!(machine.run_for(ticks::of_ms(100)), Ending::Time);
    // One damaged frame in service: a fault is latched, whose ever it is.
    let latch = machine
        .board()
        .spi
        .bank
        .transfers
        .last()
        .map_or(0, |last| last.latch);
    machine
        .board()
        .spi
        .bank
        .faults
        .insert(latch + 5, Fault::Inverted(vec![100]));
    let ending = machine.run_for(ticks::of_ms(31_000));
    assert_eq!(ending, Ending::Software);
    machine.follow(&ending);
    rolled_back(&mut machine);
    println!("an image with a fault in service: rolled back by its own reset after 30 s");
}
