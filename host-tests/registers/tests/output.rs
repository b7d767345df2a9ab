//! The output in either form, and the enable pin of an RS-422 line against every bit of it.

use rlg_registers::board::Behaviour;
use rlg_registers::host::{Telemetry, ask};
use rlg_registers::image::{CORES, Image};
use rlg_registers::machine::{Ending, Machine};
use rlg_registers::ticks;
use trueaxis::health::HEALTH_ITEMS;
use trueaxis::inertial_message::{CONTROL_EVERY, InertialDecoder, InertialMessage};
use trueaxis::service_frame::{Request, RequestKind};
use trueaxis::{OutputFormat, Parameters};

/// A unit of 400 or more outputs a second in this form, after so long.
fn run(image: &Image, output: OutputFormat, samples_per_output: u16, ms: u64) -> Machine {
    let parameters = Parameters::default().with(|p| {
        p.output = output;
        p.samples_per_output = samples_per_output;
    });
    let block = parameters.to_block(2);
    let mut machine = Machine::new(image, Behaviour::SOUND, [&block, &block]);
    assert_eq!(machine.run_for(ticks::of_ms(ms)), Ending::Time);
    machine
}

#[test]
fn both_forms_have_the_same_increments_and_the_line_is_driven_for_their_bits() {
    // The longest round of control messages, and some frames before the first.
    let round_ms = HEALTH_ITEMS.len() as u64 * u64::from(CONTROL_EVERY);
    for core in CORES {
        let image = Image::build(core, &[]);
        // 1000 a second.
        let mut framed = run(&image, OutputFormat::Frames, 4, round_ms + 200);
        let mut messaged = run(&image, OutputFormat::Inertial, 4, round_ms + 200);
        let frames = Telemetry::take(&mut framed).frames;
        let mut decoder = InertialDecoder::new();
        let sent = std::mem::take(&mut messaged.board().usarts[0].sent);
        let messages: Vec<_> = sent.iter().filter_map(|byte| decoder.push(*byte)).collect();
        assert_eq!(decoder.refused(), 0);
        let mut increments = 0;
        let mut told = std::collections::BTreeSet::new();
        for message in &messages {
            match message {
                InertialMessage::Increments(one) => {
                    let frame = &frames[increments].output;
                    assert_eq!(u32::from(one.counter), frame.sequence & 0xFFFF);
                    assert_eq!(one.dtheta_codes, frame.dtheta_codes);
                    assert_eq!(one.dvel_codes, frame.dvel_codes);
                    increments += 1;
                }
                InertialMessage::Control(one) => {
                    told.insert(one.health.index);
                }
                _ => panic!("a message of another kind"),
            }
        }
        assert!(increments.abs_diff(frames.len()) <= 1 && increments > 600);
        assert_eq!(
            told.len(),
            HEALTH_ITEMS.len(),
            "every item in control messages"
        );
        for (form, machine) in [("frames", &mut framed), ("messages", &mut messaged)] {
            let longest_us = ticks::to_ms(machine.longest_interrupt) * 1e3;
            let board = machine.board();
            assert!(board.wrong.is_empty(), "{core}, {form}: {:?}", board.wrong);
            let driver = &board.line_driver;
            assert!(
                driver.turned_off.abs_diff(increments) <= 2,
                "{core}: {driver:?}"
            );
            let hold_us = ticks::to_ms(driver.longest_hold) * 1e3;
            // A turn of the main loop, and an interrupt that comes between.
            assert!(hold_us < longest_us + 20.0, "{core}, {form}: {hold_us} us");
            println!(
                "{core}, {form}: driven for {} outputs, off at most {hold_us:.1} us behind the last stop bit (longest interrupt {longest_us:.1} us)",
                driver.turned_off
            );
        }
    }
}

/// The largest rate that the format is for, and the interrupt's part of the processor with it.
#[test]
fn eighteen_hundred_messages_a_second_leave_the_board() {
    for core in CORES {
        let image = Image::build(core, &[]);
        let parameters = Parameters::default().with(|p| {
            p.output = OutputFormat::Inertial;
            p.sample_rate_hz = 5_400.0;
            p.samples_per_output = 3;
        });
        let block = parameters.to_block(2);
        let mut machine = Machine::new(&image, Behaviour::SOUND, [&block, &block]);
        assert_eq!(machine.run_for(ticks::of_ms(700)), Ending::Time);
        let mut decoder = InertialDecoder::new();
        let sent = std::mem::take(&mut machine.board().usarts[0].sent);
        let counters: Vec<u16> = sent
            .iter()
            .filter_map(|byte| decoder.push(*byte))
            .filter_map(|message| match message {
                InertialMessage::Increments(one) => Some(one.counter),
                _ => None,
            })
            .collect();
        let gaps = counters
            .windows(2)
            .filter(|pair| pair[1] != pair[0] + 1)
            .count();
        assert!(counters.len() > 1_100 && gaps == 0, "{core}: {gaps} gaps");
        println!(
            "{core}: {} messages of increments at 1800 a second, none lost",
            counters.len()
        );
    }
}

#[test]
fn requests_are_answered_between_messages() {
    let image = Image::build("firmware", &[]);
    let mut machine = run(&image, OutputFormat::Inertial, 4, 50);
    let request = Request::new(5, RequestKind::State, 0);
    let answer = ask(&mut machine, &request, 1_000, 200).expect("no reset");
    assert_eq!(answer.expect("an answer").outcome, 0);
    let request = Request::new(6, RequestKind::Stop, 0);
    let answer = ask(&mut machine, &request, 1_000, 200).expect("no reset");
    assert_eq!(answer.expect("an answer").outcome, 0);
    let ending = machine.run_for(ticks::of_ms(5));
    assert_eq!(ending, Ending::Software);
    machine.follow(&ending);
    assert_eq!(machine.run_for(ticks::of_ms(20)), Ending::Time);
    let request = Request::new(7, RequestKind::State, 0);
    let answer = ask(&mut machine, &request, 0, 20).expect("no reset");
    assert!(answer.expect("an answer").stopped);
    assert_eq!(machine.run_for(ticks::of_ms(1)), Ending::Time);
    let board = machine.board();
    assert!(board.wrong.is_empty(), "{:?}", board.wrong);
    // The stopped unit's answer ended, too.
    assert_eq!(board.ports[0].output(8), Some(false));
}
