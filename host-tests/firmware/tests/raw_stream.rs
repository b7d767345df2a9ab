//! The raw stream: its frames, its running sums, and finding it among damaged bytes.

use proptest::prelude::*;
use trueaxis::frame_finder::{StreamStatistics, WireFrame};
use trueaxis::raw_frame::{RAW_BYTES, RawFinder, RawFrame, RawItem, RawItems, item};
use trueaxis::raw_period::{RawCounters, RawPeriod, RawSource};
use trueaxis::sample_source::{Reading, SourceFault};
use trueaxis::{AccelerometerParameters, CrossAxis, Parameters, Sample, SlowReadings, Timing};

fn reading(counts: [i32; 3], periods: u32) -> Reading {
    Reading::new(
        Some(Sample {
            pulse_counts: counts,
            pickoff_codes: [7, -8, 9],
            accelerometer_codes: [-1, 2, -3],
        }),
        periods,
        None,
    )
}

fn frame(number: u32) -> RawFrame {
    RawFrame {
        period: RawPeriod {
            number,
            pulse_counters: [1, -2, i32::MIN],
            pickoff_codes: [0x0102_0304, -5, i32::MAX],
            velocity_counters: [6, 7, 8],
            missed: 0,
            covered: 1,
            source: RawSource::new(&reading([0; 3], 1), Timing::default()),
        },
        item: RawItem {
            index: 17,
            value: 0xAABB_CCDD,
        },
    }
}

fn find(bytes: &[u8]) -> (Vec<RawFrame>, StreamStatistics) {
    let mut finder = RawFinder::new();
    let frames = bytes.iter().filter_map(|byte| finder.push(*byte)).collect();
    (frames, *finder.statistics())
}

#[test]
fn the_bytes_are_the_documented_ones() {
    let bytes = frame(0x1122_3344).to_bytes();
    #[rustfmt::skip]
    let documented = [
        0x1A, 0xCF, 1, 54,
        0x44, 0x33, 0x22, 0x11,
        1, 0, 0, 0, 0xFE, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0x80,
        4, 3, 2, 1, 0xFB, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F,
        6, 0, 0, 0, 7, 0, 0, 0, 8, 0, 0, 0,
        0, 1, 0b1_0000, 17,
        0xDD, 0xCC, 0xBB, 0xAA,
    ];
    assert_eq!(bytes[..52], documented);
    // CRC-16/IBM-3740 from its definition.
    let crc = documented.iter().fold(0xFFFF_u16, |crc, byte| {
        (0..8).fold(crc ^ (u16::from(*byte) << 8), |crc, _| {
            (crc << 1) ^ if crc & 0x8000 == 0 { 0 } else { 0x1021 }
        })
    });
    assert_eq!(bytes[52..], crc.to_le_bytes());
}

#[test]
fn every_single_flipped_bit_is_refused() {
    let bytes = frame(7).to_bytes();
    assert_eq!(RawFrame::decode(&bytes), Some(frame(7)));
    for bit in 0..8 * RAW_BYTES {
        let mut damaged = bytes;
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(RawFrame::decode(&damaged), None, "bit {bit}");
    }
}

#[test]
fn a_missed_interrupt_is_no_lost_frame_and_a_lost_frame_is_counted() {
    let mut after_missed = frame(13);
    after_missed.period.missed = 2;
    let frames = [frame(9), frame(10), after_missed, frame(17)];
    let bytes: Vec<u8> = frames.iter().flat_map(RawFrame::to_bytes).collect();
    let (found, statistics) = find(&bytes);
    assert_eq!(found, frames);
    assert_eq!(statistics.frames_lost, 3);
}

#[test]
fn sums_tell_what_periods_without_a_frame_counted() {
    let mut counters = RawCounters::NONE;
    let timing = Timing::default();
    let first = counters.period(1, &reading([0; 3], 0), timing);
    assert_eq!((first.covered, first.source.has_sample()), (0, true));
    let told: Vec<RawPeriod> = (2..=6)
        .map(|number| counters.period(number, &reading([10, -20, i32::MAX], 1), timing))
        .collect();
    let step =
        |axis: usize| told[4].pulse_counters[axis].wrapping_sub(told[0].pulse_counters[axis]);
    assert_eq!(
        [step(0), step(1), step(2)],
        [40, -80, i32::MAX.wrapping_mul(4)]
    );
    assert_eq!(told[4].velocity_counters, [-6, 12, -18]);
}

#[test]
fn a_period_without_a_sample_says_why_and_changes_no_sum() {
    let mut counters = RawCounters::NONE;
    counters.period(1, &reading([5; 3], 1), Timing::default());
    for fault in [
        SourceFault::Bus,
        SourceFault::StuckLine,
        SourceFault::Checksum,
        SourceFault::Repeated,
        SourceFault::Restarted,
        SourceFault::Starved,
    ] {
        let timing = Timing {
            missed: 1000,
            late: true,
        };
        let period = counters.period(2, &Reading::without_sample(fault), timing);
        assert_eq!(period.source.fault(), Some(fault));
        assert!(!period.source.has_sample() && period.source.is_late());
        assert_eq!((period.missed, period.covered), (255, 0));
        assert_eq!(period.pulse_counters, [5; 3]);
        assert_eq!(period.pickoff_codes, [7, -8, 9]);
    }
}

#[test]
fn items_come_round_and_tell_weights_to_the_last_bit() {
    let parameters = Parameters::default().with(|p| {
        p.pulse_weight_rad = [2.1e-6, 1.9e-6, 2.05e-6];
        p.pickoff_weight_rad = 9.7e-9;
        p.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [6.1e-6, 5.9e-6, 6.3e-6],
            bias_m_s2: [0.0; 3],
            scale_error: [0.0; 3],
            misalignment_rad: CrossAxis::default(),
            lever_arm_m: [[0.0; 3]; 3],
        });
    });
    let mut items = RawItems::new(&parameters, 42);
    items.dropped = 3;
    items.slow = SlowReadings {
        temperature_k: [293.5, 294.5, 295.5],
        temperature_rate_k_s: [1e-3, 2e-3, 3e-3],
        magnetic_field_t: [1e-5, 2e-5, 3e-5],
    };
    let told: Vec<RawItem> = (0..item::COUNT).map(|_| items.turn()).collect();
    let again: Vec<RawItem> = (0..item::COUNT).map(|_| items.turn()).collect();
    assert_eq!(told, again);
    let word = |index: u8| {
        let found = told.iter().find(|item| item.index == index);
        found.expect("told").value
    };
    let double =
        |first: u8| f64::from_bits(u64::from(word(first + 1)) << 32 | u64::from(word(first)));
    let single = |index: u8| f32::from_bits(word(index));
    assert_eq!(single(item::SAMPLE_RATE), 4000.0);
    assert_eq!((word(item::GENERATION), word(item::DROPPED)), (42, 3));
    assert_eq!(double(item::PICKOFF_WEIGHT), 9.7e-9);
    assert_eq!(double(item::VELOCITY_WEIGHT + 4), 6.3e-6);
    assert_eq!(double(item::PULSE_WEIGHT), 2.1e-6);
    assert_eq!(single(item::TEMPERATURE + 2), 295.5);
    assert_eq!(single(item::TEMPERATURE_RATE), 1e-3);
    assert_eq!(single(item::MAGNETIC_FIELD + 2), 3e-5);
}

proptest! {
    /// Tests that whole frames are found among any bytes before, between and after them, and nothing else.
    #[test]
    fn whole_frames_are_found_among_any_bytes(
        numbers in prop::collection::vec(0_u32..1000, 1..6),
        noise in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let mut bytes = noise.clone();
        for number in &numbers {
            bytes.extend(frame(*number).to_bytes());
        }
        let (found, statistics) = find(&bytes);
        // A false header in the noise may take the first frame's bytes, but they are searched again.
        let found: Vec<u32> = found.iter().map(|frame| frame.period.number).collect();
        prop_assert_eq!(found, numbers);
        prop_assert_eq!(statistics.bytes_skipped as usize, noise.len());
    }

    /// A cut anywhere costs no frame that it does not touch, and nothing is found that was not sent. (One that it
    /// touches may come through, if the bytes before the cut happen to equal the removed ones.)
    #[test]
    fn a_cut_costs_only_what_it_touches(from in 0_usize..540, length in 1_usize..120) {
        let sent: Vec<RawFrame> = (1..=10).map(frame).collect();
        let mut bytes: Vec<u8> = sent.iter().flat_map(RawFrame::to_bytes).collect();
        let end = (from + length).min(bytes.len());
        bytes.drain(from..end);
        let (found, _) = find(&bytes);
        let touched = from / RAW_BYTES..=(end - 1) / RAW_BYTES;
        for (at, frame) in sent.iter().enumerate() {
            prop_assert!(touched.contains(&at) || found.contains(frame), "{}", at);
        }
        prop_assert!(found.iter().all(|frame| sent.contains(frame)));
        prop_assert!(found.is_sorted_by_key(|frame| frame.period.number));
    }
}
