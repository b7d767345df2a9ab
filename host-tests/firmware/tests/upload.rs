//! A parameter upload while the unit is stopped, from the bytes that it receives to the slot that the next boot uses.
//!
//! The flash is [`firmware_tests::nor`]; requests come byte by byte, as over the line.

use firmware_tests::nor::{LEFTOVERS, Nor, SECTOR};
use proptest::array::uniform32;
use proptest::collection::vec;
use proptest::prelude::*;
use trueaxis::frame_finder::WireFrame;
use trueaxis::parameter_slots::{Loaded, ParameterSlots};
use trueaxis::service::{DONE, RUNNING, Service, UNKNOWN, meaning, while_sampling};
use trueaxis::service_frame::{
    ANSWER_BYTES, Answer, AnswerFinder, DATA_BYTES, Request, RequestKind, RequestReceiver,
};
use trueaxis::terms::TermKinds;
use trueaxis::{Chain, F32, Parameters, TermKind};

type Unit = Service<Nor<4>, Chain<F32>>;

/// Distinguishable parameters.
fn parameters(number: u32) -> Parameters {
    Parameters::default().with(|p| p.bias_rad_s = [1e-6 * f64::from(number + 1), -2e-6, 3e-6])
}

fn slots(flash: Nor<4>) -> ParameterSlots<Nor<4>> {
    ParameterSlots::new(flash, [0, SECTOR as u32])
}

/// A flash of which both slots are good; `parameters(1)` are in force, as generation 2.
fn in_use() -> Nor<4> {
    let mut flash = Nor::erased();
    for number in 0..2 {
        let mut slots = slots(flash);
        slots.store(&parameters(number)).expect("power holds");
        flash = slots.release().rebooted();
    }
    flash
}

fn load(flash: &Nor<4>) -> Loaded {
    slots(flash.rebooted()).load()
}

fn unit(flash: Nor<4>) -> Unit {
    Service::new(slots(flash), TermKinds::NONE)
}

/// Requests of a sender for this block.
fn requests(block: &[u8]) -> Vec<Request> {
    let begin = Request::new(1, RequestKind::Begin, block.len() as u16);
    let pieces = block.chunks(DATA_BYTES).enumerate();
    let data = pieces.map(|(at, piece)| Request::data(2, (at * DATA_BYTES) as u16, piece));
    let store = Request::new(3, RequestKind::Store, 0);
    std::iter::once(begin).chain(data).chain([store]).collect()
}

fn line(requests: &[Request]) -> Vec<u8> {
    requests.iter().flat_map(Request::to_bytes).collect()
}

/// Brings the bytes to the unit; every answer, as the sender reads it.
fn send(unit: &mut Unit, bytes: &[u8], supply_suffices: bool) -> Vec<Answer> {
    let mut finder = RequestReceiver::new();
    let mut answers = AnswerFinder::new();
    bytes
        .iter()
        .filter_map(|byte| finder.push(*byte))
        .flat_map(|request| unit.answer(&request, || supply_suffices).answer.to_bytes())
        .collect::<Vec<u8>>()
        .into_iter()
        .filter_map(|byte| answers.push(byte))
        .collect()
}

#[test]
fn a_block_that_is_good_is_in_force_from_the_next_boot_on() {
    let mut unit = unit(in_use());
    // Its own generation does not count.
    let answers = send(
        &mut unit,
        &line(&requests(&parameters(7).to_block(0))),
        true,
    );
    assert!(
        answers
            .iter()
            .all(|answer| answer.outcome == DONE && answer.stopped)
    );
    assert_eq!(answers.last().expect("an answer").detail, 3);
    let loaded = load(&unit.release().release());
    assert_eq!((loaded.parameters, loaded.generation), (parameters(7), 3));
    assert!(!loaded.slot_bad);
}

/// Power fails after each byte that is received.
#[test]
fn power_lost_at_any_received_byte_leaves_the_old_block_until_the_last() {
    let bytes = line(&requests(&parameters(7).to_block(9)));
    for cut in 0..=bytes.len() {
        let mut unit = unit(in_use());
        send(&mut unit, &bytes[..cut], true);
        let flash = unit.release().release();
        let loaded = load(&flash);
        if cut < bytes.len() {
            assert_eq!(flash.steps, 0, "flash was touched at byte {cut}");
            assert_eq!((loaded.parameters, loaded.generation), (parameters(1), 2));
        } else {
            assert_eq!(loaded.parameters, parameters(7));
        }
    }
    println!(
        "{} bytes received: each cut leaves the old block",
        bytes.len()
    );
}

/// Power fails at each byte that is erased or programmed.
#[test]
fn power_lost_at_any_step_of_flash_leaves_the_old_or_the_new_block() {
    let bytes = line(&requests(&parameters(7).to_block(9)));
    let mut whole = unit(in_use());
    send(&mut whole, &bytes, true);
    let steps = whole.release().release().steps;
    let (mut kept, mut replaced) = (0, 0);
    for leftover in LEFTOVERS {
        for cut in 0..steps {
            let mut unit = unit(in_use().failing_after(cut, leftover, cut as u64));
            let answers = send(&mut unit, &bytes, true);
            let last = answers.last().expect("an answer");
            assert!(last.outcome != DONE && meaning(last.outcome).contains("flash"));
            let loaded = load(&unit.release().release());
            if loaded.parameters == parameters(7) {
                replaced += 1;
            } else {
                assert_eq!((loaded.parameters, loaded.generation), (parameters(1), 2));
                kept += 1;
            }
        }
    }
    println!(
        "{steps} steps, 3 kinds of leftover: {kept} cuts left the old block, {replaced} the new"
    );
    assert!(kept > 3 * SECTOR);
}

/// Each single bit of the line flipped: the block is not taken, or it is the block that was sent.
#[test]
fn no_flipped_bit_on_the_line_gets_into_force() {
    let bytes = line(&requests(&parameters(7).to_block(9)));
    let mut taken = 0;
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let mut unit = unit(in_use());
        let answers = send(&mut unit, &damaged, true);
        assert_eq!(
            answers.len() + 1,
            bytes.len() / 44,
            "a request is not answered"
        );
        let loaded = load(&unit.release().release());
        taken += usize::from(loaded.parameters != parameters(1));
    }
    assert_eq!(taken, 0);
}

/// Tests faulty blocks: fault, outcome, and detail of the outcome.
#[test]
fn what_is_wrong_is_refused_by_name_and_touches_nothing() {
    let good = parameters(7).to_block(9).to_vec();
    let with = |at: usize, byte: u8| {
        let mut block = good.clone();
        block[at] = byte;
        // Seals the block anew: the check sum fits, so that the fault itself must be found.
        let end = block.len() - 4;
        let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&block[..end]);
        block[end..].copy_from_slice(&sum.to_le_bytes());
        block
    };
    let mut damaged = good.clone();
    damaged[100] ^= 1;
    let out_of_range = Parameters::default().with(|p| p.scale_error = [0.5, 0.0, 0.0]);
    let with_term = Parameters::default().with(|p| {
        let pushed = p.terms.push(TermKind::GyroDelay, &[1e-6; 3]);
        pushed.expect("there is room");
    });
    let term = TermKind::GyroDelay as u32;
    for (block, outcome, detail) in [
        (with(0, b'X'), 6, Some(0)),
        (with(4, 9), 7, Some(9)),
        (damaged, 8, None),
        (with(11, 2), 9, Some(2)),
        (out_of_range.to_block(9).to_vec(), 10, Some(0)),
        (with_term.to_block(9).to_vec(), 11, Some(term)),
    ] {
        let mut unit = unit(in_use());
        let answers = send(&mut unit, &line(&requests(&block)), true);
        let last = answers.last().expect("an answer");
        assert_eq!(last.outcome, outcome, "{}", meaning(last.outcome));
        assert!(detail.is_none_or(|detail| detail == last.detail));
        assert_eq!(unit.release().release().steps, 0);
    }
    let mut unit = unit(in_use());
    let refused = |unit: &mut Unit, requests: &[Request], supply: bool| {
        let answers = send(unit, &line(requests), supply);
        let last = *answers.last().expect("an answer");
        (last.outcome, last.detail)
    };
    let whole = requests(&good);
    assert_eq!(refused(&mut unit, &whole[1..2], true), (2, 0));
    assert_eq!(refused(&mut unit, &whole[whole.len() - 1..], true), (2, 0));
    let short = [Request::new(1, RequestKind::Begin, 300)];
    assert_eq!(refused(&mut unit, &short, true), (4, 300));
    assert_eq!(refused(&mut unit, &[whole[0], whole[2]], true), (3, 0));
    let unfinished = [whole[0], whole[1], whole[whole.len() - 1]];
    assert_eq!(refused(&mut unit, &unfinished, true), (5, 32));
    assert_eq!(refused(&mut unit, &whole, false), (13, 0));
    let unknown = Request {
        kind: 77,
        ..Request::default()
    };
    assert_eq!(refused(&mut unit, &[unknown], true), (UNKNOWN, 77));
    assert_eq!(unit.release().release().steps, 0);
}

#[test]
fn a_request_that_comes_again_because_its_answer_was_lost_changes_nothing() {
    let block = parameters(7).to_block(9);
    let twice: Vec<Request> = requests(&block)
        .into_iter()
        .flat_map(|request| [request, request])
        .collect();
    let mut unit = unit(in_use());
    let answers = send(&mut unit, &line(&twice), true);
    assert!(answers.iter().all(|answer| answer.outcome == DONE));
    assert_eq!(load(&unit.release().release()).parameters, parameters(7));
}

#[test]
fn a_unit_that_samples_tells_its_state_stops_when_asked_and_refuses_the_rest() {
    for (kind, outcome, stops) in [
        (RequestKind::State, DONE, false),
        (RequestKind::Stop, DONE, true),
        (RequestKind::Begin, RUNNING, false),
        (RequestKind::Data, RUNNING, false),
        (RequestKind::Store, RUNNING, false),
        (RequestKind::Restart, RUNNING, false),
    ] {
        let request = Request::new(5, kind, 0);
        let (answer, stop) = while_sampling(&request, TermKinds::from_bits(6));
        assert_eq!(
            (answer.outcome, stop, answer.stopped),
            (outcome, stops, false)
        );
        assert_eq!((answer.number, answer.term_kinds), (5, 6));
        assert_eq!(Answer::decode(&answer.to_bytes()), Some(answer));
    }
    assert!(meaning(RUNNING).contains("the unit is running"));
    let said: std::collections::BTreeSet<&str> = (0..=17).map(meaning).collect();
    assert_eq!(said.len(), 18);
}

/// Bits by the table of `board_state`, written here a second time.
#[test]
fn the_boards_word_holds_what_it_says() {
    use trueaxis::board_state::BoardState;
    let state = BoardState {
        low_speed_hz: 34_783,
        reference_hz: 32_000,
        clock_fallback: true,
        brown_out_low: false,
        caches_off: true,
        enable_unconfirmed: false,
    };
    assert_eq!(state.to_word(), 34_783 | 2_000 << 16 | 1 << 28 | 1 << 30);
    let deviation = state.deviation().expect("both are known");
    assert!((deviation + 0.08).abs() < 1e-4, "{deviation}");
    for word in [
        0,
        1,
        0xFFFF,
        0xFFF << 16,
        1 << 28,
        1 << 29,
        1 << 30,
        1 << 31,
        u32::MAX,
    ] {
        assert_eq!(BoardState::from_word(word).to_word(), word, "{word:#x}");
    }
    let beyond = BoardState {
        low_speed_hz: 70_000,
        reference_hz: 70_000,
        ..BoardState::default()
    };
    assert_eq!(beyond.to_word(), 0x0FFF_FFFF);
    assert_eq!(BoardState::default().deviation(), None);
}

#[test]
fn a_request_to_start_anew_is_answered_first() {
    let mut unit = unit(in_use());
    let reply = unit.answer(&Request::new(1, RequestKind::Restart, 0), || true);
    assert!(reply.restart && reply.answer.outcome == DONE);
    let reply = unit.answer(&Request::new(1, RequestKind::State, 0), || true);
    assert!(!reply.restart && reply.answer.stopped);
}

fn any_request() -> impl Strategy<Value = Request> {
    (
        any::<u8>(),
        prop_oneof![0..8u8, any::<u8>()],
        prop_oneof![0..1_700u16, any::<u16>()],
        0..=DATA_BYTES as u8,
        uniform32(any::<u8>()),
    )
        .prop_map(|(number, kind, word, count, data)| Request {
            number,
            kind,
            word,
            count,
            data,
        })
}

proptest! {
    /// Behind any bytes but a frame's beginning, which would take the request's bytes for its own.
    #[test]
    fn every_request_comes_back_from_its_bytes(
        request in any_request(),
        noise in vec(any::<u8>(), 0..100),
    ) {
        let mut receiver = RequestReceiver::new();
        for byte in noise {
            receiver.push(byte);
        }
        // A damaged frame that has begun ends first.
        let taken = (0..2).find_map(|_| {
            request.to_bytes().into_iter().find_map(|byte| receiver.push(byte))
        });
        prop_assert!(taken.is_some());
        let mut receiver = RequestReceiver::new();
        let taken = request.to_bytes().into_iter().find_map(|byte| receiver.push(byte));
        prop_assert_eq!(taken, Some(request));
    }

    #[test]
    fn every_answer_comes_back_from_its_bytes(
        (number, kind, outcome, stopped) in any::<(u8, u8, u8, bool)>(),
        (detail, term_kinds) in any::<(u32, u32)>(),
        noise in vec(any::<u8>(), 0..60),
    ) {
        let answer = Answer { number, kind, outcome, stopped, detail, term_kinds };
        prop_assert_eq!(Answer::decode(&answer.to_bytes()), Some(answer));
        let mut finder = AnswerFinder::new();
        let stream = noise.into_iter().chain(answer.to_bytes()).chain([0; ANSWER_BYTES]);
        prop_assert!(stream.into_iter().filter_map(|byte| finder.push(byte)).any(|one| one == answer));
    }

    /// No panic, and the block in force stays: no block comes about by chance.
    #[test]
    fn any_requests_leave_the_block_in_force(sent in vec(any_request(), 1..60)) {
        let mut unit = unit(in_use());
        for request in &sent {
            let _ = unit.answer(request, || true);
        }
        prop_assert_eq!(load(&unit.release().release()).generation, 2);
    }
}
