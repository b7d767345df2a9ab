//! The built-in test's word, its turn among the health items, and the comparison of flash, bit by bit.

use std::collections::BTreeMap;

use trueaxis::flash_check::{CheckedFlash, FlashCheck, Seal};
use trueaxis::health::{HEALTH_ITEMS, item};
use trueaxis::image::{HEADER_BYTES, ImageHeader, ImageSlot, PIECE_BYTES};
use trueaxis::image_layout::{FLASH_BEGIN, IMAGE_HEADER_BYTES};
use trueaxis::sample_source::Reading;
use trueaxis::self_test::SHOWN_EVERY;
use trueaxis::service::{DONE, RUNNING, while_on_trial, while_sampling};
use trueaxis::service_frame::{Request, RequestKind};
use trueaxis::terms::TermKinds;
use trueaxis::{BootReport, F32, Parameters, Processor, Sample, SelfTest, TelemetryFrame, Timing};

#[test]
fn a_word_comes_back_from_its_results() {
    // The documented bits.
    let names = [
        (0, "RAM"),
        (1, "flash at power-up"),
        (2, "floating-point unit"),
        (3, "flash in service"),
    ];
    for (bit, name) in names {
        let results = SelfTest::from_word(1 << bit);
        assert!(results.has_failed());
        assert_eq!(results.failures().collect::<Vec<_>>(), [name]);
    }
    let known = 0xFFFF_00FF_u32;
    for bit in (0..32).filter(|bit| known >> bit & 1 == 1) {
        let word = 1_u32 << bit;
        let results = SelfTest::from_word(word);
        assert_eq!(results.to_word(), word);
        assert_eq!(results.has_failed(), bit < 4);
    }
    let tested = SelfTest::from_word(0b1111 << 4);
    assert!(tested.ram_tested && tested.flash_tested && tested.float_tested && tested.commanded);
    assert_eq!(SelfTest::from_word(7 << 16).scrub_passes, 7);
}

/// Frames of a processor, with these results in them.
fn frames(results: SelfTest, count: usize) -> Vec<TelemetryFrame> {
    let mut processor =
        Processor::<F32>::new(&Parameters::default(), BootReport::default()).expect("in range");
    let periods = std::iter::from_fn(|| {
        let reading = Reading::new(Some(Sample::default()), 1, None);
        Some(processor.period(reading, Timing::default()))
    });
    let mut frames: Vec<_> = periods.flatten().take(count).collect();
    frames.iter_mut().for_each(|frame| results.show_in(frame));
    frames
}

#[test]
fn results_take_their_turn_and_a_failure_shows_every_seventh_frame() {
    let sound = SelfTest::from_word(0b0111 << 4);
    let one_round = frames(sound, HEALTH_ITEMS.len());
    let told: Vec<u8> = one_round.iter().map(|frame| frame.health.index).collect();
    assert_eq!(told, HEALTH_ITEMS);
    let own = one_round
        .iter()
        .find(|frame| frame.health.index == item::SELF_TEST);
    assert_eq!(own.expect("its turn").health.value, sound.to_word());

    let failed = SelfTest::from_word(1);
    // Every other item still comes, within seven rounds.
    let rounds = frames(failed, SHOWN_EVERY as usize * HEALTH_ITEMS.len());
    let mut times = BTreeMap::new();
    let mut longest = 0;
    let mut since = 0;
    for frame in &rounds {
        *times.entry(frame.health.index).or_insert(0) += 1;
        since += 1;
        if frame.health.index == item::SELF_TEST {
            assert_eq!(frame.health.value, 1);
            longest = longest.max(since);
            since = 0;
        }
    }
    assert_eq!(longest, SHOWN_EVERY);
    assert!(HEALTH_ITEMS.iter().all(|index| times.contains_key(index)));
}

#[test]
fn a_unit_in_service_tells_its_results_and_runs_no_test() {
    for (kind, outcome) in [
        (RequestKind::SelfTest, DONE),
        (RequestKind::RunSelfTest, RUNNING),
    ] {
        let request = Request::new(1, kind, 0);
        let (answer, stop) = while_sampling(&request, TermKinds::NONE);
        assert_eq!((answer.outcome, stop), (outcome, false));
        assert_eq!(while_on_trial(&request, TermKinds::NONE).outcome, outcome);
    }
}

/// Flash from an address on, as the test reads it.
struct Memory {
    begin: u32,
    bytes: Vec<u8>,
}

impl Memory {
    fn word(&self, address: u32) -> u32 {
        let at = (address - self.begin) as usize;
        u32::from_le_bytes(self.bytes[at..at + 4].try_into().expect("four bytes"))
    }

    /// True if the whole image agrees.
    fn agrees(&self, flash: CheckedFlash) -> bool {
        FlashCheck::new(flash).finish_pass(|address| self.word(address))
    }
}

fn code(bytes: usize) -> Vec<u8> {
    let mut state = 0x9E37_79B9_u32;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as u8
    };
    (0..bytes).map(|_| next()).collect()
}

/// CRC-32 of ISO-HDLC, bit by bit.
fn crc_32<'a>(bytes: impl Iterator<Item = &'a u8>) -> u32 {
    !bytes.fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| {
            sum >> 1 ^ if sum & 1 == 1 { 0xEDB8_8320 } else { 0 }
        })
    })
}

#[test]
fn every_flipped_bit_of_an_image_alone_is_seen() {
    const SEAL_AT: usize = 1000;
    let mut bytes = code(2_000);
    bytes[SEAL_AT..SEAL_AT + Seal::BYTES as usize].fill(0xFF);
    let seal = Seal::sealing(&bytes, SEAL_AT);
    let around = bytes[..SEAL_AT].iter().chain(&bytes[SEAL_AT + 12..]);
    assert_eq!((seal.bytes, seal.crc), (2_000, crc_32(around)));
    assert_eq!(Seal::of_words(seal.to_words()), Some(seal));
    assert_eq!(Seal::of_words(Seal::ERASED), None);
    let seal_at = FLASH_BEGIN + SEAL_AT as u32;
    // Beside a seal the linker's end does not count.
    let flash = CheckedFlash::alone(FLASH_BEGIN + 3_000, seal_at, seal.to_words());
    let words = seal.to_words().map(u32::to_le_bytes);
    bytes[SEAL_AT..SEAL_AT + 12].copy_from_slice(words.as_flattened());
    let mut memory = Memory {
        begin: FLASH_BEGIN,
        bytes,
    };
    assert!(memory.agrees(flash));
    for bit in 0..8 * 2_000 {
        memory.bytes[bit / 8] ^= 1 << (bit % 8);
        let words = [0, 4, 8].map(|at| memory.word(seal_at + at));
        let checked = CheckedFlash::alone(FLASH_BEGIN + 2_000, seal_at, words);
        // With a longer length the flash behind the image counts, which is not here.
        let is_longer = checked.words.end > FLASH_BEGIN + 2_000;
        assert!(is_longer || !memory.agrees(checked), "bit {bit}");
        memory.bytes[bit / 8] ^= 1 << (bit % 8);
    }
}

#[test]
fn every_flipped_bit_of_an_image_in_a_slot_is_seen() {
    for slot in ImageSlot::BOTH {
        let code = code(64 * PIECE_BYTES);
        let header = ImageHeader::sealing(slot, 1, 2, &code);
        let mut bytes = header.to_bytes().to_vec();
        bytes.resize(IMAGE_HEADER_BYTES as usize, 0xFF);
        bytes.extend(code);
        let begin = slot.vector_table() - IMAGE_HEADER_BYTES;
        let mut memory = Memory { begin, bytes };
        let flash = |memory: &Memory| {
            let header = memory
                .bytes
                .first_chunk::<HEADER_BYTES>()
                .expect("a header");
            CheckedFlash::in_slot(slot.vector_table(), header)
        };
        assert!(memory.agrees(flash(&memory)));
        for bit in 0..8 * memory.bytes.len() {
            memory.bytes[bit / 8] ^= 1 << (bit % 8);
            // Beside a longer length: the flash behind the image.
            let checked = flash(&memory);
            let end = (checked.words.end - begin) as usize;
            let is_seen = end > memory.bytes.len() || !memory.agrees(checked);
            assert!(is_seen, "bit {bit}");
            memory.bytes[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

#[test]
fn an_image_without_a_check_sum_is_compared_with_its_first_pass() {
    let mut memory = Memory {
        begin: FLASH_BEGIN,
        bytes: code(1_002),
    };
    memory.bytes.resize(1_004, 0xFF);
    let flash = CheckedFlash::alone(FLASH_BEGIN + 1_002, FLASH_BEGIN + 500, Seal::ERASED);
    assert_eq!((flash.crc, flash.words.end), (None, FLASH_BEGIN + 1_004));
    let mut check = FlashCheck::new(flash);
    assert!(!check.has_check_sum());
    // Words are read once a pass, in steps of any length.
    let mut read = 0;
    let mut steps = 0;
    let count = std::cell::Cell::new(0);
    while !check.step(7, |address| {
        count.set(count.get() + 1);
        memory.word(address)
    }) {
        read += 7;
        steps += 1;
    }
    assert_eq!((count.get(), steps), (1_004 / 4 - 3, (1_004 / 4 - 3) / 7));
    assert!(read <= count.get() && check.has_check_sum() && !check.has_failed());
    assert!(check.finish_pass(|address| memory.word(address)));
    memory.bytes[77] ^= 4;
    assert!(!check.finish_pass(|address| memory.word(address)));
    memory.bytes[77] ^= 4;
    // It stays.
    assert!(!check.finish_pass(|address| memory.word(address)));
}
