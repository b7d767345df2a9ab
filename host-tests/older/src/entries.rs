//! One finding as an entry of `diagnosis.json`.
//!
//! Enters: a chosen effect, found terms, excess noise or a fault of the data. Leaves: the entry with the contract's names
//! and units. Accelerometers and units at rest use the same entries with words of their own.

use std::collections::BTreeMap;

use super::empirical::Form;
use super::hunt::FoundTerm;
use super::hypotheses::{CATALOGUE, reference_harmonic};
use super::identify::identifiable;
use super::invariance::Verdict;
use super::result::{EffectEntry, Identifiable, ParameterEntry, RegimeEntry, UNLISTED};
use super::select::Chosen;
use super::signals;
use super::streams::{AXES, Streams};
pub use rlg_diagnosis::entries_of_rows::fault_entry;
pub(super) use rlg_findings::entries::{noise, unlisted};
use rlg_model::EffectValue;

/// The parameters that stand for something.
pub(super) fn parameters_of(one: &Chosen) -> Vec<usize> {
    let hypothesis = CATALOGUE[one.effect];
    (0..hypothesis.card().count())
        .filter(|&k| hypothesis.has(one.values.as_slice(), k))
        .collect()
}

/// An effect of the catalogue.
pub(super) fn listed(one: &Chosen) -> EffectEntry {
    let card = CATALOGUE[one.effect].card();
    let kept = parameters_of(one);
    EffectEntry {
        evidence: None,
        gravity_speaks_against: one
            .gravity_speaks_against
            .iter()
            .map(|&rival| CATALOGUE[rival].card().kind.to_string())
            .collect(),
        kind: card.kind.to_string(),
        indistinguishable_from: one
            .indistinguishable_from
            .iter()
            .map(|&rival| CATALOGUE[rival].card().kind.to_string())
            .chain(
                card.resembles_untested
                    .iter()
                    .map(|kind| (*kind).to_string()),
            )
            .chain(
                one.harmonic_rival
                    .then(|| reference_harmonic::KIND.to_string()),
            )
            .chain(one.unlisted_rival.iter().map(|_| UNLISTED.to_string()))
            .collect(),
        equation: card.equation.to_string(),
        parameters: kept
            .iter()
            .map(|&k| ParameterEntry::Number {
                name: card.name(k),
                value: one.values[k],
                std: one.covariance[(k, k)].sqrt(),
                unit: card.unit_of(k).to_string(),
            })
            .collect(),
        covariance: kept
            .iter()
            .map(|&a| kept.iter().map(|&b| one.covariance[(a, b)]).collect())
            .collect(),
        identifiable: identifiable(card, one),
        log_evidence_gain: one.log_evidence_gain,
        p_value: one.p_value,
        what_was_left_out: card.left_out.to_string(),
        expression: one
            .unlisted_rival
            .as_ref()
            .map(|(_, expression)| expression.clone()),
        regimes: Vec::new(),
    }
}

/// The size in every regime that shows the effect.
pub(super) fn regimes(verdict: &Verdict) -> Vec<RegimeEntry> {
    let amplitudes = verdict.amplitudes.iter();
    amplitudes
        .map(|amplitude| RegimeEntry {
            name: amplitude.regime.clone(),
            amplitude: amplitude.value,
            std: amplitude.std,
        })
        .collect()
}

/// Terms by effect: the two halves of a harmonic stand together.
pub(super) fn of_one_effect<'a>(terms: &[&'a FoundTerm]) -> Vec<Vec<&'a FoundTerm>> {
    let mut groups: Vec<Vec<&FoundTerm>> = Vec::new();
    for &found in terms {
        let alike = |group: &&mut Vec<&FoundTerm>| match (&group[0].term.form, &found.term.form) {
            (Form::Harmonic { order: a, .. }, Form::Harmonic { order: b, .. }) => {
                a == b && group[0].term.axis == found.term.axis
            }
            _ => false,
        };
        match groups.iter_mut().find(alike) {
            Some(group) => group.push(found),
            None => groups.push(vec![found]),
        }
    }
    groups
}

/// Terms that are one effect.
pub(super) fn term(halves: Vec<&FoundTerm>, streams: &Streams) -> EffectEntry {
    let found = halves[0];
    let (name, _) = found.term.size();
    let effect = found.term.to_effect(found.size, streams);
    let mut parameters: Vec<ParameterEntry> = halves
        .iter()
        .map(|half| {
            let (name, unit) = half.term.size();
            ParameterEntry::Number {
                name: name.to_string(),
                value: half.size,
                std: half.std,
                unit: unit.to_string(),
            }
        })
        .collect();
    parameters.extend(
        effect
            .parameters
            .iter()
            .filter(|(other, _)| *other != name)
            .map(|(name, value)| match value {
                EffectValue::Text(value) => ParameterEntry::Text {
                    name: name.clone(),
                    value: value.clone(),
                },
                EffectValue::Number(value) => ParameterEntry::Number {
                    name: name.clone(),
                    value: *value,
                    std: found.alike.order_std,
                    unit: if name == "order" { "1" } else { "s" }.to_string(),
                },
            }),
    );
    let expression = match effect.parameters.get("expression") {
        Some(EffectValue::Text(expression)) => Some(expression.clone()),
        _ => None,
    };
    let rival = found.alike.unlisted.clone();
    let axis = AXES[found.term.axis];
    let what_was_left_out = match (&expression, found.term.kind()) {
        (Some(expression), _) if signals::is_window(expression) => format!(
            "Gyro {axis} drifts in one stretch of time and no measured channel explains it; the constant in the model is a description, not physics."
        ),
        (Some(expression), _) if *expression == format!("time*alpha_{axis}") => format!(
            "The reference is late against gyro {axis} by a time that grows, by the coefficient in seconds a second: their clocks, or the rates of their tables, part by that share."
        ),
        (Some(expression), _) => format!(
            "Gyro {axis} follows {expression}, which is no effect of the catalogue: an expression in measured channels, found by search."
        ),
        (None, reference_harmonic::KIND) => reference_harmonic::LEFT_OUT.to_string(),
        (None, "gyro_bias_step") => format!("The bias of gyro {axis} jumps once and stays there."),
        (None, _) => format!(
            "The angle of gyro {axis} jumps once, as when its counter loses or gains pulses."
        ),
    };
    EffectEntry {
        evidence: None,
        gravity_speaks_against: Vec::new(),
        kind: found.term.kind().to_string(),
        indistinguishable_from: rival.iter().map(|_| UNLISTED.to_string()).collect(),
        equation: found.term.equation(),
        covariance: {
            let numbers = parameters
                .iter()
                .filter(|parameter| matches!(parameter, ParameterEntry::Number { .. }))
                .count();
            let mut covariance = vec![vec![0.0; numbers]; numbers];
            for (place, half) in halves.iter().enumerate() {
                covariance[place][place] = half.std * half.std;
            }
            if halves.len() > 1 {
                covariance[0][1] = found.with_next;
                covariance[1][0] = found.with_next;
            }
            covariance
        },
        parameters,
        identifiable: halves
            .iter()
            .map(|half| Identifiable {
                combination: BTreeMap::from([(half.term.size().0.to_string(), 1.0)]),
                value: half.size,
                std: half.std,
            })
            .collect(),
        log_evidence_gain: 0.5 * found.ratio,
        p_value: found.p_value,
        what_was_left_out,
        expression: expression.or(rival),
        regimes: Vec::new(),
    }
}
