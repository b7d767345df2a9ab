//! What one of several recordings shows by itself: a bias after another switch-on, a mount that was touched.
//!
//! Enters: the outcome of all recordings together, and each one's aligned channels in turn. Leaves: the outcome with
//! all that a recording shows when it is looked at alone, where that is physics. Beside it is what all of them show: the
//! model as it was found where that explains them, and else the listed effects alone, since what stands for an effect
//! that only one recording has is found in its place.
//!
//! Left out: an effect of several recordings but not all, whose size is the same there, is found in each by itself.

use super::empirical::{SLIP, STEP};
use super::explain::descriptions;
use super::hypotheses::{find, reference_harmonic};
use super::result::{EffectEntry, ParameterEntry, UNLISTED, Verdict};
use super::sentences::{effect_lines, opening};
use super::signals;
use super::streams::Streams;
use super::{Outcome, diagnose_aligned};
use rlg_model::Model;
use rlg_model::kinds::FAULT_KINDS;
use rlg_recording::error::InputError;
use std::path::Path;

/// One recording alone.
struct Alone {
    name: String,
    verdict: Verdict,
    shown: Vec<EffectEntry>,
    /// What it says of the proof and of drift.
    lines: Vec<String>,
}

/// Looks at each of `count` recordings by itself, as `read` brings them, and adds what they show; `given` is the model
/// before anything was found.
pub fn look_at_each(
    outcome: &mut Outcome,
    (count, read): (usize, &dyn Fn(usize) -> Result<Streams, InputError>),
    (given, model_file): (&Model, &Path),
    seed: u64,
    progress: &dyn Fn(&str),
) -> Result<(), InputError> {
    let model = of_all(outcome, given);
    let mut each = Vec::with_capacity(count);
    for place in 0..count {
        let streams = read(place)?;
        let name = streams.pieces[0].recording.clone();
        let stage = |stage: &str| progress(&format!("{name} alone: {stage}"));
        let found = diagnose_aligned(&[], vec![streams], None, &model, model_file, seed, &stage)?;
        let diagnosis = found.diagnosis;
        let shown = diagnosis.effects.into_iter();
        let lines = diagnosis.summary.into_iter();
        each.push(Alone {
            verdict: diagnosis.verdict,
            shown: shown.map(|effect| seen_in(&name, effect)).collect(),
            lines: lines
                .filter(|line| is_of_proof(line) || is_of_drift(line))
                .collect(),
            name,
        });
    }
    if each.iter().any(|alone| alone.shown.iter().any(is_physics)) {
        add(outcome, &model, each);
    }
    Ok(())
}

/// The model of what all recordings show.
fn of_all(outcome: &Outcome, given: &Model) -> Model {
    let explains = outcome.diagnosis.verdict == Verdict::Explained;
    let mut model = outcome.model.clone();
    model.effects.retain(|effect| {
        let describes = effect.text("expression").is_some_and(signals::is_window);
        // A bias that only one recording has looks like a step at its beginning: events are found again in each.
        let happens = effect.kind == STEP || effect.kind == SLIP;
        let is_listed = is_listed(&effect.kind) || FAULT_KINDS.contains(&&*effect.kind);
        given.effects.contains(effect) || is_listed || (explains && !describes && !happens)
    });
    model
}

fn add(outcome: &mut Outcome, of_all: &Model, each: Vec<Alone>) {
    let diagnosis = &mut outcome.diagnosis;
    diagnosis.verdict = match each.iter().all(|alone| alone.verdict.is_told()) {
        true => Verdict::Explained,
        false => Verdict::PartlyExplained,
    };
    // The file says no more than the model that the recordings were looked at with.
    outcome.model = of_all.clone();
    let mut describes = descriptions(&diagnosis.effects).into_iter();
    diagnosis.effects.retain(|effect| {
        let in_model = of_all.effects.iter().any(|one| one.kind == effect.kind);
        !describes.next().unwrap_or(false) && in_model
    });
    let said = diagnosis.summary.iter();
    let before = said.clone().filter(|line| line.starts_with("Where:"));
    let before: Vec<String> = before.cloned().collect();
    let still_drifts = |line: &str| each.iter().any(|alone| alone.drifts_as(line));
    let after = said.filter(|line| {
        is_of_proof(line) || is_last(line) || (is_of_drift(line) && still_drifts(line))
    });
    let after: Vec<String> = after.cloned().collect();
    let mut proofs = Vec::new();
    for alone in each.into_iter().filter(|alone| !alone.shown.is_empty()) {
        let lines = alone.lines.into_iter().filter(|line| is_of_proof(line));
        let own = format!("Proof: in {}, on", alone.name);
        proofs.extend(lines.map(|line| line.replacen("Proof: on", &own, 1)));
        diagnosis.effects.extend(alone.shown);
    }
    let mut summary = vec![opening(diagnosis.verdict).to_string()];
    summary.extend(before);
    summary.extend(diagnosis.effects.iter().flat_map(effect_lines));
    summary.extend(proofs);
    summary.extend(after);
    diagnosis.summary = summary;
}

impl Alone {
    /// Whether it says the same gyro drifts.
    fn drifts_as(&self, line: &str) -> bool {
        let gyro = |line: &str| line.split(" wanders").next().map(str::to_owned);
        let mut drifts = self.lines.iter().filter(|line| is_of_drift(line));
        drifts.any(|own| gyro(own) == gyro(line))
    }
}

/// Whether a kind is an effect of the catalogue that has one size all the time.
fn is_listed(kind: &str) -> bool {
    find(kind).is_some() || kind == reference_harmonic::KIND
}

/// Whether it explains: an effect of the catalogue, or an expression in channels.
fn is_physics(effect: &EffectEntry) -> bool {
    let expression = effect.expression.as_deref();
    let is_expression = expression.is_some_and(|one| !signals::is_shape(one));
    is_listed(&effect.kind) || (effect.kind == UNLISTED && is_expression)
}

/// The effect as one recording's.
fn seen_in(name: &str, mut effect: EffectEntry) -> EffectEntry {
    if effect.text("recording").is_none() {
        effect.parameters.push(ParameterEntry::Text {
            name: "recording".to_string(),
            value: name.to_string(),
        });
    }
    let of = format!(
        " Seen in {name}, looked at by itself; the model of all recordings does not hold it."
    );
    effect.what_was_left_out += &of;
    effect
}

fn is_of_proof(line: &str) -> bool {
    line.starts_with("Proof:")
}

fn is_of_drift(line: &str) -> bool {
    line.starts_with("Drift:")
}

/// What a summary ends with.
fn is_last(line: &str) -> bool {
    line.starts_with("Self-test:") || line.starts_with("Not named:")
}
