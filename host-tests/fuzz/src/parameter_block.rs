//! Parses any bytes as a parameter block, with and without their valid check sum.
//!
//! Checks: no panic; an accepted block builds the chains of both number systems, processes a sample, and is unchanged by a
//! round trip through its own block.
#![no_main]

use libfuzzer_sys::fuzz_target;
use trueaxis::{
    Chain, ChainState, F32, Fixed, NumberSystem, PARAMETER_BLOCK_BYTES, Parameters, Sample,
};

const CRC_AT: usize = PARAMETER_BLOCK_BYTES - 4;

fuzz_target!(|data: &[u8]| {
    let Some((mode, data)) = data.split_first() else {
        return;
    };
    match mode % 3 {
        0 => read(data),
        // Over a valid block, the header kept: the fields are reached without knowledge of the header.
        1 => {
            let mut block = Parameters::default().to_block(1).to_vec();
            for (byte, given) in block[8..].iter_mut().zip(data) {
                *byte = *given;
            }
            read(&sealed(block));
        }
        // Numbers of a valid block replaced, each by its place and its bits.
        _ => {
            let mut block = Parameters::default().to_block(1).to_vec();
            for patch in data.chunks_exact(9) {
                let numbers = (CRC_AT - 16) / 8;
                let at = 16 + 8 * (usize::from(patch[0]) % numbers);
                block[at..at + 8].copy_from_slice(&patch[1..]);
                // Accelerometers are read if the header declares them.
                block[11] = patch[0] >> 7;
            }
            read(&sealed(block));
        }
    }
});

fn sealed(mut block: Vec<u8>) -> Vec<u8> {
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&block[..CRC_AT]);
    block[CRC_AT..].copy_from_slice(&crc.to_le_bytes());
    block
}

fn read(bytes: &[u8]) {
    let Ok((parameters, generation)) = Parameters::from_block(bytes) else {
        return;
    };
    assert_eq!(
        Parameters::from_block(&parameters.to_block(generation)),
        Ok((parameters, generation))
    );
    takes_a_sample::<F32>(&parameters);
    takes_a_sample::<Fixed>(&parameters);
}

fn takes_a_sample<N: NumberSystem>(parameters: &Parameters) {
    let chain = Chain::<N>::new(parameters).expect("what a block may hold");
    let mut state = ChainState::new();
    let sample = Sample {
        pulse_counts: [i32::MAX, -1, i32::MIN],
        pickoff_codes: [i32::MIN, 1, i32::MAX],
        accelerometer_codes: [i32::MAX, i32::MIN, 1],
    };
    // Twice, because the first one only primes the strip.
    for sample in [Sample::default(), sample] {
        chain.process(&mut state, &sample);
    }
}
