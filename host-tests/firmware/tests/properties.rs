//! Laws that hold for every input, instead of examples.
//!
//! Parameters are drawn from anywhere in their ranges, samples from any bits, for both number systems. `cargo verify`
//! runs these tests a second time with overflow checks and debug assertions (profile `checked`), where an integer
//! operation that does not fit ends the test.

use std::collections::VecDeque;

use crc::{CRC_32_ISO_HDLC, Crc};
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use proptest::array::uniform3 as three;
use proptest::collection::vec;
use proptest::prelude::*;
use trueaxis::bank_bus::CounterBank;
use trueaxis::counter_bank::{AccelerometerInput, BankFrame};
use trueaxis::design_parameters::{ADAPTATION_WINDOW_S, LEAST_WINDOW_SAMPLES};
use trueaxis::parameters::AccelerometerParameters;
use trueaxis::processor::{BootReport, Processor, Timing};
use trueaxis::sample_source::{Reading, SampleSource, SourceFault};
use trueaxis::telemetry_frame::TelemetryFrame;
use trueaxis::{
    BlockError, Chain, ChainState, CrossAxis, F32, Fixed, FlexureResponse, NumberSystem,
    OUTPUT_RAD_PER_CODE, OutputFrame, PARAMETER_BLOCK_BYTES, Parameters, Sample,
};

// ---- Inputs

/// An i32: often ordinary, often at an edge, else any.
fn word() -> impl Strategy<Value = i32> {
    const EDGES: [i32; 7] = [0, 1, -1, i32::MAX, i32::MIN, i32::MAX - 1, i32::MIN + 1];
    prop_oneof![-300..300i32, prop::sample::select(&EDGES), any::<i32>()]
}

fn sample<W: Strategy<Value = i32>>(word: fn() -> W) -> impl Strategy<Value = Sample> {
    (three(word()), three(word()), three(word())).prop_map(
        |(pulse_counts, pickoff_codes, accelerometer_codes)| Sample {
            pulse_counts,
            pickoff_codes,
            accelerometer_codes,
        },
    )
}

fn any_samples(most: usize) -> impl Strategy<Value = Vec<Sample>> {
    vec(sample(word), 1..most)
}

/// 220 pulses are 100 °/s at 2 µrad; the default pickoff code is 2.3e-10 rad, 200″ at 400 Hz is 2.4e6 of them
/// a sample.
fn ordinary_samples(most: usize) -> impl Strategy<Value = Vec<Sample>> {
    vec(sample(|| -220..220i32), 1..most)
}

fn six(limit: f64) -> impl Strategy<Value = CrossAxis<f64>> {
    prop::array::uniform6(-limit..=limit).prop_map(CrossAxis::from_array)
}

fn accelerometers() -> impl Strategy<Value = AccelerometerParameters> {
    (
        three(1e-9..1e-2f64),
        three(-1.0..1.0f64),
        three(-1.0 / 128.0..1.0 / 128.0f64),
        six(1.0 / 128.0),
        three(three(-0.5..0.5f64)),
    )
        .prop_map(
            |(weight_m_s, bias_m_s2, scale_error, misalignment_rad, lever_arm_m)| {
                AccelerometerParameters {
                    weight_m_s,
                    bias_m_s2,
                    scale_error,
                    misalignment_rad,
                    lever_arm_m,
                }
            },
        )
}

fn response() -> impl Strategy<Value = FlexureResponse> {
    prop_oneof![
        Just(FlexureResponse::Static),
        (0.002..=0.99f64).prop_map(|damping| FlexureResponse::Mode { damping }),
    ]
}

/// Anywhere in the documented ranges.
fn parameters() -> impl Strategy<Value = Parameters> {
    let gyros = (
        three(1.9e-9..1e-4f64),
        three(-0.01..0.01f64),
        three(-1.0 / 128.0..1.0 / 128.0f64),
        six(1.0 / 128.0),
        six(8.0),
    );
    let strip = (
        three(0.0..2.0f64),
        2.92e-11..1e-4f64,
        three(-1e-4..1e-4f64),
        three(0.02..0.4f64),
        three(prop_oneof![Just(0.0), 1e-5..0.01f64]),
        prop_oneof![Just(0.0), 0.1..1000.0f64],
    );
    (
        gyros,
        strip,
        500.0..8000.0f64,
        1..=40u16,
        response(),
        prop::option::of(accelerometers()),
    )
        .prop_map(
            |(gyros, strip, rate, samples_per_output, response, accelerometers)| {
                let (pulse_weight_rad, bias_rad_s, scale_error, installation_rad, flexure) = gyros;
                let (gain, weight, delay, frequency, amplitude, adaptation) = strip;
                Parameters::default().with(|p| {
                    p.pulse_weight_rad = pulse_weight_rad;
                    p.bias_rad_s = bias_rad_s;
                    p.scale_error = scale_error;
                    p.installation_rad = installation_rad;
                    p.flexure_s2 =
                        flexure.map(|k| k * if rate < 1000.0 { 0.5 } else { 1.0 } / (rate * rate));
                    p.pickoff_gain = gain;
                    p.pickoff_weight_rad = weight;
                    p.sample_rate_hz = rate;
                    p.samples_per_output = samples_per_output;
                    p.flexure_response = response;
                    p.pickoff_delay_s = delay;
                    p.dither_frequency_hz = frequency.map(|f| f * rate);
                    p.dither_amplitude_rad = amplitude;
                    p.adaptation_time_s = adaptation;
                    p.accelerometers = accelerometers;
                })
            },
        )
        .prop_map(|parameters| {
            parameters.with(|p| {
                p.samples_per_output = parameters
                    .samples_per_output
                    .min(parameters.most_samples_per_output());
                // Fast strips at 8 kHz allow a sixth of the farthest arms.
                p.accelerometers = parameters
                    .accelerometers
                    .map(|known| AccelerometerParameters {
                        lever_arm_m: known
                            .lever_arm_m
                            .map(|arm| arm.map(|coordinate| coordinate / 6.0)),
                        ..known
                    });
            })
        })
        .prop_filter("every field in its range", |parameters| {
            parameters.check().is_ok()
        })
}

// ---- Outputs

fn frames<N: NumberSystem>(parameters: &Parameters, samples: &[Sample]) -> Vec<OutputFrame> {
    let chain = Chain::<N>::new(parameters).expect("parameters in range");
    let mut state = ChainState::new();
    samples
        .iter()
        .filter_map(|sample| chain.process(&mut state, sample))
        .collect()
}

/// The same, handing the state over between chains of their own at the end of each block.
fn frames_in_blocks<N: NumberSystem>(
    parameters: &Parameters,
    samples: &[Sample],
    lengths: &[usize],
) -> Vec<OutputFrame> {
    let mut state = ChainState::new();
    let mut frames = Vec::new();
    let mut rest = samples;
    let mut lengths = lengths.iter().cycle();
    while !rest.is_empty() {
        let length = lengths.next().map_or(rest.len(), |length| *length);
        let (block, more) = rest.split_at(length.min(rest.len()));
        let (parameters, _) =
            Parameters::from_block(&parameters.to_block(1)).expect("its own block");
        let chain = Chain::<N>::new(&parameters).expect("parameters in range");
        let mut taken_over = state;
        frames.extend(
            block
                .iter()
                .filter_map(|sample| chain.process(&mut taken_over, sample)),
        );
        state = taken_over;
        rest = more;
    }
    frames
}

/// Sum of the frames' codes.
fn angle_codes(frames: &[OutputFrame]) -> [i64; 3] {
    frames.iter().fold([0; 3], |sum, frame| {
        std::array::from_fn(|axis| sum[axis] + i64::from(frame.dtheta_codes[axis]))
    })
}

// ---- Laws of the chain

fn survives<N: NumberSystem>(parameters: &Parameters, samples: &[Sample]) {
    let chain = Chain::<N>::new(parameters).expect("parameters in range");
    let mut state = ChainState::new();
    for sample in samples {
        if let Some(frame) = chain.process(&mut state, sample) {
            let bytes = frame.to_bytes();
            assert_eq!(OutputFrame::from_bytes(&bytes), Ok(frame));
        }
    }
    // Then the instrument stands still: 45 samples fill every history anew, a dither that stopped is known after two
    // windows that end with a period, whereupon the swing of the accelerometers' arms is settled up, and both end an
    // output period of up to 40; from the next one on nothing of the earlier samples may remain but a carried part of a
    // code.
    // A NaN or an infinity would stay for ever.
    let still = Sample {
        pulse_counts: [0; 3],
        accelerometer_codes: [0; 3],
        ..samples.last().copied().unwrap_or_default()
    };
    let period = usize::from(parameters.samples_per_output);
    let window = (ADAPTATION_WINDOW_S * parameters.sample_rate_hz).max(LEAST_WINDOW_SAMPLES);
    let last = (0..45 + 2 * (window.ceil() as usize + period) + 2 * period)
        .filter_map(|_| chain.process(&mut state, &still))
        .last()
        .expect("a frame in every period");
    for code in last.dtheta_codes.into_iter().chain(last.dvel_codes) {
        assert!((-1..=1).contains(&code), "{} drifts on: {last:?}", N::NAME);
    }
}

proptest! {
    /// 256 cases of up to 200 samples, and with every saved failure.
    #[test]
    fn any_sample_bits_are_processed_and_leave_no_trace(
        parameters in parameters(),
        samples in any_samples(200),
    ) {
        // Without the terms that turn or accelerate a body at rest.
        let parameters = parameters.with(|p| {
p.bias_rad_s = [0.0; 3];
p.accelerometers = parameters.accelerometers.map(|a| AccelerometerParameters {
                bias_m_s2: [0.0; 3],
                ..a
            });
});
        survives::<F32>(&parameters, &samples);
        survives::<Fixed>(&parameters, &samples);
    }

    #[test]
    fn a_stream_split_into_blocks_gives_the_same_bits(
        parameters in parameters(),
        samples in any_samples(300),
        lengths in vec(1..50usize, 1..8),
    ) {
        prop_assert_eq!(
            frames::<F32>(&parameters, &samples),
            frames_in_blocks::<F32>(&parameters, &samples, &lengths)
        );
        prop_assert_eq!(
            frames::<Fixed>(&parameters, &samples),
            frames_in_blocks::<Fixed>(&parameters, &samples, &lengths)
        );
    }

    /// Tests that without K nothing of the flexure stage reaches an output.
    #[test]
    fn without_flexure_its_response_changes_no_bit(
        parameters in parameters(),
        other in response(),
        samples in any_samples(200),
    ) {
        let one = parameters.with(|p| p.flexure_s2 = CrossAxis::default());
        let other = one.with(|p| p.flexure_response = other);
        prop_assert_eq!(
            increments(frames::<F32>(&one, &samples)),
            increments(frames::<F32>(&other, &samples))
        );
        prop_assert_eq!(
            increments(frames::<Fixed>(&one, &samples)),
            increments(frames::<Fixed>(&other, &samples))
        );
    }

    /// One gyro turns: the coning terms vanish (all increments are parallel), and the sum of all frames is
    /// Eq. (7) of the sum of all counts.
    #[test]
    fn without_flexure_the_sum_of_all_frames_is_eq_7(
        axis in 0..3usize,
        scale in -1.0 / 128.0..1.0 / 128.0f64,
        installation in six(1.0 / 128.0),
        counts in vec(-220..220i32, 40..400),
    ) {
        let parameters = Parameters::default().with(|p| {
p.scale_error = [scale; 3];
p.installation_rad = installation;
p.samples_per_output = 20;
});
        // The stream's first sample only primes the strip: it holds no counts here. Whole output periods.
        let length = counts.len() / 20 * 20;
        let samples: Vec<Sample> = (0..length)
            .map(|k| {
                let mut sample = Sample::default();
                sample.pulse_counts[axis] = if k == 0 { 0 } else { counts[k] };
                sample
            })
            .collect();
        let total: i64 = samples
            .iter()
            .map(|sample| i64::from(sample.pulse_counts[axis]))
            .sum();
        let turned = parameters.pulse_weight_rad[axis] * (1.0 - scale) * total as f64;
        let travelled: f64 = samples
            .iter()
            .map(|sample| f64::from(sample.pulse_counts[axis].abs()))
            .sum::<f64>()
            * parameters.pulse_weight_rad[axis];
        let e = installation;
        let eq_7 = match axis {
            0 => [turned, e.yz * turned, e.zy * turned],
            1 => [e.xz * turned, turned, e.zx * turned],
            _ => [e.xy * turned, e.yx * turned, turned],
        };
        // One code that the last frame still carries; each sample's products, rounded to half a unit of the coarsest
        // format (2^-39 rad); a coefficient of up to 2^-6 held to 24 bits is wrong by up to 2^-31 of the angle
        // travelled.
        let bound_rad = OUTPUT_RAD_PER_CODE
            + length as f64 / 2.0 / (1u64 << 39) as f64
            + travelled / (1u64 << 31) as f64;
        for (name, codes) in [
            (F32::NAME, angle_codes(&frames::<F32>(&parameters, &samples))),
            (Fixed::NAME, angle_codes(&frames::<Fixed>(&parameters, &samples))),
        ] {
            for out in 0..3 {
                let error = codes[out] as f64 * OUTPUT_RAD_PER_CODE - eq_7[out];
                prop_assert!(
                    error.abs() <= bound_rad,
                    "{name}, gyro {axis} to {out}: {error:e} rad, at most {bound_rad:e}"
                );
            }
        }
    }
}

/// The increments that navigation integrates, without the flags.
fn increments(frames: Vec<OutputFrame>) -> Vec<([i32; 3], [i32; 3])> {
    frames
        .into_iter()
        .map(|frame| (frame.dtheta_codes, frame.dvel_codes))
        .collect()
}

#[test]
fn the_edges_of_every_word_together_do_not_panic() {
    let edges = [i32::MIN, i32::MIN + 1, -1, 0, 1, i32::MAX - 1, i32::MAX];
    // Every ordered pair of edges, so that every step from edge to edge is taken by every word.
    let samples: Vec<Sample> = edges
        .iter()
        .flat_map(|a| edges.iter().flat_map(move |b| [a, b]))
        .map(|edge| Sample {
            pulse_counts: [*edge; 3],
            pickoff_codes: [*edge, edge.wrapping_neg(), *edge],
            accelerometer_codes: [*edge; 3],
        })
        .collect();
    for samples_per_output in [1, 10, 40] {
        let parameters = Parameters::default().with(|p| {
            p.samples_per_output = samples_per_output;
            p.flexure_s2 = CrossAxis::from_array([5e-7; 6]);
        });
        survives::<F32>(&parameters, &samples);
        survives::<Fixed>(&parameters, &samples);
    }
}

// ---- Laws of the processor

fn reading() -> impl Strategy<Value = Reading> {
    let faults = prop_oneof![
        Just(SourceFault::Bus),
        Just(SourceFault::StuckLine),
        Just(SourceFault::Checksum),
        Just(SourceFault::Repeated),
        Just(SourceFault::Starved),
        Just(SourceFault::Restarted),
    ];
    // Also readings that the bank never gives, such as a sample with a bus fault.
    (
        prop::option::of(sample(word)),
        any::<u32>(),
        prop::option::of(faults),
    )
        .prop_map(|(sample, periods, fault)| Reading::new(sample, periods, fault))
}

/// Mostly none, sometimes some, sometimes more than possible.
fn missed() -> impl Strategy<Value = u32> {
    prop_oneof![4 => Just(0), 2 => 1..100u32, 1 => any::<u32>()]
}

fn processor_survives<N: NumberSystem>(
    parameters: &Parameters,
    periods: &[(Reading, u32, bool)],
) -> usize {
    let mut processor =
        Processor::<N>::new(parameters, BootReport::default()).expect("parameters in range");
    let mut frames = 0;
    for (reading, missed, late) in periods {
        let timing = Timing {
            missed: *missed,
            late: *late,
        };
        if let Some(frame) = processor.period(*reading, timing) {
            assert_eq!(TelemetryFrame::from_bytes(&frame.to_bytes()), Ok(frame));
            frames += 1;
        }
    }
    frames
}

proptest! {
    #[test]
    fn any_readings_at_any_times_do_not_panic(
        parameters in parameters(),
        periods in vec((reading(), missed(), any::<bool>()), 1..200),
    ) {
        // The number of frames is a matter of time alone, so it is the same in both number systems.
        prop_assert_eq!(
            processor_survives::<F32>(&parameters, &periods),
            processor_survives::<Fixed>(&parameters, &periods)
        );
    }
}

// ---- Laws of the counter bank

/// A bus that yields frames one after the other.
struct Frames(VecDeque<BankFrame>);

impl ErrorType for Frames {
    type Error = std::convert::Infallible;
}

impl SpiDevice for Frames {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Self::Error> {
        let frame = self.0.pop_front().expect("one frame for each reading");
        for operation in operations {
            if let Operation::Read(bytes) = operation {
                bytes.copy_from_slice(&frame.to_bytes());
            }
        }
        Ok(())
    }
}

proptest! {
    #[test]
    fn the_same_counts_come_out_wherever_the_counters_and_the_sequence_wrap(
        counters in three(word()),
        accelerometers in three(word()),
        sequence in any::<u16>(),
        samples in ordinary_samples(50),
    ) {
        let mut frame = BankFrame::default().with(|frame| {
frame.sequence = sequence;
frame.counters = counters;
frame.accelerometers = accelerometers;
});
        let mut sent = VecDeque::from([frame]);
        for sample in &samples {
            frame = frame.followed_by(sample, AccelerometerInput::Counters);
            sent.push_back(frame);
        }
        let mut bank = CounterBank::new(Frames(sent), AccelerometerInput::Counters);
        let _ = bank.take(1);
        for sample in samples {
            let reading = bank.take(1);
            prop_assert_eq!(reading.fault, None);
            prop_assert_eq!(reading.sample, Some(sample));
        }
    }
}

// ---- Laws of the parameter block

/// Gives bytes the check sum that belongs to them, so that the checks behind it are reached.
fn sealed(mut block: Vec<u8>) -> Vec<u8> {
    let crc_at = block.len() - 4;
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&block[..crc_at]);
    block[crc_at..].copy_from_slice(&crc.to_le_bytes());
    block
}

/// Beginning of the numbers in a block.
const NUMBERS_AT: usize = 16;

/// Reads a block without a panic; an accepted one builds both chains and comes back the same.
fn read_or_refused(bytes: &[u8]) -> Result<(), BlockError> {
    let (parameters, generation) = Parameters::from_block(bytes)?;
    Chain::<F32>::new(&parameters).expect("what a block may hold");
    Chain::<Fixed>::new(&parameters).expect("what a block may hold");
    let again = Parameters::from_block(&parameters.to_block(generation));
    assert_eq!(again, Ok((parameters, generation)));
    Ok(())
}

/// Any f64, and often one that is no ordinary number.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        prop::sample::select(&[
            f64::NAN,
            -f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MIN_POSITIVE / 2.0,
            5e-324,
            -5e-324,
            -0.0,
            0.0,
            f64::MAX,
            f64::MIN,
        ]),
    ]
}

proptest! {
    #[test]
    fn any_bytes_are_a_block_or_refused(bytes in vec(any::<u8>(), 0..2 * PARAMETER_BLOCK_BYTES)) {
        let _ = read_or_refused(&bytes);
    }

    #[test]
    fn any_number_in_any_field_is_accepted_or_refused_by_name(
        parameters in parameters(),
        field in 0..(PARAMETER_BLOCK_BYTES - 4 - NUMBERS_AT) / 8,
        number in number(),
        header in prop::option::of((8..12usize, any::<u8>())),
    ) {
        let mut block = parameters.to_block(7).to_vec();
        let at = NUMBERS_AT + 8 * field;
        block[at..at + 8].copy_from_slice(&number.to_le_bytes());
        if let Some((at, byte)) = header {
            block[at] = byte;
        }
        let read = read_or_refused(&sealed(block.clone()));
        let is_refused_by_name = matches!(
            read,
            Err(BlockError::Parameter(_) | BlockError::Accelerometers(_) | BlockError::Response(_))
        );
        prop_assert!(is_refused_by_name || read.is_ok(), "{read:?}");
        // Fields of absent accelerometers, and the damping of a static flexure, are not checked; all others must be finite.
        let is_looked_at = match field {
            ..36 => true,
            36..60 => block[11] == 1,
            _ => block[10] == 1,
        };
        if is_looked_at && !number.is_finite() {
            prop_assert!(is_refused_by_name, "field {field} holds {number}");
        }
    }

    #[test]
    fn parameters_in_their_ranges_come_back_from_their_block(
        parameters in parameters(),
        generation in any::<u32>(),
    ) {
        let read = Parameters::from_block(&parameters.to_block(generation));
        prop_assert_eq!(read, Ok((parameters, generation)));
    }
}
