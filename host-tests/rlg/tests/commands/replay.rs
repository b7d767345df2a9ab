//! The f64 reference against formulas, the core against the reference, and the replay of both.

use assert_cmd::Command;
use nalgebra::{UnitQuaternion, Vector3};
use rlg::model::{Model, ModelEffect, MotionSource};
use rlg::recording::{Quantity, Recording};
use rlg::reference::adaptation::AdaptationCalibration;
use rlg::reference::coning::Coning;
use rlg::reference::flexure::FlexureCalibration;
use rlg::reference::terms::TermCalibration;
use rlg::reference::{Calibration, Reading, ReferenceChain, Six, acceleration};
use rlg::replay::drift::{
    DEG_H_PER_RAD_S, drift, mean_difference_deg_h, periods_in, reference_rotations_rad,
};
use rlg::replay::samples::{
    INCREMENT_WEIGHT_RAD, PICKOFF_WEIGHT_RAD, Setup, samples_from_recording,
};
use rlg::replay::{Core, replay};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::{Simulation, coning_demo, simulate};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

const SETUP: Setup = Setup::STANDARD;

/// Largest difference of both number systems from the f64 chain \[°/h\]: a tenth of the best bias stability of a ring-laser
/// gyro (0.01 °/h), so that arithmetic never limits the unit.
const AGREEMENT_DEG_H: f64 = 1e-3;

const TABLE_3: Six = Six {
    xy: 6.9e-8,
    xz: 7.1e-8,
    yx: 7.5e-8,
    yz: 7.3e-8,
    zx: 6.7e-8,
    zy: 7.6e-8,
};

fn perfect(flexure_s2: Six) -> Calibration {
    Calibration {
        bias_rad_s: [0.0; 3],
        scale_error: [0.0; 3],
        installation_rad: Six::default(),
        pickoff_gain: [0.0; 3],
        pickoff_delay_s: [0.0; 3],
        adaptation: AdaptationCalibration {
            time_s: 0.0,
            frequency_hz: [400.0; 3],
            amplitude_rad: [0.0; 3],
        },
        accelerometers: None,
        flexure: FlexureCalibration {
            linear_s2: flexure_s2,
            ..FlexureCalibration::default()
        },
        terms: TermCalibration::default(),
        period_s: 1.0 / 4000.0,
        periods_per_output: 10,
    }
}

fn reading(sensed_rad: [f64; 3], pickoff_rad: [f64; 3]) -> Reading {
    Reading {
        sensed_rad,
        pickoff_rad,
        ..Reading::default()
    }
}

/// Exact case increments of steady coning about x, from the integral of its body rate: ω_x =
/// −Ω(1 − cos φ), ω_y = −Ω sin φ sin Ωt, ω_z = Ω sin φ cos Ωt.
fn coning_increment(row: usize, omega_rad_s: f64, angle_rad: f64) -> Vector3<f64> {
    let (begin, end) = (row as f64 / 4000.0, (row + 1) as f64 / 4000.0);
    let phase = |time_s: f64| (omega_rad_s * time_s).sin_cos();
    let ((sin_0, cos_0), (sin_1, cos_1)) = (phase(begin), phase(end));
    let sin = angle_rad.sin();
    Vector3::new(
        -omega_rad_s * (1.0 - angle_rad.cos()) / 4000.0,
        sin * (cos_1 - cos_0),
        sin * (sin_1 - sin_0),
    )
}

/// Exact integral of the tilt terms of gyro x under that motion, δ_xj = −K_xj α_j: the products of sines
/// and cosines, K_xz α's ω_y and K_xy's ω_z, integrated.
fn flexed_x_increment(row: usize, omega: f64, angle_rad: f64, k: &Six) -> f64 {
    let (begin, end) = (row as f64 / 4000.0, (row + 1) as f64 / 4000.0);
    let squared = (omega * angle_rad.sin()).powi(2) * omega;
    // ∫sin² and ∫cos²
    let wave = ((2.0 * omega * end).sin() - (2.0 * omega * begin).sin()) / (4.0 * omega);
    let half = 0.5 * (end - begin);
    // −K_xz α_z ω_y + K_xy α_y ω_z with α_z = −Ω² sin φ sin, α_y = −Ω² sin φ cos
    -squared * (k.xz * (half - wave) + k.xy * (half + wave))
}

#[test]
fn acceleration_coefficients_are_those_derived_by_hand() {
    // Of the central difference: 0.8958, −0.2417, 0.0292
    let printed = [43.0 / 48.0, -29.0 / 120.0, 7.0 / 240.0];
    for (solved, printed) in acceleration::central_coefficients().iter().zip(printed) {
        // rounding of a 3 × 3 solution of condition about 1e3
        assert!((solved - printed).abs() < 1e-12, "{solved} {printed}");
    }
}

#[test]
fn f64_chain_takes_the_paper_s_drift_away_and_shows_it_without_its_coefficients() {
    let (omega, angle_rad) = (TAU * 15.0, f64::to_radians(0.367));
    // 4 s, 60 cycles, after the two periods that prime the chain
    let rows = 10..16010;
    let drift = |k: Six| {
        let mut chain = ReferenceChain::new(&perfect(k));
        let mut sum = 0.0;
        for row in 0..rows.end {
            let case = coning_increment(row, omega, angle_rad);
            let mut sensed = case;
            sensed.x += flexed_x_increment(row, omega, angle_rad, &TABLE_3);
            let step = chain.process(&reading(sensed.into(), [0.0; 3]));
            if rows.contains(&row) {
                sum += step.case_rad.x - case.x;
            }
        }
        sum / 4.0 * DEG_H_PER_RAD_S
    };
    let expected = -(TABLE_3.xy + TABLE_3.xz) * omega.powi(3) * angle_rad.sin().powi(2) / 2.0
        * DEG_H_PER_RAD_S;
    assert!((expected.abs() - 0.495).abs() < 0.001, "{expected}");
    // whole cycles: the difference of drift and formula is rounding
    assert!((drift(Six::default()) - expected).abs() < 1e-9);
    // three pairs are wrong by order x⁶ (x = 0.024); sensing of y and z is perfect here, so the filter's error of ω_x
    // through y and z is zero. Rounding of 16 000 f64 sums remains.
    assert!(drift(TABLE_3).abs() < 1e-9 * expected.abs().max(1.0));
}

#[test]
fn f64_coning_brings_increments_to_the_output_rate_without_drift() {
    let (omega, angle_rad) = (TAU * 100.0, f64::to_radians(0.1));
    let mut coning = Coning::new(10);
    let mut attitude = UnitQuaternion::identity();
    let mut begin = None;
    let seconds = 4.0;
    for row in 0..16400 {
        if let Some(rotation) = coning.turn(coning_increment(row, omega, angle_rad)) {
            attitude *= UnitQuaternion::from_scaled_axis(rotation);
        }
        // after 10 and 410 cycles the body is at the same attitude
        if row + 1 == 400 {
            begin = Some(attitude);
        }
    }
    let turned = (begin.unwrap().inverse() * attitude).scaled_axis() / seconds * DEG_H_PER_RAD_S;
    // the algorithm's own residual at 4 kHz, 100 Hz, 0.1°: 6e-5 °/h; with one term less 4e-3
    assert!(turned.x.abs() < 1e-4, "{turned}");
}

fn with_truth(simulation: &Simulation) -> Model {
    let mut model = simulation.model.clone();
    model.effects = simulation.truth.effects.clone();
    model
}

#[test]
fn concealed_flexure_put_into_the_model_leaves_no_drift_in_either_number_system() {
    let simulation = coning_demo(1).unwrap();
    let input = samples_from_recording(
        &simulation.recording,
        &with_truth(&simulation),
        Path::new("model.toml"),
        SETUP,
    )
    .unwrap();
    assert!(input.uncompensated.is_empty());
    let reference = replay(&input, Core::Reference, &input.parameters).unwrap();
    let mut static_only = input.parameters;
    static_only.flexure_s2 = Default::default();
    let truth = reference_rotations_rad(&input).unwrap();
    for core in [Core::F32, Core::Fixed] {
        let after = replay(&input, core, &input.parameters).unwrap();
        let before = replay(&input, core, &static_only).unwrap();
        let periods = after.rotations_rad.len();
        assert_eq!(periods, 24_000);
        let apart = mean_difference_deg_h(
            &after.rotations_rad,
            &reference.rotations_rad,
            0..periods,
            &input,
        );
        for axis in apart.unwrap() {
            assert!(axis.abs() < AGREEMENT_DEG_H, "{core:?}: {axis} °/h");
        }
        for (axis, name) in ["coning-x", "coning-y", "coning-z"].into_iter().enumerate() {
            let mut segments = simulation.recording.segments.iter();
            let segment = segments.find(|segment| segment.name == name).unwrap();
            let range = periods_in(segment, &input, periods);
            assert_eq!(range.len(), 6800);
            let [before, after] = [&before, &after].map(|run| {
                let found = drift(&run.rotations_rad, &truth, range.clone(), &input);
                found.unwrap().deg_h
            });
            // 17 s of both random walks, and the white angles (pulse, pickoff, reference) at both ends
            let walk = 5.8e-7_f64.hypot(8.7e-8) / 17.0_f64.sqrt();
            let white =
                (2.0 * (2.1e-6_f64.powi(2) / 12.0 + 2.0 * 2.4e-7_f64.powi(2))).sqrt() / 17.0;
            let noise_deg_h = walk.hypot(white) * DEG_H_PER_RAD_S;
            assert!(
                after[axis].abs() < 4.0 * noise_deg_h,
                "{core:?} {name}: {after:?}"
            );
            assert!(
                before[axis].abs() > 10.0 * after[axis].abs(),
                "{before:?} {after:?}"
            );
        }
    }
}

#[test]
fn first_sample_primes_both_chains_and_turns_nothing() {
    let mut chain = ReferenceChain::new(&Calibration {
        pickoff_gain: [1.0; 3],
        ..perfect(TABLE_3)
    });
    // without a previous pickoff sample, this would be 100 µrad of dither
    assert_eq!(
        chain.process(&reading([1e-4; 3], [1e-4; 3])).case_rad,
        Vector3::zeros()
    );
    let second = chain.process(&reading([3e-5; 3], [1.2e-4; 3])).case_rad;
    for axis in second.iter() {
        // no previous increment either: no acceleration, and Eq. (7) of a perfect triad is the identity
        assert!((axis - 1e-5).abs() < 1e-19);
    }
}

/// Simulates a short recording for a test to modify.
fn short() -> (Recording, Model) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/coning.toml");
    let text = std::fs::read_to_string(path)
        .unwrap()
        .replace("duration_s = 17.0", "duration_s = 2.0")
        .replace("duration_s = 4.0", "duration_s = 0.25")
        .replace("duration_s = 5.0", "duration_s = 0.25");
    let scenario = Scenario::parse(&text, Path::new("short.toml")).unwrap();
    let simulation = simulate(&scenario, 3, |_| {});
    (simulation.recording, simulation.model)
}

fn values(recording: &Recording, column: &str) -> Vec<f64> {
    let mut channels = recording.tables[0].channels.iter();
    let channel = channels.find(|channel| channel.column == column);
    channel.unwrap().values.clone()
}

fn set(recording: &mut Recording, column: &str, row: usize, value: f64) {
    let mut channels = recording.tables[0].channels.iter_mut();
    channels
        .find(|channel| channel.column == column)
        .unwrap()
        .values[row] = value;
}

#[test]
fn pickoff_codes_keep_the_angle_to_half_a_code_and_counts_pass_unchanged() {
    let (mut recording, model) = short();
    // As of a recorder that writes rad.
    for channel in &mut recording.tables[0].channels {
        channel.scale = 1.0;
    }
    let input = samples_from_recording(&recording, &model, Path::new("model.toml"), SETUP).unwrap();
    let (counts, angles) = (values(&recording, "gy"), values(&recording, "dy"));
    for (row, sample) in input.samples.iter().enumerate() {
        assert_eq!(f64::from(sample.pulse_counts[1]), counts[row]);
        let angle = f64::from(sample.pickoff_codes[1]) * PICKOFF_WEIGHT_RAD;
        assert!((angle - angles[row]).abs() <= 0.5 * PICKOFF_WEIGHT_RAD);
    }
}

#[test]
fn recordings_without_pulses_are_counted_without_drift() {
    let (recording, mut model) = short();
    model.dither = None;
    for (quantity, unit) in [(Quantity::GyroIncrement, 1.0), (Quantity::GyroRate, 4000.0)] {
        let mut undithered = recording.clone();
        let channels = &mut undithered.tables[0].channels;
        channels.retain(|c| c.quantity == Quantity::ReferenceIncrement);
        let gyros: Vec<_> = channels
            .iter()
            .map(|reference| {
                let mut gyro = reference.clone();
                gyro.quantity = quantity.clone();
                gyro.column = format!("{}{}", quantity.name(), reference.column);
                gyro.values.iter_mut().for_each(|value| *value *= unit);
                gyro
            })
            .collect();
        channels.extend(gyros);
        let input =
            samples_from_recording(&undithered, &model, Path::new("model.toml"), SETUP).unwrap();
        let reference = input.reference_rad.as_ref().unwrap();
        let (mut counted, mut angle) = (0_i64, 0.0);
        for (sample, increment) in input.samples.iter().zip(reference) {
            counted += i64::from(sample.pulse_counts[2]);
            angle += increment[2];
            let error = counted as f64 * INCREMENT_WEIGHT_RAD - angle;
            // half a count, and rounding of a running sum of 1e-2 rad
            assert!(error.abs() < 0.51 * INCREMENT_WEIGHT_RAD, "{error}");
        }
        for core in [Core::F32, Core::Fixed] {
            let core_output = replay(&input, core, &input.parameters).unwrap();
            let f64_output = replay(&input, Core::Reference, &input.parameters).unwrap();
            let periods = core_output.rotations_rad.len();
            let apart = mean_difference_deg_h(
                &core_output.rotations_rad,
                &f64_output.rotations_rad,
                0..periods,
                &input,
            );
            for axis in apart.unwrap() {
                assert!(axis.abs() < AGREEMENT_DEG_H, "{core:?}: {axis} °/h");
            }
        }
    }
}

#[test]
fn unmeasured_rows_are_cut_at_the_ends_and_refused_in_between() {
    let (recording, model) = short();
    let rows = recording.tables[0].rows;
    let mut ends = recording.clone();
    set(&mut ends, "gx", 0, f64::NAN);
    set(&mut ends, "dz", 1, f64::NAN);
    set(&mut ends, "gy", rows - 1, f64::NAN);
    let input = samples_from_recording(&ends, &model, Path::new("model.toml"), SETUP).unwrap();
    assert_eq!(input.rows_left_out, [2, 1]);
    assert_eq!(input.samples.len(), rows - 3);
    assert_eq!(input.start_s, 2.0 / 4000.0);

    let mut gap = recording.clone();
    set(&mut gap, "dz", 1234, f64::NAN);
    let error = samples_from_recording(&gap, &model, Path::new("model.toml"), SETUP).unwrap_err();
    assert_eq!(error.channel.as_deref(), Some("dz"));
    assert_eq!(error.row, Some(1234));

    // a missing row of the reference costs the output periods that it touches, its own and the next
    let mut unseen = recording.clone();
    set(&mut unseen, "rx", 5005, f64::NAN);
    let input = samples_from_recording(&unseen, &model, Path::new("model.toml"), SETUP).unwrap();
    let truth = reference_rotations_rad(&input).unwrap();
    let lost: Vec<_> = (0..truth.len()).filter(|m| truth[*m][1].is_nan()).collect();
    assert_eq!(lost, [500]);
    let output = replay(&input, Core::F32, &input.parameters).unwrap();
    assert!(drift(&output.rotations_rad, &truth, 0..truth.len(), &input).is_some());
    assert!(drift(&output.rotations_rad, &truth, 500..501, &input).is_none());
}

#[test]
fn recordings_and_models_that_disagree_about_the_dither_are_refused() {
    let (recording, model) = short();
    let mut bare = recording.clone();
    bare.tables[0]
        .channels
        .retain(|channel| channel.quantity != Quantity::DitherAngle);
    let message = |recording: &Recording, model: &Model| {
        samples_from_recording(recording, model, Path::new("model.toml"), SETUP)
            .unwrap_err()
            .to_string()
    };
    assert!(message(&bare, &model).contains("dither_angle"));
    let mut undithered = model.clone();
    undithered.dither = None;
    assert!(samples_from_recording(&bare, &undithered, Path::new("model.toml"), SETUP).is_ok());
    // Pickoffs on which the model is silent are taken as calibrated.
    let plain = samples_from_recording(&recording, &undithered, Path::new("model.toml"), SETUP);
    assert_eq!(plain.unwrap().parameters.pickoff_gain, [1.0; 3]);

    let mut two_axes = recording.clone();
    two_axes.tables[0].channels.retain(|c| c.column != "gz");
    assert!(message(&two_axes, &model).contains("gyro_count z"));
    let mut large = recording.clone();
    set(&mut large, "dx", 7, 0.6);
    let text = message(&large, &model);
    assert!(text.contains("dx") && text.contains("row 7") && text.contains("0.6"));
}

#[test]
fn effects_the_chain_lacks_are_named() {
    let (recording, mut model) = short();
    model.effects.push(ModelEffect {
        kind: "gyro_bias_step".to_owned(),
        parameters: [
            (
                "axis".to_owned(),
                rlg::model::EffectValue::Text("x".to_owned()),
            ),
            ("time_s".to_owned(), rlg::model::EffectValue::Number(0.5)),
            ("size".to_owned(), rlg::model::EffectValue::Number(1e-6)),
        ]
        .into(),
    });
    let input = samples_from_recording(&recording, &model, Path::new("model.toml"), SETUP).unwrap();
    assert_eq!(input.uncompensated, ["gyro_bias_step"]);
}

fn rlg(arguments: &[&str]) -> assert_cmd::assert::Assert {
    Command::cargo_bin("rlg").unwrap().args(arguments).assert()
}

fn json(path: PathBuf) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn command_writes_what_the_contract_promises_and_the_same_output_twice() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (recording, model) = short();
    recording.write_to(place("recording")).unwrap();
    model.write(place("model.toml")).unwrap();
    let run = |core: &str, out: &str| {
        let out = place(out);
        rlg(&[
            "replay",
            &place("recording"),
            "--model",
            &place("model.toml"),
            "--core",
            core,
            "--out",
            &out,
        ])
        .success();
        json(PathBuf::from(out).join("replay.json"))
    };
    for core in ["f32", "fixed", "reference"] {
        let (once, twice) = (run(core, core), run(core, &format!("{core}-again")));
        assert_eq!(once["core"], core);
        assert_eq!(once["samples"], 26_000);
        assert!(once["ns_per_sample"].as_f64().unwrap() > 0.0);
        assert_eq!(once["output_sha256"], twice["output_sha256"]);
        assert_eq!(once["output_sha256"].as_str().unwrap().len(), 64);
        let segments = once["segments"].as_array().unwrap();
        assert_eq!(segments.len(), 5);
        assert_eq!(segments[1]["name"], "coning-x");
        assert_eq!(segments[1]["kind"], "coning");
        for when in ["drift_before_deg_h", "drift_after_deg_h"] {
            assert_eq!(segments[1][when].as_array().unwrap().len(), 3);
        }
        // segments of a quarter of a second: a code of 2⁻³⁵ rad at each end is 5e-5 °/h
        assert!(
            once["against_reference"]["max_drift_deg_h"]
                .as_f64()
                .unwrap()
                < AGREEMENT_DEG_H
        );
        let output = Recording::read(place(core)).unwrap();
        assert_eq!(output.tables[0].file, "compensated.parquet");
        assert_eq!(output.tables[0].rows, 2600);
        assert_eq!(output.tables[0].channels[2].column, "dtheta_z");
    }
}

#[test]
fn command_replaces_an_earlier_replay_and_no_other_recording() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (recording, model) = short();
    for name in ["recording", "other"] {
        recording.write_to(place(name)).unwrap();
    }
    model.write(place("model.toml")).unwrap();
    let run = |out: &str| {
        let (recording, model, out) = (place("recording"), place("model.toml"), place(out));
        rlg(&[
            "replay", &recording, "--model", &model, "--core", "f32", "--out", &out,
        ])
    };
    run("out").success();
    run("out").success();
    let manifest = || std::fs::read(place("other/recording.toml")).unwrap();
    let before = manifest();
    let output = run("other").code(2).get_output().clone();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("holds another recording"), "{text}");
    assert_eq!(manifest(), before);
}

#[test]
fn recordings_shorter_than_one_output_period_are_refused() {
    let (mut recording, model) = short();
    let keep = |recording: &mut Recording, rows: usize| {
        let table = &mut recording.tables[0];
        table.rows = rows;
        for channel in &mut table.channels {
            channel.values.truncate(rows);
        }
    };
    keep(&mut recording, 10);
    let input = samples_from_recording(&recording, &model, Path::new("model.toml"), SETUP).unwrap();
    let output = replay(&input, Core::F32, &input.parameters).unwrap();
    assert_eq!(output.rotations_rad.len(), 1);
    keep(&mut recording, 9);
    let error =
        samples_from_recording(&recording, &model, Path::new("model.toml"), SETUP).unwrap_err();
    assert!(error.problem.contains("shorter than one output period"));
    assert_eq!(error.value.as_deref(), Some("9 measured rows"));
}

#[test]
fn limits_of_the_chain_name_the_input_at_fault() {
    let (recording, model) = short();
    let refused = |recording: &Recording, model: &Model, setup: Setup| {
        let error = samples_from_recording(recording, model, Path::new("model.toml"), setup);
        error.unwrap_err().to_string()
    };
    let mut biased = model.clone();
    biased.gyro.bias_rad_s = [0.0, 0.05, 0.0];
    let text = refused(&recording, &biased, SETUP);
    assert!(text.starts_with("model.toml, bias_rad_s: "), "{text}");
    // as stored in the chain: relative to the installation's scaling, 5e-6 less than the model's 0.05
    assert!(text.contains("found [0.0, 0.04999"), "{text}");

    let seldom = Setup {
        samples_per_output: 41,
        ..SETUP
    };
    let text = refused(&recording, &model, seldom);
    assert!(text.starts_with("--output-every"), "{text}");
    assert!(text.contains("found 41"), "{text}");

    // a weight that no sample uses is accepted
    let mut heavy = model.clone();
    heavy.gyro.pulse_weight_rad = [1e-3; 3];
    let text = refused(&recording, &heavy, SETUP);
    assert!(text.starts_with("model.toml, pulse_weight_rad: "), "{text}");
    let mut increments = recording.clone();
    for channel in &mut increments.tables[0].channels {
        if channel.quantity == Quantity::GyroCount {
            channel.quantity = Quantity::GyroIncrement;
            channel.values.iter_mut().for_each(|value| *value *= 1e-9);
        }
    }
    heavy.dither = None;
    samples_from_recording(&increments, &heavy, Path::new("model.toml"), SETUP).unwrap();
}

#[test]
fn command_gives_no_drift_against_a_reference_that_is_no_truth() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (recording, model) = short();
    recording.write_to(place("recording")).unwrap();
    let run = |model: &Model| {
        model.write(place("model.toml")).unwrap();
        let (recording, model, out) = (place("recording"), place("model.toml"), place("out"));
        let done = rlg(&[
            "replay", &recording, "--model", &model, "--core", "f32", "--out", &out,
        ])
        .success();
        let words = String::from_utf8(done.get_output().stderr.clone()).unwrap();
        (json(PathBuf::from(out).join("replay.json")), words)
    };
    let (report, _) = run(&model);
    assert!(report["no_drift_because"].is_null());
    assert!(report["segments"][0]["drift_after_deg_h"].is_array());

    let mut at_rest = model.clone();
    at_rest.motion = MotionSource::Static;
    let mut without_earth = model.clone();
    without_earth.earth_rate_in_reference = false;
    let mut turned = model.clone();
    turned.effects.push(ModelEffect {
        kind: "reference_misalignment".to_owned(),
        parameters: [("x".to_owned(), rlg::model::EffectValue::Number(1e-3))].into(),
    });
    for (model, part) in [
        (at_rest, "static"),
        (without_earth, "the Earth's rotation"),
        (turned, "reference_misalignment"),
    ] {
        let (report, words) = run(&model);
        let reason = report["no_drift_because"].as_str().unwrap();
        assert!(reason.contains(part), "{reason}");
        assert!(words.contains(reason), "{words}");
        for segment in report["segments"].as_array().unwrap() {
            assert!(segment["drift_before_deg_h"].is_null());
            assert!(segment["drift_after_deg_h"].is_null());
        }
    }
}

#[test]
fn command_refuses_what_it_cannot_replay_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (mut recording, model) = short();
    set(&mut recording, "gx", 100, f64::NAN);
    recording.write_to(place("recording")).unwrap();
    model.write(place("model.toml")).unwrap();
    let (recording, model, out) = (place("recording"), place("model.toml"), place("out"));
    let run = |model: &str, extra: &[&str]| {
        let mut arguments = vec![
            "replay", &recording, "--model", model, "--core", "f32", "--out", &out,
        ];
        arguments.extend(extra);
        let output = rlg(&arguments).code(2).get_output().clone();
        assert!(output.stdout.is_empty());
        assert!(!Path::new(&out).exists());
        String::from_utf8(output.stderr).unwrap()
    };
    let text = run(&model, &[]);
    assert!(text.contains("gx") && text.contains("row 100"), "{text}");
    assert!(run(&place("none.toml"), &[]).contains("none.toml"));
}

#[test]
fn bench_recordings_replay_within_the_marks() {
    let Some(folder) = std::env::var_os("RLG_RECORDINGS") else {
        eprintln!("skipped: RLG_RECORDINGS names no folder with bench-coning");
        return;
    };
    let bench = PathBuf::from(folder).join("bench-coning");
    let recording = Recording::read(&bench).unwrap();
    let mut model = Model::read(bench.join("model.toml")).unwrap();
    let truth = json(bench.parent().unwrap().join("truth/bench-coning.json"));
    let concealed = &truth["effects"][0];
    let numbers = concealed["parameters"].as_object().unwrap().iter();
    model.effects.push(ModelEffect {
        kind: concealed["kind"].as_str().unwrap().to_owned(),
        parameters: numbers
            .map(|(name, value)| {
                let number = rlg::model::EffectValue::Number(value.as_f64().unwrap());
                (name.clone(), number)
            })
            .collect(),
    });
    let input = samples_from_recording(&recording, &model, Path::new("model.toml"), SETUP).unwrap();
    let truth = reference_rotations_rad(&input).unwrap();
    let f64_output = replay(&input, Core::Reference, &input.parameters).unwrap();
    let mut static_only = input.parameters;
    static_only.flexure_s2 = Default::default();
    for core in [Core::F32, Core::Fixed] {
        let after = replay(&input, core, &input.parameters).unwrap();
        let before = replay(&input, core, &static_only).unwrap();
        let periods = after.rotations_rad.len();
        let apart = mean_difference_deg_h(
            &after.rotations_rad,
            &f64_output.rotations_rad,
            0..periods,
            &input,
        );
        assert!(
            apart
                .unwrap()
                .iter()
                .all(|axis| axis.abs() < AGREEMENT_DEG_H)
        );
        for (axis, name) in ["coning-x", "coning-y", "coning-z"].into_iter().enumerate() {
            let mut segments = recording.segments.iter();
            let segment = segments.find(|segment| segment.name == name).unwrap();
            let range = periods_in(segment, &input, periods);
            let [before, after] = [&before, &after].map(|run| {
                let found = drift(&run.rotations_rad, &truth, range.clone(), &input);
                found.unwrap().deg_h
            });
            assert!(
                before[axis].abs() > 10.0 * after[axis].abs(),
                "{core:?} {name}: {before:?} {after:?}"
            );
        }
    }
}
