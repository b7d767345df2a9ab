//! Identity and limits in the parameter block: both ways, old blocks, and blocks of another unit.

use firmware_tests::nor::{Nor, SECTOR};
use firmware_tests::service as unit_in_service;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueaxis::parameter_slots::{ParameterSlots, SlotError};
use trueaxis::service::{self, DONE, FOREIGN, Service};
use trueaxis::service_frame::{DATA_BYTES, Request, RequestKind};
use trueaxis::terms::TermKinds;
use trueaxis::{
    BlockError, BootReport, F32, HealthLimits, Identity, OutputFormat, ParameterError, Parameters,
    Processor, Sample, Status, Timing, UnitNumber, sample_source::Reading,
};

fn number(text: &str) -> UnitNumber {
    UnitNumber::of_text(text).expect("a number")
}

fn identity(unit: &str) -> Identity {
    Identity::new(number(unit)).with(|known| {
        known.calibrated = 20_261_129;
        known.model = [1, 2, 3, 4, 5, 6, 7, 8];
    })
}

fn of(unit: &str) -> Parameters {
    unit_in_service::parameters().with(|known| known.identity = Some(identity(unit)))
}

/// Sets the check sum that belongs to a block's bytes.
fn sealed(mut block: Vec<u8>) -> Vec<u8> {
    let end = block.len() - 4;
    let length = (block.len() as u16).to_le_bytes();
    block[6..8].copy_from_slice(&length);
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&block[..end]);
    block[end..].copy_from_slice(&sum.to_le_bytes());
    block
}

#[test]
fn a_hundred_foreign_blocks_show_in_the_first_frame() {
    let mut random = ChaCha8Rng::seed_from_u64(41);
    for _ in 0..100 {
        let mut draw = || {
            let digits: String = (0..10).map(|_| random.random_range('0'..='9')).collect();
            format!("R-{digits}")
        };
        let (own, other) = (draw(), draw());
        let mut flash = Nor::<4>::erased();
        let slots = ParameterSlots::new(&mut flash, [0, SECTOR as u32]);
        slots
            .of_unit(number(&other))
            .store(&of(&other))
            .expect("flash takes it");
        let mut slots = ParameterSlots::new(&mut flash, [0, SECTOR as u32]).of_unit(number(&own));
        let loaded = slots.load();
        assert!(loaded.foreign.is_some() && loaded.parameters_default());
        let boot = BootReport::default().with(|report| report.parameters_foreign = true);
        let mut processor = Processor::<F32>::new(&loaded.parameters, boot).expect("in range");
        let periods = std::iter::from_fn(|| {
            let reading = Reading::new(Some(Sample::default()), 1, None);
            Some(processor.period(reading, Timing::default()))
        });
        let (at, frame) = (1..)
            .zip(periods)
            .find_map(|(at, frame)| Some((at, frame?)))
            .expect("one");
        assert!(frame.output.status.contains(Status::PARAMETERS_FOREIGN));
        // 5 ms by the nominal values.
        assert_eq!(at, 20);
    }
}

#[test]
fn the_form_of_the_output_is_an_item() {
    let frames = Parameters::default();
    assert_eq!(
        frames.to_block(1)[4..6],
        [4, 0],
        "a block of version 4 as before"
    );
    let inertial = of("RLG-0042").with(|p| p.output = OutputFormat::Inertial);
    let block = inertial.to_block(7);
    assert_eq!(Parameters::from_block(&block), Ok((inertial, 7)));
    // Behind limits and identity: kind, bytes behind it, version, form.
    assert_eq!(block[628..636], [0x03, 0x80, 4, 0, 1, 0, 1, 0]);
    // The default as an item, an unknown form, the item twice.
    for form in [[0, 0], [2, 0], [1, 1]] {
        let mut other = block.to_vec();
        other[634..636].copy_from_slice(&form);
        assert_eq!(
            Parameters::from_block(&sealed(other)),
            Err(BlockError::Item(0x8003))
        );
    }
    let one = frames
        .with(|p| p.output = OutputFormat::Inertial)
        .to_block(1);
    let mut twice = one[..512].to_vec();
    twice.extend_from_slice(&one[504..512]);
    twice.extend_from_slice(&[0; 4]);
    assert_eq!(
        Parameters::from_block(&sealed(twice)),
        Err(BlockError::Item(0x8003))
    );
    // A read replaces what was there.
    let mut kept = inertial;
    assert_eq!(kept.read_block(&frames.to_block(3)), Ok(3));
    assert_eq!(kept, frames);
}

#[test]
fn a_block_brings_limits_and_identity_back() {
    let all = of("RLG-0042");
    assert_eq!(Parameters::from_block(&all.to_block(7)), Ok((all, 7)));
    let only_limits = unit_in_service::parameters();
    assert_eq!(
        Parameters::from_block(&only_limits.to_block(1)),
        Ok((only_limits, 1))
    );
    // The documented bytes: kind, bytes behind it, version; then limits, then the identity.
    let block = all.to_block(7);
    assert_eq!(block[4..6], [5, 0]);
    assert_eq!(block[504..510], [0x01, 0x80, 90, 0, 1, 0]);
    assert_eq!(block[510..518], 233.0_f64.to_le_bytes());
    assert_eq!(block[598..604], [0x02, 0x80, 26, 0, 1, 0]);
    assert_eq!(block[604..616], *b"RLG-0042\0\0\0\0");
    assert_eq!(block[616..620], 20_261_129_u32.to_le_bytes());
    assert_eq!(block[620..628], [1, 2, 3, 4, 5, 6, 7, 8]);
    assert_eq!(block.len(), 628 + 4);
}

#[test]
fn a_block_without_items_is_one_of_version_4_and_of_any_unit() {
    let plain = Parameters::default();
    let block = plain.to_block(3);
    assert_eq!(block[4..6], [4, 0]);
    let mut flash = Nor::<4>::erased();
    let mut slots = ParameterSlots::new(&mut flash, [0, SECTOR as u32]).of_unit(number("A"));
    assert!(slots.store(&plain).is_ok());
    let loaded = slots.load();
    assert_eq!((loaded.parameters, loaded.foreign), (plain, None));
    assert!(loaded.slot.is_some());
}

#[test]
fn an_item_that_is_not_known_is_refused_by_its_kind() {
    let block = of("A").to_block(1).to_vec();
    let changed = |at: usize, byte: u8| {
        let mut block = block.clone();
        block[at] = byte;
        Parameters::from_block(&sealed(block)).map(|(_, generation)| generation)
    };
    assert_eq!(changed(504, 0x07), Err(BlockError::Item(0x8007)));
    assert_eq!(
        changed(508, 2),
        Err(BlockError::Item(0x8001)),
        "another version"
    );
    assert_eq!(
        changed(506, 89),
        Err(BlockError::Item(0x8001)),
        "another length"
    );
    assert_eq!(changed(598, 0x01), Err(BlockError::Item(0x8001)), "twice");
    let mut short = block.clone();
    short.truncate(600);
    assert!(Parameters::from_block(&sealed(short)).is_err());
}

#[test]
fn limits_and_dates_have_ranges() {
    let check = |change: fn(&mut HealthLimits)| {
        let limits = HealthLimits::default().with(change);
        Parameters::default()
            .with(|known| known.limits = Some(limits))
            .check()
    };
    use ParameterError as E;
    assert_eq!(check(|_| {}), Ok(()));
    assert_eq!(
        check(|l| l.temperature_k = Some([300.0, 300.0])),
        Err(E::TemperatureLimits)
    );
    assert_eq!(
        check(|l| l.temperature_k = Some([100.0, 300.0])),
        Err(E::TemperatureLimits)
    );
    assert_eq!(
        check(|l| l.intensity_least = Some([0.5, f64::NAN, 0.5])),
        Err(E::IntensityLimit)
    );
    assert_eq!(
        check(|l| l.path_length_step = Some(1.5)),
        Err(E::PathLengthStep)
    );
    assert_eq!(
        check(|l| l.dither_drive = Some([0.5, 2.5])),
        Err(E::DitherDriveLimits)
    );
    assert_eq!(
        check(|l| l.dither_amplitude = [1.1, 1.5]),
        Err(E::DitherAmplitudeLimits)
    );
    assert_eq!(
        check(|l| l.pulse_silence_s = Some(1.0)),
        Err(E::PulseSilence)
    );
    let dated = |date| {
        let identity = Identity::new(number("A")).with(|known| known.calibrated = date);
        Parameters::default()
            .with(|known| known.identity = Some(identity))
            .check()
    };
    assert_eq!(dated(0), Ok(()));
    assert_eq!(dated(20_260_228), Ok(()));
    assert_eq!(dated(20_261_301), Err(E::CalibrationDate));
    assert_eq!(dated(20_261_200), Err(E::CalibrationDate));
}

/// Each of a hundred foreign blocks: refused at boot with its number, in every frame, and by upload.
#[test]
fn the_block_of_another_unit_is_refused_with_its_number() {
    for serial in 0..100_u32 {
        let name = format!("RLG-{serial:04}");
        let foreign = of(&name);
        let mut flash = Nor::<4>::erased();
        let written = ParameterSlots::new(&mut flash, [0, SECTOR as u32]).store(&foreign);
        assert!(written.is_ok());
        let mut slots =
            ParameterSlots::new(&mut flash, [0, SECTOR as u32]).of_unit(number("RLG-1000"));
        assert!(
            matches!(slots.store(&foreign), Err(SlotError::Foreign(unit)) if unit == number(&name))
        );
        let loaded = slots.load();
        assert_eq!(loaded.foreign, Some(number(&name)));
        assert!(loaded.parameters_default());
        assert_eq!(loaded.parameters, Parameters::default());
        let boot = BootReport::default().with(|report| {
            report.parameters_default = loaded.parameters_default();
            report.parameters_foreign = loaded.foreign.is_some();
        });
        let mut processor = Processor::<F32>::new(&loaded.parameters, boot).expect("in range");
        let reading = Reading::new(Some(Sample::default()), 1, None);
        let frames = (0..400).filter_map(|_| processor.period(reading, Timing::default()));
        let due = Status::PARAMETERS_FOREIGN.union(Status::PARAMETERS_DEFAULT);
        assert!(
            frames
                .map(|frame| frame.output.status)
                .all(|status| status.contains(due))
        );
    }
}

#[test]
fn an_upload_for_another_unit_is_refused_and_changes_nothing() {
    let mut flash = Nor::<4>::erased();
    let mut slots = ParameterSlots::new(&mut flash, [0, SECTOR as u32]);
    let own = of("RLG-1000");
    assert_eq!(slots.store(&own).ok(), Some(1));
    let mut unit = Service::new(slots, TermKinds::NONE);
    let mut ask = |request: Request| unit.answer(&request, || true).answer;
    let mut upload = |parameters: &Parameters| {
        let block = parameters.to_block(0);
        let begin = Request::new(1, RequestKind::Begin, block.len() as u16);
        assert_eq!(ask(begin).outcome, DONE);
        for (piece, bytes) in block.chunks(DATA_BYTES).enumerate() {
            let data = Request::data(2, (DATA_BYTES * piece) as u16, bytes);
            assert_eq!(ask(data).outcome, DONE);
        }
        let answer = ask(Request::new(3, RequestKind::Store, 0));
        (answer.outcome, answer.detail)
    };
    assert_eq!(
        upload(&of("RLG-0007")),
        (FOREIGN, number("RLG-1000").short())
    );
    assert!(service::meaning(FOREIGN).contains("another unit"));
    // The unit's own, and one of any unit.
    assert_eq!(upload(&own), (DONE, 2));
    assert_eq!(upload(&Parameters::default()), (DONE, 3));
}

#[test]
fn numbers_are_shown_as_text_or_as_bytes() {
    assert_eq!(number("RLG-0042").to_string(), "RLG-0042");
    assert_eq!(UnitNumber::of_text(""), None);
    assert_eq!(UnitNumber::of_text("thirteen-long"), None);
    let bytes = UnitNumber([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 0xFF]);
    assert_eq!(bytes.to_string(), "000102030405060708090aff");
    assert_eq!(bytes.short(), 0x0809_0AFF);
    assert_eq!(number("RLG-0042").short(), u32::from_be_bytes(*b"0042"));
    assert_eq!(number("A").short(), u32::from(b'A'));
    assert_eq!(UnitNumber([0; 12]).short(), 0);
}
