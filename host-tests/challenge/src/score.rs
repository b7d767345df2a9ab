//! Scores of the diagnoses against the concealed effects.
//!
//! From answers and outcomes of the same trials, the [`Scores`], written as `challenge.json`: counts by kind, by setting
//! and by strength, and the marks of the diagnosis with the number of trials of each.
//!
//! A *claim* is a finding with a name of the catalogue (data faults and `unlisted` do not count). A claim is wrong if
//! neither it nor its class (`indistinguishable_from`) contains a concealed kind. A trial is *named* if every concealed
//! kind is claimed and no claim is wrong.

use std::collections::BTreeMap;

use serde::Serialize;
use statrs::distribution::{ContinuousCDF as _, Normal};

use super::answer::{Answer, LADDER};
use super::case::{Case, NAMEABLE, Plan, one_deviation, unread};
use super::catalogue_marks::{Mark, marks};
use super::chance::limits;
use super::examine::Outcome;
use super::trial::Family;

/// Edges of the strength bins.
pub const EDGES: [f64; 10] = [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 15.0, 30.0, 101.0];

/// Counts of like trials.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Counts {
    /// Number of trials.
    pub trials: usize,
    /// The tool reports any effect outside the model.
    pub detected: usize,
    /// Every concealed kind was claimed, alone or in its class, and nothing else.
    pub named: usize,
    /// An absent kind was claimed.
    pub misnamed: usize,
}

impl Counts {
    fn add(&mut self, case: &Case) {
        self.trials += 1;
        self.detected += usize::from(case.is_detected());
        self.named += usize::from(case.is_named());
        let wrong = if case.answer.effects.is_empty() {
            case.is_false()
        } else {
            case.wrong().next().is_some()
        };
        self.misnamed += usize::from(wrong);
    }
}

/// Trials of like strength.
#[derive(Debug, Clone, Serialize)]
pub struct Strength {
    /// Lower edge of the strengths.
    pub from: f64,
    /// Upper edge.
    pub to: f64,
    /// Counts.
    #[serde(flatten)]
    pub counts: Counts,
    /// 95 % limits of the detected share.
    pub detected_limits: [f64; 2],
    /// Theoretical detection probability: a likelihood ratio above the tool's threshold, corrected for its number of kinds.
    pub theory: f64,
}

/// `challenge.json`.
#[derive(Debug, Clone, Serialize)]
pub struct Scores {
    /// Format of this file.
    pub format: u32,
    /// Version of the tool.
    pub version: &'static str,
    /// Plan of the run.
    pub plan: Plan,
    /// Number of scored trials.
    pub scored: usize,
    /// Marks.
    pub marks: Vec<Mark>,
    /// By family.
    pub by_family: BTreeMap<Family, Counts>,
    /// Effect-free records by setting; `misnamed` counts false names.
    pub nulls: BTreeMap<String, Counts>,
    /// By concealed kind, at strengths for which a name is required.
    pub by_kind: BTreeMap<String, Counts>,
    /// Single effects of the catalogue by strength.
    pub by_strength: Vec<Strength>,
    /// Six-parameter effects at the strengths of the marks.
    pub ladder: Vec<Strength>,
    /// Concealed kind → claimed kind → trials, single effects at strengths for which a name is required.
    pub confusion: BTreeMap<String, BTreeMap<String, usize>>,
    /// Sorted probabilities Φ((estimate − truth)/std): uniform for correct intervals.
    pub chances: Vec<f64>,
    /// Trials with a false or wrong name, to repeat with `--trial`.
    pub to_repeat: Vec<Repeat>,
}

/// Trial with a wrong name.
#[derive(Debug, Clone, Serialize)]
pub struct Repeat {
    /// Number of the trial.
    pub trial: u64,
    /// Family.
    pub family: Family,
    /// Setting.
    pub setting: String,
    /// Concealed kinds.
    pub concealed: Vec<String>,
    /// Strength.
    pub rho: f64,
    /// Claimed kinds.
    pub claimed: Vec<String>,
}

/// Scores trials; both lists in the order of the trials.
pub fn score(plan: &Plan, answers: &[Answer], outcomes: &[Outcome]) -> Scores {
    let cases: Vec<Case> = answers
        .iter()
        .zip(outcomes)
        .map(|(answer, outcome)| Case { answer, outcome })
        .collect();
    let mut by_family: BTreeMap<Family, Counts> = BTreeMap::new();
    let mut nulls: BTreeMap<String, Counts> = BTreeMap::new();
    let mut by_kind: BTreeMap<String, Counts> = BTreeMap::new();
    let mut confusion: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for case in &cases {
        by_family.entry(case.answer.family).or_default().add(case);
        if case.answer.family == Family::Null {
            nulls.entry(setting(case.answer)).or_default().add(case);
        }
        if case.answer.rho < NAMEABLE {
            continue;
        }
        for effect in &case.answer.effects {
            let title = title(case.answer, &effect.kind);
            by_kind.entry(title).or_default().add(case);
        }
        if let [only] = case.answer.effects.as_slice() {
            let row = confusion.entry(title(case.answer, &only.kind)).or_default();
            *row.entry(claimed(case, &only.kind)).or_default() += 1;
        }
    }
    let listed = |case: &&Case| matches!(case.answer.family, Family::Single | Family::Detection);
    let singles: Vec<&Case> = cases.iter().filter(listed).collect();
    let strengths = EDGES.windows(2).map(|edge| {
        let inside = |case: &&&Case| (edge[0]..edge[1]).contains(&case.answer.rho);
        strength([edge[0], edge[1]], singles.iter().filter(inside).copied())
    });
    let ladder = LADDER.iter().map(|&rho| {
        let inside = |case: &&&Case| {
            case.answer.family == Family::Detection && (case.answer.rho - rho).abs() < 1e-6
        };
        strength([rho, rho], singles.iter().filter(inside).copied())
    });
    let wrong = cases.iter().filter(|case| match case.answer.family {
        Family::Null => case.is_false() || unread(case.outcome),
        _ => case.wrong().next().is_some() || unread(case.outcome),
    });
    Scores {
        format: 1,
        version: env!("CARGO_PKG_VERSION"),
        plan: plan.clone(),
        scored: cases.len(),
        marks: marks(plan, &cases),
        by_family,
        nulls,
        by_kind,
        by_strength: strengths.collect(),
        ladder: ladder.collect(),
        confusion,
        chances: chances(&cases),
        to_repeat: wrong.map(repeat).collect(),
    }
}

/// Setting of an effect-free record.
pub fn setting(answer: &Answer) -> String {
    if answer.glitches {
        return "glitches".to_owned();
    }
    serde_json::to_value(answer.setting)
        .ok()
        .and_then(|name| name.as_str().map(str::to_owned))
        .unwrap_or_default()
}

/// Title of a kind; for unlisted physics its expression.
fn title(answer: &Answer, kind: &str) -> String {
    let effect = answer.effects.iter().find(|effect| effect.kind == kind);
    let expression = effect.and_then(|effect| effect.parameters.get("expression")?.as_str());
    expression.map_or_else(|| kind.to_owned(), |text| format!("unlisted: {text}"))
}

/// Claim for a concealed kind: itself, a class that contains it, or the other finding.
fn claimed(case: &Case, kind: &str) -> String {
    let mut names: Vec<String> = case
        .outcome
        .findings
        .iter()
        .filter(|one| !one.is_fault())
        .map(|one| match &one.expression {
            _ if one.kind != kind && one.covers(kind) => format!("{} or {kind}", one.kind),
            Some(expression) if expression.starts_with("window(") => {
                "unlisted: described".to_owned()
            }
            Some(_) => "unlisted: expression".to_owned(),
            None if one.kind == "unlisted" => "unlisted: located".to_owned(),
            None => one.kind.clone(),
        })
        .collect();
    names.sort();
    names.dedup();
    match names.len() {
        0 => "nothing".to_owned(),
        1 | 2 => names.join(" + "),
        more => format!("{} + {} more", names[0], more - 1),
    }
}

fn strength<'a>(edge: [f64; 2], cases: impl Iterator<Item = &'a Case<'a>>) -> Strength {
    let mut counts = Counts::default();
    let mut theory = 0.0;
    for case in cases {
        counts.add(case);
        theory += case.theory();
    }
    Strength {
        from: edge[0],
        to: edge[1],
        detected_limits: limits(counts.detected, counts.trials),
        theory: theory / counts.trials.max(1) as f64,
        counts,
    }
}

/// One parameter of every named trial, chosen by the trial: independent of each other.
fn chances(cases: &[Case]) -> Vec<f64> {
    let Ok(law) = Normal::new(0.0, 1.0) else {
        return Vec::new();
    };
    let mut list: Vec<f64> = one_deviation(cases)
        .into_iter()
        .map(|[own, _]| law.cdf(own))
        .collect();
    list.sort_by(f64::total_cmp);
    list
}

fn repeat(case: &Case) -> Repeat {
    let claims = case.outcome.findings.iter().filter(|one| !one.is_fault());
    Repeat {
        trial: case.answer.trial,
        family: case.answer.family,
        setting: setting(case.answer),
        concealed: case
            .answer
            .effects
            .iter()
            .map(|effect| title(case.answer, &effect.kind))
            .collect(),
        rho: case.answer.rho,
        claimed: if unread(case.outcome) {
            vec![case.outcome.verdict.clone()]
        } else {
            claims
                .map(|one| one.expression.clone().unwrap_or_else(|| one.kind.clone()))
                .collect()
        },
    }
}
