//! Records of terms in parameter blocks and slots.

use crc::{CRC_32_ISO_HDLC, Crc};
use trueaxis::terms::{AllTerms, RecordError, TermKinds};
use trueaxis::{
    BlockError, Chain, F32, Fixed, FlexureResponse, NumberSystem, ParameterError, Parameters, Term,
    TermKind, TermRecords,
};

use crate::errors::errors;
use crate::unit::parameters;

fn sealed(mut block: Vec<u8>) -> Vec<u8> {
    let length = block.len();
    block[6..8].copy_from_slice(&(length as u16).to_le_bytes());
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&block[..length - 4]);
    block[length - 4..].copy_from_slice(&crc.to_le_bytes());
    block
}

fn full() -> Parameters {
    let records: Vec<_> = errors()
        .into_iter()
        .flat_map(|error| error.records)
        .collect();
    parameters(&records)
}

#[test]
fn a_block_with_records_comes_back_the_same() {
    let known = full();
    let block = known.to_block(7);
    assert_eq!(Parameters::from_block(&block), Ok((known, 7)));
    // Bytes behind a block in flash are not part of it.
    let mut longer = block.to_vec();
    longer.extend([0xFF; 300]);
    assert_eq!(Parameters::from_block(&longer), Ok((known, 7)));
    for end in 0..block.len() {
        assert!(Parameters::from_block(&block[..end]).is_err(), "{end}");
    }
}

/// A block as an older version wrote it: an acceleration order, and no damping of the flexure.
fn of_version(version: u8, parameters: &Parameters) -> Vec<u8> {
    let mut block = parameters.to_block(3).to_vec();
    block[4] = version;
    block[10] = 4;
    block.drain(496..504);
    let length = (block.len() as u16).to_le_bytes();
    block[6..8].copy_from_slice(&length);
    sealed(block)
}

/// Their flexure was calibrated as a static one, and stays it.
#[test]
fn older_versions_still_read_with_a_static_flexure_and_version_2_has_no_records() {
    let as_read = |known: Parameters| known.with(|p| p.flexure_response = FlexureResponse::Static);
    let known = parameters(&[]);
    let block = known.to_block(3);
    assert_eq!(block.len(), trueaxis::PARAMETER_BLOCK_BYTES);
    for version in [2, 3] {
        let read = Parameters::from_block(&of_version(version, &known));
        assert_eq!(read, Ok((as_read(known), 3)));
    }
    let read = Parameters::from_block(&of_version(3, &full()));
    assert_eq!(read, Ok((as_read(full()), 3)));
    let with_records = of_version(2, &full());
    let length = with_records.len();
    assert_eq!(
        Parameters::from_block(&with_records),
        Err(BlockError::Length(length))
    );
}

#[test]
fn bytes_that_are_no_records_are_refused() {
    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut block = parameters(&[(TermKind::GyroDelay, vec![1e-6; 3])])
            .to_block(1)
            .to_vec();
        change(&mut block);
        match Parameters::from_block(&sealed(block)) {
            Err(BlockError::Parameter(ParameterError::Records(error))) => error,
            other => panic!("{other:?}"),
        }
    };
    let at = trueaxis::PARAMETER_BLOCK_BYTES - 4;
    assert_eq!(refused(&|block| block[at] = 99), RecordError::Unknown(99));
    assert_eq!(
        refused(&|block| block[at + 2] = 16),
        RecordError::Length(TermKind::GyroDelay, 16)
    );
    assert_eq!(
        refused(&|block| {
            let again = block[at..at + 28].to_vec();
            block.splice(at..at, again);
        }),
        RecordError::Repeated(TermKind::GyroDelay)
    );
    assert_eq!(
        refused(&|block| {
            block.splice(at..at, [5, 0, 24]);
        }),
        RecordError::Length(TermKind::GyroDelay, 24 + 256 * 5)
    );
    assert_eq!(
        refused(&|block| {
            block.splice(at + 20..at + 28, []);
        }),
        RecordError::Truncated
    );
}

/// A build refuses every kind that it lacks by its name.
#[test]
fn a_kind_that_the_build_lacks_is_refused_by_name() {
    for error in errors() {
        let known = parameters(&error.records);
        let kind = error.records[0].0;
        let refused = Chain::<F32>::new(&known).expect_err("no terms");
        assert_eq!(refused, ParameterError::TermAbsent(kind));
        assert!(refused.to_string().contains(kind.name()), "{refused}");
        assert!(Chain::<Fixed, AllTerms<Fixed>>::with_terms(&known).is_ok());
    }
}

#[test]
fn the_full_list_has_every_kind() {
    fn lacks<N: NumberSystem>() -> Option<TermKind> {
        TermKinds::of(TermKind::ALL).first_beyond(<AllTerms<N> as Term<N>>::KINDS)
    }
    assert_eq!((lacks::<F32>(), lacks::<Fixed>()), (None, None));
    for kind in TermKind::ALL {
        assert_eq!(TermKind::from_number(*kind as u16), Some(*kind));
    }
}

#[test]
fn every_value_that_is_not_finite_or_far_beyond_its_range_is_refused_by_its_kind() {
    for kind in TermKind::ALL {
        for at in 0..kind.values() {
            for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e9, -1e9] {
                let mut values = vec![0.0; kind.values()];
                values[at] = wrong;
                let known = parameters(&[(*kind, values)]);
                let refused = Chain::<F32, AllTerms<F32>>::with_terms(&known).err();
                let expected = match kind {
                    // A mode without a frequency is no mode, for any other numbers.
                    TermKind::AxisFlexureMode => ParameterError::ModeFrequency,
                    _ => ParameterError::Term(*kind),
                };
                assert_eq!(refused, Some(expected), "{at} {wrong}");
            }
        }
    }
}

#[test]
fn a_record_has_as_many_values_as_its_kind_and_comes_once() {
    let mut records = TermRecords::NONE;
    assert_eq!(
        records.push(TermKind::GyroDelay, &[0.0; 2]),
        Err(RecordError::Length(TermKind::GyroDelay, 16))
    );
    assert_eq!(records.push(TermKind::GyroDelay, &[1.0, 2.0, 3.0]), Ok(()));
    assert_eq!(
        records.push(TermKind::GyroDelay, &[0.0; 3]),
        Err(RecordError::Repeated(TermKind::GyroDelay))
    );
    assert_eq!(records.values(TermKind::GyroDelay), [1.0, 2.0, 3.0]);
    assert_eq!(TermRecords::from_bytes(records.bytes()), Ok(records));
}
