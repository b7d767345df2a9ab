//! Recordings from which no coefficient can be estimated: one sentence, exit code 2, nothing written.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use rlg::model::{EffectValue, ModelEffect};
use rlg::recording::{Clock, Quantity};

use crate::closed_form::{Against, Made, Motion, Programme, TABLE_3, coning, make, spins};

/// Checks that the command refuses `made` with one line that holds all of `parts`.
fn is_refused(made: &[&Made], parts: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = folder.path().join("model.toml");
    made[0].model.write(&model).expect("a model");
    let out = folder.path().join("out");
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    command.arg("calibrate");
    for (place, made) in made.iter().enumerate() {
        let recording = folder.path().join(format!("recording-{place}"));
        made.recording.write_to(&recording).expect("a recording");
        command.arg(recording);
    }
    let output = command
        .arg("--model")
        .arg(&model)
        .arg("--out")
        .arg(&out)
        .output()
        .expect("the command runs");
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(
        words.starts_with("error: ") && words.lines().count() == 1,
        "{words}"
    );
    for part in parts {
        assert!(words.contains(part), "no {part:?} in: {words}");
    }
    let left: Vec<_> = fs::read_dir(folder.path())
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name())
        .filter(|name| !Path::new(name).starts_with("model.toml"))
        .filter(|name| !name.to_string_lossy().starts_with("recording-"))
        .collect();
    assert!(left.is_empty(), "{left:?} was left behind");
}

#[test]
fn no_motion() {
    let still = Programme(vec![(Motion::Still, 20.0)]);
    for against in [Against::Rates, Against::Attitude(1.0, 1e-6)] {
        let made = make(&still, &TABLE_3, &against, 1);
        is_refused(
            &[&made],
            &["recording.toml", "no recording moves enough", "coning"],
        );
    }
}

#[test]
fn no_reference() {
    let made = make(&coning(), &TABLE_3, &Against::Nothing, 1);
    is_refused(
        &[&made],
        &["recording.toml", "no reference", "reference_attitude"],
    );
}

#[test]
fn a_reference_in_degrees() {
    let mut made = make(&coning(), &TABLE_3, &Against::Rates, 1);
    for channel in &mut made.recording.tables[1].channels {
        channel
            .values
            .iter_mut()
            .for_each(|value| *value = value.to_degrees());
    }
    is_refused(&[&made], &["measure different motions", "gyro_scale"]);
}

#[test]
fn a_gyro_that_is_dead() {
    for against in [Against::Rates, Against::Attitude(2.0, 1e-6)] {
        let mut made = make(&coning(), &TABLE_3, &against, 1);
        made.recording.tables[0].channels[2].values.fill(0.0);
        is_refused(&[&made], &["recording.toml", "measure different motions"]);
    }
}

#[test]
fn a_quaternion_that_is_no_rotation() {
    let mut made = make(&coning(), &TABLE_3, &Against::Attitude(1.0, 1e-6), 1);
    made.recording.tables[1].channels[2].values[3] += 0.1;
    is_refused(&[&made], &["attitude.csv", "row 3", "no unit quaternion"]);
}

#[test]
fn gyros_of_another_rate() {
    let first = make(&coning(), &TABLE_3, &Against::Rates, 1);
    let mut second = make(&coning(), &TABLE_3, &Against::Rates, 2);
    for table in &mut second.recording.tables {
        table.clock = Clock::Uniform {
            rate_hz: 250.0,
            start_s: 0.0,
        };
    }
    is_refused(
        &[&first, &second],
        &["recording-1", "not of the same instrument", "500 Hz"],
    );
}

#[test]
fn gyros_that_report_something_else() {
    let first = make(&coning(), &TABLE_3, &Against::Rates, 1);
    let mut second = make(&coning(), &TABLE_3, &Against::Rates, 2);
    for channel in &mut second.recording.tables[0].channels {
        channel.quantity = Quantity::GyroRate;
    }
    is_refused(&[&first, &second], &["recording-1", "gyro_increment"]);
}

#[test]
fn another_instrument() {
    let first = make(&spins(), &TABLE_3, &Against::Rates, 1);
    let second = make(&spins(), &TABLE_3.map(|k| 2.0 * k), &Against::Rates, 2);
    is_refused(&[&first, &second], &["other flexure coefficients"]);
    let mut turned = make(&spins(), &TABLE_3, &Against::Rates, 2);
    let gyro = &mut turned.recording.tables[0].channels;
    let z = gyro[2].values.clone();
    for (x, z) in gyro[0].values.iter_mut().zip(z) {
        *x += 1e-3 * z;
    }
    is_refused(&[&first, &turned], &["recording-1", "installation xy"]);
}

#[test]
fn an_effect_that_attitudes_cannot_be_rid_of() {
    let mut made = make(&coning(), &TABLE_3, &Against::Attitude(1.0, 1e-6), 1);
    let number = |name: &str, value| (name.to_owned(), EffectValue::Number(value));
    let axis = ("axis".to_owned(), EffectValue::Text("x".to_owned()));
    made.model.effects.push(ModelEffect {
        kind: "gyro_bias_step".to_owned(),
        parameters: [axis, number("time_s", 20.0), number("size", 1e-6)].into(),
    });
    is_refused(&[&made], &["model.toml", "gyro_bias_step", "attitudes"]);
}

#[test]
fn an_attitude_without_the_gyros_noise() {
    let mut made = make(&coning(), &TABLE_3, &Against::Attitude(1.0, 1e-6), 1);
    made.model.gyro.angle_random_walk_rad_sqrt_s = None;
    is_refused(&[&made], &["model.toml", "angle_random_walk_rad_sqrt_s"]);
}

#[test]
fn results_over_a_recording() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let made = make(&coning(), &TABLE_3, &Against::Rates, 1);
    let model = folder.path().join("model.toml");
    made.model.write(&model).expect("a model");
    let recording = folder.path().join("recording");
    made.recording.write_to(&recording).expect("a recording");
    let output = Command::cargo_bin("rlg")
        .expect("the command is built")
        .arg("calibrate")
        .arg(&recording)
        .args(["--model".as_ref(), model.as_os_str()])
        .args(["--out".as_ref(), recording.as_os_str()])
        .output()
        .expect("the command runs");
    assert_eq!(output.status.code(), Some(2));
}
