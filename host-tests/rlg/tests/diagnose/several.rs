//! Several recordings of one instrument, explained together: made by this workspace's simulator.

use super::support::{concealed, holds, in_less_time, number, of_gyros};
use rlg::diagnose::result::{Diagnosis, EffectEntry, ParameterEntry, Verdict};
use rlg::diagnose::streams::Streams;
use rlg::diagnose::{Outcome, Settings, diagnose_streams, diagnose_together};
use rlg::error::InputError;
use rlg::model::{DeclaredModel, EffectValue, Model, ModelEffect};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;
use rlg_plan::AlignPlan;
use std::path::Path;

const STILL_SLEWS_AND_VIBRATION: &str = include_str!("../../../scenarios/null.toml");

/// Makes a recording of gyros of that name with an effect concealed, of a quarter of the rows: several recordings cost
/// several times one.
fn made(name: &str, seed: u64, effect: &str) -> (Streams, Model) {
    made_at(1000, name, seed, effect)
}

fn made_at(rate_hz: u32, name: &str, seed: u64, effect: &str) -> (Streams, Model) {
    let scene = of_gyros(STILL_SLEWS_AND_VIBRATION);
    simulated(&scene, rate_hz, name, seed, effect)
}

/// Does the same in less time.
fn quick(name: &str, seed: u64, effect: &str) -> (Streams, Model) {
    let scene = of_gyros(&in_less_time(STILL_SLEWS_AND_VIBRATION));
    simulated(&scene, 1000, name, seed, effect)
}

/// Makes a quick recording of fine increments without a dither, for effects that need none.
fn undithered(rate_hz: u32, name: &str, seed: u64, effect: &str) -> (Streams, Model) {
    let scene = of_gyros(&in_less_time(STILL_SLEWS_AND_VIBRATION));
    let (gyro, rest) = scene.split_once("[dither]").expect("it has a dither");
    let (_, rest) = rest.split_once("[reference]").expect("it has a reference");
    let fine = gyro.replace(
        "[2.1e-6, 1.9e-6, 2.0e-6]",
        "[1e-9, 1e-9, 1e-9]\noutput = \"increment\"",
    );
    assert_ne!(fine, gyro);
    let scene = format!("{fine}[reference]{rest}");
    simulated(&scene, rate_hz, name, seed, effect)
}

fn simulated(scene: &str, rate_hz: u32, name: &str, seed: u64, effect: &str) -> (Streams, Model) {
    let rate = format!("\nrate_hz = {rate_hz}.0\n");
    let at_rate = scene.replace("\nrate_hz = 4000.0\n", &rate);
    assert_ne!(at_rate, scene);
    let text = format!("{at_rate}\n{effect}");
    let scenario = Scenario::parse(&text, Path::new("null.toml")).expect("a scenario");
    let mut simulation = simulate(&scenario, seed, |_| {});
    simulation.recording.name = name.to_string();
    let streams = Streams::align(
        &simulation.recording,
        &simulation.model,
        &AlignPlan::default(),
    )
    .expect("it aligns");
    (streams, simulation.model)
}

fn together(recordings: Vec<(Streams, Model)>) -> Diagnosis {
    // The instrument is the same: so is the model.
    let model = recordings[0].1.clone();
    let streams = recordings.into_iter().map(|(streams, _)| streams).collect();
    diagnosed(streams, &model).expect("a diagnosis").diagnosis
}

fn diagnosed(streams: Vec<Streams>, model: &Model) -> Result<Outcome, InputError> {
    let of = DeclaredModel::new(model, Path::new("model.toml"));
    let aligned = streams.into_iter().map(Into::into).collect();
    diagnose_together(&Settings::default(), aligned, of, &|_| {})
}

/// One recording on the same engine.
fn alone((streams, model): (Streams, Model)) -> Diagnosis {
    let settings = Settings::default();
    let of = DeclaredModel::new(&model, Path::new("model.toml"));
    let outcome = diagnose_streams(&settings, streams, of, &|_| {});
    outcome.expect("a diagnosis").diagnosis
}

fn scale(size: f64) -> String {
    concealed("gyro_scale", &[("x", size)])
}

#[test]
fn what_one_recording_shows_predicts_the_one_that_is_held_out() {
    let mut friday = quick("friday", 72, &scale(1e-3));
    friday.0.piece.held_out = true;
    let found = together(vec![quick("monday", 71, &scale(1e-3)), friday]);
    let [effect] = found.effects.as_slice() else {
        panic!("{:#?}", found.summary);
    };
    assert_eq!(effect.kind, "gyro_scale");
    assert_eq!(effect.text("recording"), None);
    let friday = &found.fit.recordings[1];
    let is_noise = |power: &Option<f64>| power.is_some_and(|power| (power - 1.0).abs() < 0.1);
    assert!(friday.normalised_power.iter().all(is_noise), "{friday:?}");
}

#[test]
#[ignore = "a minute: --test diagnose -- --ignored in_full"]
fn three_recordings_find_together_what_none_finds_alone_in_full() {
    let made = |name, seed, effect: &str| made_at(2000, name, seed, effect);
    let large = alone(made("large", 1, &scale(1e-3)));
    let [effect] = large.effects.as_slice() else {
        panic!("{:#?}", large.summary);
    };
    let (_, std) = number(effect, "x");
    /// SNR of each: among 30 kinds a name requires some 5. Three together have 6.1.
    const SNR_EACH: f64 = 3.5;
    let size = SNR_EACH * std;
    let names = ["monday", "tuesday", "wednesday"];
    for (name, seed) in names.iter().zip(61..) {
        let alone = alone(made(name, seed, &scale(size)));
        assert!(alone.effects.is_empty(), "{name}: {:#?}", alone.summary);
    }
    let mut all: Vec<_> = names
        .iter()
        .zip(61..)
        .map(|(name, seed)| made(name, seed, &scale(size)))
        .collect();
    let mut friday = made("friday", 64, &scale(size));
    friday.0.piece.held_out = true;
    all.push(friday);
    let found = together(all);
    assert_eq!(found.verdict, Verdict::Explained, "{:#?}", found.summary);
    assert_eq!(found.recording, "monday + tuesday + wednesday + friday");
    let [effect] = found.effects.as_slice() else {
        panic!("{:#?}", found.summary);
    };
    assert_eq!(effect.text("recording"), None);
    // At this strength the dither does not yet distinguish the gyro's scale error from minus that of the reference.
    let mut names = std::iter::once(&effect.kind).chain(&effect.indistinguishable_from);
    assert!(
        names.any(|kind| kind == "gyro_scale"),
        "{:#?}",
        found.summary
    );
    let ParameterEntry::Number { value, std, .. } = &effect.parameters[0] else {
        panic!("a number");
    };
    assert!(
        (value.abs() - size).abs() < 4.0 * std,
        "{value:e} ± {std:e}, {size:e}"
    );
    // Not used in the selection.
    let friday = &found.fit.recordings[3];
    assert!(friday.held_out_whole && friday.fitted_on.is_empty());
    assert!(!found.fit.recordings[0].fitted_on.is_empty());
    let is_noise = |power: &Option<f64>| power.is_some_and(|power| (power - 1.0).abs() < 0.1);
    assert!(friday.normalised_power.iter().all(is_noise), "{friday:?}");
}

#[test]
fn an_effect_that_is_not_the_same_in_each_recording_keeps_no_name_in_common() {
    let tilt = |size: f64| concealed("installation", &[("xy", size)]);
    let found = together(vec![
        made("cold", 31, &tilt(10e-6)),
        made("warm", 32, &tilt(50e-6)),
    ]);
    let summary = &found.summary;
    // If force_z is g all along its products are tilts, too: a class that contains the tilt is right.
    let is_tilt = |effect: &EffectEntry| {
        let alike = &effect.indistinguishable_from;
        effect.kind == "installation" || alike.iter().any(|kind| kind == "installation")
    };
    assert!(found.effects.iter().all(is_tilt), "{summary:#?}");
    let effects = found.effects.iter();
    let own: Vec<Option<&str>> = effects.map(|effect| effect.text("recording")).collect();
    assert_eq!(own, [Some("cold"), Some("warm")], "{summary:#?}");
    assert_eq!(found.verdict, Verdict::Explained, "{summary:#?}");
}

#[test]
#[ignore = "half a minute: --test diagnose -- --ignored in_full"]
fn an_effect_of_one_recording_is_found_in_that_one_alone_in_full() {
    let bias = concealed("gyro_bias", &[("y", 3e-6)]);
    let found = together(vec![
        made("before", 71, &scale(4e-6)),
        made("after", 72, &[scale(4e-6).as_str(), &bias].concat()),
        made("later", 73, &scale(4e-6)),
    ]);
    let Diagnosis {
        summary, effects, ..
    } = &found;
    let each: Vec<(&str, Option<&str>)> = effects
        .iter()
        .map(|effect| (&*effect.kind, effect.text("recording")))
        .collect();
    assert_eq!(
        each,
        [("gyro_scale", None), ("gyro_bias", Some("after"))],
        "{summary:#?}"
    );
    holds(&effects[0], &[("x", 4e-6)]);
    holds(&effects[1], &[("y", 3e-6)]);
    assert_eq!(found.verdict, Verdict::Explained, "{summary:#?}");
}

#[test]
fn a_step_is_told_on_its_own_recordings_clock() {
    step_on_its_own_clock();
}

#[test]
#[ignore = "twice as long: --test diagnose -- --ignored in_full"]
fn a_step_on_its_own_recordings_clock_leaves_nothing_in_full() {
    let model = step_on_its_own_clock();
    let again = vec![
        undithered(250, "first", 41, "").0,
        undithered(250, "second", 42, STEP).0,
    ];
    let again = diagnosed(again, &model).expect("a diagnosis").diagnosis;
    assert_eq!(again.verdict, Verdict::Matches, "{:#?}", again.summary);
}

const STEP: &str = "[[effect]]\nkind = \"gyro_bias_step\"\nconcealed = true\naxis = \"y\"\ntime_s = 20.0\n\
    size = 3e-6\n";

/// Returns the model with the step of the second of two recordings.
fn step_on_its_own_clock() -> Model {
    let first = undithered(250, "first", 41, "");
    let second = undithered(250, "second", 42, STEP);
    let model = first.1.clone();
    let streams = vec![first.0, second.0];
    let outcome = diagnosed(streams, &model).expect("a diagnosis");
    let summary = &outcome.diagnosis.summary;
    let [effect] = outcome.model.effects.as_slice() else {
        panic!("{summary:#?}");
    };
    assert_eq!(effect.kind, "gyro_bias_step", "{summary:#?}");
    assert_eq!(effect.text("recording"), Some("second"));
    // 3e-6 rad/s against 6e-7 rad/√s: a second's random walk is 0.2 of its size.
    assert!((effect.number("time_s") - 20.0).abs() < 2.0, "{effect:?}");
    outcome.model
}

#[test]
fn a_step_before_a_recording_began_is_in_it_all_along() {
    let bias = concealed("gyro_bias", &[("y", 5e-6)]);
    let early = undithered(250, "early", 43, &bias);
    let late = undithered(250, "late", 44, &bias);
    let mut model = late.1.clone();
    let parameters = [
        ("axis", EffectValue::Text("y".to_string())),
        ("time_s", EffectValue::Number(-5.0)),
        ("size", EffectValue::Number(5e-6)),
    ];
    let named = |(name, value): (&str, EffectValue)| (name.to_string(), value);
    model.effects.push(ModelEffect {
        kind: "gyro_bias_step".to_string(),
        parameters: parameters.map(named).into(),
    });
    let found = diagnosed(vec![early.0, late.0], &model).expect("a diagnosis");
    let found = found.diagnosis;
    assert_eq!(found.verdict, Verdict::Matches, "{:#?}", found.summary);
}

#[test]
fn recordings_of_one_name_are_refused_and_rows_of_other_rates_are_not() {
    let (first, model) = undithered(250, "first", 1, "");
    let second = undithered(250, "first", 2, "").0;
    let same = diagnosed(vec![first, second], &model).err();
    let same = same.expect("an error").to_string();
    assert!(same.contains("the name of another recording"), "{same}");
    let size = 2e-5;
    let tilt = concealed("installation", &[("xy", size)]);
    let recordings = vec![
        undithered(250, "fast", 3, &tilt),
        undithered(500, "faster", 4, &tilt),
    ];
    let found = together(recordings);
    let [effect] = found.effects.as_slice() else {
        panic!("{:#?}", found.summary);
    };
    assert_eq!(effect.kind, "installation", "{:#?}", found.summary);
    holds(effect, &[("xy", size)]);
}
