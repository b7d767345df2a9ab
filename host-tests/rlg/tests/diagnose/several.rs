//! Several recordings of one instrument, explained together: made by this workspace's simulator.

use super::support::holds;
use rlg::diagnose::apart::look_at_each;
use rlg::diagnose::residual::residual_rad;
use rlg::diagnose::result::{Diagnosis, ParameterEntry, Verdict};
use rlg::diagnose::scene::Scene;
use rlg::diagnose::streams::Streams;
use rlg::diagnose::{Outcome, diagnose_aligned};
use rlg::error::InputError;
use rlg::model::{EffectValue, Model, ModelEffect};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;
use std::path::Path;

const STILL_SLEWS_AND_VIBRATION: &str = include_str!("../../../scenarios/null.toml");

/// A recording of that name with an effect concealed, of a quarter of the rows: a family of recordings is the work of one,
/// several times.
fn made(name: &str, seed: u64, effect: &str) -> (Streams, Model) {
    made_at(1000, name, seed, effect)
}

fn made_at(rate_hz: u32, name: &str, seed: u64, effect: &str) -> (Streams, Model) {
    let rate = format!("\nrate_hz = {rate_hz}.0\n");
    let scene = STILL_SLEWS_AND_VIBRATION.replace("\nrate_hz = 4000.0\n", &rate);
    assert_ne!(scene, STILL_SLEWS_AND_VIBRATION);
    let text = format!("{scene}\n{effect}");
    let scenario = Scenario::parse(&text, Path::new("null.toml")).expect("a scenario");
    let mut simulation = simulate(&scenario, seed, |_| {});
    simulation.recording.name = name.to_string();
    let streams = Streams::align(&simulation.recording, &simulation.model).expect("it aligns");
    (streams, simulation.model)
}

fn together(recordings: Vec<(Streams, Model)>) -> Diagnosis {
    // The instrument is the same: so is the model.
    let model = recordings[0].1.clone();
    let streams = recordings.into_iter().map(|(streams, _)| streams).collect();
    diagnosed(streams, &model).expect("a diagnosis").diagnosis
}

fn diagnosed(streams: Vec<Streams>, model: &Model) -> Result<Outcome, InputError> {
    let file = Path::new("model.toml");
    diagnose_aligned(&[], streams, None, model, file, 0, &|_| {})
}

fn scale(size: f64) -> String {
    format!("[[effect]]\nkind = \"gyro_scale\"\nconcealed = true\nx = {size:e}\n")
}

#[test]
fn three_recordings_find_together_what_none_finds_alone() {
    let made = |name, seed, effect: &str| made_at(2000, name, seed, effect);
    // Its strength in one recording, from what an empty one says of itself.
    let empty = together(vec![made("empty", 1, "")]);
    assert_eq!(empty.verdict, Verdict::Matches, "{:#?}", empty.summary);
    let reach = empty
        .sensitivity
        .iter()
        .find(|one| one.kind == "gyro_scale");
    let reach = reach.expect("scale can be seen");
    /// In the fitted rows of each: three together have 6.9, which is found 97 times in a hundred. Of single recordings
    /// about one in ten shows it by luck at this strength; these three do not.
    const SNR_EACH: f64 = 4.0;
    let size = SNR_EACH / reach.snr * reach.typical;
    let names = ["monday", "tuesday", "wednesday"];
    for (name, seed) in names.iter().zip(61..) {
        let alone = together(vec![made(name, seed, &scale(size))]);
        assert!(alone.effects.is_empty(), "{name}: {:#?}", alone.summary);
    }
    let mut all: Vec<_> = names
        .iter()
        .zip(61..)
        .map(|(name, seed)| made(name, seed, &scale(size)))
        .collect();
    let mut friday = made("friday", 64, &scale(size));
    friday.0.pieces[0].held_out = true;
    all.push(friday);
    let found = together(all);
    assert_eq!(found.verdict, Verdict::Explained, "{:#?}", found.summary);
    assert_eq!(found.recording, "monday + tuesday + wednesday + friday");
    let [effect] = found.effects.as_slice() else {
        panic!("{:#?}", found.summary);
    };
    // At this strength the dither does not yet tell whose scale it is: the gyro's, or minus that of the reference.
    let names = std::iter::once(&effect.kind).chain(&effect.indistinguishable_from);
    assert!(
        names.clone().any(|kind| kind == "gyro_scale"),
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
    // Selection never saw it.
    let friday = &found.fit.recordings[3];
    assert!(friday.held_out_whole && friday.fitted_on.is_empty());
    assert!(!found.fit.recordings[0].fitted_on.is_empty());
}

#[test]
fn an_effect_that_is_not_the_same_in_each_recording_keeps_no_name() {
    let tilt = |size: f64| {
        format!("[[effect]]\nkind = \"installation\"\nconcealed = true\nxy = {size:e}\n")
    };
    let found = together(vec![
        made("cold", 31, &tilt(5e-6)),
        made("warm", 32, &tilt(25e-6)),
    ]);
    let summary = &found.summary;
    assert!(
        found
            .effects
            .iter()
            .all(|effect| effect.kind != "installation"),
        "{summary:#?}"
    );
    let is_plain = [Verdict::Matches, Verdict::Explained].contains(&found.verdict);
    assert!(!is_plain, "{summary:#?}");
}

#[test]
fn an_effect_of_one_recording_is_found_in_that_one_alone() {
    let bias = "[[effect]]\nkind = \"gyro_bias\"\nconcealed = true\ny = 3e-6\n";
    let recording = |place: usize| match place {
        0 => made("before", 71, &scale(4e-6)),
        1 => made("after", 72, &[scale(4e-6).as_str(), bias].concat()),
        _ => made("later", 73, &scale(4e-6)),
    };
    let model = recording(0).1;
    let all = (0..3).map(|place| recording(place).0).collect();
    let mut outcome = diagnosed(all, &model).expect("a diagnosis");
    let read = |place: usize| Ok(recording(place).0);
    let of = (&model, Path::new("model.toml"));
    look_at_each(&mut outcome, (3, &read), of, 0, &|_| {}).expect("a diagnosis of each");
    let Diagnosis {
        summary, effects, ..
    } = &outcome.diagnosis;
    let found: Vec<(&str, Option<&str>)> = effects
        .iter()
        .map(|effect| (&*effect.kind, effect.text("recording")))
        .collect();
    assert_eq!(
        found,
        [("gyro_scale", None), ("gyro_bias", Some("after"))],
        "{summary:#?}"
    );
    holds(&effects[0], &[("x", 4e-6)]);
    holds(&effects[1], &[("y", 3e-6)]);
    assert_eq!(
        outcome.diagnosis.verdict,
        Verdict::Explained,
        "{summary:#?}"
    );
}

#[test]
fn a_step_is_told_on_its_own_recordings_clock() {
    let step = "[[effect]]\nkind = \"gyro_bias_step\"\nconcealed = true\naxis = \"y\"\ntime_s = 31.0\nsize = 3e-6\n";
    let (first, second) = (made("first", 41, ""), made("second", 42, step));
    let model = first.1.clone();
    let streams = vec![first.0, second.0];
    let outcome = diagnosed(streams, &model).expect("a diagnosis");
    let summary = &outcome.diagnosis.summary;
    let [effect] = outcome.model.effects.as_slice() else {
        panic!("{summary:#?}");
    };
    assert_eq!(effect.kind, "gyro_bias_step", "{summary:#?}");
    assert_eq!(effect.text("recording"), Some("second"));
    // 3e-6 rad/s against 6e-7 rad/√s: the step of a second's walk is 0.2 of its size.
    assert!((effect.number("time_s") - 31.0).abs() < 2.0, "{effect:?}");
    // With it in the model nothing is left in either.
    let again = vec![made("first", 41, "").0, made("second", 42, step).0];
    let again = diagnosed(again, &outcome.model).expect("a diagnosis");
    assert_eq!(
        again.diagnosis.verdict,
        Verdict::Matches,
        "{:#?}",
        again.diagnosis.summary
    );
}

#[test]
fn a_step_before_a_recording_began_is_in_it_all_along() {
    let with = |kind: &str, parameters: &[(&str, EffectValue)]| {
        let (streams, mut model) = made("late", 43, "");
        let named = |(name, value): &(&str, EffectValue)| (name.to_string(), value.clone());
        model.effects.push(ModelEffect {
            kind: kind.to_string(),
            parameters: parameters.iter().map(named).collect(),
        });
        let scene = Scene::new(streams, None, model.gyro.scale_error);
        residual_rad(&scene, &model, Path::new("model.toml")).expect("a residual")
    };
    let step = [
        ("axis", EffectValue::Text("y".to_string())),
        ("time_s", EffectValue::Number(-5.0)),
        ("size", EffectValue::Number(2e-6)),
    ];
    let step = with("gyro_bias_step", &step);
    let bias = with("gyro_bias", &[("y", EffectValue::Number(2e-6))]);
    // 5e-10 rad a row, to rounding.
    let same = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-20;
    assert!((0..3).all(|axis| step[axis].iter().zip(&bias[axis]).all(same)));
}

#[test]
fn recordings_that_do_not_fit_together_are_refused() {
    let refused = |second: Streams| {
        let (first, model) = made("first", 1, "");
        diagnosed(vec![first, second], &model)
            .err()
            .expect("an error")
            .to_string()
    };
    let same = refused(made("first", 2, "").0);
    assert!(same.contains("the name of another recording"), "{same}");
    let mut slower = made("second", 2, "").0;
    slower.rate_hz = 500.0;
    let slower = refused(slower);
    assert!(
        slower.contains("500 Hz") && slower.contains("1000 Hz"),
        "{slower}"
    );
}
