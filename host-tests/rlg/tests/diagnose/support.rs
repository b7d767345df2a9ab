//! Common parts of the tests of this folder: effects as concealed in a scenario, and comparison of a diagnosis with them.

use std::fmt::Display;

use rlg::diagnose::Outcome;
use rlg::diagnose::result::{
    Diagnosis, EffectEntry, ExperimentEntry, MoveEntry, ParameterEntry, Verdict,
};

/// Tolerance of each number in its standard deviations. A file holds some forty to a hundred: one in three hundred exceeds
/// three by chance, one in fifteen thousand four.
pub const WITHIN: f64 = 4.0;

/// Returns the scenario at a quarter of its rows, 1000 a second: enough for dithers and motion, and a quarter of the work.
pub fn at_a_quarter(scenario: &str) -> String {
    let thinned = scenario.replace("\nrate_hz = 4000.0\n", "\nrate_hz = 1000.0\n");
    assert_ne!(thinned, scenario, "it has 4000 rows a second");
    thinned
}

/// Returns the scenario of rest, slews and vibration in two thirds of its time: quicker slews, half the vibration.
pub fn in_less_time(scenario: &str) -> String {
    let quicker = scenario.replace("duration_s = 5.0", "duration_s = 3.0");
    let shorter = quicker.replace("duration_s = 22.0", "duration_s = 12.0");
    assert!(quicker != scenario && shorter != quicker);
    shorter
}

/// Returns the scenario without its accelerometers, whose columns and noise are a third of the work: for effects observable
/// on gyros alone.
pub fn of_gyros(scenario: &str) -> String {
    let (before, rest) = scenario
        .split_once("[accelerometer]")
        .expect("it has accelerometers");
    let (_, motion) = rest.split_once("[[motion]]").expect("it moves");
    format!("{before}[[motion]]{motion}")
}

/// Formats an effect of a scenario that is missing from its model.
pub fn concealed(kind: &str, values: &[(&str, f64)]) -> String {
    let values: String = values
        .iter()
        .map(|(name, value)| format!("{name} = {value:e}\n"))
        .collect();
    format!("[[effect]]\nkind = \"{kind}\"\nconcealed = true\n{values}")
}

/// Returns the names of the findings.
pub fn kinds(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis
        .effects
        .iter()
        .map(|effect| effect.kind.as_str())
        .collect()
}

/// Checks that the model is a match, and no name is given.
pub fn names_nothing(diagnosis: &Diagnosis, which: impl Display) {
    let summary = &diagnosis.summary;
    assert_eq!(kinds(diagnosis), [""; 0], "{which}: {summary:#?}");
    assert_eq!(diagnosis.verdict, Verdict::Matches, "{which}: {summary:#?}");
}

/// Returns the effect's numbers: name, value, standard deviation.
fn numbers(effect: &EffectEntry) -> impl Iterator<Item = (&str, f64, f64)> {
    effect
        .parameters
        .iter()
        .filter_map(|parameter| match parameter {
            ParameterEntry::Number {
                name, value, std, ..
            } => Some((name.as_str(), *value, *std)),
            ParameterEntry::Text { .. } => None,
        })
}

/// Returns one of the effect's numbers with its standard deviation.
pub fn number(effect: &EffectEntry, wanted: &str) -> (f64, f64) {
    numbers(effect)
        .find(|(name, ..)| *name == wanted)
        .map(|(_, value, std)| (value, std))
        .unwrap_or_else(|| panic!("no {wanted} in {:?}", effect.parameters))
}

/// Checks that the effect has these numbers.
pub fn holds(effect: &EffectEntry, truth: &[(&str, f64)]) {
    for (name, truth) in truth {
        let (value, std) = number(effect, name);
        assert!(
            (value - truth).abs() < WITHIN * std,
            "{} {name}: {value:e} ± {std:e}, {truth:e}",
            effect.kind
        );
    }
}

/// Checks that the effect has these numbers, and all its others are zero.
pub fn sizes_are(effect: &EffectEntry, truth: &[(&str, f64)]) {
    holds(effect, truth);
    let others: Vec<(&str, f64)> = numbers(effect)
        .filter(|(name, ..)| truth.iter().all(|(known, _)| known != name))
        .map(|(name, ..)| (name, 0.0))
        .collect();
    holds(effect, &others);
}

/// Formats the moves of a proposed experiment as in a scenario, with their repetitions.
pub fn moves(experiment: &ExperimentEntry) -> String {
    let one = |one: &MoveEntry| {
        let turning = match one.kind {
            "still" => String::new(),
            "coning" => format!(
                "axis = \"{}\"\nfrequency_hz = {:.12}\nangle_rad = {:.12}\nramp_s = {:.3}\n",
                one.axis, one.frequency_hz, one.angle_rad, one.ramp_s
            ),
            _ => format!(
                "axis = \"{}\"\nrate_rad_s = {:.12}\nramp_s = {:.3}\noscillation_axis = \"{}\"\n\
                 oscillation_frequency_hz = {:.12}\noscillation_angle_rad = {:.12}\n\
                 oscillation_phase_rad = {:.12}\n",
                one.axis,
                one.rate_rad_s,
                one.ramp_s,
                one.oscillation_axis,
                one.frequency_hz,
                one.angle_rad,
                one.phase_rad
            ),
        };
        format!(
            "[[motion]]\nkind = \"{}\"\n{turning}duration_s = {:.3}\n",
            one.kind, one.duration_s
        )
    };
    let once: String = experiment.moves.iter().map(one).collect();
    once.repeat(experiment.repeats as usize)
}

/// Adds garbage of a size to a channel's values in the test rows.
///
/// # Returns
/// Number of values changed.
pub fn poison(
    values: &mut [f64],
    (start_s, rate_hz): (f64, f64),
    held_out: &[[f64; 2]],
    size: f64,
) -> usize {
    let mut count = 0;
    for (row, value) in values.iter_mut().enumerate() {
        let (begin_s, end_s) = (
            start_s + row as f64 / rate_hz,
            start_s + (row + 1) as f64 / rate_hz,
        );
        let is_in =
            |span: &[f64; 2]| begin_s > span[0] - 0.1 / rate_hz && end_s < span[1] + 0.1 / rate_hz;
        if held_out.iter().any(is_in) {
            *value += size * (7.0 * row as f64).sin();
            count += 1;
        }
    }
    count
}

/// Returns effects and model, as written.
pub fn findings(outcome: &Outcome) -> String {
    serde_json::to_string(&outcome.diagnosis.effects).expect("JSON") + &outcome.model.to_toml()
}
