//! Feeds any bytes into the telemetry decoder, whole frames and damaged ones among them.
//!
//! Checks: no panic; every byte is in a frame, skipped or pending; a decoded frame encodes to the same bytes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use trueaxis::telemetry::{Decoder, TELEMETRY_BYTES};
use trueaxis::telemetry_frame::TelemetryFrame;

/// Bytes of a frame chosen by the fuzzer: the header and the check sum are put around them.
const CONTENT_BYTES: usize = TELEMETRY_BYTES - 6;

fuzz_target!(|data: &[u8]| {
    let stream = stream(data);
    let mut decoder = Decoder::new();
    for (at, byte) in stream.iter().enumerate() {
        if let Some(frame) = decoder.push(*byte) {
            let bytes = frame.to_bytes();
            assert_eq!(bytes.as_slice(), &stream[at + 1 - TELEMETRY_BYTES..=at]);
        }
    }
    let met = decoder.statistics();
    assert_eq!(
        met.frames * TELEMETRY_BYTES as u64 + met.bytes_skipped + decoder.pending_bytes() as u64,
        stream.len() as u64
    );
});

/// Returns the fuzzer's bytes unchanged, and for a marker byte a frame with the following bytes as content and the right
/// check sum, damaged or not.
fn stream(data: &[u8]) -> Vec<u8> {
    let mut stream = Vec::new();
    let mut rest = data;
    while let [first, more @ ..] = rest {
        rest = more;
        match (first, rest.split_first_chunk::<CONTENT_BYTES>()) {
            (0xF0..=0xFF, Some((content, more))) => {
                let mut frame = whole(content);
                if first & 1 != 0 {
                    frame[usize::from(content[0]) % TELEMETRY_BYTES] ^= content[1];
                }
                stream.extend(frame);
                rest = more;
            }
            _ => stream.push(*first),
        }
    }
    stream
}

/// Makes a frame with this content.
fn whole(content: &[u8; CONTENT_BYTES]) -> [u8; TELEMETRY_BYTES] {
    let mut bytes = TelemetryFrame::default().to_bytes();
    bytes[4..4 + CONTENT_BYTES].copy_from_slice(content);
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_IBM_3740).checksum(&bytes[..4 + CONTENT_BYTES]);
    bytes[4 + CONTENT_BYTES..].copy_from_slice(&crc.to_le_bytes());
    bytes
}
