//! A frame's time against the pulse per second, with a bank's clock that wanders and samples that are lost.

use firmware_tests::service::{self, SlowBank, latch_s};
use firmware_tests::unit::{SAMPLES_PER_OUTPUT, Unit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueaxis::counter_bank::{AccelerometerInput, BankDecoder, BankFrame, BusFault};
use trueaxis::{BootReport, F32, Processor, Timing};

/// Largest error of a frame's time \[s\].
const LARGEST_S: f64 = 1e-6;

#[test]
fn a_frames_time_is_right_to_a_microsecond() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut unit = Unit::new(5);
    let mut slow = SlowBank::new(5);
    let mut bank = BankFrame::default();
    let mut decoder = BankDecoder::new(AccelerometerInput::Counters);
    let mut processor =
        Processor::<F32>::new(&service::parameters(), BootReport::default()).expect("in range");
    let mut judged = 0;
    let mut largest_s = 0.0_f64;
    let mut without = 0;
    let mut silent = 0_u32;
    for _ in 0..480_000 {
        bank = bank.followed_by(&unit.step([1.0; 3]), AccelerometerInput::Counters);
        bank.service = slow.step(None);
        // One sample in a hundred is lost, and sometimes those of two seconds.
        if silent == 0 && random.random_range(0..100_000) == 0 {
            silent = 9_000;
        }
        silent = silent.saturating_sub(1);
        let lost = silent > 0 || random.random_range(0..100) == 0;
        let bytes = bank.to_bytes();
        let transfer = if lost { Err(BusFault) } else { Ok(&bytes) };
        let reading = decoder.reading(transfer, 1);
        let Some(frame) = processor.period(reading, Timing::default()) else {
            continue;
        };
        let first = frame.output.sequence * u32::from(SAMPLES_PER_OUTPUT);
        let Some(ns) = frame.time.nanoseconds() else {
            without += 1;
            continue;
        };
        let true_s = latch_s(first);
        // Two pulses make a second by the bank's clock.
        if true_s < 3.0 {
            continue;
        }
        let told_s = f64::from(frame.time.pulses) - 1.0 + f64::from(ns) * 1e-9;
        let error_s = (told_s - true_s).abs();
        assert!(
            error_s <= LARGEST_S,
            "{error_s} s at {true_s} s: {:?}",
            frame.time
        );
        largest_s = largest_s.max(error_s);
        judged += 1;
    }
    assert!(judged > 40_000, "{judged} frames");
    println!(
        "{judged} frames: largest error {:.3} µs; {without} without a time",
        1e6 * largest_s
    );
}

#[test]
fn without_pulses_a_frame_has_no_time() {
    let mut unit = Unit::new(6);
    let mut bank = BankFrame::default();
    let mut decoder = BankDecoder::new(AccelerometerInput::Counters);
    let parameters = firmware_tests::unit::parameters();
    let mut processor =
        Processor::<F32>::new(&parameters, BootReport::default()).expect("in range");
    let mut frames = 0;
    for _ in 0..4_000 {
        bank = bank.followed_by(&unit.step([1.0; 3]), AccelerometerInput::Counters);
        let reading = decoder.reading(Ok(&bank.to_bytes_v2()), 1);
        if let Some(frame) = processor.period(reading, Timing::default()) {
            assert_eq!(frame.time.nanoseconds(), None);
            frames += 1;
        }
    }
    assert_eq!(frames, 400);
}
