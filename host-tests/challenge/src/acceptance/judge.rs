//! Judgement of one trial: claims against concealed effects.
//!
//! A *claim* is a reported effect that names physics: noise findings (the declaration is wrong indeed), effects that are
//! only `measured` or `indicated`, and locations without an expression do not count. A claim with drift in its class is
//! neither a false name nor a miss.

use serde::Serialize;
use serde_json::Value;

use super::run::Outcome;
use super::under_test::{DiagnosisSummary, FoundEffect};
use crate::acceptance::record::{Answer, Concealed};
use crate::marks::family::Family;
use crate::marks::kinds::largest;

/// Kinds that raise the noise and predict no signal.
const NOISE_KINDS: [&str; 2] = ["angle_random_walk", "pulse_quantisation"];

/// Names of drift in an equivalence class, of gyros or accelerometers.
const DRIFT_KINDS: [&str; 4] = [
    "drift",
    "rate_random_walk",
    "flicker",
    "acceleration_random_walk",
];

/// Data faults: a claim is right if it overlaps a fault in time.
const FAULT_KINDS: [&str; 6] = [
    "reference_jump",
    "reference_spike",
    "reference_dropout",
    MISSING,
    "held_values",
    "stuck_channel",
];

/// Kinds of the alignment of two instruments: present in others' recordings with any injection.
const ALIGNMENT: [&str; 10] = [
    "gyro_bias",
    "gyro_scale",
    "installation",
    "gyro_bandwidth",
    "reference_misalignment",
    "reference_delay",
    "reference_clock_rate",
    "reference_scale",
    "reference_bandwidth",
    "earth_rate",
];

/// Missing rows need no name.
const MISSING: &str = "lost_samples";

/// Labels of effects that are reported without a name.
const NO_NAME: [&str; 2] = ["measured", "indicated"];

/// Score of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Score {
    /// Every concealed kind is named, alone or in its class, and nothing else; on a null: nothing is named.
    Right,
    /// As `Right`, but a class contains "or drift".
    OrDrift,
    /// A concealed effect is not named, and nothing false is.
    Missed,
    /// An absent effect is named, or one effect twice.
    Wrong,
    /// The diagnosis gave no answer.
    Unanswered,
}

/// Judged trial.
#[derive(Debug, Clone, Serialize)]
pub struct Judgement {
    /// Number of the trial.
    pub trial: u64,
    /// Score.
    pub score: Score,
    /// Claims, classes included.
    pub claims: Vec<String>,
    /// Normalised error (estimate − truth)/σ of every identifiable parameter.
    pub pulls: Vec<f64>,
    /// The updated model matches, if tested.
    pub matches_again: Option<bool>,
}

/// Normalised error beyond which a parameter counts as wrong \[σ\].
const FAR: f64 = 3.0;

impl Judgement {
    /// Returns the normalised errors beyond three standard deviations.
    pub fn far(&self) -> impl Iterator<Item = f64> {
        self.pulls.iter().copied().filter(|pull| pull.abs() > FAR)
    }
}

impl FoundEffect {
    /// True if the effect is a claim; a noise kind is one only with `of_noise`.
    pub fn is_claim(&self, of_noise: bool) -> bool {
        let located = self.kind == "unlisted" && self.expression.is_none();
        let unnamed = self
            .label
            .as_deref()
            .is_some_and(|label| NO_NAME.contains(&label));
        !located && !unnamed && (of_noise || !NOISE_KINDS.contains(&self.kind.as_str()))
    }

    /// True if the class contains drift.
    pub fn or_drift(&self) -> bool {
        let mut kinds = std::iter::once(&self.kind).chain(&self.indistinguishable_from);
        kinds.any(|kind| DRIFT_KINDS.contains(&kind.as_str()))
    }

    /// True if a concealed effect is the named one or in its class; a step or slip on its own gyro.
    fn covers(&self, concealed: &Concealed) -> bool {
        let same_axis = match (
            self.texts.get("axis"),
            concealed.parameters.get("axis").and_then(Value::as_str),
        ) {
            (Some(found), Some(truth)) => found == truth,
            _ => true,
        };
        let mut alike = self.indistinguishable_from.iter();
        let is_kind = self.kind == concealed.kind && same_axis && self.is_line_of(concealed);
        is_kind || alike.any(|kind| *kind == concealed.kind)
    }

    /// True if two lines agree in frequency to half a resolution; always true for a concealed effect without frequency.
    fn is_line_of(&self, concealed: &Concealed) -> bool {
        let of_line = |name: &str| number(concealed, name);
        let (Some(frequency_hz), Some(resolution_hz)) =
            (of_line("frequency_hz"), of_line("resolution_hz"))
        else {
            return true;
        };
        let said_hz = match self.numbers.get("frequency_hz") {
            Some(said) => Some(said.value),
            None => self.expression.as_deref().and_then(line_hz),
        };
        said_hz.is_some_and(|said_hz| (said_hz - frequency_hz).abs() < 0.5 * resolution_hz)
    }

    /// True if the claim reports a data fault: one that overlaps it in time, or a kind whose class contains it.
    fn tells(&self, fault: &Concealed) -> bool {
        let own = |name: &str| self.numbers.get(name).map(|one| one.value);
        let span =
            |from: Option<f64>, to: Option<f64>, at: Option<f64>| Some([from.or(at)?, to.or(at)?]);
        let said_s = span(own("start_s"), own("end_s"), own("time_s"));
        let [from_s, to_s] = ["start_s", "end_s"].map(|name| number(fault, name));
        let overlaps = match (said_s, span(from_s, to_s, None)) {
            (Some([begin, end]), Some([from_s, to_s])) => begin <= to_s && end >= from_s,
            _ => false,
        };
        (is_fault(&self.kind) && overlaps) || self.covers(fault)
    }

    fn words(&self) -> String {
        let mut words = self.kind.clone();
        if let Some(axis) = self.texts.get("axis") {
            words = format!("{words} {axis}");
        }
        if let Some(expression) = &self.expression {
            words = format!("{words} {expression}");
        }
        if !self.indistinguishable_from.is_empty() {
            words = format!("{words} (or {})", self.indistinguishable_from.join(", "));
        }
        format!("{words} [gain {:.1}]", self.gain)
    }
}

fn is_fault(kind: &str) -> bool {
    FAULT_KINDS.contains(&kind)
}

fn number(concealed: &Concealed, name: &str) -> Option<f64> {
    concealed.parameters.get(name).and_then(Value::as_f64)
}

/// Returns the frequency of a line's expression \[Hz\].
fn line_hz(expression: &str) -> Option<f64> {
    let inside = expression.strip_prefix("sine(")?;
    inside.strip_suffix(')')?.parse().ok()
}

/// Judges an outcome.
pub fn judge(answer: &Answer, outcome: &Outcome) -> Judgement {
    let Some(said) = &outcome.said else {
        return Judgement {
            trial: answer.trial,
            score: Score::Unanswered,
            claims: outcome.failure.iter().cloned().collect(),
            pulls: Vec::new(),
            matches_again: None,
        };
    };
    // With a reference of rate, noise is declared wrongly on purpose.
    let of_noise = answer.family == Family::Rest;
    let claims = |said: &'_ DiagnosisSummary| -> Vec<FoundEffect> {
        let effects = said.effects.iter();
        effects
            .filter(|one| one.is_claim(of_noise))
            .cloned()
            .collect()
    };
    let mut all = claims(said);
    all.retain(|claim| answer.family != Family::Recorded || is_of_planting(claim, answer));
    let (faults, effects): (Vec<Concealed>, Vec<Concealed>) = answer
        .effects
        .iter()
        .map(|one| beside(one, answer))
        .partition(|one| is_fault(&one.kind));
    let (telling, others): (Vec<&FoundEffect>, Vec<&FoundEffect>) = all
        .iter()
        .partition(|claim| faults.iter().any(|fault| claim.tells(fault)));
    let matched = matching(&effects, &others);
    let is_silent = telling.is_empty() && faults.iter().any(|fault| fault.kind != MISSING);
    let mut judged = match answer.family {
        Family::Unrelated => of_two_motions(said, &all),
        _ => score(said, &effects, &others, &matched),
    };
    if judged == Score::Right && is_silent {
        judged = Score::Missed;
    }
    let again = said.again.as_deref();
    let mut words: Vec<String> = all.iter().map(FoundEffect::words).collect();
    words.extend(again.filter(|again| again.verdict != MATCHES).map(|again| {
        let names: Vec<String> = claims(again).iter().map(FoundEffect::words).collect();
        format!("again {}: {}", again.verdict, names.join(", "))
    }));
    Judgement {
        trial: answer.trial,
        score: judged,
        claims: words,
        pulls: match answer.family {
            Family::Recorded => pulls_beside(&effects, said, &others, &matched),
            Family::Positions => pulls_of_combinations(&effects, &others, &matched),
            _ => pulls(&effects, &others, &matched),
        },
        matches_again: again.map(|again| again.verdict == MATCHES),
    }
}

/// True if a claim about others' recording may be due to the injected effect, and not to the recording itself: its
/// alignment, faults, and, if its physics is kept, effects reported before the injection.
fn is_of_planting(claim: &FoundEffect, answer: &Answer) -> bool {
    let is_aligning = |kind: &str| ALIGNMENT.contains(&kind);
    let was_said = answer.beside.iter().any(|one| one.kind == claim.kind);
    let is_own = is_aligning(&claim.kind)
        || is_fault(&claim.kind)
        || (was_said && !answer.effects.is_empty());
    !is_own
        || answer.effects.iter().any(|planted| {
            claim.kind == planted.kind || (!is_aligning(&planted.kind) && claim.covers(planted))
        })
}

/// Injected effect, added to the parameters of its kind reported before the injection.
fn beside(planted: &Concealed, answer: &Answer) -> Concealed {
    let mut whole = planted.clone();
    let mut before = answer.beside.iter();
    if let Some(before) = before.find(|one| one.kind == planted.kind) {
        for (name, value) in &before.parameters {
            if let Some(value) = value.as_f64() {
                let sum = value + number(planted, name).unwrap_or(0.0);
                whole.parameters.insert(name.clone(), sum.into());
            }
        }
    }
    whole
}

/// Verdict for a model that explains a recording.
const MATCHES: &str = "matches";

/// Assigns a claim to each concealed effect, each claim once: the assignment with most names, headlines preferred.
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
            // One more name counts more than all headlines together.
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

/// Verdict for an unusable recording.
const UNUSABLE: &str = "unusable";

/// Scores the diagnosis of gyros and an unrelated reference: right if unusable and without a name.
fn of_two_motions(said: &DiagnosisSummary, claims: &[FoundEffect]) -> Score {
    match said.verdict == UNUSABLE && claims.is_empty() {
        true => Score::Right,
        false => Score::Wrong,
    }
}

fn score(
    said: &DiagnosisSummary,
    concealed: &[Concealed],
    claims: &[&FoundEffect],
    matched: &[Option<usize>],
) -> Score {
    if said.verdict == UNUSABLE {
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

/// Normalised errors of an effect injected into others' recording: for alignment kinds, named or not, those of the joint
/// fit.
fn pulls_beside(
    effects: &[Concealed],
    said: &DiagnosisSummary,
    claims: &[&FoundEffect],
    matched: &[Option<usize>],
) -> Vec<f64> {
    let aligning: Vec<&FoundEffect> = said.registration.iter().collect();
    let is_planted = |one: &Concealed| aligning.iter().position(|entry| entry.kind == one.kind);
    let places: Vec<Option<usize>> = effects.iter().map(is_planted).collect();
    // With a low-pass filter, which has a delay itself, an estimated delay is only the remainder.
    let is_pole = |one: &&FoundEffect| one.numbers.keys().any(|name| name.ends_with("_pole_s"));
    let is_late = effects.iter().any(|one| one.kind == "reference_delay");
    if is_late && aligning.iter().any(is_pole) {
        return Vec::new();
    }
    match places.iter().any(Option::is_some) {
        true => pulls(effects, &aligning, &places),
        false => pulls(effects, claims, matched),
    }
}

/// Normalised errors of combinations, for an effect that has some: gravity determines differences of tilts, each tilt alone
/// is undetermined.
fn pulls_of_combinations(
    concealed: &[Concealed],
    claims: &[&FoundEffect],
    matched: &[Option<usize>],
) -> Vec<f64> {
    let mut list = Vec::new();
    for (effect, place) in concealed.iter().zip(matched) {
        let Some(claim) = place.map(|place| claims[place]) else {
            continue;
        };
        if claim.kind != effect.kind || claim.combinations.is_empty() {
            let alone = std::slice::from_ref(effect);
            list.extend(pulls(alone, claims, std::slice::from_ref(place)));
            continue;
        }
        for (weights, estimate) in &claim.combinations {
            let terms = weights.iter();
            let truth: f64 = terms
                .map(|(name, weight)| weight * number(effect, name).unwrap_or(0.0))
                .sum();
            list.push((estimate.value - truth) / estimate.std);
        }
    }
    list
}

/// Normalised errors for headlines of the concealed kind, of parameters known better than any instrument's size.
fn pulls(concealed: &[Concealed], claims: &[&FoundEffect], matched: &[Option<usize>]) -> Vec<f64> {
    let mut list = Vec::new();
    for (effect, place) in concealed.iter().zip(matched) {
        let Some(claim) = place.map(|place| claims[place]) else {
            continue;
        };
        if claim.kind != effect.kind {
            continue;
        }
        // A concealed effect may be larger than in ordinary instruments.
        let sizes = effect.parameters.iter();
        let sizes = sizes.filter(|(name, _)| !["time_s", "frequency_hz"].contains(&name.as_str()));
        let sizes = sizes.filter_map(|(_, value)| Some(value.as_f64()?.abs()));
        let largest = sizes.fold(largest(&effect.kind), f64::max);
        for (name, estimate) in &claim.numbers {
            let truth = number(effect, name).unwrap_or(0.0);
            let known = name == "time_s" || estimate.std < largest;
            if estimate.std > 0.0 && estimate.std.is_finite() && known {
                list.push((estimate.value - truth) / estimate.std);
            }
        }
    }
    list
}
