//! The older stages' result beside the new engine's.

use rlg_model::Model;

use crate::Outcome;

/// The result where the older stages were asked as well: theirs of the accelerometers, and of gyros whose error gravity may
/// tell from the reference's. What the new engine explains to the end, with nothing found, is no effect of a gyro.
pub fn beside(found: Outcome, older: Outcome, model: &Model) -> Outcome {
    let of_accelerometers = |kind: &str| kind.starts_with("accel_") || kind == "size_effect";
    let names_gyros = older
        .diagnosis
        .effects
        .iter()
        .any(|effect| !of_accelerometers(&effect.kind));
    if found.diagnosis.verdict != crate::result::Verdict::Matches || !names_gyros {
        return older;
    }
    let mut merged = found;
    let from = older.diagnosis;
    let effects: Vec<_> = from
        .effects
        .into_iter()
        .filter(|effect| of_accelerometers(&effect.kind))
        .collect();
    if !effects.is_empty() {
        merged.diagnosis.verdict = crate::result::Verdict::Explained;
        merged.diagnosis.summary[0] =
            crate::sentences::opening(merged.diagnosis.verdict).to_string();
    }
    merged.diagnosis.effects.extend(effects);
    let is_of_accelerometer = |channel: &str| channel.starts_with("accel_");
    let locations = from
        .locations
        .into_iter()
        .filter(|one| is_of_accelerometer(&one.channel));
    merged.diagnosis.locations.extend(locations);
    let channels = from
        .fit
        .channels
        .into_iter()
        .filter(|one| is_of_accelerometer(&one.channel));
    merged.diagnosis.fit.channels.extend(channels);
    merged.diagnosis.accelerometer_noise = from.accelerometer_noise;
    let known = |effect: &&rlg_model::ModelEffect| {
        of_accelerometers(&effect.kind) && !model.effects.contains(effect)
    };
    let added: Vec<_> = older.model.effects.iter().filter(known).cloned().collect();
    for effect in added {
        merged
            .model
            .effects
            .retain(|other| other.kind != effect.kind);
        merged.model.effects.push(effect);
    }
    merged
}
