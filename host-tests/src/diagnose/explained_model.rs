//! The model with what was found in it, so that the same recording then matches (diagnosis road, step 11).
//!
//! Enters: [`Findings`] and the model that was diagnosed. Leaves: the model with effects, terms, faults of the data and
//! excess noise as effects of the contract. Sizes of one kind add up; what has a time or an expression stays apart.

use std::collections::BTreeMap;

use super::entries::{of_one_effect, parameters_of};
use super::excess::NOISE_KINDS;
use super::explain::Findings;
use super::hypotheses::{CATALOGUE, reference_harmonic};
use super::qualify::FAULT_KINDS;
use super::select::Chosen;
use super::streams::AXES;
use crate::model::{EffectValue, Model, ModelEffect};

impl Findings<'_> {
    /// The model with the found effects switched on.
    pub fn explained_model(&self, model: &Model) -> Model {
        let mut explained = model.clone();
        let mut add = |effect| switch_on(&mut explained, effect);
        self.catch
            .choice
            .chosen
            .iter()
            .map(effect_of)
            .for_each(&mut add);
        for halves in of_one_effect(&self.catch.terms.iter().collect::<Vec<_>>()) {
            let mut effect = halves[0]
                .term
                .to_effect(halves[0].size, &self.scene.streams);
            for other in &halves[1..] {
                effect.parameters.extend(
                    other
                        .term
                        .to_effect(other.size, &self.scene.streams)
                        .parameters,
                );
            }
            add(effect);
        }
        self.rows_effects().into_iter().for_each(&mut add);
        for fault in self.faults {
            let streams = &self.scene.streams;
            let (recording, [start_s, end_s]) = streams.own_span(&fault.rows);
            let mut parameters = BTreeMap::from([
                (
                    "channel".to_string(),
                    EffectValue::Text(fault.channel.clone()),
                ),
                ("start_s".to_string(), EffectValue::Number(start_s)),
                ("end_s".to_string(), EffectValue::Number(end_s)),
            ]);
            if streams.is_joined() {
                let name = EffectValue::Text(recording.to_string());
                parameters.insert("recording".to_string(), name);
            }
            add(ModelEffect {
                kind: fault.kind.to_string(),
                parameters,
            });
        }
        for excess in self.excess {
            let parameters: BTreeMap<String, EffectValue> = (0..3)
                .map(|axis| {
                    (
                        AXES[axis].to_string(),
                        EffectValue::Number(excess.values[axis]),
                    )
                })
                .collect();
            add(ModelEffect {
                kind: excess.kind.to_string(),
                parameters,
            });
        }
        explained
    }
}

/// A model with chosen effects switched on, and nothing else that was found.
pub(super) fn with_chosen(model: &Model, chosen: &[Chosen]) -> Model {
    let mut explained = model.clone();
    for one in chosen {
        switch_on(&mut explained, effect_of(one));
    }
    explained
}

/// A chosen effect as the model has it.
pub(super) fn effect_of(one: &Chosen) -> ModelEffect {
    let card = CATALOGUE[one.effect].card();
    let parameters = parameters_of(one).into_iter();
    ModelEffect {
        kind: card.kind.to_string(),
        parameters: parameters
            .map(|k| (card.name(k), EffectValue::Number(one.values[k])))
            .collect(),
    }
}

/// Adds an effect to a model.
pub(super) fn switch_on(model: &mut Model, effect: ModelEffect) {
    // Sizes of one kind add up in one entry; events and expressions stay apart.
    let single = !FAULT_KINDS.contains(&effect.kind.as_str())
        && !matches!(
            effect.kind.as_str(),
            "unlisted"
                | "gyro_bias_step"
                | "counter_slip"
                | "axis_flexure_mode"
                | "isolator_mode"
                | reference_harmonic::KIND
        );
    let noise = NOISE_KINDS.contains(&effect.kind.as_str());
    let known = model
        .effects
        .iter_mut()
        .find(|known| single && known.kind == effect.kind);
    match known {
        None => model.effects.push(effect),
        Some(known) => {
            for (name, value) in effect.parameters {
                let EffectValue::Number(more) = value else {
                    continue;
                };
                let slot = known
                    .parameters
                    .entry(name)
                    .or_insert(EffectValue::Number(0.0));
                if let EffectValue::Number(sum) = slot {
                    *sum = if noise { sum.hypot(more) } else { *sum + more };
                }
            }
        }
    }
}
