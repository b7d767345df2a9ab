//! The counter bank through the image's own SPI driver: ten thousand frames with bit errors, late edges and bytes that do not
//! come, each counted as `src/unit/health.rs` and `src/unit/counter_bank.rs` document, none passed as good.

use std::collections::BTreeMap;

use rlg_registers::bank::{FRAME_BITS, Fault, Transfer};
use rlg_registers::board::Behaviour;
use rlg_registers::host::Telemetry;
use rlg_registers::image::{CORES, Image};
use rlg_registers::machine::{Ending, Machine};
use rlg_registers::random::Random;
use rlg_registers::ticks;
use trueaxis::counter_bank::FRAME_BYTES;
use trueaxis::health::item;
use trueaxis::raw_frame::{RawFinder, RawFrame};
use trueaxis::sample_source::SourceFault;

/// Frames of which every second one is struck, on the average.
const FRAMES: u64 = 20_400;

/// Sampling periods before the first fault and after the last: the stream begins, and every health item is sent, in 295 ms.
const QUIET: u64 = 1_300;

/// Draws a fault for one frame in two.
fn faults(seed: u64) -> BTreeMap<u64, Fault> {
    let mut random = Random::new(seed);
    let struck = (QUIET..QUIET + FRAMES).filter_map(|latch| {
        let fault = draw(&mut random)?;
        Some((latch, fault))
    });
    struck.collect()
}

fn draw(random: &mut Random) -> Option<Fault> {
    let bits = |random: &mut Random, most: usize| {
        let count = 1 + random.below(most);
        (0..count)
            .map(|_| random.below(FRAME_BITS))
            .collect::<Vec<_>>()
    };
    Some(match random.below(20) {
        0 => Fault::Inverted(vec![random.below(FRAME_BITS)]),
        1 => Fault::Inverted(bits(random, 3)),
        2 => Fault::Inverted(bits(random, 40)),
        3 => {
            let begin = random.below(FRAME_BITS - 16);
            Fault::Inverted((begin..begin + 1 + random.below(16)).collect())
        }
        4 => Fault::LateEdges(bits(random, 8)),
        5 => Fault::LateEdges((0..FRAME_BITS).filter(|_| random.below(4) == 0).collect()),
        6 => Fault::EdgeTooMany(random.below(FRAME_BITS)),
        7 => Fault::EdgeMissed(random.below(FRAME_BITS)),
        8 => Fault::Stuck(random.below(2) == 1),
        9 => match random.below(4) {
            0 => Fault::Unfinished(random.below(FRAME_BYTES)),
            1 => Fault::Delayed(random.below(FRAME_BYTES)),
            2 => Fault::LatchedLate,
            _ => Fault::Restarted,
        },
        _ => return None,
    })
}

/// Expected reading of a frame: the table of `src/unit/counter_bank.rs`, written here independently.
#[derive(Debug, Default)]
struct Judge {
    /// Number and counters of the last good frame, and periods since then with and without its repetition.
    last: Option<(u16, [u8; 12])>,
    elapsed: u64,
    repeats: u64,
}

impl Judge {
    fn verdict(&mut self, transfer: &Transfer) -> Option<SourceFault> {
        self.elapsed += 1;
        let Some(bytes) = transfer.received.first_chunk::<FRAME_BYTES>() else {
            return Some(SourceFault::Bus);
        };
        // A byte that does not come in time ends the transfer, even if it is the last.
        if let Some(Fault::Unfinished(_) | Fault::Delayed(_)) = transfer.fault {
            return Some(SourceFault::Bus);
        }
        if bytes.iter().all(|byte| *byte == 0) || bytes.iter().all(|byte| *byte == 0xFF) {
            return Some(SourceFault::StuckLine);
        }
        if crc(&bytes[..46]) != u16::from_le_bytes([bytes[46], bytes[47]]) {
            return Some(SourceFault::Checksum);
        }
        let number = u16::from_le_bytes([bytes[0], bytes[1]]);
        let counters = std::array::from_fn(|place| bytes[2 + place]);
        let fault = self.last.and_then(|(last, counted)| {
            let step = u64::from(number.wrapping_sub(last));
            if step == 0 && counted == counters {
                return Some(SourceFault::Repeated);
            }
            let follows = (self.elapsed - self.repeats..=self.elapsed).contains(&step);
            (!follows).then_some(SourceFault::Restarted)
        });
        if fault == Some(SourceFault::Repeated) {
            self.repeats += 1;
        } else {
            (self.last, self.elapsed, self.repeats) = (Some((number, counters)), 0, 0);
        }
        fault
    }
}

/// CRC-16/IBM-3740, bit by bit: polynomial 0x1021, initial 0xFFFF.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |sum, byte| {
        (0..8).fold(sum ^ u16::from(*byte) << 8, |sum, _| {
            sum << 1 ^ if sum & 0x8000 != 0 { 0x1021 } else { 0 }
        })
    })
}

/// Plays the faults into an image.
fn play(image: &Image, seed: u64) -> Machine {
    let mut machine = Machine::new(image, Behaviour::SOUND, [&[], &[]]);
    machine.board().spi.bank.faults = faults(seed);
    let periods = QUIET + FRAMES + QUIET;
    let ending = machine.run_for(periods * ticks::of_us(250));
    assert_eq!(ending, Ending::Time);
    machine
}

/// Faults by kind, in a fixed order.
const KINDS: [SourceFault; 5] = [
    SourceFault::Checksum,
    SourceFault::Bus,
    SourceFault::StuckLine,
    SourceFault::Repeated,
    SourceFault::Restarted,
];

#[test]
fn ten_thousand_frames() {
    for (core, seed) in CORES.into_iter().zip(1..) {
        let mut machine = play(&Image::build(core, &[]), seed);
        let telemetry = Telemetry::take(&mut machine);
        let board = machine.board();
        let transfers = std::mem::take(&mut board.spi.bank.transfers);
        assert!(board.wrong.is_empty(), "{core}: {:?}", board.wrong);
        let read = transfers.len();
        let mut judge = Judge::default();
        let mut counts = BTreeMap::new();
        let (mut damaged, mut passed, mut struck) = (0, 0, 0);
        for transfer in &transfers {
            let verdict = judge.verdict(transfer);
            *counts.entry(verdict.map(|fault| fault as u32)).or_insert(0) += 1;
            let is_damaged = transfer.received != transfer.shown;
            damaged += u32::from(is_damaged);
            passed += u32::from(is_damaged && verdict.is_none());
            struck += u32::from(transfer.fault.is_some());
        }
        assert!(struck >= 10_000, "{core}: {struck} frames struck");
        let [checksums, bus, stuck, repeated, restarted] =
            KINDS.map(|kind| counts.get(&Some(kind as u32)).copied().unwrap_or(0));
        let told = |index: u8| telemetry.item(index);
        assert_eq!(told(20), checksums, "{core}: check sums");
        assert_eq!(told(21), bus + stuck, "{core}: bus errors");
        assert_eq!(told(item::STUCK_LINES), stuck, "{core}: stuck lines");
        assert_eq!(told(18), repeated, "{core}: repeated frames");
        assert_eq!(told(26), restarted, "{core}: restarts");
        for (index, what) in [
            (16, "missed"),
            (17, "late"),
            (19, "starved"),
            (22, "dropped"),
        ] {
            assert_eq!(told(index), 0, "{core}: {what}");
        }
        // A sum of 16 bits lets one of 65 536 gross damages through: 0.15 of these are expected.
        assert!(
            passed <= 2,
            "{core}: {passed} damaged frames pass every check"
        );
        assert_eq!(
            telemetry.statistics.bytes_skipped, 0,
            "{core}: the serial line"
        );
        println!(
            "{core}: {read} frames read, {struck} struck, {damaged} arrived damaged: {checksums} check sums, {bus} bus errors, {stuck} stuck lines, {repeated} repeated, {restarted} restarts, {passed} passed as good; every counter agrees"
        );
    }
}

/// Checks that the raw stream holds every period's input of the chain.
#[test]
fn ten_thousand_frames_by_the_raw_stream() {
    for (core, seed) in CORES.into_iter().zip(11..) {
        let mut machine = play(&Image::build(core, &["raw"]), seed);
        let board = machine.board();
        assert!(board.wrong.is_empty(), "{core}: {:?}", board.wrong);
        let [_, apb2_hz] = board.rcc.apb_hz(board.now);
        assert_eq!(board.usarts[1].baud(apb2_hz), 3_000_000);
        let transfers = std::mem::take(&mut board.spi.bank.transfers);
        let (batches, bytes) = (board.stream.batches, board.stream.bytes);
        let mut decoder = RawFinder::new();
        let sent = &board.usarts[1].sent;
        let frames: Vec<RawFrame> = sent.iter().filter_map(|byte| decoder.push(*byte)).collect();
        assert_eq!(decoder.statistics().bytes_skipped, 0, "{core}");
        // The last batches have not left yet.
        assert!(
            frames.len() + 20 >= transfers.len(),
            "{core}: {} frames",
            frames.len()
        );
        let mut judge = Judge::default();
        let mut faulty = 0;
        for (frame, transfer) in frames.iter().zip(&transfers) {
            let verdict = judge.verdict(transfer);
            let period = frame.period;
            assert_eq!(
                u64::from(period.number),
                transfer.latch,
                "{core}: {transfer:?}"
            );
            assert_eq!(period.source.fault(), verdict, "{core}: {transfer:?}");
            assert_eq!(
                (period.missed, period.source.is_late()),
                (0, false),
                "{core}"
            );
            if period.source.has_sample() {
                let pickoffs: Vec<u8> = period
                    .pickoff_codes
                    .iter()
                    .flat_map(|code| code.to_le_bytes())
                    .collect();
                assert_eq!(pickoffs, transfer.shown[14..26], "{core}: {transfer:?}");
            }
            faulty += u32::from(verdict.is_some());
        }
        println!(
            "{core}, raw stream: {} periods told, {faulty} of them with the fault that befell them, every pickoff as the bank showed it; {bytes} bytes in {batches} DMA transfers, none lost",
            frames.len()
        );
    }
}
