//! The telemetry frame, and finding it in a stream of bytes.

use proptest::prelude::*;
use trueaxis::health::HEALTH_ITEMS;
use trueaxis::telemetry::StreamStatistics;
use trueaxis::{
    Decoder, HealthItem, OutputFrame, Status, TELEMETRY_BYTES, TelemetryError, TelemetryFrame,
};

fn frame(sequence: u32) -> TelemetryFrame {
    TelemetryFrame::new(
        OutputFrame {
            sequence,
            dtheta_codes: [1, -2, i32::MIN],
            dvel_codes: [0x0102_0304, -5, i32::MAX],
            status: Status::from_bits(0x8000_0021),
        },
        HealthItem {
            index: 33,
            value: 0xAABB_CCDD,
        },
    )
}

/// Every frame in `bytes`, and the statistics of the rest.
fn decode(bytes: &[u8]) -> (Vec<TelemetryFrame>, StreamStatistics) {
    let mut decoder = Decoder::new();
    let frames = bytes
        .iter()
        .filter_map(|byte| decoder.push(*byte))
        .collect();
    (frames, *decoder.statistics())
}

#[test]
fn the_bytes_are_the_documented_ones() {
    let bytes = frame(0x1122_3344).to_bytes();
    #[rustfmt::skip]
    let documented = [
        0xEB, 0x90, 1, 43,
        0x44, 0x33, 0x22, 0x11,
        1, 0, 0, 0, 0xFE, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0x80,
        4, 3, 2, 1, 0xFB, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F,
        0x21, 0, 0, 0x80,
        33, 0xDD, 0xCC, 0xBB, 0xAA,
    ];
    assert_eq!(bytes[..41], documented);
    // CRC-16/IBM-3740 from its definition.
    let crc = documented.iter().fold(0xFFFF_u16, |crc, byte| {
        (0..8).fold(crc ^ (u16::from(*byte) << 8), |crc, _| {
            (crc << 1) ^ if crc & 0x8000 == 0 { 0 } else { 0x1021 }
        })
    });
    assert_eq!(bytes[41..], crc.to_le_bytes());
}

#[test]
fn every_single_flipped_bit_is_refused() {
    let bytes = frame(7).to_bytes();
    for bit in 0..8 * TELEMETRY_BYTES {
        let mut flipped = bytes;
        flipped[bit / 8] ^= 1 << (bit % 8);
        let refused = TelemetryFrame::from_bytes(&flipped);
        let expected = if bit < 32 {
            TelemetryError::Header
        } else {
            TelemetryError::Checksum
        };
        assert_eq!(refused, Err(expected), "bit {bit}");
    }
}

#[test]
fn a_clean_stream_gives_every_frame_and_skips_nothing() {
    let bytes: Vec<u8> = (0..100).flat_map(|n| frame(n).to_bytes()).collect();
    let (frames, met) = decode(&bytes);
    assert_eq!(frames, (0..100).map(frame).collect::<Vec<_>>());
    let clean = StreamStatistics {
        frames: 100,
        ..StreamStatistics::default()
    };
    assert_eq!(met, clean);
}

#[test]
fn a_damaged_frame_costs_itself_alone_even_when_its_end_is_missing() {
    // Cut short at every length: the next frame begins where the decoder expects the rest.
    for kept in 1..TELEMETRY_BYTES {
        let mut bytes = frame(0).to_bytes().to_vec();
        bytes.extend(&frame(1).to_bytes()[..kept]);
        bytes.extend(frame(2).to_bytes());
        let (frames, met) = decode(&bytes);
        assert_eq!(frames, [frame(0), frame(2)], "{kept} bytes kept");
        assert_eq!(met.bytes_skipped, kept as u64, "{kept} bytes kept");
        assert_eq!(met.frames_lost, 1);
    }
}

#[test]
fn a_stream_may_begin_anywhere() {
    let stream: Vec<u8> = (0..3).flat_map(|n| frame(n).to_bytes()).collect();
    for begin in 1..=TELEMETRY_BYTES {
        let (frames, met) = decode(&stream[begin..]);
        assert_eq!(frames, [frame(1), frame(2)], "begins at byte {begin}");
        assert_eq!(met.bytes_skipped as usize, TELEMETRY_BYTES - begin);
    }
}

#[test]
fn sequence_numbers_show_gaps_wraps_and_restarts() {
    let numbers = [u32::MAX - 1, u32::MAX, 0, 3, 4, 0, 0];
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| frame(*n).to_bytes()).collect();
    let (_, met) = decode(&bytes);
    assert_eq!(met.frames, 7);
    assert_eq!(met.frames_lost, 2, "1 and 2 after the wrap");
    assert_eq!(met.restarts, 2, "0 after 4, and 0 after 0");
}

#[test]
fn frames_of_another_version_are_counted_and_not_read() {
    let mut other = frame(1).to_bytes();
    other[2] += 1;
    let bytes = [frame(0).to_bytes(), other, frame(2).to_bytes()].concat();
    let (frames, met) = decode(&bytes);
    assert_eq!(frames, [frame(0), frame(2)]);
    assert_eq!((met.other_versions, met.bad_checksums), (1, 0));
}

#[test]
fn every_health_item_has_its_own_index() {
    let mut seen = HEALTH_ITEMS.to_vec();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), HEALTH_ITEMS.len());
}

fn any_frame() -> impl Strategy<Value = TelemetryFrame> {
    (any::<(u32, [i32; 3], [i32; 3], u32)>(), any::<(u8, u32)>()).prop_map(
        |((sequence, dtheta_codes, dvel_codes, status), (index, value))| {
            TelemetryFrame::new(
                OutputFrame {
                    sequence,
                    dtheta_codes,
                    dvel_codes,
                    status: Status::from_bits(status),
                },
                HealthItem { index, value },
            )
        },
    )
}

/// Random bytes, which hold a sync word once in 65 536, or the beginning of a frame. Not all of it but the
/// check sum: the next frame's sync would complete it once in 65 536, or in 256 where one byte lacks.
fn garbage() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        prop::collection::vec(any::<u8>(), 0..60),
        (any_frame(), 0..TELEMETRY_BYTES - 2)
            .prop_map(|(frame, kept)| frame.to_bytes()[..kept].to_vec()),
    ]
}

proptest! {
    #[test]
    fn what_is_encoded_is_decoded(frame in any_frame()) {
        prop_assert_eq!(TelemetryFrame::from_bytes(&frame.to_bytes()), Ok(frame));
    }

    /// Tests that every frame is found among any bytes: a false beginning is given up for the true one.
    #[test]
    fn garbage_costs_no_frame_and_every_byte_is_accounted_for(
        pieces in prop::collection::vec((garbage(), any_frame()), 1..8),
    ) {
        let bytes: Vec<u8> = pieces
            .iter()
            .flat_map(|(garbage, frame)| garbage.iter().copied().chain(frame.to_bytes()))
            .collect();
        // A beginning that the following bytes complete, check sum and all (once in 65 536), is a frame.
        let complete = bytes.windows(TELEMETRY_BYTES).filter(|window| {
            <&[u8; TELEMETRY_BYTES]>::try_from(*window)
                .is_ok_and(|window| TelemetryFrame::from_bytes(window).is_ok())
        });
        prop_assume!(complete.count() == pieces.len());
        let mut decoder = Decoder::new();
        let found: Vec<_> = bytes.iter().filter_map(|byte| decoder.push(*byte)).collect();
        let sent: Vec<_> = pieces.iter().map(|(_, frame)| *frame).collect();
        prop_assert_eq!(found, sent);
        let met = decoder.statistics();
        let whole = met.frames * TELEMETRY_BYTES as u64;
        prop_assert_eq!(whole + met.bytes_skipped, bytes.len() as u64);
        prop_assert_eq!(decoder.pending_bytes(), 0);
    }
}
