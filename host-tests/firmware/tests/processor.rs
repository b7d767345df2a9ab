//! The processor around the chain: cost, count and end of each fault.

use proptest::prelude::*;
use trueaxis::health::{HEALTH_ITEMS, item, reset_cause};
use trueaxis::sample_source::{Reading, SourceFault};
use trueaxis::trace::{TraceEntry, TraceRing};
use trueaxis::{
    BootReport, F32, Fixed, NumberSystem, Parameters, Processor, Sample, Status, TelemetryFrame,
    Timing,
};

const IN_TIME: Timing = Timing {
    missed: 0,
    late: false,
};

/// Pulses of a case that turns about z and a pickoff that follows a block: exact in pulses, so that the
/// whole angle is known.
fn sample(period: u32) -> Sample {
    let block = |period: u32| ((f64::from(period) * 0.6).sin() * 360.0).round() as i32;
    Sample {
        pulse_counts: [0, 0, 3],
        pickoff_codes: [0, 0, block(period)],
        ..Sample::default()
    }
}

fn good(period: u32) -> Reading {
    Reading::new(Some(sample(period)), 1, None)
}

/// Pulses of 2⁻¹⁹ rad (0.39″), so that three a period are a whole number of output codes; pickoffs are
/// watched and not stripped.
fn parameters(samples_per_output: u16) -> Parameters {
    Parameters::default().with(|p| {
        p.pulse_weight_rad = [1.0 / f64::from(1 << 19); 3];
        p.pickoff_gain = [0.0; 3];
        p.samples_per_output = samples_per_output;
    })
}

/// Output codes of one pulse.
const CODES_PER_PULSE: i64 = 1 << 16;

fn processor<N: NumberSystem>(samples_per_output: u16) -> Processor<N> {
    Processor::new(&parameters(samples_per_output), BootReport::default()).expect("in range")
}

/// Periods 0..`periods`, all good but for those that `fault` replaces.
fn run<N: NumberSystem>(
    processor: &mut Processor<N>,
    periods: std::ops::Range<u32>,
    mut fault: impl FnMut(u32) -> Option<(Reading, Timing)>,
) -> Vec<TelemetryFrame> {
    periods
        .filter_map(|period| {
            let (reading, timing) = fault(period).unwrap_or((good(period), IN_TIME));
            processor.period(reading, timing)
        })
        .collect()
}

/// A sample that covers `periods` periods.
fn whole(periods: u32, period: u32) -> Reading {
    let mut sample = sample(period);
    sample.pulse_counts[2] *= i32::try_from(periods).expect("few");
    Reading::new(Some(sample), periods, None)
}

fn angle_about_z(frames: &[TelemetryFrame]) -> i64 {
    frames
        .iter()
        .map(|frame| i64::from(frame.output.dtheta_codes[2]))
        .sum()
}

/// The item of `index` among all.
fn item_now<N: NumberSystem>(processor: &Processor<N>, index: u8) -> u32 {
    let place = HEALTH_ITEMS.iter().position(|known| *known == index);
    processor.health_items()[place.expect("an item")]
}

#[test]
fn a_clean_stream_raises_nothing_and_gives_a_frame_an_output_period() {
    let mut processor = processor::<F32>(10);
    let frames = run(&mut processor, 0..100, |_| None);
    assert_eq!(frames.len(), 10);
    for (number, frame) in frames.iter().enumerate() {
        assert_eq!(frame.output.sequence, number as u32);
        let primed = if number == 0 {
            Status::PRIMED
        } else {
            Status::default()
        };
        assert_eq!(frame.output.status, primed);
    }
    assert_eq!(*processor.health(), trueaxis::Health::NONE);
    assert_eq!(processor.periods(), 100);
}

#[test]
fn every_fault_of_the_source_raises_its_bit_and_counter_and_keeps_the_angle() {
    let cases = [
        (SourceFault::Bus, Status::BUS_FAULT, 21),
        (SourceFault::StuckLine, Status::BUS_FAULT, 21),
        (SourceFault::Checksum, Status::FRAME_CHECKSUM, 20),
        (SourceFault::Repeated, Status::SAMPLE_REPEATED, 18),
        (SourceFault::Starved, Status::SAMPLE_LOST, 19),
    ];
    for (fault, bit, counter) in cases {
        let mut processor = processor::<Fixed>(10);
        let frames = run(&mut processor, 0..100, |period| match period {
            34 => Some((Reading::without_sample(fault), IN_TIME)),
            35 => Some((whole(2, 35), IN_TIME)),
            _ => None,
        });
        assert_eq!(frames.len(), 10, "{fault:?}");
        for (number, frame) in frames.iter().enumerate() {
            let status = frame.output.status;
            assert_eq!(status.contains(bit), number == 3, "{fault:?} {number}");
            assert_eq!(status.contains(Status::GAP), number == 3, "{fault:?}");
        }
        // The first sample adds no rotation.
        assert_eq!(angle_about_z(&frames), 3 * 99 * CODES_PER_PULSE);
        for (index, value) in HEALTH_ITEMS.into_iter().zip(processor.health_items()) {
            let expected = u32::from(index == counter || index == 12);
            if index < 32 {
                assert_eq!(value, expected, "{fault:?}: counter {index}");
            }
        }
        assert_eq!(
            item_now(&processor, item::STUCK_LINES),
            u32::from(fault == SourceFault::StuckLine)
        );
        let first = processor.health().first;
        assert_eq!(first.sample, 34, "{fault:?}");
        assert_eq!(first.stages, bit.union(Status::GAP), "{fault:?}");
    }
}

#[test]
fn missed_interrupts_pass_their_periods_and_are_not_called_skipped() {
    let mut processor = processor::<F32>(10);
    let missed = Timing {
        missed: 3,
        late: true,
    };
    // Interrupts 0..49 come; three are missed; the next finds the bank's counts meanwhile.
    let mut frames = run(&mut processor, 0..49, |_| None);
    let after = whole(4, 52);
    frames.extend(processor.period(after, missed));
    frames.extend(run(&mut processor, 53..100, |_| None));
    assert_eq!(processor.periods(), 100);
    assert_eq!(frames.len(), 10);
    assert_eq!(angle_about_z(&frames), 3 * 99 * CODES_PER_PULSE);
    assert_eq!(processor.health().interrupts_missed, 3);
    assert_eq!(processor.health().interrupts_late, 1);
    assert_eq!(item_now(&processor, 19), 0);
    let first = processor.health().first;
    assert_eq!(first.sample, 49);
}

/// The reading of a bank that has started anew: the pickoffs' present codes, and meaningless counts.
fn restarted(period: u32) -> Reading {
    let mut sample = sample(period);
    sample.pulse_counts = [123_456, -7, 99];
    Reading::new(Some(sample), 0, Some(SourceFault::Restarted))
}

#[test]
fn a_restart_of_the_bank_costs_the_angle_that_it_did_not_count_and_no_time() {
    for outage in [0, 1, 25, 200] {
        let mut processor = processor::<Fixed>(10);
        let onset = 45;
        let back = onset + outage;
        let frames = run(&mut processor, 0..400, |period| match period {
            period if period == back => Some((restarted(period), IN_TIME)),
            period if (onset..back).contains(&period) => {
                Some((Reading::without_sample(SourceFault::Bus), IN_TIME))
            }
            _ => None,
        });
        assert_eq!(processor.periods(), 400);
        assert_eq!(frames.len(), 40);
        // The stream's first sample and those from the onset to the restart.
        let counted = i64::from(400 - 1 - (outage + 1));
        assert_eq!(angle_about_z(&frames), 3 * counted * CODES_PER_PULSE);
        let flagged = frames
            .iter()
            .filter(|frame| frame.output.status.contains(Status::BANK_RESTARTED))
            .map(|frame| frame.output.sequence)
            .collect::<Vec<_>>();
        assert_eq!(flagged, [back / 10], "{outage}");
        assert_eq!(item_now(&processor, 26), 1);
    }
}

#[test]
fn a_restart_gives_back_the_bias_of_periods_without_counts() {
    let parameters = parameters(10).with(|p| p.bias_rad_s = [0.01; 3]);
    let mut processor =
        Processor::<F32>::new(&parameters, BootReport::default()).expect("in range");
    let frames = run(&mut processor, 0..2000, |period| match period {
        1200 => Some((restarted(period), IN_TIME)),
        400..1200 => Some((Reading::without_sample(SourceFault::Bus), IN_TIME)),
        _ => None,
    });
    let shown_rad = angle_about_z(&frames) as f64 * trueaxis::OUTPUT_RAD_PER_CODE;
    let counted = f64::from(2000 - 1 - 801);
    let expected_rad = counted * (3.0 * parameters.pulse_weight_rad[2] - 0.01 / 4000.0);
    assert!((shown_rad - expected_rad).abs() < trueaxis::OUTPUT_RAD_PER_CODE);
}

#[test]
fn the_time_before_the_first_sample_has_no_bias() {
    let parameters = parameters(10).with(|p| p.bias_rad_s = [0.01; 3]);
    for waited in [3, 10, 47, 5000] {
        for at_once in [false, true] {
            let mut processor =
                Processor::<F32>::new(&parameters, BootReport::default()).expect("in range");
            let mut frames = Vec::new();
            if at_once {
                let missed = Timing {
                    missed: waited,
                    late: false,
                };
                frames.extend(processor.period(good(waited), missed));
            } else {
                frames.extend(run(&mut processor, 0..waited, |_| {
                    Some((Reading::without_sample(SourceFault::Bus), IN_TIME))
                }));
                frames.extend(processor.period(good(waited), IN_TIME));
            }
            let end = (waited + 401).next_multiple_of(10);
            frames.extend(run(&mut processor, waited + 1..end, |_| None));
            let shown_rad = angle_about_z(&frames) as f64 * trueaxis::OUTPUT_RAD_PER_CODE;
            let counted = f64::from(end - waited - 1);
            let expected_rad = counted * (3.0 * parameters.pulse_weight_rad[2] - 0.01 / 4000.0);
            let error = (shown_rad - expected_rad).abs();
            assert!(error < trueaxis::OUTPUT_RAD_PER_CODE, "{waited}: {error}");
        }
    }
}

#[test]
fn a_bank_that_is_late_to_start_leaves_the_latch_to_service() {
    let mut processor = processor::<F32>(10);
    let mut ring = TraceRing::<16>::new();
    let mut latched = None;
    for period in 0..2000 {
        let reading = match period {
            // The bank does not answer yet.
            0..1000 => Reading::without_sample(SourceFault::Bus),
            1700 => Reading::without_sample(SourceFault::Checksum),
            1701 => whole(2, period),
            _ => good(period),
        };
        processor.period(reading, IN_TIME);
        if processor.has_latched_fault() {
            latched.get_or_insert(period);
        }
        let entry = TraceEntry::new(period, processor.period_status(), 0, reading.sample);
        ring.record(entry, processor.has_latched_fault());
    }
    assert_eq!(item_now(&processor, 21), 1000, "it is counted");
    assert_eq!(latched, Some(1700));
    let first = processor.health().first;
    assert_eq!(first.sample, 1700);
    assert_eq!(first.stages, Status::FRAME_CHECKSUM.union(Status::GAP));
    assert!(ring.entries().any(|entry| entry.period == 1700));
}

#[test]
fn a_bank_that_never_starts_is_latched_when_the_start_up_is_over() {
    let mut processor = processor::<F32>(10);
    let frames = run(&mut processor, 0..8100, |_| {
        Some((Reading::without_sample(SourceFault::StuckLine), IN_TIME))
    });
    assert_eq!(frames.len(), 810);
    let first = processor.health().first;
    assert!(first.stages.contains(Status::BUS_FAULT), "{first:?}");
    // 2 s, and the rest of the output period in which they end.
    assert!((8000..8020).contains(&first.sample), "{first:?}");
}

#[test]
fn a_gap_that_ends_one_output_period_and_a_sample_that_ends_the_next_lose_no_frame() {
    let mut processor = processor::<F32>(10);
    let mut frames = run(&mut processor, 0..9, |_| None);
    let missed = Timing {
        missed: 10,
        late: false,
    };
    // Periods 9 to 18 are missed, 19 ends the second output period.
    let now = processor.period(whole(11, 19), missed);
    let later = processor.period(good(20), IN_TIME);
    assert_eq!(now.map(|frame| frame.output.sequence), Some(0));
    assert_eq!(later.map(|frame| frame.output.sequence), Some(1));
    frames.extend([now, later].into_iter().flatten());
    frames.extend(run(&mut processor, 21..30, |_| None));
    assert_eq!(angle_about_z(&frames), 3 * 29 * CODES_PER_PULSE);
    assert_eq!(processor.health().output_overruns, 0);
}

#[test]
fn an_overrun_is_counted_and_the_next_frame_says_so() {
    let mut processor = processor::<F32>(10);
    let frames = run(&mut processor, 0..10, |_| None);
    assert_eq!(frames.len(), 1);
    processor.output_overrun();
    let frames = run(&mut processor, 10..30, |_| None);
    assert!(frames[0].output.status.contains(Status::OUTPUT_OVERRUN));
    assert!(!frames[1].output.status.contains(Status::OUTPUT_OVERRUN));
    assert_eq!(item_now(&processor, 22), 1);
    assert_eq!(processor.health().first.stages, Status::OUTPUT_OVERRUN);
}

#[test]
fn the_boots_faults_stand_in_every_frame_and_leave_the_first_fault_to_service() {
    let boot = BootReport::default().with(|report| {
        report.clock_fallback = true;
        report.parameters_default = true;
        report.slot_bad = true;
        report.generation = 7;
    });
    let mut processor = Processor::<F32>::new(&parameters(10), boot).expect("in range");
    let frames = run(&mut processor, 0..100, |period| {
        (period == 50).then_some((Reading::without_sample(SourceFault::Bus), IN_TIME))
    });
    let bits = Status::CLOCK_FALLBACK
        .union(Status::PARAMETERS_DEFAULT)
        .union(Status::PARAMETER_SLOT_BAD);
    assert!(
        frames
            .iter()
            .all(|frame| frame.output.status.contains(bits))
    );
    assert_eq!(
        processor.health().first.stages,
        Status::BUS_FAULT.union(Status::GAP)
    );
    assert_eq!(item_now(&processor, item::GENERATION), 7);
}

#[test]
fn the_first_fault_is_the_earlier_one_even_where_the_chain_tells_it_later() {
    // The chain's fault is in period 32, the processor's in 35; the chain's shows in the frame, at 39.
    let mut processor = processor::<F32>(10);
    run(&mut processor, 0..40, |period| match period {
        32 => {
            let mut reading = good(32);
            reading.sample.as_mut().expect("a sample").pulse_counts[0] = 1_000_000;
            Some((reading, IN_TIME))
        }
        35 => Some((Reading::without_sample(SourceFault::Bus), IN_TIME)),
        _ => None,
    });
    let first = processor.health().first;
    assert_eq!(first.sample, 32);
    assert!(first.stages.contains(Status::COUNTS_SATURATED));
}

#[test]
fn every_health_item_takes_its_turn_and_tells_the_settings() {
    let mut processor = processor::<Fixed>(4);
    let turn = HEALTH_ITEMS.len() as u32;
    let frames = run(&mut processor, 0..8 * turn, |_| None);
    let told: Vec<_> = frames.iter().map(|frame| frame.health.index).collect();
    assert_eq!(told[..HEALTH_ITEMS.len()], HEALTH_ITEMS);
    assert_eq!(told[HEALTH_ITEMS.len()..], HEALTH_ITEMS);
    let value = |index| {
        let frame = frames.iter().find(|frame| frame.health.index == index);
        frame.expect("its turn").health.value
    };
    assert_eq!(f32::from_bits(value(item::SAMPLE_RATE)), 4000.0);
    assert_eq!(value(item::SAMPLES_PER_OUTPUT), 4);
    assert_eq!(value(item::CONFIGURATION), 0);
    let version = value(item::VERSION).to_be_bytes();
    let text = format!("{}.{}.{}", version[0], version[1], version[2]);
    assert_eq!(text, env!("CARGO_PKG_VERSION"));
    assert_eq!(version[3], 1, "fixed point");
}

#[test]
fn reset_cause_and_last_failure_are_told_in_their_turn() {
    let boot = BootReport::default().with(|report| {
        report.reset_cause = reset_cause::PIN | reset_cause::SOFTWARE;
        report.last_failure_kind = 2;
        report.last_failure_place = 0x0800_1234;
    });
    for (boot, told) in [
        (boot, [0b1010, 2, 0x0800_1234]),
        (BootReport::default(), [0; 3]),
    ] {
        let mut processor = Processor::<F32>::new(&parameters(4), boot).expect("in range");
        let turn = HEALTH_ITEMS.len() as u32;
        let frames = run(&mut processor, 0..8 * turn, |_| None);
        for (index, value) in (42..=44).zip(told) {
            let of_item = frames.iter().filter(|frame| frame.health.index == index);
            let values: Vec<_> = of_item.map(|frame| frame.health.value).collect();
            assert_eq!(values, [value; 2], "item {index} in two turns");
            assert_eq!(item_now(&processor, index), value);
        }
        // Neither is a fault of this run.
        assert_eq!(*processor.health(), trueaxis::Health::NONE);
        assert!(
            frames.iter().all(|frame| {
                frame.output.status.bits() & Status::IN_SERVICE_FAULTS.bits() == 0
            })
        );
    }
}

#[test]
fn counters_stop_at_their_end_instead_of_wrapping() {
    let mut processor = processor::<F32>(10);
    let missed = Timing {
        missed: u32::MAX - 1,
        late: false,
    };
    for _ in 0..3 {
        processor.period(good(0), missed);
    }
    assert_eq!(processor.health().interrupts_missed, u32::MAX);
}

#[test]
fn the_trace_keeps_half_a_ring_before_the_first_fault_and_half_after_it() {
    let mut ring = TraceRing::<16>::new();
    let mut processor = processor::<F32>(4);
    for period in 0..100 {
        let reading = match period {
            // Not the fault of the trace's middle: that is the first.
            50 | 52 => Reading::without_sample(SourceFault::Checksum),
            _ => good(period),
        };
        processor.period(reading, IN_TIME);
        let status = processor.period_status();
        let entry = TraceEntry::new(period, status, 7, reading.sample);
        ring.record(entry, processor.has_latched_fault());
        assert_eq!(ring.is_frozen(), period >= 58, "period {period}");
    }
    let kept: Vec<_> = ring.entries().collect();
    let periods: Vec<_> = kept.iter().map(|entry| entry.period).collect();
    assert_eq!(periods, (43..59).collect::<Vec<_>>());
    let fault = kept[7];
    assert_eq!(fault.with_sample, 0);
    assert_eq!(fault.status, Status::FRAME_CHECKSUM.bits());
    assert_eq!(kept[8].pickoff_codes, sample(51).pickoff_codes);
}

#[test]
fn the_traces_memory_is_laid_out_as_documented() {
    assert_eq!(size_of::<TraceEntry>(), 52);
    assert_eq!(size_of::<TraceRing<256>>(), 20 + 256 * 52);
    let mut ring = TraceRing::<2>::new();
    let entry = TraceEntry::new(
        5,
        Status::PRIMED,
        9,
        Some(Sample {
            pulse_counts: [1, 2, 3],
            pickoff_codes: [4, 5, 6],
            accelerometer_codes: [7, 8, 9],
        }),
    );
    ring.record(entry, false);
    // SAFETY: the ring is 31 words of 32 bits without padding, as the sizes above say; it is read, as a
    // probe reads it, and outlives the reference.
    let words = unsafe { &*(&raw const ring).cast::<[u32; 31]>() };
    let magic = u32::from_le_bytes(*b"RLGT");
    assert_eq!(words[..5], [magic, 52 << 16 | 1, 2, 1, u32::MAX]);
    assert_eq!(words[5..18], [5, 16, 9, 1, 2, 3, 4, 5, 6, 7, 8, 9, 1]);
}

/// Event that one interrupt meets.
#[derive(Debug, Clone, Copy)]
enum Meets {
    Good,
    Missed(u32),
    NoSample(SourceFault),
}

fn meets() -> impl Strategy<Value = Meets> {
    prop_oneof![
        6 => Just(Meets::Good),
        1 => (1..30_u32).prop_map(Meets::Missed),
        1 => Just(Meets::NoSample(SourceFault::Bus)),
        1 => Just(Meets::NoSample(SourceFault::Checksum)),
        1 => Just(Meets::NoSample(SourceFault::Repeated)),
    ]
}

fn any_reading() -> impl Strategy<Value = Reading> {
    let words = any::<Option<([i32; 3], [i32; 3], [i32; 3])>>();
    let sample = words.prop_map(|words| {
        words.map(
            |(pulse_counts, pickoff_codes, accelerometer_codes)| Sample {
                pulse_counts,
                pickoff_codes,
                accelerometer_codes,
            },
        )
    });
    let fault = prop_oneof![
        Just(None),
        Just(Some(SourceFault::Bus)),
        Just(Some(SourceFault::StuckLine)),
        Just(Some(SourceFault::Checksum)),
        Just(Some(SourceFault::Repeated)),
        Just(Some(SourceFault::Starved)),
        Just(Some(SourceFault::Restarted)),
    ];
    (sample, any::<u32>(), fault)
        .prop_map(|(sample, periods, fault)| Reading::new(sample, periods, fault))
}

fn any_timing() -> impl Strategy<Value = Timing> {
    (any::<u32>(), any::<bool>()).prop_map(|(missed, late)| Timing { missed, late })
}

proptest! {
    /// Tests that the angle arrives despite any loss and the output periods keep their number.
    #[test]
    fn no_angle_is_lost_with_the_samples(
        interrupts in prop::collection::vec(meets(), 1..80),
        samples_per_output in 2..20_u16,
    ) {
        let mut processor = processor::<Fixed>(samples_per_output);
        let mut frames: Vec<_> = processor.period(whole(0, 0), IN_TIME).into_iter().collect();
        // Periods that passed, and those since the last sample.
        let (mut passed, mut open, mut missed_in_all) = (1_u32, 0_u32, 0_u32);
        let tail = std::iter::repeat_n(&Meets::Good, 2 * usize::from(samples_per_output));
        for meets in interrupts.iter().chain(tail) {
            let missed = if let Meets::Missed(missed) = meets { *missed } else { 0 };
            let timing = Timing { missed, late: false };
            passed += missed + 1;
            open += missed + 1;
            missed_in_all += missed;
            let reading = if let Meets::NoSample(fault) = meets {
                Reading::without_sample(*fault)
            } else {
                whole(std::mem::take(&mut open), passed - 1)
            };
            frames.extend(processor.period(reading, timing));
        }
        prop_assert_eq!(processor.periods(), passed);
        prop_assert_eq!(processor.health().interrupts_missed, missed_in_all);
        prop_assert!(frames.is_sorted_by(|a, b| a.output.sequence < b.output.sequence));
        if processor.health().output_overruns == 0 {
            // Up to the last frame's end; the part in no frame yet is less than an output period.
            let ended = passed / u32::from(samples_per_output) * u32::from(samples_per_output);
            prop_assert_eq!(angle_about_z(&frames), i64::from(3 * (ended - 1)) * CODES_PER_PULSE);
        }
    }

    /// Tests that no reading or timing panics, in both number systems.
    #[test]
    fn any_reading_and_timing_do_not_panic(
        interrupts in prop::collection::vec((any_reading(), any_timing()), 1..60),
        samples_per_output in 1..=40_u16,
    ) {
        fn all<N: NumberSystem>(interrupts: &[(Reading, Timing)], samples_per_output: u16) {
            let mut processor = processor::<N>(samples_per_output);
            for (reading, timing) in interrupts {
                if processor.period(*reading, *timing).is_some() {
                    processor.output_overrun();
                }
            }
        }
        all::<F32>(&interrupts, samples_per_output);
        all::<Fixed>(&interrupts, samples_per_output);
    }
}
