//! Findings as entries of `diagnosis.json` and as effects of the updated model.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use rlg_catalogue::candidates::Variant;
use rlg_catalogue::entries::STEP;
use rlg_catalogue::signals::AXES;
use rlg_findings::entries::append;
use rlg_findings::result::{EffectEntry, EvidenceEntry, ParameterEntry};
use rlg_findings::updated_model::set_choice;
use rlg_inference::Fit;
use rlg_inference::judgement::chance_in_noise;
use rlg_model::{EffectValue, ModelEffect};
use rlg_signal::streams::Streams;

use super::finding::{Finding, Number, Numbers, card, fixed, numbers, of_the_others};
use crate::search::structure::Searched;

/// Entry in a class for drift of a gyro.
pub const DRIFT: &str = "rate_random_walk";

pub(crate) fn entry(one: &Finding, fit: &Fit, of: Searched) -> EffectEntry {
    let (streams, signals) = (of.data.streams, &of.found.motion.signals);
    let card = card(one.candidate.kind);
    let Numbers {
        each: numbers,
        covariance: of_numbers,
        ..
    } = numbers(one, fit);
    let mut parameters = Parameters::new(&numbers, &of_numbers);
    let mut what_was_left_out = card.meaning.to_string();
    let mut shown = None;
    match one.candidate.variant {
        Variant::Harmonic { axis, order } => {
            parameters.add_text("axis", AXES[axis]);
            parameters.add_number("order", f64::from(order), 0.0, "1");
        }
        Variant::Expression { axis, expression } => {
            let expression = expression.text(signals);
            parameters.add_text("axis", AXES[axis]);
            parameters.add_text("expression", &expression);
            what_was_left_out = followed(AXES[axis], &expression);
            shown = Some(expression);
        }
        Variant::Event { axis, row } => {
            let time_s = event_time_s(one.candidate.kind, row, streams);
            parameters.add_text("axis", AXES[axis]);
            parameters.add_number("time_s", time_s, event_std_s(one, streams), "s");
        }
        _ => {}
    }
    if let Some(name) = one.recording {
        parameters.add_text("recording", name);
    }
    let mut alike = one.alike.clone();
    if one.or_drift {
        alike.push(DRIFT.to_string());
    }
    let label = if alike.is_empty() { "named" } else { "class" };
    if one.or_drift {
        what_was_left_out.push_str(
            " Not distinguishable from gyro drift: a longer record, or a second cycle of its cause, would decide.",
        );
    }
    what_was_left_out.push_str(&of_the_others(one.supported));
    let price = one.candidate.hypothesis.price;
    EffectEntry {
        kind: one.candidate.kind.to_string(),
        indistinguishable_from: alike,
        gravity_speaks_against: Vec::new(),
        equation: card.equation.to_string(),
        parameters: parameters.each,
        covariance: parameters.covariance,
        identifiable: fixed(&numbers, &of_numbers, &one.combinations),
        log_evidence_gain: one.cost_without,
        p_value: chance_in_noise(one.squared_size, one.rank, price),
        what_was_left_out,
        expression: shown,
        regimes: one.regimes.clone(),
        evidence: Some(EvidenceEntry {
            label,
            confirmed_gain: one.confirmed_gain,
            share: one.share,
            reenactments: one.bootstrap.draws,
            inflation: one.bootstrap.inflation(),
        }),
    }
}

/// Parameters of an entry with the covariance of the numbers among them.
struct Parameters {
    each: Vec<ParameterEntry>,
    covariance: Vec<Vec<f64>>,
}

impl Parameters {
    fn new(numbers: &[Number], covariance: &DMatrix<f64>) -> Self {
        let of_number = |(k, number): (usize, &Number)| {
            let std = covariance[(k, k)].max(0.0).sqrt();
            ParameterEntry::number(&number.name, number.value, std, number.unit)
        };
        let row = |a: usize| (0..numbers.len()).map(|b| covariance[(a, b)]).collect();
        Self {
            each: numbers.iter().enumerate().map(of_number).collect(),
            covariance: (0..numbers.len()).map(row).collect(),
        }
    }

    fn add_text(&mut self, name: &str, value: &str) {
        self.each.push(ParameterEntry::text(name, value));
    }

    /// Adds a number that is independent of the others.
    fn add_number(&mut self, name: &str, value: f64, std: f64, unit: &str) {
        let number = ParameterEntry::number(name, value, std, unit);
        append(&mut self.each, &mut self.covariance, number);
    }
}

/// Sentence on the effect missing from the model of a gyro that follows an expression.
pub fn followed(axis: &str, expression: &str) -> String {
    if expression == format!("time*alpha_{axis}") {
        format!(
            "Delay of the reference against gyro {axis} grows in time, by the coefficient in seconds per second: their clocks, or the rates of their tables, differ by that ratio."
        )
    } else {
        format!(
            "Gyro {axis} follows {expression}, outside the catalogue: an expression in measured channels, found by search."
        )
    }
}

fn event_time_s(kind: &str, row: usize, streams: &Streams) -> f64 {
    if kind == STEP {
        streams.begin_s(row)
    } else {
        streams.middle_s(row)
    }
}

/// Standard deviation of the instant of an event \[s\]; half a row for a slip.
fn event_std_s(one: &Finding, streams: &Streams) -> f64 {
    one.instant_std_rows.unwrap_or(0.5) / streams.rate_hz
}

pub(crate) fn effect_of(one: &Finding, fit: &Fit, of: Searched) -> ModelEffect {
    let (streams, signals) = (of.data.streams, &of.found.motion.signals);
    let Numbers { each, choice, .. } = numbers(one, fit);
    let mut parameters: BTreeMap<String, EffectValue> = each
        .into_iter()
        .map(|number| (number.name, EffectValue::Number(number.value)))
        .collect();
    let text = |value: &str| EffectValue::Text(value.to_string());
    match one.candidate.variant {
        Variant::Harmonic { axis, order } => {
            parameters.insert("axis".to_string(), text(AXES[axis]));
            let order = EffectValue::Number(f64::from(order));
            parameters.insert("order".to_string(), order);
        }
        Variant::Expression { axis, expression } => {
            parameters.insert("axis".to_string(), text(AXES[axis]));
            parameters.insert("expression".to_string(), text(&expression.text(signals)));
        }
        Variant::Event { axis, row } => {
            let time_s = event_time_s(one.candidate.kind, row, streams);
            parameters.insert("axis".to_string(), text(AXES[axis]));
            parameters.insert("time_s".to_string(), EffectValue::Number(time_s));
        }
        _ => {}
    }
    if let Some(name) = one.recording {
        parameters.insert("recording".to_string(), text(name));
    }
    let mut effect = ModelEffect {
        kind: one.candidate.kind.to_string(),
        parameters,
    };
    set_choice(&mut effect, choice);
    effect
}
