//! Exactness of sums, carries, zeros, the calibration.

use trueaxis::parameters::AccelerometerParameters;
use trueaxis::{
    CrossAxis, F32, Fixed, NumberSystem, OUTPUT_M_S_PER_CODE, OutputFrame, Parameters, Sample,
};

use crate::frames;
use crate::motion::parameters;

const NO_ARMS: [[f64; 3]; 3] = [[0.0; 3]; 3];

fn with(accelerometers: AccelerometerParameters) -> Parameters {
    parameters(NO_ARMS).with(|p| p.accelerometers = Some(accelerometers))
}

fn perfect() -> AccelerometerParameters {
    parameters(NO_ARMS).accelerometers.expect("accelerometers")
}

/// Sum of the velocity codes.
fn total(frames: &[OutputFrame]) -> [i64; 3] {
    frames.iter().fold([0; 3], |sum, frame| {
        [0, 1, 2].map(|axis| sum[axis] + i64::from(frame.dvel_codes[axis]))
    })
}

/// Codes about a mean that none of the weights divides; the first only primes.
fn readings(count: i32) -> Vec<Sample> {
    (0..count)
        .map(|k| Sample {
            accelerometer_codes: [1000 + k % 7, -333 - k % 11, k % 13],
            ..Sample::default()
        })
        .collect()
}

fn counted(samples: &[Sample]) -> [i64; 3] {
    samples.iter().skip(1).fold([0; 3], |sum, sample| {
        [0, 1, 2].map(|axis| sum[axis] + i64::from(sample.accelerometer_codes[axis]))
    })
}

fn carries<N: NumberSystem>() {
    // 1/3 µm/s is no whole number of anything.
    let weight_m_s = [1e-6 / 3.0, 1e-5 / 7.0, 1e-7 / 11.0];
    let parameters = with(AccelerometerParameters {
        weight_m_s,
        ..perfect()
    });
    let samples = readings(100_000);
    let shown = total(&frames::<N>(&parameters, &samples).0);
    let counted = counted(&samples);
    for axis in 0..3 {
        let exact = counted[axis] as f64 * weight_m_s[axis] / OUTPUT_M_S_PER_CODE;
        // Half a code is carried; the weight's own rounding, 2⁻³² of 2⁻²⁹ of a code, times the codes counted, and
        // one of these units a period, are below 1e-4 of a code.
        let error = shown[axis] as f64 - exact;
        assert!(
            error.abs() < 0.5001,
            "{}, axis {axis}: {error} codes",
            N::NAME
        );
    }
}

#[test]
fn the_sum_of_all_frames_is_within_half_a_code_of_what_was_counted() {
    carries::<F32>();
    carries::<Fixed>();
}

fn whole_codes<N: NumberSystem>() {
    let parameters = with(AccelerometerParameters {
        weight_m_s: [8.0 * OUTPUT_M_S_PER_CODE; 3],
        ..perfect()
    });
    let samples = readings(1000);
    let (frames, _) = frames::<N>(&parameters, &samples);
    for (frame, period) in frames.iter().zip(samples.chunks(10)) {
        let skip = usize::from(frame.sequence == 0);
        let sum = |axis: usize| -> i32 {
            let codes = period
                .iter()
                .skip(skip)
                .map(|s| s.accelerometer_codes[axis]);
            codes.sum()
        };
        assert_eq!(frame.dvel_codes, [0, 1, 2].map(|axis| 8 * sum(axis)));
    }
}

#[test]
fn a_unit_at_rest_shows_its_pulses_exactly() {
    whole_codes::<F32>();
    whole_codes::<Fixed>();
}

fn calibration<N: NumberSystem>() {
    let known = AccelerometerParameters {
        weight_m_s: [1e-6, 2e-6, 3e-6],
        bias_m_s2: [0.9, -0.5, 0.01],
        scale_error: [1.0 / 130.0, -1.0 / 140.0, 1e-4],
        misalignment_rad: CrossAxis::from_array([7e-3, -6e-3, 5e-3, 4e-3, -3e-3, 2e-3]),
        lever_arm_m: NO_ARMS,
    };
    let samples = readings(40_000);
    let shown = total(&frames::<N>(&with(known), &samples).0);
    let counted = counted(&samples);
    let time_s = (samples.len() - 1) as f64 / 4000.0;
    let u = [0, 1, 2].map(|axis| {
        known.weight_m_s[axis] * (1.0 - known.scale_error[axis]) * counted[axis] as f64
            - known.bias_m_s2[axis] * time_s
    });
    let e = known.misalignment_rad;
    let exact = [
        u[0] + e.xy * u[2] + e.xz * u[1],
        u[1] + e.yz * u[0] + e.yx * u[2],
        u[2] + e.zx * u[1] + e.zy * u[0],
    ];
    for axis in 0..3 {
        let error = shown[axis] as f64 * OUTPUT_M_S_PER_CODE - exact[axis];
        // A matrix term is held to 2⁻³⁸, two of them times some 30 m/s; half a code is carried.
        let bound = 0.5 * OUTPUT_M_S_PER_CODE + 2.0 * 30.0 / (1u64 << 38) as f64;
        assert!(
            error.abs() < bound,
            "{}, axis {axis}: {error:e} m/s",
            N::NAME
        );
    }
}

#[test]
fn bias_scale_and_misalignment_are_taken_out_as_the_equation_says() {
    calibration::<F32>();
    calibration::<Fixed>();
}

/// Rotation of up to 57 °/s in all axes, and readings of any kind.
fn shaken() -> Vec<Sample> {
    let scattered = |k: i64, step: i64, limit: i64| (k * step % limit) as i32;
    (0..5000)
        .map(|k| Sample {
            pulse_counts: [
                scattered(k, 7919, 4_000_000),
                scattered(k, 104_729, 3_000_000),
                -scattered(k, 1_299_709, 2_000_000),
            ],
            accelerometer_codes: [
                scattered(k, 31, 9_000_000),
                -scattered(k, 17, 9_000_000),
                scattered(k, 7, 1000),
            ],
            ..Sample::default()
        })
        .collect()
}

fn zeros<N: NumberSystem>() {
    let still: Vec<Sample> = shaken()
        .into_iter()
        .map(|sample| Sample {
            accelerometer_codes: [0; 3],
            ..sample
        })
        .collect();
    let (frames, _) = frames::<N>(&with(perfect()), &still);
    assert!(frames.iter().any(|frame| frame.dtheta_codes != [0; 3]));
    assert!(frames.iter().all(|frame| frame.dvel_codes == [0; 3]));
}

#[test]
fn a_body_that_feels_no_force_gains_no_velocity_however_it_turns() {
    zeros::<F32>();
    zeros::<Fixed>();
}

fn beside<N: NumberSystem>() {
    let without = parameters(NO_ARMS).with(|p| p.accelerometers = None);
    let samples = shaken();
    let (with_them, _) = frames::<N>(&with(perfect()), &samples);
    let (without_them, _) = frames::<N>(&without, &samples);
    assert!(with_them.iter().any(|frame| frame.dvel_codes != [0; 3]));
    for (with_them, without_them) in with_them.iter().zip(&without_them) {
        assert_eq!(with_them.dtheta_codes, without_them.dtheta_codes);
        assert_eq!(without_them.dvel_codes, [0; 3]);
    }
}

#[test]
fn accelerometers_change_no_bit_of_the_rotation_and_without_them_there_is_no_velocity() {
    beside::<F32>();
    beside::<Fixed>();
}
