//! Judged trials in groups, and the list of failures.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use super::judge::{Judgement, Score};
use crate::acceptance::record::Answer;
use crate::marks::family::Family;

/// An answer with its judgement.
pub type Judged<'a> = (&'a Answer, Judgement);

/// Returns `seed:number`.
pub fn id(answer: &Answer) -> String {
    format!("{}:{}", answer.seed, answer.trial)
}

/// Trial with an incorrect diagnosis.
#[derive(Debug, Clone, Serialize)]
pub struct Failure {
    /// `seed:number`.
    pub trial: String,
    /// Family.
    pub family: Family,
    /// Setting in words.
    pub setting: String,
    /// Concealed effects, with ρ.
    pub concealed: Vec<String>,
    /// Claims.
    pub claimed: Vec<String>,
    /// Score.
    pub score: Score,
    /// Normalised errors (estimate − truth)/σ beyond the limit.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub far: Vec<f64>,
}

/// Counts of like trials by score.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Counts {
    /// Right, or no claim on a null.
    pub right: usize,
    /// Right, "or drift".
    pub or_drift: usize,
    /// Not named.
    pub missed: usize,
    /// Named wrongly.
    pub wrong: usize,
    /// No answer.
    pub unanswered: usize,
}

impl Counts {
    /// Sum of two counts.
    pub fn and(self, other: Self) -> Self {
        Self {
            right: self.right + other.right,
            or_drift: self.or_drift + other.or_drift,
            missed: self.missed + other.missed,
            wrong: self.wrong + other.wrong,
            unanswered: self.unanswered + other.unanswered,
        }
    }

    /// Returns the number of trials.
    pub fn all(&self) -> usize {
        self.right + self.or_drift + self.missed + self.wrong + self.unanswered
    }

    /// Counts one more trial.
    pub fn add(&mut self, score: Score) {
        *match score {
            Score::Right => &mut self.right,
            Score::OrDrift => &mut self.or_drift,
            Score::Missed => &mut self.missed,
            Score::Wrong => &mut self.wrong,
            Score::Unanswered => &mut self.unanswered,
        } += 1;
    }
}

/// Returns a judged trial in the form of the list.
pub fn failure((answer, judgement): &Judged) -> Failure {
    Failure {
        trial: id(answer),
        family: answer.family,
        setting: answer
            .setting
            .as_ref()
            .map(|setting| setting.words())
            .or_else(|| Some(answer.conditions.join(", ")).filter(|words| !words.is_empty()))
            .unwrap_or_else(|| "dithered counts".to_owned()),
        concealed: answer
            .effects
            .iter()
            .map(|effect| {
                let of = |(name, value): (&String, &Value)| match value.as_f64() {
                    Some(number) => format!("{name} {number:.3e}"),
                    None => format!("{name} {}", value.as_str().unwrap_or_default()),
                };
                let numbers: Vec<String> = effect.parameters.iter().map(of).collect();
                format!(
                    "{} [{}] ρ {:.0}",
                    effect.kind,
                    numbers.join(" "),
                    effect.rho
                )
            })
            .collect(),
        claimed: judgement.claims.clone(),
        score: judgement.score,
        far: judgement.far().collect(),
    }
}

/// Counts trials by motion, reference, rate, length, declaration, drift and kind.
pub fn groups(judged: &[Judged]) -> BTreeMap<String, Counts> {
    let mut groups: BTreeMap<String, Counts> = BTreeMap::new();
    for (answer, judgement) in judged {
        let side = if answer.effects.is_empty() {
            "null"
        } else {
            "positive"
        };
        let mut names = vec![format!("family {}", answer.family.name())];
        if let Some(setting) = &answer.setting {
            names.extend(setting.groups());
        }
        let conditions = answer.conditions.iter();
        names.extend(
            conditions
                .filter(|name| !name.starts_with("length"))
                .cloned(),
        );
        names.extend(
            answer
                .effects
                .iter()
                .map(|effect| format!("kind {}", effect.kind)),
        );
        for name in names {
            let counts = groups.entry(format!("{side}, {name}")).or_default();
            counts.add(judgement.score);
        }
    }
    groups
}
