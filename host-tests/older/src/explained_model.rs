//! The model with what was found in it, so that the same recording then matches (diagnosis road, step 11).
//!
//! Enters: [`Findings`] and the model that was diagnosed. Leaves: the model with effects, terms, faults of the data and
//! excess noise as effects of the contract. Sizes of one kind add up; what has a time or an expression stays apart.

use std::collections::BTreeMap;

use super::entries::{of_one_effect, parameters_of};
use super::explain::Findings;
use super::hunt::FoundTerm;
use super::hypotheses::CATALOGUE;
use super::select::Chosen;
use super::streams::{AXES, Streams};
pub(super) use rlg_findings::updated_model::switch_on;
use rlg_model::{EffectValue, Model, ModelEffect};

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
        let terms = self.catch.terms.iter().collect();
        effects_of(terms, &self.scene.streams)
            .into_iter()
            .for_each(&mut add);
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

/// Found terms as the model has them.
fn effects_of(terms: Vec<&FoundTerm>, streams: &Streams) -> Vec<ModelEffect> {
    let merged = |halves: Vec<&FoundTerm>| {
        let effect = |found: &FoundTerm| found.term.to_effect(found.size, streams);
        let mut whole = effect(halves[0]);
        for half in &halves[1..] {
            whole.parameters.extend(effect(half).parameters);
        }
        whole
    };
    of_one_effect(&terms).into_iter().map(merged).collect()
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
