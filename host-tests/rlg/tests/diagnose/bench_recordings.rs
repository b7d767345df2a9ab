//! Recordings of a program independent of this project, from the folder of `RLG_RECORDINGS`. Their concealed values are in
//! `truth/`, read by this file only.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use firmware_tests::sensing_block::measure::attitude_error;
use firmware_tests::sensing_block::{Flexure, Motion, Recording as Played, Unit};
use nalgebra::{DMatrix, DVector};
use rlg::challenge::golden::{Header, Row, Table, compare};
use rlg::diagnose::result::{EffectEntry, ParameterEntry, Verdict};
use rlg::diagnose::{Outcome, Settings, diagnose, diagnose_under, diagnose_without};
use rlg::model::Model;
use rlg::recording::Recording;
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;

use super::support::{at_a_quarter, of_gyros};

/// 3σ in six dimensions: the squared Mahalanobis distance that contains 99.73 % of a six-dimensional normal.
const THREE_SIGMA_SIX: f64 = 20.06;

/// The tolerance of the sums, far outside their standard deviations of 1 to 6 %.
const SUMS_WITHIN: f64 = 0.1;

/// All entries of a block that lags its case: one with a distant resonance is the same physics.
const FLEXURES: [&str; 3] = ["axis_flexure", "axis_flexure_cubic", "axis_flexure_mode"];

fn recordings() -> Option<PathBuf> {
    let folder = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("skipped: RLG_RECORDINGS names no folder of recordings");
    }
    folder
}

/// Diagnosis of each with the model in its folder: tests of the same recording share it.
static SAID: [OnceLock<Outcome>; 3] = [const { OnceLock::new() }; 3];

const NAMES: [&str; 3] = ["bench-coning", "bench-null", "bench-shake"];

fn said(name: &str) -> Option<&'static Outcome> {
    let folder = recordings()?.join(name);
    let place = NAMES.iter().position(|known| *known == name);
    let said = &SAID[place.expect("one of them")];
    Some(said.get_or_init(|| {
        let model = Model::read(folder.join("model.toml")).expect("a model");
        run(&folder, &model)
    }))
}

fn run(folder: &Path, model: &Model) -> Outcome {
    let recording = Recording::read(folder).expect("a recording");
    let file = folder.join("model.toml");
    diagnose(&recording, model, &file, 0, &|_| {}).expect("a diagnosis")
}

/// Returns values, standard deviations and covariance of an effect's numbers.
fn numbers(effect: &EffectEntry) -> (Vec<String>, DVector<f64>, DMatrix<f64>) {
    let (names, values): (Vec<String>, Vec<f64>) = effect
        .parameters
        .iter()
        .filter_map(|parameter| match parameter {
            ParameterEntry::Number { name, value, .. } => Some((name.clone(), *value)),
            ParameterEntry::Text { .. } => None,
        })
        .unzip();
    let count = values.len();
    let covariance = DMatrix::from_fn(count, count, |a, b| effect.covariance[a][b]);
    (names, DVector::from_vec(values), covariance)
}

fn flexure_is_found(name: &str) {
    let Some(recordings) = recordings() else {
        return;
    };
    let Some(outcome) = said(name) else {
        return;
    };
    let diagnosis = &outcome.diagnosis;
    assert_eq!(
        diagnosis.verdict,
        Verdict::Explained,
        "{:#?}",
        diagnosis.summary
    );
    assert_eq!(diagnosis.effects.len(), 1, "{:#?}", diagnosis.summary);
    let effect = &diagnosis.effects[0];
    assert_eq!(effect.kind, "axis_flexure");

    let text =
        std::fs::read_to_string(recordings.join(format!("truth/{name}.json"))).expect("truth");
    let truth: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let (names, values, covariance) = numbers(effect);
    let concealed = DVector::from_iterator(
        6,
        names.iter().map(|name| {
            truth["effects"][0]["parameters"][name]
                .as_f64()
                .expect("a number")
        }),
    );
    let off = &values - &concealed;
    let distance = off.dot(&(covariance.try_inverse().expect("a proper covariance") * &off));
    assert!(distance < THREE_SIGMA_SIX, "squared distance {distance}");
    for gyro in 0..3 {
        let sum = |k: &DVector<f64>| k[2 * gyro] + k[2 * gyro + 1];
        let share = sum(&off).abs() / sum(&concealed);
        assert!(share < SUMS_WITHIN, "gyro {gyro}: sum off by {share}");
    }
    // For a gyro with only its sum identifiable the two are equal: an unequal pair drifts under vibration in phase.
    let of_pair = |gyro: usize| {
        let fixed = effect.identifiable.iter();
        fixed.filter(move |one| {
            one.combination
                .contains_key(rlg::model::catalogue::SIX[2 * gyro])
        })
    };
    for gyro in (0..3).filter(|gyro| of_pair(*gyro).count() == 1) {
        assert_eq!(
            of_pair(gyro).next().map(|one| one.combination.len()),
            Some(2)
        );
        let apart = values[2 * gyro] - values[2 * gyro + 1];
        assert!(apart.abs() < 1e-15, "gyro {gyro}: {apart} apart");
        let choice = outcome.model.effects[0].choice().unwrap_or_default();
        assert!(choice.contains("set to 0"), "{choice}");
    }
    let mut drifted = 0;
    for channel in &diagnosis.fit.channels {
        let (before, after) = (&channel.held_out_before, &channel.held_out_after);
        if channel.channel.starts_with("accel_") {
            // Its ± excludes the scatter of its drift, a few µg here: it must not grow.
            assert!(
                after.drift_rad_s.abs() <= before.drift_rad_s.abs() * 1.01,
                "{channel:#?}"
            );
            continue;
        }
        if before.drift_rad_s.abs() > 3.0 * before.drift_std_rad_s {
            drifted += 1;
            assert!(
                after.drift_rad_s.abs() < 3.0 * after.drift_std_rad_s,
                "{channel:#?}"
            );
        }
        assert!(
            (0.9..=1.1).contains(&after.normalised_power),
            "{channel:#?}"
        );
    }
    assert!(drifted > 0, "no held-out drift to remove");
}

/// Checks that the written model explains the recording.
fn the_found_model_matches(name: &str) {
    let (Some(recordings), Some(outcome)) = (recordings(), said(name)) else {
        return;
    };
    let again = run(&recordings.join(name), &outcome.model).diagnosis;
    assert_eq!(again.verdict, Verdict::Matches, "{:#?}", again.summary);
    assert!(again.effects.is_empty());
}

#[test]
fn flexure_concealed_under_coning_is_found_and_nothing_else() {
    flexure_is_found("bench-coning");
}

#[test]
fn flexure_concealed_under_vibration_is_found_and_nothing_else() {
    flexure_is_found("bench-shake");
}

#[test]
#[ignore = "half a minute: --test diagnose -- --ignored in_full"]
fn the_models_that_were_found_match_in_full() {
    the_found_model_matches("bench-coning");
    the_found_model_matches("bench-shake");
}

/// The diagnosed unit, vibrated in phase about all its axes: nothing rectifies, and the parameters of the written model must
/// preserve that, although it splits two K of a gyro evenly and the unit does not.
#[test]
fn the_written_model_adds_no_drift_to_its_unit_in_phase() {
    let (Some(recordings), Some(outcome)) = (recordings(), said("bench-coning")) else {
        return;
    };
    let truth = std::fs::read_to_string(recordings.join("truth/bench-coning.json"));
    let truth: serde_json::Value = serde_json::from_str(&truth.expect("the truth")).expect("JSON");
    let k = &truth["effects"][0]["parameters"];
    let k_s2 = ["xy", "xz", "yx", "yz", "zx", "zy"].map(|pair| k[pair].as_f64().expect("a K"));
    let modes_hz = k_s2.map(|k: f64| 1.0 / (std::f64::consts::TAU * k.sqrt()));
    let unit =
        Unit::fine().with(|unit| unit.flexure = Flexure::rigid(k_s2).ringing(modes_hz, 0.005));
    let stiff = unit.with(|unit| unit.flexure = Flexure::default());
    let of_unit = rlg::parameters::Unit::at(4000.0);
    let found = rlg::parameters::unchecked_parameters(&outcome.model, &of_unit);
    let (found, _) = found.expect("parameters");
    let nothing = unit.chain_parameters(&Flexure::default());
    let known = nothing.with(|p| {
        p.flexure_s2 = found.flexure_s2;
        p.flexure_response = found.flexure_response;
    });
    for frequency_hz in [100.061_8, 200.123_6] {
        let motion = Motion::in_phase(frequency_hz, [0.6, 0.6, -0.6]);
        let played = Played::new(&motion, &[unit, stiff], 4000.0, 20_000);
        let drift = |parameters: &trueaxis::Parameters, of| {
            let f32 = attitude_error::<trueaxis::F32>(parameters, &played, of);
            let fixed = attitude_error::<trueaxis::Fixed>(parameters, &played, of);
            [f32, fixed].map(|error| error.drift(1.0, motion.period_s()))
        };
        let [of_stiff, before, after] = [drift(&nothing, 1), drift(&nothing, 0), drift(&known, 0)];
        for (core, (of_stiff, (before, after))) in ["f32", "fixed"]
            .into_iter()
            .zip(of_stiff.iter().zip(before.iter().zip(&after)))
        {
            let [before, after] = [before, after].map(|drift| drift.less(of_stiff).largest_deg_h());
            println!(
                "{frequency_hz} Hz, {core}: {before:.6e} °/h without, {after:.6e} with the written model"
            );
            assert!(after < before + 1e-5, "{core}: {after} °/h");
        }
    }
}

#[test]
fn a_recording_with_nothing_concealed_matches() {
    let Some(outcome) = said("bench-null") else {
        return;
    };
    let diagnosis = &outcome.diagnosis;
    assert_eq!(
        diagnosis.verdict,
        Verdict::Matches,
        "{:#?}",
        diagnosis.summary
    );
    assert!(diagnosis.effects.is_empty() && diagnosis.locations.is_empty());
}

/// To the last bit of each diagnosis.
#[test]
fn their_rows_are_those_of_the_reviewed_golden_table() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../challenge/golden.tsv");
    let text = std::fs::read_to_string(&file).expect("the reviewed table");
    let reviewed = Table::parse(&text, &file).unwrap_or_else(|error| panic!("{error}"));
    let mut rows = Vec::new();
    for name in NAMES {
        let Some(outcome) = said(name) else {
            return;
        };
        let row = Row::of_recording(name, Ok(&outcome.diagnosis));
        rows.push(row.unwrap_or_else(|error| panic!("{error}")));
    }
    let header = Header::here(reviewed.header.seed, reviewed.header.trials);
    let comparison = compare(&reviewed, &Table::new(header, rows));
    assert!(comparison.is_equal(), "{}", comparison.lines().join("\n"));
    assert_eq!(comparison.compared, NAMES.len());
}

/// On the demo's own cones, at a quarter of their rows and half their time.
#[test]
fn without_flexure_in_the_catalogue_no_wrong_name_is_confident() {
    let text = of_gyros(&at_a_quarter(include_str!(
        "../../../scenarios/coning.toml"
    )));
    let text = text.replace("duration_s = 17.0", "duration_s = 8.0");
    let scenario = Scenario::parse(&text, Path::new("coning.toml")).expect("a scenario");
    let simulation = simulate(&scenario, 3, |_| {});
    no_wrong_name_without_flexure(&simulation.recording, &simulation.model);
}

#[test]
#[ignore = "two recordings: --test diagnose -- --ignored in_full"]
fn without_flexure_in_the_catalogue_no_wrong_name_of_the_bench_is_confident_in_full() {
    for name in ["bench-coning", "bench-shake"] {
        let Some(recordings) = recordings() else {
            return;
        };
        let folder = recordings.join(name);
        let model = Model::read(folder.join("model.toml")).expect("a model");
        let recording = Recording::read(&folder).expect("a recording");
        no_wrong_name_without_flexure(&recording, &model);
    }
}

/// The scanned kinds leave the catalogue with the listed ones: without flexure a resonant one is out as well.
#[test]
#[ignore = "two recordings: --test diagnose -- --ignored in_full"]
fn nothing_that_is_taken_out_of_the_catalogue_is_named_in_full() {
    let Some(recordings) = recordings() else {
        return;
    };
    let folder = recordings.join("bench-coning");
    let file = folder.join("model.toml");
    let model = Model::read(&file).expect("a model");
    let recording = Recording::read(&folder).expect("a recording");
    let settings = Settings {
        left_out: &FLEXURES,
        ..Settings::default()
    };
    let outcome = diagnose_under(&settings, &recording, &model, &file, &|_| {});
    let diagnosis = outcome.expect("a diagnosis").diagnosis;
    for effect in &diagnosis.effects {
        let is_out = |kind: &String| FLEXURES.contains(&kind.as_str());
        assert!(!is_out(&effect.kind), "{:#?}", diagnosis.summary);
        assert!(
            !effect.indistinguishable_from.iter().any(is_out),
            "{:#?}",
            diagnosis.summary
        );
    }
    assert_ne!(diagnosis.verdict, Verdict::Matches);
}

fn no_wrong_name_without_flexure(recording: &Recording, model: &Model) {
    let file = Path::new("model.toml");
    let outcome = diagnose_without(&FLEXURES, recording, model, file, 0, &|_| {});
    let diagnosis = outcome.expect("a diagnosis").diagnosis;
    let name = &diagnosis.recording;
    for effect in &diagnosis.effects {
        let is_open = effect.kind == "unlisted" || effect.may_be_unlisted();
        assert!(is_open, "{name}: {:#?}", diagnosis.summary);
    }
    assert!(
        !diagnosis.effects.is_empty(),
        "{name}: the drift went unnoticed"
    );
}
