//! Outages of the stream of samples, from a millisecond to seconds: no angle and no velocity is lost that the counters
//! kept, and frames flag late parts.

use trueaxis::bank_bus::CounterBank;
use trueaxis::counter_bank::{AccelerometerInput, BankFrame};
use trueaxis::parameters::AccelerometerParameters;
use trueaxis::sample_source::{Reading, SampleSource, SourceFault};
use trueaxis::{
    BootReport, F32, Fixed, NumberSystem, OUTPUT_M_S_PER_CODE, OUTPUT_RAD_PER_CODE, OutputFrame,
    Parameters, Processor, Sample, Status, Timing,
};

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cell::Cell;

const RATE_HZ: f64 = 4000.0;

/// Pulses of 0.79″.
const PULSE_RAD: f64 = 1.0 / (1u64 << 18) as f64;

/// Kinds of outage of the samples.
#[derive(Debug, Clone, Copy)]
enum Outage {
    /// Each period's frame is damaged.
    BadFrames,
    /// The interrupt does not come.
    Missed,
}

/// A case that turns about z at a rate, from `begin` on for so many periods.
struct Turn {
    rate_rad_s: f64,
    periods: u32,
}

impl Turn {
    /// Pulses counted since the stream's start at the end of a period, the first one's included.
    fn pulses(&self, period: u32) -> i64 {
        let turned = f64::from((period + 1).min(self.periods));
        (self.rate_rad_s * turned / RATE_HZ / PULSE_RAD).round() as i64
    }
}

/// Every frame of a stream of `periods` periods with an outage in it.
fn frames<N: NumberSystem>(
    parameters: &Parameters,
    turn: &Turn,
    outage: (Outage, std::ops::Range<u32>),
    periods: u32,
) -> Vec<OutputFrame> {
    let mut processor = Processor::<N>::new(parameters, BootReport::default()).expect("in range");
    let mut frames = Vec::new();
    let (kind, lost) = outage;
    let mut open = 0;
    let mut seen = 0;
    let mut missed = 0;
    for period in 0..periods {
        open += 1;
        let reading = match kind {
            Outage::Missed if lost.contains(&period) => {
                missed += 1;
                continue;
            }
            Outage::BadFrames if lost.contains(&period) => {
                Reading::without_sample(SourceFault::Checksum)
            }
            _ => {
                let pulses = turn.pulses(period);
                let counted = i32::try_from(pulses - seen).expect("counters span it");
                seen = pulses;
                Reading::new(
                    Some(Sample {
                        // The first sample of a bank has no counts.
                        pulse_counts: [0, 0, if period == 0 { 0 } else { counted }],
                        ..Sample::default()
                    }),
                    std::mem::take(&mut open),
                    None,
                )
            }
        };
        let timing = Timing {
            missed: std::mem::take(&mut missed),
            late: false,
        };
        let frame = processor.period(reading, timing);
        frames.extend(frame.map(|frame| frame.output));
    }
    assert_eq!(processor.health().output_overruns, 0);
    frames
}

fn turned_codes(frames: &[OutputFrame]) -> i64 {
    frames
        .iter()
        .map(|frame| i64::from(frame.dtheta_codes[2]))
        .sum()
}

/// The sum of all frames is the sum of all counts to half a code, once all is shown; until then every frame flags a
/// remainder, and those that show part of it are flagged too. Returns the difference of the sums \[codes\].
fn no_angle_is_lost<N: NumberSystem>(
    rate_deg_s: f64,
    outage_s: f64,
    samples_per_output: u16,
    kind: Outage,
) -> f64 {
    let parameters = Parameters::default().with(|p| {
        p.pulse_weight_rad = [PULSE_RAD; 3];
        p.samples_per_output = samples_per_output;
    });
    let outage_periods = (outage_s * RATE_HZ) as u32;
    let onset = 401;
    let turn = Turn {
        rate_rad_s: rate_deg_s.to_radians(),
        periods: onset + outage_periods + 400,
    };
    // Then the case stands still until everything must have been shown: a frame holds 0.0625 rad.
    let total_rad = turn.rate_rad_s * f64::from(turn.periods) / RATE_HZ;
    let every = u32::from(samples_per_output);
    let periods =
        (turn.periods + ((total_rad.abs() / 0.0625) as u32 + 4) * every).next_multiple_of(every);
    let all = frames::<N>(
        &parameters,
        &turn,
        (kind, onset..onset + outage_periods),
        periods,
    );
    let what = format!(
        "{} {rate_deg_s} °/s, {outage_s} s of {kind:?}, {samples_per_output} samples",
        N::NAME
    );
    let counted = turn.pulses(periods) - turn.pulses(0);
    let expected = counted as f64 * PULSE_RAD / OUTPUT_RAD_PER_CODE;
    let error = turned_codes(&all) as f64 - expected;
    assert!(error.abs() <= 0.5, "{what}: {error} codes");

    let mut shown = 0;
    let mut owing = false;
    for frame in &all {
        // Up to the frame's end all counts, but for an outage that has not ended.
        shown += i64::from(frame.dtheta_codes[2]);
        let end = (frame.sequence + 1) * every - 1;
        let read = match end {
            end if (onset..onset + outage_periods).contains(&end) => turn.pulses(onset - 1),
            end => turn.pulses(end),
        };
        let due = (read - turn.pulses(0)) as f64 * PULSE_RAD / OUTPUT_RAD_PER_CODE;
        let behind = (due - shown as f64).abs() > 0.51;
        let status = frame.status;
        assert_eq!(
            status.contains(Status::OUTPUT_SATURATED),
            behind,
            "{what}: {frame:?}"
        );
        if owing {
            assert!(status.contains(Status::CARRIED_OVER), "{what}: {frame:?}");
        }
        owing = behind;
    }
    assert!(!owing, "{what}: not all is shown");
    error.abs()
}

fn over_all_outages<N: NumberSystem>() {
    let (mut cases, mut largest) = (0, 0.0f64);
    for kind in [Outage::BadFrames, Outage::Missed] {
        for rate_deg_s in [10.0, 100.0, -400.0] {
            for outage_s in [0.001, 0.002, 0.005, 0.02, 0.1, 0.5, 1.0] {
                for samples_per_output in [1, 2, 7, 10, 20, 40] {
                    // A frame dropped at one sample an output is an overrun, which is counted (`Processor::period`).
                    let dropped = matches!(kind, Outage::Missed) && samples_per_output == 1;
                    if !dropped {
                        let error =
                            no_angle_is_lost::<N>(rate_deg_s, outage_s, samples_per_output, kind);
                        largest = largest.max(error);
                        cases += 1;
                    }
                }
            }
        }
    }
    println!(
        "{}: {cases} outages of 1 ms to 1 s, frames and counts differ by {largest:.2} codes at most",
        N::NAME
    );
}

#[test]
fn no_angle_is_lost_in_any_outage_f32() {
    over_all_outages::<F32>();
}

#[test]
fn no_angle_is_lost_in_any_outage_fixed() {
    over_all_outages::<Fixed>();
}

#[test]
fn ten_seconds_at_400_deg_s_come_back_too() {
    no_angle_is_lost::<Fixed>(400.0, 10.0, 10, Outage::BadFrames);
    no_angle_is_lost::<F32>(400.0, 10.0, 20, Outage::Missed);
}

fn no_velocity_is_lost<N: NumberSystem>(outage_periods: u32) {
    const WEIGHT_M_S: f64 = 1e-6;
    let parameters = Parameters::default().with(|p| {
        p.samples_per_output = 10;
        p.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [WEIGHT_M_S; 3],
            bias_m_s2: [0.0; 3],
            scale_error: [0.0; 3],
            misalignment_rad: Default::default(),
            lever_arm_m: [[0.0; 3]; 3],
        });
    });
    let mut processor = Processor::<N>::new(&parameters, BootReport::default()).expect("in range");
    // 20 g.
    let per_period = 49_050;
    let mut shown = 0;
    let mut counted = 0;
    let mut open = 0;
    let periods = 4000 + outage_periods;
    for period in 0..periods.next_multiple_of(10) + 400 {
        let lost = (1000..1000 + outage_periods).contains(&period);
        let pushed = if (1..periods).contains(&period) {
            per_period
        } else {
            0
        };
        open += pushed;
        let reading = if lost {
            Reading::without_sample(SourceFault::Bus)
        } else {
            let codes = std::mem::take(&mut open);
            counted += i64::from(codes);
            Reading::new(
                Some(Sample {
                    accelerometer_codes: [codes, 0, 0],
                    ..Sample::default()
                }),
                1,
                None,
            )
        };
        if let Some(frame) = processor.period(reading, Timing::default()) {
            shown += i64::from(frame.output.dvel_codes[0]);
        }
    }
    let error = shown as f64 - counted as f64 * WEIGHT_M_S / OUTPUT_M_S_PER_CODE;
    // Codes are weighed to 2⁻³² of a fine unit.
    assert!(error.abs() < 0.51, "{}: {error} codes", N::NAME);
}

#[test]
fn no_velocity_is_lost_in_any_outage() {
    for outage_periods in [4, 40, 400, 4000, 20_000] {
        no_velocity_is_lost::<F32>(outage_periods);
        no_velocity_is_lost::<Fixed>(outage_periods);
    }
}

/// A gap about one axis and then the fastest turn across it, the most samples an output: its coning once went beyond
/// the fixed-point sum and came back with the other sign.
#[test]
fn a_gap_and_the_fastest_turn_across_it_keep_their_coning() {
    let parameters = Parameters::default().with(|p| p.samples_per_output = 40);
    let gap_rad = 0.219;
    let rate = 400f64.to_radians() / RATE_HZ / PULSE_RAD;
    let coning = |frames: Vec<OutputFrame>| {
        let sum = |axis: usize| -> f64 {
            let codes = frames
                .iter()
                .map(|frame| i64::from(frame.dtheta_codes[axis]));
            codes.sum::<i64>() as f64 * OUTPUT_RAD_PER_CODE
        };
        [sum(0), sum(1), sum(2)]
    };
    let stream = |lost: u32| {
        let mut samples = vec![(0, Sample::default()); 40];
        samples.push((
            lost,
            Sample {
                pulse_counts: [(gap_rad / PULSE_RAD) as i32, 0, 0],
                ..Sample::default()
            },
        ));
        samples.extend((0..79).map(|_| {
            let sample = Sample {
                pulse_counts: [0, rate as i32, 0],
                ..Sample::default()
            };
            (0, sample)
        }));
        samples.extend(vec![(0, Sample::default()); 240]);
        samples
    };
    fn run<N: NumberSystem>(parameters: &Parameters, stream: &[(u32, Sample)]) -> Vec<OutputFrame> {
        let mut processor =
            Processor::<N>::new(parameters, BootReport::default()).expect("in range");
        let mut frames = Vec::new();
        for (missed, sample) in stream {
            let reading = Reading::new(Some(*sample), 1 + missed, None);
            let timing = Timing {
                missed: *missed,
                late: false,
            };
            frames.extend(processor.period(reading, timing).map(|frame| frame.output));
        }
        frames
    }
    // 127 periods of the largest rate make up the gap's angle, so it is within its limit.
    let samples = stream(160);
    let [single, fixed] = [
        coning(run::<F32>(&parameters, &samples)),
        coning(run::<Fixed>(&parameters, &samples)),
    ];
    let turned_y = 79.0 * f64::from(rate as i32) * PULSE_RAD;
    for (name, [x, y, z]) in [("f32", single), ("fixed", fixed)] {
        assert!((x - gap_rad).abs() < PULSE_RAD, "{name}: {x}");
        assert!((y - turned_y).abs() < 1e-9, "{name}: {y} {turned_y}");
        // ½ g × θ of one output period at most.
        assert!(z.abs() <= 0.5 * gap_rad * turned_y, "{name}: {z}");
    }
    for (single, fixed) in single.iter().zip(fixed) {
        assert!((single - fixed).abs() < 1e-7, "{single} {fixed}");
    }
}

/// A small gap is composed with the motion before and after it, as if it had come in one sample.
#[test]
fn a_gap_that_a_frame_can_show_has_its_coning_with_both_sides() {
    fn z_of<N: NumberSystem>(order: [[i32; 3]; 3]) -> f64 {
        let parameters = Parameters::default().with(|p| p.samples_per_output = 30);
        let chain = trueaxis::Chain::<N>::new(&parameters).expect("in range");
        let mut state = trueaxis::ChainState::new();
        let mut frame = None;
        let turn = |counts| Sample {
            pulse_counts: counts,
            ..Sample::default()
        };
        let [before, gap, after] = order;
        for _ in 0..40 {
            frame = frame.or(chain.process(&mut state, &Sample::default()));
        }
        // Ten periods before, eleven in the gap, the rest after it.
        for _ in 0..4 {
            chain.process(&mut state, &turn(before));
        }
        chain.process_lost(&mut state, 10);
        chain.process(&mut state, &turn(gap));
        for _ in 0..5 {
            frame = chain.process(&mut state, &turn(after));
        }
        let codes = frame
            .expect("the thirtieth period ends the frame")
            .dtheta_codes;
        f64::from(codes[2]) * OUTPUT_RAD_PER_CODE
    }
    for z in [z_of::<F32>, z_of::<Fixed>] {
        let one = 1000.0 * PULSE_RAD;
        // x before, y in the gap: ½ (4·100) × 1000; y in the gap, x after: the same with 5, the other way.
        let expected = 0.5 * 0.4 * one * one;
        let got = z([[100, 0, 0], [0, 1000, 0], [0; 3]]);
        assert!((got - expected).abs() < 1e-9, "{got} {expected}");
        let expected = -0.5 * 0.5 * one * one;
        let got = z([[0; 3], [0, 1000, 0], [100, 0, 0]]);
        assert!((got - expected).abs() < 1e-9, "{got} {expected}");
        // x before and after, the gap's angle has no part across them: parallel.
        let got = z([[100, 0, 0], [1000, 0, 0], [100, 0, 0]]);
        assert!(got.abs() < 1e-9, "{got}");
    }
}

// ---- Restarts of the bank

/// A bus on which one frame stands.
struct Line<'a>(&'a Cell<[u8; trueaxis::counter_bank::FRAME_BYTES]>);

impl ErrorType for Line<'_> {
    type Error = ErrorKind;
}

impl SpiDevice for Line<'_> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        for operation in operations {
            if let Operation::Read(bytes) = operation {
                bytes.copy_from_slice(&self.0.get());
            }
        }
        Ok(())
    }
}

fn restarts_at_random_moments<N: NumberSystem>(seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let parameters = Parameters::default().with(|p| {
        p.pulse_weight_rad = [PULSE_RAD; 3];
        p.samples_per_output = 10;
    });
    let mut processor = Processor::<N>::new(&parameters, BootReport::default()).expect("in range");
    let line = Cell::new([0; trueaxis::counter_bank::FRAME_BYTES]);
    let mut bank = CounterBank::new(Line(&line), AccelerometerInput::Counters);
    let mut device = BankFrame::default();
    let per_period = 400;
    let mut restarts = 0;
    let mut next = 500;
    let mut outage = 0;
    let mut uncounted = 0;
    let mut shown = 0;
    let mut flagged = 0;
    let periods = 400_000;
    for period in 0..periods {
        let sample = Sample {
            pulse_counts: [0, 0, per_period],
            ..Sample::default()
        };
        if period == next {
            // From anywhere, or from 0 as after a reset.
            device = if random.random() {
                BankFrame::default()
            } else {
                BankFrame::default().with(|frame| {
                    frame.sequence = random.random();
                    frame.counters = [random.random(), random.random(), random.random()];
                })
            };
            outage = if random.random() {
                random.random_range(1..=400)
            } else {
                0
            };
            restarts += 1;
            uncounted += 1 + outage;
            next += random.random_range(800..2000);
        }
        // A bank that is off counts nothing and answers nothing.
        let reading = if outage > 0 {
            outage -= 1;
            line.set([0xFF; trueaxis::counter_bank::FRAME_BYTES]);
            bank.take(1)
        } else {
            device = device.followed_by(&sample, AccelerometerInput::Counters);
            line.set(device.to_bytes());
            bank.take(1)
        };
        if let Some(frame) = processor.period(reading, Timing::default()) {
            shown += i64::from(frame.output.dtheta_codes[2]);
            flagged += u32::from(frame.output.status.contains(Status::BANK_RESTARTED));
        }
    }
    assert_eq!(processor.periods(), periods);
    assert_eq!(processor.health().bank_restarts, restarts);
    assert_eq!(flagged, restarts);
    // The stream's first sample, the bank's outages and the first sample after each are not counted.
    let counted = i64::from(periods - 1 - uncounted) * i64::from(per_period);
    let expected = counted as f64 * PULSE_RAD / OUTPUT_RAD_PER_CODE;
    let error = shown as f64 - expected;
    println!(
        "{}: {restarts} restarts, {uncounted} periods without counts, error beside them {error:.2} codes",
        N::NAME
    );
    assert!(error.abs() <= 0.5, "{}", N::NAME);
}

#[test]
fn a_restart_of_the_bank_at_any_moment_costs_one_samples_angle_and_its_outages() {
    restarts_at_random_moments::<F32>(28);
    restarts_at_random_moments::<Fixed>(82);
}
