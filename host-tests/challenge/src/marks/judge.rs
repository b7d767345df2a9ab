//! Judgement of one trial: what was said against what was concealed.
//!
//! A *claim* is a reported effect that names physics: noise findings (a wrong declaration is really there), effects
//! that are only `measured` or `indicated`, and locations without an expression are none. A claim whose class holds
//! drift says that drift would do as well: it is neither a false name nor a miss.

use serde::Serialize;
use serde_json::Value;

use super::engine::{DiagnosisSummary, FoundEffect};
use super::kinds::largest;
use super::record::{Answer, Concealed};
use super::run::Outcome;

/// Kinds that raise the noise and predict nothing.
const NOISE_KINDS: [&str; 2] = ["angle_random_walk", "pulse_quantisation"];

/// Names of drift in a class.
const DRIFT_KINDS: [&str; 3] = ["drift", "rate_random_walk", "flicker"];

/// Labels of effects that are reported without a name.
const NO_NAME: [&str; 2] = ["measured", "indicated"];

/// How a diagnosis did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Score {
    /// Every concealed kind is named, alone or in its class, and nothing else; on a null: nothing is named.
    Right,
    /// The same, but a class says "or drift".
    OrDrift,
    /// Something concealed is not named, and nothing wrong is.
    Missed,
    /// Something is named that is not there, or one effect twice.
    Wrong,
    /// The diagnosis gave no answer.
    Unanswered,
}

/// One trial, judged.
#[derive(Debug, Clone, Serialize)]
pub struct Judgement {
    /// The trial's number.
    pub trial: u64,
    /// How the diagnosis did.
    pub score: Score,
    /// What was claimed, classes included.
    pub claims: Vec<String>,
    /// (estimate − truth)/σ of every number that the recording fixes.
    pub pulls: Vec<f64>,
}

impl FoundEffect {
    /// Whether the effect is a claim.
    pub fn is_claim(&self) -> bool {
        let located = self.kind == "unlisted" && self.expression.is_none();
        let unnamed = self
            .label
            .as_deref()
            .is_some_and(|label| NO_NAME.contains(&label));
        !located && !unnamed && !NOISE_KINDS.contains(&self.kind.as_str())
    }

    /// Whether its class holds drift.
    pub fn or_drift(&self) -> bool {
        let mut kinds = std::iter::once(&self.kind).chain(&self.indistinguishable_from);
        kinds.any(|kind| DRIFT_KINDS.contains(&kind.as_str()))
    }

    /// Whether a concealed effect is what it names, or in its class; a step or slip on its own gyro.
    fn covers(&self, concealed: &Concealed) -> bool {
        let same_axis = match (
            self.texts.get("axis"),
            concealed.parameters.get("axis").and_then(Value::as_str),
        ) {
            (Some(found), Some(truth)) => found == truth,
            _ => true,
        };
        let mut alike = self.indistinguishable_from.iter();
        (self.kind == concealed.kind && same_axis) || alike.any(|kind| *kind == concealed.kind)
    }

    fn words(&self) -> String {
        let mut words = self.kind.clone();
        if let Some(axis) = self.texts.get("axis") {
            words = format!("{words} {axis}");
        }
        if self.indistinguishable_from.is_empty() {
            return words;
        }
        format!("{words} (or {})", self.indistinguishable_from.join(", "))
    }
}

/// Judges an outcome.
pub fn judge(answer: &Answer, outcome: &Outcome) -> Judgement {
    let Some(said) = &outcome.said else {
        return Judgement {
            trial: answer.trial,
            score: Score::Unanswered,
            claims: outcome.failure.iter().cloned().collect(),
            pulls: Vec::new(),
        };
    };
    let claims: Vec<&FoundEffect> = said.effects.iter().filter(|one| one.is_claim()).collect();
    let matched = matching(&answer.effects, &claims);
    Judgement {
        trial: answer.trial,
        score: score(said, &answer.effects, &claims, &matched),
        claims: claims.iter().map(|one| one.words()).collect(),
        pulls: pulls(&answer.effects, &claims, &matched),
    }
}

/// For each concealed effect the claim that names it, each claim once: the pairing that names most, headlines first.
fn matching(concealed: &[Concealed], claims: &[&FoundEffect]) -> Vec<Option<usize>> {
    fn best(
        concealed: &[Concealed],
        claims: &[&FoundEffect],
        used: &mut Vec<usize>,
    ) -> (usize, Vec<Option<usize>>) {
        let Some((first, rest)) = concealed.split_first() else {
            return (0, Vec::new());
        };
        let (mut most, mut pairs) = best(rest, claims, used);
        pairs.insert(0, None);
        for (place, claim) in claims.iter().enumerate() {
            if used.contains(&place) || !claim.covers(first) {
                continue;
            }
            used.push(place);
            let (others, mut other_pairs) = best(rest, claims, used);
            used.pop();
            let headline = usize::from(claim.kind == first.kind);
            // A name counts for more than all the headlines that it could cost.
            let value = others + concealed.len() + 1 + headline;
            if value > most {
                most = value;
                other_pairs.insert(0, Some(place));
                pairs = other_pairs;
            }
        }
        (most, pairs)
    }
    best(concealed, claims, &mut Vec::new()).1
}

fn score(
    said: &DiagnosisSummary,
    concealed: &[Concealed],
    claims: &[&FoundEffect],
    matched: &[Option<usize>],
) -> Score {
    if said.verdict == "unusable" {
        return Score::Unanswered;
    }
    let is_matched = |place: usize| matched.contains(&Some(place));
    let wrong = claims
        .iter()
        .enumerate()
        .any(|(place, claim)| !is_matched(place) && !claim.or_drift());
    if wrong {
        Score::Wrong
    } else if matched.iter().flatten().count() < concealed.len() {
        Score::Missed
    } else if claims.iter().any(|claim| claim.or_drift()) {
        Score::OrDrift
    } else {
        Score::Right
    }
}

/// Pulls where the headline is the concealed kind, of the numbers that are known better than any instrument's size.
fn pulls(concealed: &[Concealed], claims: &[&FoundEffect], matched: &[Option<usize>]) -> Vec<f64> {
    let mut list = Vec::new();
    for (effect, place) in concealed.iter().zip(matched) {
        let Some(claim) = place.map(|place| claims[place]) else {
            continue;
        };
        if claim.kind != effect.kind {
            continue;
        }
        for (name, estimate) in &claim.numbers {
            let truth = effect
                .parameters
                .get(name)
                .and_then(Value::as_f64)
                .unwrap_or(0.0);
            let known = name == "time_s" || estimate.std < largest(&effect.kind);
            if estimate.std > 0.0 && estimate.std.is_finite() && known {
                list.push((estimate.value - truth) / estimate.std);
            }
        }
    }
    list
}
