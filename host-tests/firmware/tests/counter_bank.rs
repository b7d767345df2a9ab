//! The counter bank's driver against a mock bus, frame by frame.

use std::pin::pin;
use std::task::{Context, Poll, Waker};

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use embedded_hal_mock::eh1::spi::{Mock, Transaction};
use proptest::prelude::*;
use trueaxis::Sample;
use trueaxis::bank_bus::CounterBank;
use trueaxis::counter_bank::{
    AccelerometerInput, BankDecoder, BankFrame, BankService, BusFault, FRAME_BYTES, FRAME_BYTES_V2,
    WireBytes, checksum,
};
use trueaxis::sample_source::{Reading, SampleSource, SourceFault};

type Bytes = [u8; FRAME_BYTES];

/// A frame as the documentation lays it out, written here byte by byte and not by the driver.
fn frame(sequence: u16, counters: [i32; 3], pickoffs: [i32; 3]) -> Bytes {
    frame_with_accelerometers(sequence, counters, pickoffs, [0; 3])
}

fn frame_with_accelerometers(
    sequence: u16,
    counters: [i32; 3],
    pickoffs: [i32; 3],
    accelerometers: [i32; 3],
) -> Bytes {
    let mut bytes = [0; FRAME_BYTES];
    bytes[0..2].copy_from_slice(&sequence.to_le_bytes());
    for axis in 0..3 {
        bytes[2 + 4 * axis..6 + 4 * axis].copy_from_slice(&counters[axis].to_le_bytes());
        bytes[14 + 4 * axis..18 + 4 * axis].copy_from_slice(&pickoffs[axis].to_le_bytes());
        bytes[26 + 4 * axis..30 + 4 * axis].copy_from_slice(&accelerometers[axis].to_le_bytes());
    }
    // No slow channel, and no time.
    bytes[38..44].copy_from_slice(&[0xFF, 0, 0, 0xFF, 0xFF, 0xFF]);
    let crc = crc16_bit_by_bit(&bytes[..46]);
    bytes[46..48].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// CRC-16/IBM-3740 from its definition: polynomial 0x1021, initial 0xFFFF, most significant bit first.
fn crc16_bit_by_bit(bytes: &[u8]) -> u16 {
    let mut crc = 0xFFFF_u16;
    for byte in bytes {
        crc ^= u16::from(*byte) << 8;
        for _ in 0..8 {
            crc = if crc & 0x8000 == 0 {
                crc << 1
            } else {
                (crc << 1) ^ 0x1021
            };
        }
    }
    crc
}

/// Readings of the driver from `frames`, one each.
fn readings(frames: &[Bytes]) -> Vec<Reading> {
    readings_with(AccelerometerInput::Counters, frames)
}

fn readings_with(accelerometers: AccelerometerInput, frames: &[Bytes]) -> Vec<Reading> {
    timed_readings(accelerometers, frames, &vec![1; frames.len()])
}

/// The same, each after so many periods.
fn timed_readings(
    accelerometers: AccelerometerInput,
    frames: &[Bytes],
    elapsed: &[u32],
) -> Vec<Reading> {
    let transactions: Vec<_> = frames
        .iter()
        .flat_map(|bytes| {
            [
                Transaction::transaction_start(),
                Transaction::read_vec(bytes.to_vec()),
                Transaction::transaction_end(),
            ]
        })
        .collect();
    let mut bank = CounterBank::new(Mock::new(&transactions), accelerometers);
    let readings = elapsed.iter().map(|elapsed| bank.take(*elapsed)).collect();
    bank.release().done();
    readings
}

fn good(pulse_counts: [i32; 3], pickoff_codes: [i32; 3]) -> Reading {
    Reading::new(
        Some(Sample {
            pulse_counts,
            pickoff_codes,
            ..Sample::default()
        }),
        1,
        None,
    )
}

fn after_a_gap(periods: u32, reading: Reading) -> Reading {
    let mut reading = reading;
    reading.periods = periods;
    reading
}

fn restarted(pickoff_codes: [i32; 3]) -> Reading {
    let mut reading = after_a_gap(0, good([0; 3], pickoff_codes));
    reading.fault = Some(SourceFault::Restarted);
    reading
}

#[test]
fn the_check_sum_is_the_standard_one() {
    // The catalogue's check value: the CRC of "123456789" is 0x29B1.
    assert_eq!(crc16_bit_by_bit(b"123456789"), 0x29B1);
    let bytes = frame(0x1234, [1, -2, 3], [-4, 5, i32::MIN]);
    assert_eq!(checksum(&bytes), crc16_bit_by_bit(&bytes[..46]));
}

#[test]
fn the_encoder_writes_the_documented_bytes_and_the_decoder_reads_them() {
    let bytes = frame_with_accelerometers(
        0xBEEF,
        [1, -2, i32::MAX],
        [-4, 5, i32::MIN],
        [7, -8, 0x1234_5678],
    );
    let content = BankFrame::new(0xBEEF, [1, -2, i32::MAX], [-4, 5, i32::MIN])
        .with(|frame| frame.accelerometers = [7, -8, 0x1234_5678]);
    assert_eq!(content.to_bytes(), bytes);
    assert_eq!(BankFrame::from_bytes(&bytes), Ok(content));
}

#[test]
fn a_frame_of_version_2_is_the_same_sample_without_slow_channel_and_time() {
    let content = BankFrame::new(0xBEEF, [1, -2, i32::MAX], [-4, 5, i32::MIN])
        .with(|frame| frame.accelerometers = [7, -8, 0x1234_5678]);
    let whole = content.to_bytes();
    let old = content.to_bytes_v2();
    assert_eq!(old[..38], whole[..38]);
    assert_eq!(old[38..], crc16_bit_by_bit(&old[..38]).to_le_bytes());
    assert_eq!(old.decode(), Ok(content));
    for bit in 0..8 * FRAME_BYTES_V2 {
        let mut flipped = old;
        flipped[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(flipped.decode(), Err(SourceFault::Checksum), "bit {bit}");
    }
    for level in [0, 0xFF] {
        let dead = [level; FRAME_BYTES_V2];
        assert_eq!(dead.decode(), Err(SourceFault::StuckLine));
    }
    // The same bank read by either driver gives the same readings.
    let next = content.followed_by(
        &Sample {
            pulse_counts: [5, -6, 7],
            ..Sample::default()
        },
        AccelerometerInput::Counters,
    );
    let frames = [content, next];
    let expectations = frames.map(|frame| Transaction::read_vec(frame.to_bytes_v2().to_vec()));
    let transactions: Vec<_> = expectations
        .into_iter()
        .flat_map(|read| {
            [
                Transaction::transaction_start(),
                read,
                Transaction::transaction_end(),
            ]
        })
        .collect();
    let mut bank =
        CounterBank::of_version_2(Mock::new(&transactions), AccelerometerInput::Counters);
    let seen = frames.map(|_| bank.take(1));
    assert_eq!(
        seen.to_vec(),
        readings(&frames.map(|frame| frame.to_bytes()))
    );
    bank.release().done();
}

#[test]
fn slow_channel_and_time_stand_where_the_layout_has_them() {
    let service = BankService {
        channel: 7,
        value: -2,
        since_pulse: 0x0A_0B0C,
    };
    let content = BankFrame::new(1, [0; 3], [0; 3]).with(|frame| frame.service = service);
    let bytes = content.to_bytes();
    assert_eq!(bytes[38..44], [7, 0xFE, 0xFF, 0x0C, 0x0B, 0x0A]);
    assert_eq!(readings(&[bytes])[0].service, service);
    // A time beyond the field is none.
    let late = content.with(|frame| frame.service.since_pulse = 0x0100_0000);
    assert_eq!(
        readings(&[late.to_bytes()])[0].service.since_pulse,
        BankService::NO_PULSE
    );
}

#[test]
fn the_first_frame_gives_its_pickoffs_and_the_next_the_difference() {
    let seen = readings(&[
        frame(7, [100, -50, 0], [11, 12, 13]),
        frame(8, [320, -270, -1], [-21, 22, 23]),
    ]);
    assert_eq!(
        seen[0],
        after_a_gap(0, good([0, 0, 0], [11, 12, 13])),
        "there is nothing yet to difference with"
    );
    assert_eq!(seen[1], good([220, -220, -1], [-21, 22, 23]));
}

#[test]
fn counters_and_sequence_wrap_exactly() {
    let seen = readings(&[
        frame_with_accelerometers(
            u16::MAX,
            [i32::MAX, i32::MIN, -1],
            [0; 3],
            [i32::MAX, i32::MIN, 0],
        ),
        frame_with_accelerometers(
            0,
            [i32::MIN + 9, i32::MAX - 9, 4],
            [0; 3],
            [i32::MIN, i32::MAX, -5],
        ),
    ]);
    let sample = seen[1].sample.expect("a sample");
    assert_eq!(sample.pulse_counts, [10, -10, 5]);
    assert_eq!(sample.accelerometer_codes, [1, -1, -5]);
    assert_eq!((seen[1].periods, seen[1].fault), (1, None));
}

#[test]
fn accelerometer_counters_are_differenced_and_converter_codes_stand_for_lost_periods_too() {
    let frames = [
        frame_with_accelerometers(1, [0; 3], [0; 3], [100, 200, 300]),
        frame_with_accelerometers(2, [0; 3], [0; 3], [110, 190, 300]),
        frame_with_accelerometers(5, [0; 3], [0; 3], [1_000, -1_000, i32::MAX]),
    ];
    let codes = |input| {
        // Two interrupts were missed before the last.
        timed_readings(input, &frames, &[1, 1, 3])
            .iter()
            .map(|reading| reading.sample.expect("a sample").accelerometer_codes)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        codes(AccelerometerInput::Counters),
        [[0, 0, 0], [10, -10, 0], [890, -1_190, i32::MAX - 300]]
    );
    assert_eq!(
        codes(AccelerometerInput::Codes),
        [
            [100, 200, 300],
            [110, 190, 300],
            [3_000, -3_000, i32::MAX] // held at the word's end
        ]
    );
}

#[test]
fn every_single_flipped_bit_is_refused_and_loses_no_angle() {
    let damaged = frame(2, [10, 20, 30], [1, 2, 3]);
    for bit in 0..8 * FRAME_BYTES {
        let mut flipped = damaged;
        flipped[bit / 8] ^= 1 << (bit % 8);
        let seen = readings(&[
            frame(1, [0; 3], [0; 3]),
            flipped,
            frame(3, [22, 44, 66], [4, 5, 6]),
        ]);
        assert_eq!(
            seen[1],
            Reading::without_sample(SourceFault::Checksum),
            "bit {bit}"
        );
        // The angle of both periods arrives with the next good frame, and the driver reports the reason.
        assert_eq!(
            seen[2],
            after_a_gap(2, good([22, 44, 66], [4, 5, 6])),
            "bit {bit}"
        );
    }
}

#[test]
fn a_dead_line_is_told_apart_from_noise() {
    for level in [0x00, 0xFF] {
        let seen = readings(&[
            frame(1, [0; 3], [0; 3]),
            [level; FRAME_BYTES],
            [level; FRAME_BYTES],
            frame(4, [9, 9, 9], [0; 3]),
        ]);
        let stuck = Reading::without_sample(SourceFault::StuckLine);
        assert_eq!(seen[1..3], [stuck, stuck], "level {level:#x}");
        assert_eq!(seen[3], after_a_gap(3, good([9, 9, 9], [0; 3])));
    }
}

#[test]
fn a_still_unit_whose_frame_is_all_zeros_but_for_its_check_sum_is_good() {
    // The check sum's initial value keeps it from being 0, so such a frame is not a dead line.
    let bytes = frame(0, [0; 3], [0; 3]);
    assert!(bytes[..38].iter().all(|byte| *byte == 0));
    assert!(BankFrame::from_bytes(&bytes).is_ok());
}

#[test]
fn a_repeated_frame_gives_no_sample_and_loses_no_angle() {
    let again = frame(5, [10, 0, 0], [1, 1, 1]);
    let seen = readings(&[
        frame(4, [0; 3], [0; 3]),
        again,
        again,
        // The bank latched late and went on: two periods.
        frame(7, [31, 0, 0], [2, 2, 2]),
        frame(7, [31, 0, 0], [2, 2, 2]),
        // The bank missed a latch: its counters ran on over both periods.
        frame(8, [41, 0, 0], [3, 3, 3]),
    ]);
    let repeated = Reading::without_sample(SourceFault::Repeated);
    assert_eq!(seen[1], good([10, 0, 0], [1, 1, 1]));
    assert_eq!(seen[2], repeated);
    assert_eq!(seen[3], after_a_gap(2, good([21, 0, 0], [2, 2, 2])));
    assert_eq!(seen[4], repeated);
    assert_eq!(seen[5], after_a_gap(2, good([10, 0, 0], [3, 3, 3])));
}

#[test]
fn frames_of_missed_interrupts_are_due_and_their_angle_is_kept() {
    let seen = timed_readings(
        AccelerometerInput::Counters,
        &[
            frame(u16::MAX - 1, [5, 5, 5], [0; 3]),
            frame(3, [505, -495, 5], [9, 8, 7]),
        ],
        &[1, 5],
    );
    assert_eq!(seen[1], after_a_gap(5, good([500, -500, 0], [9, 8, 7])));
}

#[test]
fn a_number_that_the_clock_does_not_allow_is_a_restart_and_no_count() {
    for (sequence, elapsed) in [(0, 1), (10, 1), (12, 1), (9, 1), (11, 2), (500, 489)] {
        let seen = timed_readings(
            AccelerometerInput::Counters,
            &[
                frame(10, [5, 5, 5], [0; 3]),
                frame(sequence, [1_000_000, 0, -3], [9, 8, 7]),
                frame(sequence.wrapping_add(1), [1_000_007, 1, -3], [9, 8, 7]),
            ],
            &[1, elapsed, 1],
        );
        assert_eq!(seen[1], restarted([9, 8, 7]), "{sequence} after {elapsed}");
        assert_eq!(seen[2], good([7, 1, 0], [9, 8, 7]), "{sequence}");
    }
}

/// A bus that answers in turn; `None` is an error. (The mock above cannot report one.)
struct FlakyBus<'a>(std::slice::Iter<'a, Option<Bytes>>);

impl ErrorType for FlakyBus<'_> {
    type Error = ErrorKind;
}

impl SpiDevice for FlakyBus<'_> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let [Operation::Read(buffer)] = operations else {
            panic!("the driver does one read a period");
        };
        let answer = self.0.next().expect("a request for each answer");
        buffer.copy_from_slice(&answer.ok_or(ErrorKind::Overrun)?);
        Ok(())
    }
}

/// The same bus for an asynchronous driver; each transfer is awaited twice before it is done.
struct SlowBus<'a>(FlakyBus<'a>);

impl ErrorType for SlowBus<'_> {
    type Error = ErrorKind;
}

impl embedded_hal_async::spi::SpiDevice for SlowBus<'_> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let mut waits = 2;
        std::future::poll_fn(|_| match waits {
            0 => Poll::Ready(()),
            _ => {
                waits -= 1;
                Poll::Pending
            }
        })
        .await;
        SpiDevice::transaction(&mut self.0, operations)
    }
}

/// Runs a future to its end, and counts its polls.
fn run<T>(future: impl Future<Output = T>) -> (T, u32) {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    for polls in 1.. {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return (output, polls);
        }
    }
    unreachable!("a future of finite waits")
}

#[test]
fn failed_reads_explain_their_own_periods_and_no_more() {
    let answers = [
        Some(frame(1, [0; 3], [0; 3])),
        None,
        Some(frame(3, [7, 7, 7], [1, 2, 3])),
        None,
        None,
        Some(frame(8, [20, 7, 7], [1, 2, 3])),
    ];
    let mut bank = CounterBank::new(FlakyBus(answers.iter()), AccelerometerInput::default());
    let seen: Vec<_> = answers.iter().map(|_| bank.take(1)).collect();
    assert_eq!(seen[1], Reading::without_sample(SourceFault::Bus));
    assert_eq!(seen[2], after_a_gap(2, good([7, 7, 7], [1, 2, 3])));
    // Three periods, and five more in number: the bank is not the one it was.
    assert_eq!(seen[5], restarted([1, 2, 3]));
}

#[test]
fn a_transfer_that_is_given_up_loses_no_angle() {
    let answers = [
        Some(frame(1, [0; 3], [0; 3])),
        Some(frame(3, [7, 7, 7], [1, 2, 3])),
    ];
    let mut bank = CounterBank::new(
        SlowBus(FlakyBus(answers.iter())),
        AccelerometerInput::default(),
    );
    let _ = run(bank.take_async(1));
    {
        let mut given_up = pin!(bank.take_async(1));
        let mut context = Context::from_waker(Waker::noop());
        assert!(given_up.as_mut().poll(&mut context).is_pending());
    }
    let (reading, _) = run(bank.take_async(1));
    assert_eq!(reading, after_a_gap(2, good([7, 7, 7], [1, 2, 3])));
}

/// Event on the wire in one period.
#[derive(Debug, Clone, Copy)]
enum Wire {
    Good,
    Flipped(usize),
    Dead(bool),
    Error,
    /// The bank goes on without being read.
    Unasked,
}

fn wire() -> impl Strategy<Value = Wire> {
    prop_oneof![
        4 => Just(Wire::Good),
        1 => (0..8 * FRAME_BYTES).prop_map(Wire::Flipped),
        1 => any::<bool>().prop_map(Wire::Dead),
        1 => Just(Wire::Error),
        1 => Just(Wire::Unasked),
    ]
}

proptest! {
    /// However the frames come through, the counts of all readings add up to the bank's counts, and their periods to
    /// the elapsed ones.
    #[test]
    fn no_pulse_is_lost_or_invented(
        start in any::<[i32; 3]>(),
        sequence in any::<u16>(),
        periods in prop::collection::vec((wire(), any::<[i16; 3]>()), 1..60),
    ) {
        let mut bank = BankFrame::default().with(|frame| {
frame.sequence = sequence;
frame.counters = start;
});
        let mut answers = vec![(1, Some(bank.to_bytes()))];
        let mut elapsed = 0;
        for (wire, counts) in &periods {
            let sample = Sample { pulse_counts: counts.map(i32::from), ..Sample::default() };
            bank = bank.followed_by(&sample, AccelerometerInput::Counters);
            let mut bytes = bank.to_bytes();
            elapsed += 1;
            match wire {
                Wire::Good => {}
                Wire::Flipped(bit) => bytes[bit / 8] ^= 1 << (bit % 8),
                Wire::Dead(high) => bytes = [if *high { 0xFF } else { 0 }; FRAME_BYTES],
                Wire::Error => { answers.push((std::mem::take(&mut elapsed), None)); continue; }
                Wire::Unasked => continue,
            }
            answers.push((std::mem::take(&mut elapsed), Some(bytes)));
        }
        bank = bank.followed_by(&Sample::default(), AccelerometerInput::Counters);
        answers.push((elapsed + 1, Some(bank.to_bytes())));

        let on_the_bus: Vec<_> = answers.iter().map(|(_, answer)| *answer).collect();
        let mut driver =
            CounterBank::new(FlakyBus(on_the_bus.iter()), AccelerometerInput::Counters);
        // However the bytes came, by a blocking bus, an asynchronous one or a buffer that DMA filled.
        let mut slow = CounterBank::new(
            SlowBus(FlakyBus(on_the_bus.iter())),
            AccelerometerInput::Counters,
        );
        let mut decoder = BankDecoder::new(AccelerometerInput::Counters);
        let (mut counted, mut passed) = (start, 0);
        for (elapsed, answer) in &answers {
            let reading = driver.take(*elapsed);
            prop_assert_eq!((reading, 3), run(slow.take_async(*elapsed)));
            prop_assert_eq!(reading, decoder.reading(answer.as_ref().ok_or(BusFault), *elapsed));
            prop_assert!(reading.fault != Some(SourceFault::Restarted));
            passed += reading.periods;
            if let Some(sample) = reading.sample {
                for (sum, pulses) in counted.iter_mut().zip(sample.pulse_counts) {
                    *sum = sum.wrapping_add(pulses);
                }
            }
        }
        prop_assert_eq!(counted, bank.counters);
        prop_assert_eq!(passed as usize, periods.len() + 1);
    }

    /// Any 48 bytes are a frame or a fault.
    #[test]
    fn any_bytes_do_not_panic(bytes in any::<[u8; 32]>(), tail in any::<[u8; 16]>()) {
        let mut frame = [0; FRAME_BYTES];
        frame[..32].copy_from_slice(&bytes);
        frame[32..].copy_from_slice(&tail);
        if let Ok(content) = BankFrame::from_bytes(&frame) {
            prop_assert_eq!(content.to_bytes(), frame);
        }
    }
}
