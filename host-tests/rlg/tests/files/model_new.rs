//! `rlg model new`: every grade gives a model that can be read, with and without its comments taken in.

use std::fs;

use assert_cmd::Command;
use rlg::model::{Model, MotionSource};

fn new(grade: &str, more: &[&str]) -> (tempfile::TempDir, Model) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.toml");
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    command
        .args(["model", "new", "--grade", grade])
        .args(more)
        .arg("--out")
        .arg(&path);
    let output = command.output().expect("it runs");
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let model = Model::read(&path).expect("a model");
    (folder, model)
}

#[test]
fn each_grade_is_an_ideal_unit_whose_noise_is_not_declared() {
    for grade in ["rlg", "fog", "mems", "consumer"] {
        let (folder, model) = new(grade, &[]);
        assert_eq!(model.motion, MotionSource::Reference);
        assert_eq!(model.gyro.bias_rad_s, [0.0; 3]);
        assert!(
            model.gyro.angle_random_walk_rad_sqrt_s.is_none() && model.gyro.flicker_rad_s.is_none()
        );
        let path = folder.path().join("model.toml");
        let text = fs::read_to_string(&path).expect("a text");
        let keys = ["# angle_random_walk", "# flicker", "# pulse_weight"];
        let taken: Vec<&str> = text
            .lines()
            .map(|line| match keys.iter().any(|key| line.starts_with(key)) {
                true => &line[2..],
                false => line,
            })
            .collect();
        fs::write(&path, taken.join("\n")).expect("a file");
        let declared = Model::read(&path).expect("a model");
        let walk = declared
            .gyro
            .angle_random_walk_rad_sqrt_s
            .expect("a figure")[0];
        let deg_sqrt_h = walk.to_degrees() * 60.0;
        assert!((0.001..1.0).contains(&deg_sqrt_h), "{grade}: {deg_sqrt_h}");
        assert_eq!(declared.gyro.names_pulse_weights(), grade == "rlg");
    }
    assert_eq!(new("mems", &["--at-rest"]).1.motion, MotionSource::Static);
}
