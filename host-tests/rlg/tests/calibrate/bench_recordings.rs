//! Recordings of a program independent of this project, from the folder of `RLG_RECORDINGS`. Their concealed values are in
//! `truth/`, read by this file only.

use std::path::PathBuf;

use nalgebra::{DMatrix, DVector};
use rlg::calibrate::calibrate;
use rlg::diagnose::result::ParameterEntry;
use rlg::model::{DeclaredModel, Model};
use rlg::recording::Recording;
use rlg_plan::Plan;

/// 3σ in six dimensions: the squared Mahalanobis distance that contains 99.73 % of a six-dimensional normal.
const THREE_SIGMA_SIX: f64 = 20.06;

fn recordings() -> Option<PathBuf> {
    let folder = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("skipped: RLG_RECORDINGS names no folder of recordings");
    }
    folder
}

/// Reads a recording and its model.
fn read(name: &str) -> Option<(Recording, Model, PathBuf)> {
    let folder = recordings()?.join(name);
    let file = folder.join("model.toml");
    let recording = Recording::read(&folder).expect("a recording");
    Some((recording, Model::read(&file).expect("a model"), file))
}

/// Computes the squared Mahalanobis distance of the calibrated six from the concealed ones.
fn distance(name: &str) -> Option<f64> {
    let (recording, model, file) = read(name)?;
    let outcome = calibrate(
        &[recording],
        DeclaredModel::new(&model, &file),
        &Plan::default(),
        &|_| {},
    )
    .expect("a calibration");
    for line in &outcome.calibration.summary {
        println!("{line}");
    }
    let text =
        std::fs::read_to_string(recordings()?.join(format!("truth/{name}.json"))).expect("truth");
    let truth: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let effect = &outcome.calibration.effects[0];
    let apart = DVector::from_iterator(
        6,
        effect.parameters.iter().map(|parameter| {
            let ParameterEntry::Number { name, value, .. } = parameter else {
                panic!("K is a number");
            };
            let concealed = &truth["effects"][0]["parameters"][name];
            (value - concealed.as_f64().unwrap_or(0.0)) * 1e8
        }),
    );
    let covariance = DMatrix::from_fn(6, 6, |a, b| effect.covariance[a][b] * 1e16);
    let inverse = covariance.try_inverse().expect("positive definite");
    Some(apart.dot(&(inverse * &apart)))
}

#[test]
fn the_calibrated_covariance_covers_concealed_flexure_and_absent_flexure() {
    for name in ["bench-coning", "bench-shake", "bench-null"] {
        let Some(distance) = distance(name) else {
            return;
        };
        println!("{name}: squared Mahalanobis distance {distance:.1} of six");
        assert!(distance < THREE_SIGMA_SIX, "{name}: {distance}");
    }
}

#[test]
fn recordings_of_two_instruments_are_not_taken_for_one() {
    let Some((coning, model, file)) = read("bench-coning") else {
        return;
    };
    let Some((shake, _, _)) = read("bench-shake") else {
        return;
    };
    let Err(error) = calibrate(
        &[coning, shake],
        DeclaredModel::new(&model, &file),
        &Plan::default(),
        &|_| {},
    ) else {
        panic!("two instruments were taken for one");
    };
    assert!(error.to_string().contains("bench-shake"), "{error}");
}
