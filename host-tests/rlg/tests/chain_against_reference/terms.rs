//! Optional terms, each alone and all together, compared with the reference written from the equations.
//!
//! A dithered triad rocks in a vibration, warms up, and loses samples now and then. Both implementations take the same
//! counts; the accumulated angle and velocity are compared, so that an omission or a double count of one of them at a gap is
//! detected.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rlg::reference::ReferenceChain;
use rlg::replay::calibration;
use trueaxis::terms::AllTerms;
use trueaxis::{
    AccelerometerParameters, Chain, ChainState, CrossAxis, F32, Fixed, NumberSystem,
    OUTPUT_M_S_PER_CODE, OUTPUT_RAD_PER_CODE, Parameters, Sample, SlowReadings, TermKind,
    TermRecords,
};

use crate::PERIOD_S;
use crate::unit::{Triad, as_built, reading};

const SAMPLES: usize = 80_000;

/// Every kind at a realistic size.
const RECORDS: [(TermKind, &[f64]); 21] = [
    (
        TermKind::GyroBiasTemperature,
        &[
            295.0, 0.0, 290.0, 2.4e-7, -1.9e-7, 3.1e-7, 2e-9, 3e-9, -4e-9,
        ],
    ),
    (TermKind::GyroBiasTemperatureRate, &[4e-7, -3e-7, 5e-7]),
    (
        TermKind::GyroScaleTemperature,
        &[0.0, 293.0, 0.0, 3e-6, -2e-6, 4e-6, 1e-8, 0.0, -2e-8],
    ),
    (
        TermKind::InstallationTemperature,
        &[
            0.0, 0.0, 293.0, 1e-6, -2e-6, 1.5e-6, 0.5e-6, -1e-6, 2e-6, 1e-8, 0.0, -1e-8, 2e-8, 0.0,
            1e-8,
        ],
    ),
    (TermKind::GyroDelay, &[20e-6, -10e-6, 35e-6]),
    (TermKind::GyroBandwidth, &[1e-8, 0.4e-8, 2e-8]),
    (TermKind::AccelDelay, &[-15e-6, 25e-6, 40e-6]),
    (TermKind::GyroScaleAsymmetry, &[1e-5, -2e-5, 3e-5]),
    (TermKind::GyroScaleQuadratic, &[1e-5, -2e-5, 1.5e-5]),
    (TermKind::GyroScaleCubic, &[2e-6, 1e-6, -3e-6]),
    (
        TermKind::GyroGBias,
        &[5e-8, -2e-8, 3e-8, 1e-8, 6e-8, -4e-8, -3e-8, 2e-8, 5e-8],
    ),
    (
        TermKind::AxisTiltByForce,
        &[2e-7, -1e-7, 3e-7, 1e-7, -2e-7, 2e-7],
    ),
    (TermKind::GyroG2Bias, &[1e-9, -2e-9, 1.5e-9]),
    (TermKind::AccelQuadratic, &[2e-6, -1e-6, 3e-6]),
    (
        TermKind::GyroBiasMagnetic,
        &[2e-3, -1e-3, 3e-3, 1e-3, 2e-3, 0.0, -2e-3, 1e-3, 1e-3],
    ),
    (
        TermKind::AxisFlexureCubic,
        &[3e-13, -2e-13, 1e-13, 3e-13, -1e-13, 2e-13],
    ),
    (
        TermKind::AxisFlexureMode,
        &[6e-8, 7e-8, 7.5e-8, 6.5e-8, 8e-8, 7e-8, 150.0, 0.03],
    ),
    (TermKind::DitherCubic, &[2000.0, -3000.0, 1500.0]),
    (
        TermKind::DitherCrosstalk,
        &[1e-3, -2e-3, 1e-3, 3e-3, -1e-3, 2e-3],
    ),
    (
        TermKind::ElasticRateByForce,
        &[1e-7, -5e-8, 2e-8, 4e-8, 1e-7, 3e-8, -6e-8, 2e-8, -1e-7],
    ),
    (
        TermKind::ElasticRateByJerk,
        &[1e-9, -2e-9, 3e-9, 2e-9, 1e-9, -3e-9, 3e-9, 2e-9, -1e-9],
    ),
];

/// A name with the records of its terms.
type Case<'a> = (&'a str, &'a [(TermKind, &'a [f64])]);

fn parameters(records: &[(TermKind, &[f64])]) -> Parameters {
    let mut terms = TermRecords::NONE;
    for (kind, values) in records {
        terms.push(*kind, values).expect("a record");
    }
    as_built().with(|p| {
        p.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [1e-7; 3],
            bias_m_s2: [2e-3, -3e-3, 1e-3],
            scale_error: [1e-4, -2e-4, 3e-4],
            misalignment_rad: CrossAxis::default(),
            lever_arm_m: [[0.0; 3]; 3],
        });
        p.terms = terms;
    })
}

/// Rates of the case \[rad/s\] and its forces \[m/s^2\]: a rotation of constant sense, and a rocking about all axes.
fn motion(t: f64) -> ([f64; 3], [f64; 3]) {
    let tone = |hz: f64, phase: f64| (std::f64::consts::TAU * hz * t + phase).sin();
    (
        [
            0.9 + 0.5 * tone(15.0, 0.0) + 0.1 * tone(61.0, 0.4),
            -0.8 + 0.4 * tone(15.0, 1.1) + 0.1 * tone(43.0, 0.2),
            1.1 + 0.6 * tone(7.0, 0.3) + 0.1 * tone(61.0, 2.0),
        ],
        [
            1.5 + 3.0 * tone(15.0, 0.7),
            -2.5 + 2.0 * tone(43.0, 0.1),
            9.3 + tone(61.0, 0.9),
        ],
    )
}

fn slow(t: f64) -> SlowReadings {
    SlowReadings {
        temperature_k: [293.0 + 0.5 * t, 294.0 + 0.4 * t, 295.0 + 0.3 * t].map(|k| k as f32),
        temperature_rate_k_s: [0.5, 0.4, 0.3],
        magnetic_field_t: [2e-5, -1e-5, 4e-5].map(|b: f64| (b * (1.0 + 0.1 * t)) as f32),
    }
}

/// Computes the largest difference of angle \[rad\] and velocity \[m/s\] between core and reference at any output, each with
/// its own parameters.
fn apart<N: NumberSystem>(known: &Parameters, of_reference: &Parameters, lossy: bool) -> [f64; 2] {
    let chain = Chain::<N, AllTerms<N>>::with_terms(known).expect("in range");
    let mut state = ChainState::new();
    let mut reference = ReferenceChain::new(&calibration(of_reference));
    let mut triad = Triad::new(known, 3, SAMPLES as f64 * PERIOD_S);
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut velocity, mut coded) = ([0.0; 3], [0i64; 3]);
    let (mut angle_apart, mut velocity_apart) = (Vector3::zeros(), Vector3::zeros());
    let mut most = [0.0f64; 2];
    let mut held: Option<Sample> = None;
    for k in 0..SAMPLES {
        let t = (k as f64 + 0.5) * PERIOD_S;
        if k % 200 == 0 {
            let readings = slow(t);
            chain.slow(&mut state, &readings);
            reference.temperature(
                readings.temperature_k.map(f64::from),
                readings.temperature_rate_k_s.map(f64::from),
            );
            reference.magnetic_field(readings.magnetic_field_t.map(f64::from));
        }
        let (rates, forces) = motion(t);
        let mut sample = triad.read(k, Vector3::from(rates) * PERIOD_S);
        for axis in 0..3 {
            velocity[axis] += forces[axis] * PERIOD_S;
            let whole = (velocity[axis] / 1e-7).floor() as i64;
            sample.accelerometer_codes[axis] = (whole - coded[axis]) as i32;
            coded[axis] = whole;
        }
        if let Some(before) = held.take() {
            for axis in 0..3 {
                sample.pulse_counts[axis] += before.pulse_counts[axis];
                sample.accelerometer_codes[axis] += before.accelerometer_codes[axis];
            }
        }
        let lost = lossy && k > 1000 && rng.random_range(0..2000) == 0;
        let (frame, output) = if lost {
            held = Some(sample);
            (chain.process_lost(&mut state, 1), reference.process_lost(1))
        } else {
            (
                chain.process(&mut state, &sample),
                reference.process(&reading(known, &sample)).output,
            )
        };
        assert_eq!(frame.is_some(), output.is_some(), "sample {k}");
        if let (Some(frame), Some(output)) = (frame, output) {
            let of_codes =
                |codes: [i32; 3], unit: f64| Vector3::from(codes.map(|c| f64::from(c) * unit));
            angle_apart += of_codes(frame.dtheta_codes, OUTPUT_RAD_PER_CODE) - output.rotation_rad;
            velocity_apart += of_codes(frame.dvel_codes, OUTPUT_M_S_PER_CODE) - output.velocity_m_s;
            most = [
                most[0].max(angle_apart.amax()),
                most[1].max(velocity_apart.amax()),
            ];
        }
    }
    most
}

/// Tests `()`, each kind alone, all kinds: the difference between core and reference in excess of that without terms,
/// relative to the correction by the reference's terms.
fn agree<N: NumberSystem>(lossy: bool, cases: &[Case]) {
    let none = parameters(&[]);
    let bare = apart::<N>(&none, &none, lossy);
    println!("{}: none: {bare:?} rad, m/s", N::NAME);
    // Fixed point rounds a tilt down, by 3e-11 rad on average; a gyro has two, at up to 1.1 rad/s.
    let duration_s = SAMPLES as f64 * PERIOD_S;
    let rounded = if N::NAME == "fixed" {
        2.0 * 3e-11 * 1.1 * duration_s
    } else {
        0.0
    };
    let mut wrong = Vec::new();
    for (name, records) in cases {
        let known = parameters(records);
        let left = apart::<N>(&known, &known, lossy);
        let corrected = apart::<N>(&none, &known, lossy);
        println!("{}: {name}: {left:?} of {corrected:?} rad, m/s", N::NAME);
        for at in 0..2 {
            let more = left[at] - 1.5 * bare[at] - [rounded, 0.0][at];
            if more >= 1e-3 * corrected[at] {
                wrong.push(format!("{name}: {left:?} {corrected:?} {bare:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn chain_and_reference_agree_with_each_term_and_with_all() {
    let mut cases: Vec<Case> = RECORDS
        .chunks(1)
        .map(|record| (record[0].0.name(), record))
        .collect();
    cases.push(("all", &RECORDS));
    agree::<F32>(false, &cases);
    agree::<Fixed>(false, &cases);
}

#[test]
fn chain_and_reference_agree_over_lost_samples() {
    agree::<F32>(true, &[("all", &RECORDS)]);
    agree::<Fixed>(true, &[("all", &RECORDS)]);
}
