//! Counters, words and tables of the unit around the chain: each number in the place that the documentation gives it.

use trueaxis::chain::terms::records::TermKinds;
use trueaxis::clock_start::{
    CRYSTAL_PAUSE_CYCLES, CRYSTAL_POLLS, ClockSource, INTERNAL_RANGE_PER_MILLE, MOST_POLLS,
    PLL_POLLS, REGISTER_POLLS, wait_states_for,
};
use trueaxis::health::{item, reset_cause};
use trueaxis::raw_period::RawSource;
use trueaxis::sample_source::{Reading, SourceFault};
use trueaxis::trace::{TraceEntry, TraceRing};
use trueaxis::{Faults, Health, Sample, Status, TermKind, Timing};

#[test]
fn each_counter_is_told_by_its_status_bit() {
    let mut chain = Faults::NONE;
    chain.counts = 1;
    chain.pickoff = 2;
    chain.acceleration = 3;
    chain.output = 4;
    chain.pickoff_failed = 6;
    chain.dither_stopped = 7;
    chain.dither_out_of_band = 8;
    chain.counter_stuck = 9;
    chain.velocity = 10;
    chain.gap = 13;
    let mut health = Health::NONE;
    health.interrupts_missed = 17;
    health.interrupts_late = 18;
    health.samples_repeated = 19;
    health.samples_starved = 20;
    health.frame_checksums = 21;
    health.bus_faults = 22;
    health.output_overruns = 23;
    health.bank_restarts = 27;
    health.stuck_lines = 99;
    health.dither_drive = 15;
    health.intensity_low = 28;
    health.mode_hops = 29;
    health.temperature_range = 30;
    health.temperature_absent = 31;
    health.pulse_lost = 32;
    // Every counter above is its bit's number and one.
    let with_counter = [
        0, 1, 2, 3, 5, 6, 7, 8, 9, 12, 14, 16, 17, 18, 19, 20, 21, 22, 26, 27, 28, 29, 30, 31,
    ];
    for bit in 0..=u8::MAX {
        let expected = if with_counter.contains(&bit) {
            u32::from(bit) + 1
        } else {
            0
        };
        assert_eq!(health.counter(&chain, bit), expected, "bit {bit}");
    }
}

#[test]
fn words_of_health_have_the_documented_bits() {
    assert_eq!(item::WITH_ACCELEROMETERS, 1);
    assert_eq!(item::ADAPTIVE, 2);
    for kind in TermKind::ALL {
        assert_eq!(
            item::terms(TermKinds::of(&[*kind])),
            2 << *kind as u16,
            "{kind}"
        );
    }
    // The order of RCC_CSR, RM0090 7.3.21: BORRSTF is its bit 25, LPWRRSTF its bit 31.
    let causes = [
        reset_cause::BROWN_OUT,
        reset_cause::PIN,
        reset_cause::POWER_ON,
        reset_cause::SOFTWARE,
        reset_cause::INDEPENDENT_WATCHDOG,
        reset_cause::WINDOW_WATCHDOG,
        reset_cause::LOW_POWER,
    ];
    for (place, cause) in causes.into_iter().enumerate() {
        assert_eq!(cause, 1 << place);
    }
}

/// The fault in the lowest four bits, then the presence of a sample, then the lateness of the interrupt.
#[test]
fn a_raw_periods_source_is_its_fault_its_sample_and_its_lateness() {
    use SourceFault as F;
    let faults = [
        None,
        Some(F::Bus),
        Some(F::StuckLine),
        Some(F::Checksum),
        Some(F::Repeated),
        Some(F::Restarted),
        Some(F::Starved),
    ];
    for (code, fault) in faults.into_iter().enumerate() {
        for (with_sample, late) in [(false, false), (true, false), (false, true), (true, true)] {
            let reading = Reading::new(with_sample.then(Sample::default), 1, fault);
            let source = RawSource::new(&reading, Timing { missed: 0, late });
            let expected =
                code as u8 + if with_sample { 16 } else { 0 } + if late { 32 } else { 0 };
            assert_eq!(source.bits(), expected, "{fault:?}");
            let read = RawSource::from_bits(expected);
            assert_eq!(read, source);
            assert_eq!(
                (read.fault(), read.has_sample(), read.is_late()),
                (fault, with_sample, late)
            );
        }
    }
    for unknown in 7..16 {
        assert_eq!(RawSource::from_bits(unknown).fault(), Some(F::Starved));
        assert!(
            !RawSource::from_bits(unknown).has_sample() && !RawSource::from_bits(unknown).is_late()
        );
    }
}

/// Entries oldest first, of a ring that is not full, just full, and overwritten; half of it after the first fault.
#[test]
fn a_trace_holds_what_came_last_and_stops_half_a_ring_after_the_fault() {
    let entry = |period: u32| TraceEntry::new(period, Status::GAP, 7, None);
    let periods =
        |ring: &TraceRing<8>| ring.entries().map(|entry| entry.period).collect::<Vec<_>>();
    for recorded in 0..30u32 {
        let mut ring = TraceRing::<8>::new();
        (0..recorded).for_each(|period| ring.record(entry(period), false));
        let expected: Vec<u32> = (recorded.saturating_sub(8)..recorded).collect();
        assert_eq!(periods(&ring), expected);
        assert!(!ring.is_frozen());
        // The entry with the fault is the last of the half before it.
        for after in 0..12 {
            ring.record(entry(recorded + after), true);
            assert_eq!(ring.is_frozen(), after >= 4, "{after} after the fault");
        }
        let last = recorded + 4;
        let expected: Vec<u32> = ((last + 1).saturating_sub(8)..=last).collect();
        assert_eq!(periods(&ring), expected);
    }
    let mut blank = TraceRing::<8>::blank();
    assert!(blank.is_frozen());
    blank.record(entry(1), false);
    blank.start();
    assert_eq!(
        format!("{blank:?}"),
        format!("{:?}", TraceRing::<8>::default())
    );

    let sample = Sample {
        pulse_counts: [1, 2, 3],
        pickoff_codes: [4, 5, 6],
        accelerometer_codes: [7, 8, 9],
    };
    let with = TraceEntry::new(11, Status::PRIMED, 12, Some(sample));
    let expected = TraceEntry {
        period: 11,
        status: 16,
        cost: 12,
        pulse_counts: [1, 2, 3],
        pickoff_codes: [4, 5, 6],
        accelerometer_codes: [7, 8, 9],
        with_sample: 1,
    };
    assert_eq!(with, expected);
    assert_eq!(
        entry(3),
        TraceEntry {
            period: 3,
            status: 1 << 12,
            cost: 7,
            ..TraceEntry::EMPTY
        }
    );
}

/// 1700 pauses of 1000 cycles, at least 100 ms of the fastest internal oscillator; 1 ms of four cycles of 16 MHz; and all
/// waits of a start together.
#[test]
fn waits_of_the_clocks_start_are_bounded_by_the_documented_polls() {
    assert_eq!(
        (CRYSTAL_POLLS, PLL_POLLS, REGISTER_POLLS),
        (1_700, 4_000, 1_000)
    );
    assert_eq!(CRYSTAL_PAUSE_CYCLES, 1_000);
    let least_cycles = CRYSTAL_POLLS * CRYSTAL_PAUSE_CYCLES;
    let fastest_khz = 16 * INTERNAL_RANGE_PER_MILLE[1];
    assert!(least_cycles / fastest_khz >= 100, "in milliseconds");
    assert_eq!(MOST_POLLS, 19_700);
    // RM0090 table 10 at 2.7 V to 3.6 V.
    for (core_mhz, states) in [
        (16, 0),
        (30, 0),
        (31, 1),
        (60, 1),
        (61, 2),
        (90, 2),
        (120, 3),
        (150, 4),
        (151, 5),
        (168, 5),
    ] {
        assert_eq!(
            wait_states_for(core_mhz * 1_000_000),
            states,
            "{core_mhz} MHz"
        );
    }
    let clocks = trueaxis::clock_start::Clocks {
        source: ClockSource::Crystal,
        core_hz: 1,
        apb2_hz: 1,
        timer_hz: 1,
        wait_states: 0,
    };
    for (source, is_fallback) in [
        (ClockSource::Crystal, false),
        (ClockSource::InternalPll, true),
        (ClockSource::Internal, true),
    ] {
        assert_eq!(
            trueaxis::clock_start::Clocks { source, ..clocks }.is_fallback(),
            is_fallback
        );
    }
}

/// Measured by a low-speed oscillator of 32 kHz that the crystal knows: a slow clock counts fewer ticks of its periods, and
/// takes it for a fast one.
#[test]
fn a_fallback_clock_is_corrected_by_the_oscillator_that_the_crystal_measured() {
    let nominal = trueaxis::clock_start::Clocks {
        source: ClockSource::InternalPll,
        core_hz: 144_000_000,
        apb2_hz: 72_000_000,
        timer_hz: 72_000_000,
        wait_states: 5,
    };
    let slow = nominal.corrected(32_000, 34_783);
    assert!(slow.core_hz.abs_diff(132_480_000) < 3_000, "{slow:?}");
    assert!(slow.timer_hz.abs_diff(66_240_000) < 1_500 && slow.apb2_hz == slow.timer_hz);
    let fast = nominal.corrected(32_000, 30_622);
    assert!(fast.core_hz.abs_diff(150_480_000) < 3_000, "{fast:?}");
    for (reference_hz, measured_hz) in
        [(0, 32_000), (32_000, 0), (32_000, 40_000), (40_000, 32_000)]
    {
        assert_eq!(nominal.corrected(reference_hz, measured_hz), nominal);
    }
    let source = ClockSource::Crystal;
    let crystal = trueaxis::clock_start::Clocks { source, ..nominal };
    assert_eq!(crystal.corrected(32_000, 34_783), crystal);
}

/// Bit 0 accelerometers, bit 1 a strip that adapts, bit n + 1 the build's term n.
#[test]
fn the_configuration_word_tells_what_the_unit_is_built_and_set_up_with() {
    use trueaxis::health::HEALTH_ITEMS;
    use trueaxis::terms::AllTerms;
    use trueaxis::{AccelerometerParameters, BootReport, F32, Parameters, Processor, Term};

    fn word<T: Term<F32>>(parameters: &Parameters) -> u32 {
        let boot = BootReport::default();
        let processor = Processor::<F32, T>::with_terms(parameters, boot).expect("in range");
        let place = HEALTH_ITEMS
            .iter()
            .position(|index| *index == item::CONFIGURATION);
        processor.health_items()[place.expect("an item")]
    }
    let adapting = Parameters::default().with(|p| p.adaptation_time_s = 20.0);
    let with_accelerometers = Parameters::default().with(|p| {
        p.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [1e-6; 3],
            bias_m_s2: [0.0; 3],
            scale_error: [0.0; 3],
            misalignment_rad: Default::default(),
            lever_arm_m: [[0.0; 3]; 3],
        });
    });
    assert_eq!(word::<()>(&Parameters::default()), 0);
    assert_eq!(word::<()>(&with_accelerometers), 1);
    assert_eq!(word::<()>(&adapting), 2);
    // Kinds 1 to 21, one place up.
    assert_eq!(word::<AllTerms<F32>>(&adapting), 2 | 0x003F_FFFE << 1);
}
