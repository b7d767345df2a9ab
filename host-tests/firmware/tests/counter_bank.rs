//! The counter bank's driver against a mock bus, frame by frame.

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use embedded_hal_mock::eh1::spi::{Mock, Transaction};
use trueaxis::Sample;
use trueaxis::counter_bank::{CounterBank, FRAME_BYTES, checksum};
use trueaxis::sample_source::{Reading, SampleSource, SourceFault};

/// A frame as the documentation lays it out, written here byte by byte and not by the driver.
fn frame(sequence: u16, counters: [i32; 3], pickoffs: [i32; 3]) -> [u8; FRAME_BYTES] {
    let mut bytes = [0; FRAME_BYTES];
    bytes[0..2].copy_from_slice(&sequence.to_le_bytes());
    for axis in 0..3 {
        bytes[2 + 4 * axis..6 + 4 * axis].copy_from_slice(&counters[axis].to_le_bytes());
        bytes[14 + 4 * axis..18 + 4 * axis].copy_from_slice(&pickoffs[axis].to_le_bytes());
    }
    let crc = crc16_bit_by_bit(&bytes[..26]);
    bytes[26..28].copy_from_slice(&crc.to_le_bytes());
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

/// What the driver makes of `frames`, one reading each.
fn readings(frames: &[[u8; FRAME_BYTES]]) -> Vec<Reading> {
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
    let mut bank = CounterBank::new(Mock::new(&transactions));
    let readings = frames.iter().map(|_| bank.take()).collect();
    bank.release().done();
    readings
}

fn good(pulse_counts: [i32; 3], pickoff_codes: [i32; 3]) -> Reading {
    Reading {
        sample: Some(Sample {
            pulse_counts,
            pickoff_codes,
            ..Sample::default()
        }),
        fault: None,
    }
}

fn faulty(fault: SourceFault) -> Reading {
    Reading {
        sample: None,
        fault: Some(fault),
    }
}

#[test]
fn the_check_sum_is_the_standard_one() {
    // The catalogue's check value: the CRC of "123456789" is 0x29B1.
    assert_eq!(crc16_bit_by_bit(b"123456789"), 0x29B1);
    let bytes = frame(0x1234, [1, -2, 3], [-4, 5, i32::MIN]);
    assert_eq!(checksum(&bytes), crc16_bit_by_bit(&bytes[..26]));
}

#[test]
fn the_first_frame_primes_and_the_next_gives_the_difference() {
    let seen = readings(&[
        frame(7, [100, -50, 0], [11, 12, 13]),
        frame(8, [320, -270, -1], [-21, 22, 23]),
    ]);
    assert_eq!(seen[0], Reading::default());
    assert_eq!(seen[1], good([220, -220, -1], [-21, 22, 23]));
}

#[test]
fn counters_and_sequence_wrap_exactly() {
    let seen = readings(&[
        frame(u16::MAX, [i32::MAX, i32::MIN, -1], [0; 3]),
        frame(0, [i32::MIN + 9, i32::MAX - 9, 4], [0; 3]),
    ]);
    assert_eq!(seen[1], good([10, -10, 5], [0; 3]));
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
        assert_eq!(seen[1], faulty(SourceFault::Checksum), "bit {bit}");
        // The angle of both periods arrives with the next good frame, and is flagged.
        assert_eq!(
            seen[2],
            Reading {
                fault: Some(SourceFault::Skipped(1)),
                ..good([22, 44, 66], [4, 5, 6])
            },
            "bit {bit}"
        );
    }
}

#[test]
fn a_repeated_frame_gives_no_sample() {
    let again = frame(5, [10, 0, 0], [1, 1, 1]);
    let seen = readings(&[frame(4, [0; 3], [0; 3]), again, again]);
    assert_eq!(seen[1], good([10, 0, 0], [1, 1, 1]));
    assert_eq!(seen[2], faulty(SourceFault::Repeated));
}

#[test]
fn skipped_frames_are_counted_and_their_angle_kept() {
    let seen = readings(&[
        frame(u16::MAX - 1, [5, 5, 5], [0; 3]),
        frame(3, [505, -495, 5], [9, 8, 7]),
    ]);
    assert_eq!(
        seen[1],
        Reading {
            fault: Some(SourceFault::Skipped(4)),
            ..good([500, -500, 0], [9, 8, 7])
        }
    );
}

/// A bus that answers in turn; `None` is an error. (The mock above cannot report one.)
struct FlakyBus<'a>(std::slice::Iter<'a, Option<[u8; FRAME_BYTES]>>);

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

#[test]
fn a_bus_error_gives_no_sample_and_loses_no_angle() {
    let answers = [
        Some(frame(1, [0; 3], [0; 3])),
        None,
        Some(frame(3, [7, 7, 7], [1, 2, 3])),
    ];
    let mut bank = CounterBank::new(FlakyBus(answers.iter()));
    assert_eq!(bank.take(), Reading::default());
    assert_eq!(bank.take(), faulty(SourceFault::Bus));
    assert_eq!(
        bank.take(),
        Reading {
            fault: Some(SourceFault::Skipped(1)),
            ..good([7, 7, 7], [1, 2, 3])
        }
    );
}
