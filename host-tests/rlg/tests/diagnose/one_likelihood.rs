//! The engine of one likelihood: inputs on which its findings may depend.

use rlg_plan::{AlignPlan, Plan};
use std::path::Path;

use super::support::{
    at_a_quarter, concealed, findings, holds, in_less_time, kinds, names_nothing, of_gyros,
};
use rlg::diagnose::result::Verdict;
use rlg::diagnose::streams::Streams;
use rlg::diagnose::{Settings, diagnose_under};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;
use rlg_diagnosis::diagnose;
use rlg_diagnosis::report::entries_of_findings::DRIFT;
use rlg_diagnosis::rows::data::Data;
use rlg_signal::partition::Use;

const STILL_SLEWS_AND_VIBRATION: &str = include_str!("../../../scenarios/null.toml");
const TABLE: &str = include_str!("table_programme.toml");

/// Gyro values in rows used only for the report's figures are replaced by garbage: no finding may change.
#[test]
fn findings_do_not_depend_on_the_rows_that_test_them() {
    let effect = concealed("gyro_scale", &[("x", 2e-5), ("y", -3e-5), ("z", 2e-5)]);
    let scenario = of_gyros(&in_less_time(&at_a_quarter(STILL_SLEWS_AND_VIBRATION)));
    the_same_with_other_test_rows(&format!("{scenario}{effect}"), &["gyro_scale"]);
}

/// The weight of coarse pulses is determined from values of the rows in use.
#[test]
fn pulses_are_not_read_off_the_rows_that_test() {
    let effect = concealed(
        "pulse_quantisation",
        &[("x", 1.2e-6), ("y", 1.7e-6), ("z", 1.4e-6)],
    );
    the_same_with_other_test_rows(&turns(&effect), &["pulse_quantisation"]);
}

/// Makes rotations through zero rate of a unit without a dither, with an effect.
fn turns(effect: &str) -> String {
    let instrument = TABLE.split("[accelerometer]").next().expect("it has one");
    let motion = "[[motion]]\nkind = \"tumble\"\nrate_rad_s = [0.05, 0.04, 0.06]\nduration_s = 60.0\n\
                  frequency_hz = [0.11, 0.17, 0.13]\nphase_rad = [0.0, 1.0, 2.0]\nramp_s = 1.0\n";
    format!("{instrument}{motion}{effect}")
}

/// Increments rounded one by one are multiples of one number as well, but their errors accumulate: they are no pulses.
#[test]
fn rounded_increments_are_no_pulses() {
    const ROUNDED_RAD: f64 = 2e-6;
    let scenario = Scenario::parse(&turns(""), Path::new("turns.toml")).expect("a scenario");
    let simulation = simulate(&scenario, 5, |_| {});
    let model = &simulation.model;
    let mut streams =
        Streams::align(&simulation.recording, model, &AlignPlan::default()).expect("channels");
    for value in streams.sensed_rad.iter_mut().flatten() {
        *value = (*value / ROUNDED_RAD).round() * ROUNDED_RAD;
    }
    let file = Path::new("model.toml");
    let settings = rlg_diagnosis::Settings::default();
    let outcome = diagnose(
        &settings,
        &mut streams,
        &[],
        rlg::model::DeclaredModel::new(model, file),
        &|_| {},
    );
    let diagnosis = outcome.expect("a model, and rows enough").diagnosis;
    assert_ne!(diagnosis.verdict, Verdict::Matches);
    for named in ["pulse_quantisation", "counter_slip", "lock_in"] {
        assert!(
            !kinds(&diagnosis).contains(&named),
            "{:#?}",
            diagnosis.summary
        );
    }
}

/// Compares the findings of a scenario with those for garbage in the test rows.
fn the_same_with_other_test_rows(text: &str, expected: &[&str]) {
    let scenario = Scenario::parse(text, Path::new("scenario.toml")).expect("a scenario");
    let simulation = simulate(&scenario, 5, |_| {});
    let file = Path::new("model.toml");
    let model = &simulation.model;
    let mut whole =
        Streams::align(&simulation.recording, model, &AlignPlan::default()).expect("channels");
    let mut poisoned =
        Streams::align(&simulation.recording, model, &AlignPlan::default()).expect("channels");
    let plan = Plan::default();
    let partition = Data::new(&mut whole, model, &plan, file)
        .expect("data")
        .partition;
    // Inputs not needed once the residual exists are dropped.
    let mut whole =
        Streams::align(&simulation.recording, model, &AlignPlan::default()).expect("channels");
    let mut replaced = 0;
    for (row, of) in partition.uses.iter().enumerate() {
        if *of == Use::Test {
            replaced += 1;
            for (axis, sensed_rad) in poisoned.sensed_rad.iter_mut().enumerate() {
                sensed_rad[row] = 1e-3 * ((row * (axis + 7)) as f64).sin();
            }
        }
    }
    assert!(
        replaced > whole.rows / 10,
        "{replaced} of {} rows",
        whole.rows
    );
    let [clean, garbage] = [&mut whole, &mut poisoned].map(|streams| {
        diagnose(
            &rlg_diagnosis::Settings::default(),
            streams,
            &[],
            rlg::model::DeclaredModel::new(model, file),
            &|_| {},
        )
        .expect("a model that can be used, and rows enough")
    });
    assert_eq!(
        kinds(&clean.diagnosis),
        expected,
        "{:#?}",
        clean.diagnosis.summary
    );
    assert_eq!(findings(&clean), findings(&garbage));
    let power = |outcome: &rlg::diagnose::Outcome| {
        outcome.diagnosis.fit.channels[0]
            .held_out_after
            .normalised_power_all
    };
    assert!(
        power(&garbage) > 10.0 * power(&clean),
        "the report's figures show it"
    );
}

/// A constant of some eight standard deviations is also explained by a weak random walk. A model that declares the drift
/// decides between the two.
#[test]
#[ignore = "half a minute: --test diagnose -- --ignored in_full"]
fn a_declared_drift_takes_drift_out_of_the_class_of_a_bias_in_full() {
    const BIAS_RAD_S: f64 = 8e-7;
    let effect = concealed("gyro_bias", &[("x", BIAS_RAD_S)]);
    let text = format!("{}{effect}", at_a_quarter(STILL_SLEWS_AND_VIBRATION));
    let scenario = Scenario::parse(&text, Path::new("null.toml")).expect("a scenario");
    let simulation = simulate(&scenario, 5, |_| {});
    let diagnosed = |walk_rad_s_sqrt_s: Option<[f64; 3]>| {
        let mut model = simulation.model.clone();
        model.gyro.rate_random_walk_rad_s_sqrt_s = walk_rad_s_sqrt_s;
        let file = Path::new("model.toml");
        let of = &simulation.recording;
        let outcome = diagnose_under(&Settings::default(), of, &model, file, &|_| {});
        let outcome = outcome.expect("a diagnosis");
        assert_eq!(
            outcome.model.gyro.rate_random_walk_rad_s_sqrt_s, walk_rad_s_sqrt_s,
            "the updated model declares what the given one does"
        );
        outcome.diagnosis
    };
    let unknown = diagnosed(None);
    let none = diagnosed(Some([0.0; 3]));
    for diagnosis in [&unknown, &none] {
        assert_eq!(kinds(diagnosis), ["gyro_bias"], "{:#?}", diagnosis.summary);
        holds(&diagnosis.effects[0], &[("x", BIAS_RAD_S)]);
    }
    // Other kinds not distinguishable from a bias in this motion, a step near the start among them, are not considered.
    let [mut or_drift, or_none] =
        [&unknown, &none].map(|one| one.effects[0].indistinguishable_from.clone());
    assert_eq!(or_drift.pop().as_deref(), Some(DRIFT));
    assert_eq!(or_none, or_drift);
    let [before, after] = [&unknown, &none].map(|one| one.effects[0].log_evidence_gain);
    assert!(after > before + 5.0, "{after} from {before}");
    assert!(!none.effects[0].what_was_left_out.contains("drift"));
    // With a walk declared on that gyro, the constant is the walk's.
    let walking = diagnosed(Some([1e-8, 0.0, 0.0]));
    names_nothing(&walking, "a declared random walk");
}

/// A dither turns lock-in into a random walk of angle, N = Ω_L/√(S Ω_D): the finding keeps both names, and reports the
/// thresholds with the same effect.
#[test]
#[ignore = "half a minute: --test diagnose -- --ignored in_full"]
fn lock_in_of_dithered_gyros_is_a_random_walk_whose_thresholds_are_said_in_full() {
    const THRESHOLD_RAD_S: f64 = 4e-3;
    let thresholds = ["x", "y", "z"].map(|axis| (axis, THRESHOLD_RAD_S));
    let effect = concealed("lock_in", &thresholds);
    let text = format!("{STILL_SLEWS_AND_VIBRATION}{effect}");
    let scenario = Scenario::parse(&text, Path::new("null.toml")).expect("a scenario");
    let simulation = simulate(&scenario, 5, |_| {});
    let (of, model) = (&simulation.recording, &simulation.model);
    let file = Path::new("model.toml");
    let outcome = diagnose_under(&Settings::default(), of, model, file, &|_| {});
    let diagnosis = outcome.expect("a diagnosis").diagnosis;
    assert_eq!(
        kinds(&diagnosis),
        ["angle_random_walk"],
        "{:#?}",
        diagnosis.summary
    );
    let found = &diagnosis.effects[0];
    assert_eq!(found.indistinguishable_from, ["lock_in"]);
    let said = &found.what_was_left_out;
    let (_, thresholds) = said
        .split_once("makes the thresholds")
        .expect("they are said");
    for axis in ["x", "y", "z"] {
        let (_, after) = thresholds.split_once(axis).expect("each gyro");
        let number = after.trim_start().split(' ').next().expect("a number");
        let said_deg_h: f64 = number.parse().expect("a number");
        let ratio = said_deg_h / (THRESHOLD_RAD_S.to_degrees() * 3600.0);
        assert!((ratio - 1.0).abs() < 0.15, "{said}");
    }
}
