//! Nonlinear effects on gyros without a dither: each is named alone, with its numbers, and its model explains the recording
//! on a second pass.

use std::path::Path;

use super::support::{concealed, holds, kinds, names_nothing, number};
use rlg::diagnose::result::{Diagnosis, EffectEntry, ParameterEntry, Verdict};
use rlg::diagnose::{Outcome, diagnose};
use rlg::model::Model;
use rlg::simulate::scenario::Scenario;
use rlg::simulate::{Simulation, simulate};

const TABLE: &str = include_str!("table_programme.toml");

fn vibration(name: &str, band_hz: [f64; 2], rms_rad_s: f64, seconds: f64) -> String {
    format!(
        "[[motion]]\nkind = \"vibration\"\nname = \"{name}\"\nlow_hz = {:.1}\nhigh_hz = {:.1}\n\
         rate_rms_rad_s = [{rms_rad_s}, {rms_rad_s}, {rms_rad_s}]\nduration_s = {seconds:.1}\nramp_s = 0.5\n",
        band_hz[0], band_hz[1]
    )
}

fn spin(axis: &str, rate_rad_s: f64) -> String {
    format!(
        "[[motion]]\nkind = \"spin\"\naxis = \"{axis}\"\nrate_rad_s = {rate_rad_s:.1}\nramp_s = 1.0\nduration_s = 10.0\n"
    )
}

fn tumble(rate_rad_s: f64) -> String {
    let [y, z] = [0.8 * rate_rad_s, 1.2 * rate_rad_s];
    format!(
        "[[motion]]\nkind = \"tumble\"\nrate_rad_s = [{rate_rad_s}, {y}, {z}]\nfrequency_hz = [0.11, 0.17, 0.13]\n\
         phase_rad = [0.0, 1.0, 2.0]\nramp_s = 1.0\nduration_s = 120.0\n"
    )
}

/// Makes a vibration with an effect, without accelerometers, at 1000 rows a second.
fn shaken(motion: &[String], effect: &str) -> Simulation {
    made("1000.0", 1e-9, motion, effect)
}

/// Makes rotations at the table's own 400 rows a second, by gyros that count pulses.
fn turned(pulse_rad: f64, motion: &[String], effect: &str) -> Simulation {
    made("400.0", pulse_rad, motion, effect)
}

fn made(rate_hz: &str, pulse_rad: f64, motion: &[String], effect: &str) -> Simulation {
    let instrument = TABLE
        .split("[accelerometer]")
        .next()
        .expect("an instrument");
    let instrument = instrument
        .replace("rate_hz = 400.0", &format!("rate_hz = {rate_hz}"))
        .replace(
            "[1e-9, 1e-9, 1e-9]",
            &format!("[{pulse_rad:e}, {pulse_rad:e}, {pulse_rad:e}]"),
        );
    let text = format!("{instrument}{}{effect}", motion.concat());
    let scenario = Scenario::parse(&text, Path::new("families.toml")).expect("a scenario");
    simulate(&scenario, 5, |_| {})
}

fn diagnosed(simulation: &Simulation, model: &Model) -> Outcome {
    let file = Path::new("model.toml");
    diagnose(&simulation.recording, model, file, 0, &|_| {}).expect("a diagnosis")
}

/// Returns the diagnosis of `kind` alone, whose model explains the recording.
fn explained_alone(kind: &str, simulation: &Simulation) -> Diagnosis {
    let Outcome {
        diagnosis: found,
        model,
        ..
    } = diagnosed(simulation, &simulation.model);
    assert_eq!(kinds(&found), [kind], "{:#?}", found.summary);
    assert_eq!(found.verdict, Verdict::Explained, "{:#?}", found.summary);
    let again = diagnosed(simulation, &model).diagnosis;
    assert_eq!(again.verdict, Verdict::Matches, "{:#?}", again.summary);
    found
}

#[test]
fn a_suspension_that_resonates_is_no_stiff_one() {
    let flexure = [
        ("xy", 1.4e-6),
        ("xz", 1.4e-6),
        ("yx", 1.5e-6),
        ("yz", 1.5e-6),
        ("zx", 1.3e-6),
        ("zy", 1.5e-6),
    ];
    let mode = [("frequency_hz", 120.0), ("damping", 0.05)];
    let motion = [
        vibration("a", [5.0, 150.0], 0.1, 10.0),
        vibration("b", [20.0, 300.0], 0.05, 10.0),
    ];
    let effect = concealed("axis_flexure_mode", &[&flexure[..], &mode].concat());
    let resonant = explained_alone("axis_flexure_mode", &shaken(&motion, &effect));
    holds(&resonant.effects[0], &flexure);
    holds(&resonant.effects[0], &mode);
    let effect = concealed("axis_flexure", &flexure);
    let stiff = explained_alone("axis_flexure", &shaken(&motion, &effect));
    holds(&stiff.effects[0], &flexure);
}

#[test]
fn an_encoders_harmonic_is_found_with_its_order() {
    let motion = [
        spin("x", 2.0),
        spin("y", -3.0),
        spin("z", 1.5),
        spin("z", -2.5),
    ];
    let effect = format!(
        "{}axis = \"z\"\norder = 3\n",
        concealed("reference_harmonic", &[("cos", 2e-6), ("sin", -1e-6)])
    );
    let diagnosis = explained_alone("reference_harmonic", &turned(1e-9, &motion, &effect));
    let found = &diagnosis.effects[0];
    holds(found, &[("cos", 2e-6), ("sin", -1e-6)]);
    assert_eq!(number(found, "order").0, 3.0);
    let on_z =
        |one: &ParameterEntry| matches!(one, ParameterEntry::Text { value, .. } if value == "z");
    assert!(found.parameters.iter().any(on_z));
}

/// Motion a million times the noise: resonances are estimated to parts in a hundred thousand, and the residual of columns of
/// that accuracy is neither physics nor noise.
#[test]
fn a_soft_mount_is_found_with_its_resonances_and_what_is_left_is_not_called_physics() {
    let mount = [
        ("x_frequency_hz", 60.0),
        ("x_damping", 0.1),
        ("y_frequency_hz", 70.0),
        ("y_damping", 0.12),
        ("z_frequency_hz", 50.0),
        ("z_damping", 0.15),
    ];
    let motion = [
        vibration("a", [5.0, 150.0], 0.1, 10.0),
        vibration("b", [20.0, 300.0], 0.05, 10.0),
    ];
    let simulation = shaken(&motion, &concealed("isolator_mode", &mount));
    let diagnosis = diagnosed(&simulation, &simulation.model).diagnosis;
    let [found, others @ ..] = diagnosis.effects.as_slice() else {
        panic!("{:#?}", diagnosis.summary);
    };
    assert_eq!(found.kind, "isolator_mode");
    for (name, truth) in mount {
        let value = number(found, name).0;
        assert!((value / truth - 1.0).abs() < 1e-4, "{name} {value}");
    }
    let is_location = |one: &EffectEntry| one.kind == "unlisted" && one.expression.is_none();
    assert!(others.iter().all(is_location), "{:#?}", diagnosis.summary);
}

/// A step of 0.6 °/h under vibration: 27 standard deviations of a rate's noise, a hundred-thousandth of the motion.
#[test]
#[ignore = "minutes: --test diagnose -- --ignored in_full"]
fn a_step_is_found_in_vibration_with_its_instant_in_full() {
    const STEP_RAD_S: f64 = 0.6 / 3600.0 * std::f64::consts::PI / 180.0;
    const AT_S: f64 = 61.5;
    let motion: Vec<String> = (0..6)
        .map(|part| vibration(&format!("shake-{part}"), [5.0, 150.0], 0.1, 20.0))
        .collect();
    let effect = format!(
        "{}axis = \"y\"\n",
        concealed("gyro_bias_step", &[("time_s", AT_S), ("size", STEP_RAD_S)])
    );
    let diagnosis = explained_alone("gyro_bias_step", &shaken(&motion, &effect));
    let step = &diagnosis.effects[0];
    holds(step, &[("size", STEP_RAD_S), ("time_s", AT_S)]);
    assert!(
        number(step, "time_s").1 < 1.2,
        "it lies in the four seconds that only test"
    );
}

/// Two delays at once: every row depends on their difference alone. One finding, of that size, reports that the two are not
/// distinguishable.
#[test]
fn delays_of_gyros_and_reference_are_seen_by_their_difference() {
    const GYRO_S: f64 = 5e-5;
    const REFERENCE_S: f64 = 1.2e-4;
    let motion = [
        vibration("a", [5.0, 150.0], 0.1, 10.0),
        vibration("b", [20.0, 300.0], 0.05, 10.0),
    ];
    let of_gyros = concealed("gyro_delay", &[("x", GYRO_S), ("y", GYRO_S), ("z", GYRO_S)]);
    let of_reference = concealed("reference_delay", &[("all", REFERENCE_S)]);
    let both = shaken(&motion, &format!("{of_gyros}{of_reference}"));
    let diagnosis = explained_alone("reference_delay", &both);
    let delay = &diagnosis.effects[0];
    holds(delay, &[("all", REFERENCE_S - GYRO_S)]);
    assert!(
        delay
            .indistinguishable_from
            .iter()
            .any(|kind| kind == "gyro_delay"),
        "{delay:#?}"
    );
}

/// Rotations through zero rate without a dither: the beams lock within 170 to 250 °/h of it, which scale terms of any order
/// would have to approximate.
#[test]
fn a_dead_band_about_rest_is_lock_in_with_each_gyros_threshold() {
    let thresholds = [("x", 1.2e-3), ("y", 8e-4), ("z", 1e-3)];
    let motion = [tumble(0.05)];
    let locked = turned(1e-6, &motion, &concealed("lock_in", &thresholds));
    let diagnosis = explained_alone("lock_in", &locked);
    let found = &diagnosis.effects[0];
    holds(found, &thresholds);
    let is_sharp = |(axis, _)| number(found, axis).1 < 8.5e-7;
    assert!(thresholds.into_iter().all(is_sharp), "{found:#?}");
    let free = turned(1e-6, &motion, "");
    let free = diagnosed(&free, &free.model).diagnosis;
    names_nothing(&free, "no threshold");
}

/// Pulses of 0.25 to 0.35″ are rare at this rate, in tones that follow the motion: their weight is read off the values, and
/// their effect is no slip and no mismatch.
#[test]
fn coarse_pulses_are_named_by_their_weight_and_nothing_that_they_make() {
    let pulses = [("x", 1.2e-6), ("y", 1.7e-6), ("z", 1.4e-6)];
    let effect = concealed("pulse_quantisation", &pulses);
    let coarse = turned(1e-9, &[tumble(0.05)], &effect);
    let diagnosis = explained_alone("pulse_quantisation", &coarse);
    holds(&diagnosis.effects[0], &pulses);
}
