//! Bytes out and in again, and refusals.

use proptest::prelude::*;
use trueaxis::{
    AccelerometerParameters, BlockError, CrossAxis, FrameError, OutputFrame, PARAMETER_BLOCK_BYTES,
    ParameterError, Parameters, Sample, Status,
};

use crate::motion::as_built;

proptest! {
    #[test]
    fn samples_round_trip_through_their_bytes(pulse_counts: [i32; 3], pickoff_codes: [i32; 3], accelerometer_codes: [i32; 3]) {
        let sample = Sample { pulse_counts, pickoff_codes, accelerometer_codes };
        prop_assert_eq!(Sample::from_bytes(&sample.to_bytes()), sample);
    }

    #[test]
    fn frames_round_trip_through_their_bytes(sequence: u32, dtheta_codes: [i32; 3], dvel_codes: [i32; 3], bits: u32) {
        let frame = OutputFrame { sequence, dtheta_codes, dvel_codes, status: Status::from_bits(bits) };
        prop_assert_eq!(OutputFrame::from_bytes(&frame.to_bytes()), Ok(frame));
    }

    #[test]
    fn a_changed_byte_is_always_found(at in 0..PARAMETER_BLOCK_BYTES, flip in 1..=255u8) {
        let mut block = as_built().to_block(0).to_vec();
        block[at] ^= flip;
        prop_assert!(Parameters::from_block(&block).is_err());
    }
}

#[test]
fn the_layouts_are_little_endian_in_the_order_of_the_fields() {
    let sample = Sample {
        pulse_counts: [1, -2, 3],
        pickoff_codes: [0x0403_0201, 5, 6],
        accelerometer_codes: [0x0403_0201, 8, -1],
    };
    let bytes = sample.to_bytes();
    assert_eq!(bytes[0..8], [1, 0, 0, 0, 0xFE, 0xFF, 0xFF, 0xFF]);
    assert_eq!(bytes[12..16], [1, 2, 3, 4]);
    assert_eq!(bytes[24..28], [1, 2, 3, 4]);
    assert_eq!(bytes[32..36], [0xFF; 4]);

    let frame = OutputFrame {
        sequence: 7,
        dtheta_codes: [1, -1, 2],
        dvel_codes: [3, 4, 0x0403_0201],
        status: Status::PRIMED,
    };
    let expected = [
        7, 0, 0, 0, 1, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 2, 0, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0, 1, 2,
        3, 4, 16, 0, 0, 0, 2, 0, 0, 0,
    ];
    assert_eq!(frame.to_bytes(), expected);
}

#[test]
fn a_frame_of_another_version_is_refused() {
    let mut bytes = OutputFrame::default().to_bytes();
    bytes[32] = 3;
    assert_eq!(OutputFrame::from_bytes(&bytes), Err(FrameError::Version(3)));
}

#[test]
fn parameters_round_trip_through_their_block() {
    let with_accelerometers = as_built().with(|p| {
        p.pickoff_delay_s = [1e-5, -2e-5, 3e-5];
        p.dither_frequency_hz = [371.0, 404.0, 439.0];
        p.dither_amplitude_rad = [7e-4, 7.1e-4, 7.2e-4];
        p.adaptation_time_s = 0.5;
        p.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [1e-6, 1.1e-6, 1.2e-6],
            bias_m_s2: [1e-3, -2e-3, 3e-3],
            scale_error: [1e-4, -2e-4, 3e-4],
            misalignment_rad: CrossAxis::from_array([1e-5, 2e-5, 3e-5, 4e-5, 5e-5, 6e-5]),
            lever_arm_m: [[0.01, 0.02, 0.03], [0.04, 0.05, 0.06], [0.07, 0.08, 0.09]],
        });
    });
    for (parameters, generation) in [(as_built(), 0), (with_accelerometers, u32::MAX)] {
        assert_eq!(
            Parameters::from_block(&parameters.to_block(generation)),
            Ok((parameters, generation))
        );
    }
}

#[test]
fn the_checksum_is_the_one_of_zip() {
    let block = as_built().to_block(0);
    let (body, stored) = block.split_at(PARAMETER_BLOCK_BYTES - 4);
    // Bit by bit, from its definition: reflected polynomial 0xEDB88320, ones before and after.
    let mut crc = u32::MAX;
    for byte in body {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xEDB8_8320 * (crc & 1));
        }
    }
    assert_eq!(stored, (!crc).to_le_bytes());
}

#[test]
fn a_bad_block_says_what_is_wrong() {
    let good = as_built().to_block(0);
    let changed = |at: usize, value: u8| {
        let mut block = good.to_vec();
        block[at] = value;
        Parameters::from_block(&block)
    };
    assert_eq!(
        Parameters::from_block(&good[..100]),
        Err(BlockError::Length(100))
    );
    assert_eq!(changed(0, b'X'), Err(BlockError::Magic));
    assert_eq!(changed(4, 9), Err(BlockError::Version(9)));
    assert_eq!(changed(7, 0), Err(BlockError::Length(252)));
    assert!(matches!(changed(40, 1), Err(BlockError::Checksum { .. })));

    let out_of_range = as_built().with(|p| p.bias_rad_s = [0.0, f64::NAN, 0.0]);
    let refused = Parameters::from_block(&out_of_range.to_block(0));
    assert_eq!(refused, Err(BlockError::Parameter(ParameterError::Bias)));
}
