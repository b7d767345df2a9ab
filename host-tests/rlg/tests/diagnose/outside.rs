//! Small recordings that others made, from `outside/` in the folder that `RLG_RECORDINGS` names: what is refused, what is
//! put right, and which rows are left out. What the search then names is not judged here.

use std::path::PathBuf;

use rlg::diagnose::result::Diagnosis;
use rlg::diagnose::{Outcome, Settings, diagnose_under};
use rlg::error::InputError;
use rlg::model::Model;
use rlg::recording::Recording;

/// Diagnoses one of them; `None` where they are not there.
fn diagnosed(name: &str, anyway: bool) -> Option<Result<Outcome, InputError>> {
    let Some(folder) = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from) else {
        eprintln!("skipped: RLG_RECORDINGS names no folder of recordings");
        return None;
    };
    let folder = folder.join("outside").join(name);
    if !folder.exists() {
        eprintln!("skipped: no {}", folder.display());
        return None;
    }
    let file = folder.join("model.toml");
    let model = Model::read(&file).unwrap_or_else(|error| panic!("{error}"));
    let recording = Recording::read(&folder).unwrap_or_else(|error| panic!("{error}"));
    let settings = Settings {
        anyway,
        ..Settings::default()
    };
    Some(diagnose_under(
        &settings,
        &recording,
        &model,
        &file,
        &|_| {},
    ))
}

fn refused(name: &str, words: &str) {
    match diagnosed(name, false) {
        None => {}
        Some(Ok(outcome)) => panic!("{name}: not refused: {:#?}", outcome.diagnosis.summary),
        Some(Err(error)) => assert!(error.to_string().contains(words), "{error}"),
    }
}

/// The diagnosis, handed to `judge`.
fn accepted(name: &str, anyway: bool, judge: impl Fn(&Diagnosis)) {
    match diagnosed(name, anyway) {
        None => {}
        Some(Err(error)) => panic!("{name}: {error}"),
        Some(Ok(outcome)) => judge(&outcome.diagnosis),
    }
}

fn count(diagnosis: &Diagnosis, kind: &str) -> usize {
    let effects = diagnosis.effects.iter();
    effects.filter(|effect| effect.kind == kind).count()
}

fn says(diagnosis: &Diagnosis, words: &str) -> bool {
    diagnosis.summary.iter().any(|line| line.contains(words))
}

/// No kind that predicts nothing: no fault of the data, no channel put right.
fn is_sound(diagnosis: &Diagnosis) {
    for kind in rlg::model::kinds::FAULT_KINDS {
        assert_eq!(
            count(diagnosis, kind),
            0,
            "{kind}: {:#?}",
            diagnosis.summary
        );
    }
}

#[test]
fn a_reversed_encoder_is_refused_and_put_right_anyway() {
    refused(
        "encoder-yaw-reversed",
        "gyro z reads -1.00 times the reference",
    );
    accepted("encoder-yaw-reversed", true, |diagnosis| {
        assert_eq!(count(diagnosis, "channel_sign"), 1);
        assert!(says(diagnosis, "yro z reads -1.00 times the reference"));
    });
}

#[test]
fn an_encoder_on_one_axis_is_sound() {
    accepted("encoder-yaw", false, is_sound);
    accepted("encoder-roll", false, is_sound);
}

#[test]
fn a_doubled_rate_is_refused_and_a_scale_error_anyway() {
    refused(
        "doubled-rate",
        "all three read 2.000 times the reference: counts or degrees?",
    );
    accepted("doubled-rate", true, |diagnosis| {
        assert!(count(diagnosis, "gyro_scale") >= 1);
        assert!(says(diagnosis, "All three read 2.000 times the reference"));
    });
}

#[test]
fn ordinary_errors_and_none_are_sound() {
    for name in [
        "null-10s",
        "null-slow",
        "null-refnoise-2",
        "scale-0.872",
        "one-tone",
        "delay-rate-0.032",
        "low-pass-rate",
    ] {
        accepted(name, false, is_sound);
    }
}

#[test]
fn readings_that_stand_for_seven_rows_are_read_once() {
    accepted("held-7-rows", false, |diagnosis| {
        assert_eq!(count(diagnosis, "held_values"), 3);
        assert!(says(
            diagnosis,
            "stands for 7 rows (mean age 3 rows, 15.0 ms)"
        ));
        for kind in [
            "stuck_channel",
            "gyro_scale",
            "reference_scale",
            "gyro_bandwidth",
            "reference_bandwidth",
        ] {
            assert_eq!(
                count(diagnosis, kind),
                0,
                "{kind}: {:#?}",
                diagnosis.summary
            );
        }
    });
}

#[test]
fn wrapped_and_saturated_rates_are_left_out_and_said() {
    accepted("wrapped-rate", false, |diagnosis| {
        assert!(count(diagnosis, "saturation") > 20);
        assert_eq!(count(diagnosis, "stuck_channel"), 0);
        for axis in ["x", "y", "z"] {
            assert!(says(diagnosis, &format!("rows of gyro_{axis}")));
        }
        assert!(says(diagnosis, "wrapped"));
    });
}

#[test]
fn spikes_at_rest_are_listed() {
    accepted("spikes-at-rest", false, |diagnosis| {
        assert_eq!(count(diagnosis, "spikes"), 25);
    });
}
