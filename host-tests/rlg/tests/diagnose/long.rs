//! A recording held in memory only in part: joint findings of stretches and blocks.

use super::support::names_nothing;
use rlg::diagnose::result::{Diagnosis, EffectEntry, ParameterEntry, Verdict};
use rlg::diagnose::{LongRecording, Settings};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::{Simulation, simulate};
use std::path::Path;

/// Makes the hour's scenario in two minutes: 1 kHz, a stronger vibration, a quicker warming.
fn shortened(effects: &str) -> String {
    let hour = include_str!("../../../scenarios/hour.toml");
    let (instrument, _) = hour.split_once("[[effect]]").expect("it conceals effects");
    let mut text = instrument.replace("rate_hz = 4000.0", "rate_hz = 1000.0");
    for (from, to) in [
        ("duration_s = 1200.0", "duration_s = 40.0"),
        ("duration_s = 600.0", "duration_s = 20.0"),
        ("duration_s = 300.0", "duration_s = 10.0"),
        ("300.0, 300.0, 300.0", "10.0, 10.0, 10.0"),
        ("ambient_period_s = 900.0", "ambient_period_s = 30.0"),
        ("[0.10, 0.08, 0.10]", "[0.30, 0.25, 0.30]"),
        ("[0.10, 0.10, 0.08]", "[0.30, 0.30, 0.25]"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    format!("{text}\n{effects}")
}

/// A third of its rows.
const MOST_ROWS: usize = 40_000;

const FLEXURE: &str = "[[effect]]\nkind = \"axis_flexure\"\nconcealed = true\n\
    xy = 6.9e-8\nxz = 7.1e-8\nyx = 7.5e-8\nyz = 7.3e-8\nzx = 6.7e-8\nzy = 7.6e-8\n";

const WARMTH: [f64; 3] = [4.0e-7, -3.0e-7, 2.0e-7];

fn warmth() -> String {
    let [x, y, z] = WARMTH;
    format!(
        "[[effect]]\nkind = \"gyro_bias_temperature\"\nconcealed = true\nx = {x}\ny = {y}\nz = {z}\n"
    )
}

fn simulated(effects: &str, seed: u64) -> Simulation {
    let text = shortened(effects);
    let scenario = Scenario::parse(&text, Path::new("hour.toml")).expect("a scenario");
    simulate(&scenario, seed, |_| {})
}

fn diagnosed(simulation: &Simulation) -> Diagnosis {
    let folder = tempfile::tempdir().expect("a temporary folder");
    simulation
        .recording
        .write_to(folder.path())
        .expect("a recording");
    let model = &simulation.model;
    let long = LongRecording::of(folder.path(), model, MOST_ROWS);
    let long = long
        .expect("it can be read")
        .expect("it is longer than that");
    let of = rlg::model::DeclaredModel::new(model, Path::new("model.toml"));
    let outcome = long.diagnose(&Settings::default(), of, &|_| {});
    let diagnosis = outcome.expect("a diagnosis").diagnosis;
    let whole = diagnosis.fit.whole.as_ref().expect("how it was looked at");
    let held_s: f64 = whole.stretches_s.iter().map(|[from, to]| to - from).sum();
    assert!(
        held_s * 1000.0 <= MOST_ROWS as f64,
        "{held_s} s at the full rate"
    );
    diagnosis
}

fn effect<'a>(diagnosis: &'a Diagnosis, kind: &str) -> &'a EffectEntry {
    let found = diagnosis.effects.iter().find(|one| one.kind == kind);
    found.unwrap_or_else(|| panic!("no {kind}: {:#?}", diagnosis.summary))
}

fn numbers(effect: &EffectEntry) -> Vec<f64> {
    let value = |parameter: &ParameterEntry| match parameter {
        ParameterEntry::Number { value, .. } => *value,
        ParameterEntry::Text { .. } => panic!("a number"),
    };
    effect.parameters.iter().map(value).collect()
}

/// Checks that they agree within three standard deviations.
fn agrees(what: &str, value: f64, std: f64, truth: f64) {
    assert!(
        (value - truth).abs() < 3.0 * std,
        "{what}: {value:e} ± {std:e}, put in {truth:e}"
    );
}

#[test]
fn slow_and_fast_effects_are_named_together_with_their_sizes() {
    let diagnosis = diagnosed(&simulated(&format!("{FLEXURE}{}", warmth()), 3));
    let kinds: Vec<&str> = diagnosis.effects.iter().map(|one| &*one.kind).collect();
    assert_eq!(
        kinds,
        ["gyro_bias_temperature", "axis_flexure"],
        "{:#?}",
        diagnosis.summary
    );
    assert_eq!(diagnosis.verdict, Verdict::Explained);
    let warm = effect(&diagnosis, "gyro_bias_temperature");
    for (axis, (value, truth)) in numbers(warm).into_iter().zip(WARMTH).enumerate() {
        agrees("K⁻¹", value, warm.covariance[axis][axis].sqrt(), truth);
    }
    let bent = effect(&diagnosis, "axis_flexure");
    let (k, c) = (numbers(bent), &bent.covariance);
    for (first, truth) in [(0, 14.0e-8), (2, 14.8e-8), (4, 14.3e-8)] {
        let variance = c[first][first] + c[first + 1][first + 1] + 2.0 * c[first][first + 1];
        agrees("s²", k[first] + k[first + 1], variance.sqrt(), truth);
    }
    let whole = diagnosis.fit.whole.as_ref().expect("how it was looked at");
    assert_eq!(whole.channels.len(), 3);
}

#[test]
fn a_recording_without_effects_that_warms_up_matches() {
    names_nothing(&diagnosed(&simulated("", 4)), "a recording that warms up");
}
