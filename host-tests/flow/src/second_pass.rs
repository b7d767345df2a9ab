//! Second pass: a diagnosis from the model that the first one wrote. An effect that is in the model must not be found again.
//!
//! Estimates are Gauss–Newton steps about motion and path of the last pass. One that the second step does not reduce has no
//! convergence, and what it was named for is another effect. A unit at rest needs none: its columns do not depend on what is
//! found.

use std::collections::BTreeSet;

use rlg_diagnosis::Unfit;
use rlg_findings::result::{Diagnosis, EffectEntry, ParameterEntry, UNLISTED, Verdict};
use rlg_findings::sentences::REJECTED;
use rlg_model::DeclaredModel;
use rlg_model::catalogue::CATALOGUE;
use rlg_model::kinds::{FAULT_KINDS, NOISE_KINDS};
use rlg_plan::JudgementPlan;

use crate::{Outcome, Settings};

/// An effect that the second pass finds again.
struct Again {
    kind: String,
    /// Parameter with its unit, in the sentence on it.
    number: String,
}

impl Again {
    fn sentence(&self) -> String {
        let Self { kind, number } = self;
        format!(
            "{REJECTED}{kind}: fitted again from a model that contains it, it returns ({number})."
        )
    }
}

/// Diagnoses by `run`, and once more from the written model; repeats both without the kinds that the second pass finds again.
///
/// # Inputs
/// `run`: diagnoses under the settings and the model that it is given.
///
/// # Errors
/// Those of `run`.
pub(crate) fn until_nothing_returns<T>(
    settings: &Settings,
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
    mut run: impl FnMut(&Settings, DeclaredModel<'_>) -> Result<(Outcome, T), Unfit>,
) -> Result<(Outcome, T), Unfit> {
    let mut returned: Vec<Again> = Vec::new();
    loop {
        let gone = returned.iter().map(|one| one.kind.as_str());
        let left_out: Vec<&str> = settings.left_out.iter().copied().chain(gone).collect();
        let without = |left_out| Settings {
            left_out,
            ..*settings
        };
        let (mut first, also) = run(&without(&left_out), of)?;
        let found = kinds_to_check(&first.diagnosis, &left_out);
        let mut again = Vec::new();
        if !found.is_empty() {
            progress("fitting once more from the written model");
            let others = others(&found);
            let written = DeclaredModel::new(&first.model, of.file);
            match run(&without(&others), written) {
                Ok((second, _)) => {
                    let plan = &settings.plan.judgement;
                    again = found_again(&first.diagnosis, &second.diagnosis, &found, plan);
                }
                // Along another path fewer rows have their reference: the first pass stands.
                Err(Unfit::TooFewRows(_)) => {}
                error => return error,
            }
        }
        if again.is_empty() {
            let sentences = returned.iter().map(Again::sentence);
            first.diagnosis.summary.extend(sentences);
            return Ok((first, also));
        }
        returned.extend(again);
    }
}

/// Kinds of the catalogue that a diagnosis found with numbers and that may still be left out.
fn kinds_to_check(diagnosis: &Diagnosis, left_out: &[&str]) -> BTreeSet<String> {
    if diagnosis.verdict == Verdict::Unusable {
        return BTreeSet::new();
    }
    // An event has an instant: another one is not the same again.
    let effects = diagnosis.effects.iter();
    let lasting = effects.filter(|one| one.number("time_s").or(one.number("start_s")).is_none());
    let effects = lasting.map(|one| one.kind.as_str());
    let is_effect = |kind: &&str| {
        *kind != UNLISTED
            && !FAULT_KINDS.contains(kind)
            && !NOISE_KINDS.contains(kind)
            && !left_out.contains(kind)
    };
    effects.filter(is_effect).map(str::to_string).collect()
}

/// Kinds of the catalogue besides those found.
fn others(found: &BTreeSet<String>) -> Vec<&'static str> {
    let listed = CATALOGUE.iter().map(|kind| kind.name);
    let all = listed.chain([UNLISTED]);
    all.filter(|kind| !found.contains(*kind)).collect()
}

/// Effects among `kinds` of which the second pass finds more again than a converging estimate leaves.
fn found_again(
    first: &Diagnosis,
    second: &Diagnosis,
    kinds: &BTreeSet<String>,
    plan: &JudgementPlan,
) -> Vec<Again> {
    let again = |kind: &String| {
        let of_kind = |one: &&EffectEntry| one.kind == *kind;
        let pairs = first.effects.iter().filter(of_kind).flat_map(|before| {
            let after = second.effects.iter().filter(of_kind);
            after.map(move |after| (before, after))
        });
        let number = pairs
            .filter(|(before, after)| texts(before).eq(texts(after)))
            .find_map(|(before, after)| number_again(before, after, plan))?;
        Some(Again {
            kind: kind.clone(),
            number,
        })
    };
    kinds.iter().filter_map(again).collect()
}

/// Text parameters of an effect: the channel or recording that it acts on.
fn texts(effect: &EffectEntry) -> impl Iterator<Item = (&str, &str)> {
    effect.parameters.iter().filter_map(|one| match one {
        ParameterEntry::Text { name, value } => Some((name.as_str(), value.as_str())),
        ParameterEntry::Number { .. } => None,
    })
}

/// First parameter, in words, of which the second estimate is significant and more than the permitted share of the first.
fn number_again(before: &EffectEntry, after: &EffectEntry, plan: &JudgementPlan) -> Option<String> {
    let least = plan.found_again_deviations;
    let is_significant = |value: f64, std: f64| std > 0.0 && value.abs() > least * std;
    before.parameters.iter().find_map(|one| {
        let ParameterEntry::Number {
            name,
            value: was,
            std: std_was,
            unit,
        } = one
        else {
            return None;
        };
        let (is, std) = after.number(name)?;
        let returns = is_significant(*was, *std_was)
            && is_significant(is, std)
            && is.abs() > plan.found_again * was.abs();
        let unit = if unit == "1" { "" } else { unit };
        returns.then(|| {
            format!("{name} {was:.2e}, then {is:.2e} ± {std:.0e} {unit}")
                .trim_end()
                .to_string()
        })
    })
}
