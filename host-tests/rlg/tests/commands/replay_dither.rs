//! The dither of a recording: estimated from its pickoffs, tracked by replay, and put into the block to flash.

use assert_cmd::Command;
use rlg::model::Model;
use rlg::recording::{Quantity, Recording};
use rlg::replay::samples::{
    PICKOFF_WEIGHT_RAD, Setup, dither_of_recording, samples_from_recording,
};
use rlg::replay::{Core, replay};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;
use std::path::Path;
use trueaxis::Parameters;

/// Simulates 6.5 s of a dithered triad; returns its scenario, the recording and the known model.
fn recorded() -> (Scenario, Recording, Model) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/coning.toml");
    let text = std::fs::read_to_string(path)
        .unwrap()
        .replace("duration_s = 17.0", "duration_s = 2.0")
        .replace("duration_s = 4.0", "duration_s = 0.25")
        .replace("duration_s = 5.0", "duration_s = 0.25");
    let scenario = Scenario::parse(&text, Path::new("short.toml")).unwrap();
    let simulation = simulate(&scenario, 3, |_| {});
    (scenario, simulation.recording, simulation.model)
}

/// Largest relative error of the frequency for the strip \[1\]: with the largest delay, 100 µs, the quadrature's tap is 2πFd
/// = 0.25 and wrong by Ω = 0.63 of this, a residual of 1.6e-4 of the dither where 1e-3 is allowed.
const FREQUENCY_ERROR: f64 = 1e-3;

fn assert_measured(frequency_hz: [f64; 3], amplitude_rad: [f64; 3], scenario: &Scenario) {
    let dither = scenario.dither.as_ref().unwrap();
    // the mean of the squares exceeds the square of the mean by that; and an amplitude with a memory of 19 half-cycles has
    // some 5200/38 independent values in 6.5 s: three sigma of their mean
    let spread = dither.amplitude_spread;
    let bound = 0.5 * spread.powi(2) + 3.0 * spread / 137.0_f64.sqrt();
    for axis in 0..3 {
        let frequency = frequency_hz[axis] / dither.frequency_hz[axis] - 1.0;
        let amplitude = amplitude_rad[axis] / dither.amplitude_rad[axis] - 1.0;
        println!("gyro {axis}: frequency {frequency:.1e}, amplitude {amplitude:.1e}");
        assert!(frequency.abs() < FREQUENCY_ERROR, "{frequency}");
        assert!(amplitude.abs() < bound, "{amplitude}");
    }
}

#[test]
fn pickoffs_tell_the_frequency_and_the_amplitude_of_each_dither() {
    let (scenario, recording, model) = recorded();
    let motion = dither_of_recording(&recording, &model).unwrap();
    assert_measured(motion.frequency_hz, motion.amplitude_rad, &scenario);
}

#[test]
fn replay_follows_a_pickoff_whose_gain_the_model_has_5_percent_wrong() {
    let (_, recording, model) = recorded();
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    recording.write_to(place("recording")).unwrap();
    let mut wrong = model.clone();
    for gain in &mut wrong.dither.as_mut().unwrap().pickoff_gain {
        *gain *= 1.05;
    }
    model.write(place("right.toml")).unwrap();
    wrong.write(place("wrong.toml")).unwrap();
    // the last second of each axis' increments
    let run = |core: &str, model: &str, adapt_s: &str| {
        let out = place(&format!("{core}-{model}-{adapt_s}"));
        Command::cargo_bin("rlg")
            .unwrap()
            .args(["replay", "--core", core, "--adapt-s", adapt_s])
            .args(["--output-every", "1", "--model"])
            .args([place(model), place("recording")])
            .arg("--out")
            .arg(&out)
            .assert()
            .success();
        let output = Recording::read(&out).unwrap();
        let channels = &output.tables[0].channels;
        [0, 1, 2].map(|axis| {
            let values = &channels[axis].values;
            values[values.len() - 4000..].to_vec()
        })
    };
    for core in ["f32", "fixed", "reference"] {
        let right = run(core, "right.toml", "0");
        let frozen = run(core, "wrong.toml", "0");
        let following = run(core, "wrong.toml", "0.5");
        for axis in 0..3 {
            let apart = |other: &[Vec<f64>; 3]| {
                let pairs = right[axis].iter().zip(&other[axis]);
                let square: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
                (square / 4000.0).sqrt()
            };
            let left = apart(&following) / apart(&frozen);
            println!("{core}, gyro {axis}: {left:.1e} of the error left");
            // pulses contribute 0.04 % of the dither to the taps of half a second, a hundredth of 5 %; three sigma
            assert!(left < 0.03, "{core}, gyro {axis}: {left}");
        }
    }
}

#[test]
fn params_puts_dither_accelerometers_and_generation_into_the_block() {
    let (scenario, recording, model) = recorded();
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    recording.write_to(place("recording")).unwrap();
    model.write(place("model.toml")).unwrap();
    Command::cargo_bin("rlg")
        .unwrap()
        .args(["params", "--generation", "7", "--adapt-s", "2"])
        .args(["--accelerometer-weight-m-s", "1e-6", "2e-6", "3e-6"])
        .arg("--dither-from")
        .args([place("recording"), place("model.toml")])
        .arg("--out")
        .arg(place("params.bin"))
        .assert()
        .success();
    let block = std::fs::read(place("params.bin")).unwrap();
    let (parameters, generation) = Parameters::from_block(&block).unwrap();
    assert_eq!(generation, 7);
    assert_eq!(parameters.adaptation_time_s, 2.0);
    let weights = parameters.accelerometers.unwrap().weight_m_s;
    assert_eq!(weights, [1e-6, 2e-6, 3e-6]);
    assert_measured(
        parameters.dither_frequency_hz,
        parameters.dither_amplitude_rad,
        &scenario,
    );
}

/// The samples of a recording whose pickoffs were written in codes are those codes, whatever their weight.
#[test]
fn pickoffs_that_were_recorded_in_codes_reach_the_chain_as_those_codes() {
    let (_, recording, model) = recorded();
    let input =
        samples_from_recording(&recording, &model, Path::new("model.toml"), Setup::STANDARD)
            .unwrap();
    let (_, channel) = recording.channel(&Quantity::DitherAngle, "y").unwrap();
    assert_eq!(input.parameters.pickoff_weight_rad, channel.scale);
    assert!(channel.scale != PICKOFF_WEIGHT_RAD);
    for (sample, angle) in input.samples.iter().zip(&channel.values) {
        let code = angle / channel.scale;
        assert!((f64::from(sample.pickoff_codes[1]) - code).abs() < 1e-6);
    }
    // One value between two codes: then all are taken as angles.
    let mut between = recording.clone();
    let found = between.tables[0]
        .channels
        .iter_mut()
        .find(|channel| channel.quantity == Quantity::DitherAngle);
    let found = found.unwrap();
    found.values[77] += 0.3 * found.scale;
    let input =
        samples_from_recording(&between, &model, Path::new("model.toml"), Setup::STANDARD).unwrap();
    assert_eq!(input.parameters.pickoff_weight_rad, PICKOFF_WEIGHT_RAD);
}

/// The chain's first sample adds no rotation whatever its counts are, so the counts of the row before the first whole one
/// need not be known; its pickoffs initialise the strip.
#[test]
fn counts_that_the_first_row_lacks_change_no_output() {
    let (_, recording, model) = recorded();
    let replayed = |recording: &Recording| {
        let input =
            samples_from_recording(recording, &model, Path::new("model.toml"), Setup::STANDARD)
                .unwrap();
        let outputs = [Core::F32, Core::Fixed, Core::Reference].map(|core| {
            replay(&input, core, &input.parameters)
                .unwrap()
                .output_sha256
        });
        (input.samples.len(), input.rows_left_out, outputs)
    };
    let mut without = recording.clone();
    for channel in &mut without.tables[0].channels {
        if channel.quantity == Quantity::GyroCount {
            channel.values[0] = f64::NAN;
        }
    }
    assert_eq!(replayed(&recording), replayed(&without));
    // Without its pickoffs the row is left out.
    for channel in &mut without.tables[0].channels {
        if channel.quantity == Quantity::DitherAngle {
            channel.values[0] = f64::NAN;
        }
    }
    assert_eq!(replayed(&without).1, [1, 0]);
}
