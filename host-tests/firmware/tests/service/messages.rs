//! Inertial messages: documented bytes, an independent check sum, the Rust and the Python decoder, damaged lines.

use std::io::Write;
use std::process::{Command, Stdio};

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueaxis::health::HealthItem;
use trueaxis::inertial_message::{
    CONTROL_EVERY, InertialDecoder, InertialEncoder, InertialMessage, MOST_BYTES,
};
use trueaxis::{FrameTime, OutputFrame, Status, TelemetryFrame};

fn frame(sequence: u32, codes: [i32; 6], status: u32, time: FrameTime) -> TelemetryFrame {
    let [x, y, z, u, v, w] = codes;
    let output = OutputFrame {
        sequence,
        dtheta_codes: [x, y, z],
        dvel_codes: [u, v, w],
        status: Status::from_bits(status),
    };
    let health = HealthItem {
        index: 46,
        value: 0x7E7D_7E7D,
    };
    let mut frame = TelemetryFrame::new(output, health);
    frame.time = time;
    frame
}

fn half_a_second() -> FrameTime {
    FrameTime {
        pulses: 0x1_0203,
        since_pulse: 8_000_400,
        second: 16_000_800,
    }
}

/// The frame check sequence of RFC 1662 bit by bit.
fn fcs_bit_by_bit(bytes: &[u8]) -> u16 {
    let mut crc = 0xFFFF_u16;
    for byte in bytes {
        crc ^= u16::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 0 {
                crc >> 1
            } else {
                crc >> 1 ^ 0x8408
            };
        }
    }
    !crc
}

#[test]
fn the_bytes_are_the_documented_ones() {
    // The catalogue's check value.
    assert_eq!(fcs_bit_by_bit(b"123456789"), 0x906E);
    let codes = [1, -1, 0x7E, 0x7D, i32::MIN, 5];
    let frame = frame(0x1_BEEF, codes, Status::GAP.bits(), half_a_second());
    let line = InertialEncoder::new().encode(&frame);
    let mut message = vec![0x01, 0x01, 0xEF, 0xBE, 0x03, 0x02];
    message.extend(500_000_000_u32.to_le_bytes());
    message.extend([0b1_1001, 0]);
    message.extend(codes.iter().flat_map(|code| code.to_le_bytes()));
    message.extend(fcs_bit_by_bit(&message).to_le_bytes());
    let mut expected = vec![0x7E];
    for byte in message {
        match byte {
            0x7E => expected.extend([0x7D, 0x5E]),
            0x7D => expected.extend([0x7D, 0x5D]),
            other => expected.push(other),
        }
    }
    expected.push(0x7E);
    assert_eq!(line.bytes(), expected);
}

#[test]
fn a_control_message_gathers_the_status_since_the_one_before() {
    let mut encoder = InertialEncoder::new();
    let mut decoder = InertialDecoder::new();
    let mut controls = Vec::new();
    for sequence in 0..u32::from(2 * CONTROL_EVERY) {
        let status = if sequence == 3 {
            Status::MODE_HOP
        } else {
            Status::default()
        };
        let line = encoder.encode(&frame(sequence, [0; 6], status.bits(), half_a_second()));
        for byte in line.bytes() {
            if let Some(InertialMessage::Control(control)) = decoder.push(*byte) {
                controls.push((
                    control.sequence,
                    control.status,
                    control.health.value,
                    control.second,
                ));
            }
        }
    }
    let last = |number: u8| u32::from(number * CONTROL_EVERY) - 1;
    assert_eq!(
        controls,
        [
            (last(1), Status::MODE_HOP, 0x7E7D_7E7D, 16_000_800),
            (last(2), Status::default(), 0x7E7D_7E7D, 16_000_800)
        ]
    );
    assert_eq!(decoder.refused(), 0);
}

/// A stream of random frames and its messages by the Rust decoder, as the Python one prints their fields.
fn stream(frames: u32) -> (Vec<u8>, Vec<String>) {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut encoder = InertialEncoder::new();
    let mut decoder = InertialDecoder::new();
    let (mut bytes, mut said) = (Vec::new(), Vec::new());
    for sequence in 0..frames {
        let codes = std::array::from_fn(|_| random.random());
        let time = if random.random() {
            half_a_second()
        } else {
            FrameTime::NONE
        };
        let line = encoder.encode(&frame(sequence, codes, random.random(), time));
        assert!(line.bytes().len() <= MOST_BYTES);
        bytes.extend(line.bytes());
        for message in line.bytes().iter().filter_map(|byte| decoder.push(*byte)) {
            said.push(match message {
                InertialMessage::Increments(m) => format!(
                    "increments {} {} {} {} {:?} {:?}",
                    m.counter,
                    m.pulses,
                    m.since_pulse_ns
                        .map_or("None".to_owned(), |ns| ns.to_string()),
                    m.summary,
                    m.dtheta_codes,
                    m.dvel_codes
                ),
                InertialMessage::Control(m) => format!(
                    "control {} {} {} {} {}",
                    m.health.index,
                    m.health.value,
                    m.status.bits(),
                    m.sequence,
                    m.second
                ),
                _ => unreachable!("two kinds"),
            });
        }
    }
    assert_eq!(decoder.refused(), 0);
    (bytes, said)
}

/// Prints the fields of each message, from the decoder of the documentation.
const FIELDS: &str = "
import sys
sys.path.insert(0, sys.argv[1])
import inertial_message as m
for message in map(m.decode, m.messages(sys.stdin.buffer.read())):
    if message['message'] == 'increments':
        print('increments', message['counter'], message['pulses'], message['since_pulse_ns'], message['summary'],
              message['dtheta_codes'], message['dvel_codes'])
    else:
        print('control', message['item'], message['value'], message['status'], message['sequence'], message['second'])
";

#[test]
fn the_python_decoder_reads_what_the_rust_encoder_writes() {
    let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs");
    let python = Command::new("python3")
        .args(["-B", "-c", FIELDS, docs])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn();
    let Ok(mut python) = python else {
        println!("passed over: there is no python3");
        return;
    };
    let (bytes, said) = stream(2_000);
    let mut input = python.stdin.take().expect("piped");
    let writer = std::thread::spawn(move || input.write_all(&bytes).expect("python reads"));
    let output = python.wait_with_output().expect("python ends");
    writer.join().expect("written");
    assert!(output.status.success());
    let printed = String::from_utf8(output.stdout).expect("text");
    assert_eq!(printed.lines().collect::<Vec<_>>(), said);
    assert_eq!(said.len(), 2_200);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// One damaged byte spoils the frame that it is in, or two where it is a flag, and no other.
    #[test]
    fn a_damaged_byte_costs_at_most_two_messages(at in any::<prop::sample::Index>(), flip in 1..=255_u8) {
        let (mut bytes, said) = stream(20);
        let at = at.index(bytes.len());
        bytes[at] ^= flip;
        let mut decoder = InertialDecoder::new();
        let found = bytes.iter().filter_map(|byte| decoder.push(*byte)).count();
        prop_assert!(found + 2 >= said.len() && found <= said.len(), "{found} of {}", said.len());
    }

    /// Any bytes are messages or none.
    #[test]
    fn any_bytes_do_not_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut decoder = InertialDecoder::new();
        for byte in &bytes {
            if let Some(message) = decoder.push(*byte) {
                let again = match message {
                    InertialMessage::Increments(m) => InertialMessage::from_bytes(&m.to_bytes()),
                    InertialMessage::Control(m) => InertialMessage::from_bytes(&m.to_bytes()),
                    _ => None,
                };
                prop_assert!(again.is_some());
            }
        }
    }
}
