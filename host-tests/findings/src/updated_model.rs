//! Model updated by the findings.

use rlg_model::catalogue::CHOICE_KEY;
use rlg_model::kinds::{FAULT_KINDS, NOISE_KINDS};
use rlg_model::{EffectValue, Model, ModelEffect};

/// Writes into an effect the text on its parameters that are a choice.
pub fn set_choice(effect: &mut ModelEffect, choice: Option<String>) {
    if let Some(choice) = choice {
        let key = CHOICE_KEY.to_owned();
        effect.parameters.insert(key, EffectValue::Text(choice));
    }
}

/// Adds an effect to a model.
pub fn switch_on(model: &mut Model, effect: ModelEffect) {
    // Sizes of one kind add up in one entry; events and expressions remain separate.
    let single = !FAULT_KINDS.contains(&effect.kind.as_str())
        && !matches!(
            effect.kind.as_str(),
            "unlisted"
                | "gyro_bias_step"
                | "counter_slip"
                | "axis_flexure_mode"
                | "isolator_mode"
                | "reference_harmonic"
        );
    let noise = NOISE_KINDS.contains(&effect.kind.as_str());
    let known = model.effects.iter_mut().find(|known| {
        let same = known.text("recording") == effect.text("recording");
        single && same && known.kind == effect.kind
    });
    match known {
        None => model.effects.push(effect),
        Some(known) => {
            for (name, value) in effect.parameters {
                let EffectValue::Number(more) = value else {
                    if name == CHOICE_KEY {
                        known.parameters.insert(name, value);
                    }
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
