//! Table of the marks: each with its figure, its confidence limits, and the trials that count against it.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Serialize;

use super::by_effect::{EffectRow, rows, words};
use super::groups::{Counts, Failure, Judged, failure, groups, id};
use super::judge::{Judgement, Score, judge};
use super::run::{Outcome, Plan};
use crate::acceptance::record::Answer;
use crate::chance::{limits, upper_limit};
use crate::marks::family::Family;

/// Limit for the requirement "none": met if the upper limit of the share is below it; 0 of 600 gives 0.5 %.
const NONE_BELOW: f64 = 5e-3;

/// Number of trials from which a share is judged by its figure alone.
const ENOUGH: usize = 300;

/// Status of a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Met.
    Met,
    /// Missed.
    Missed,
    /// Too few trials for a decision.
    Open,
}

/// Mark with its counts.
#[derive(Debug, Clone, Serialize)]
pub struct Mark {
    /// Counted quantity.
    pub mark: String,
    /// Requirement.
    pub needed: String,
    /// Number of hits.
    pub hits: usize,
    /// Number of trials.
    pub of: usize,
    /// 95 % limits of the share (Clopper and Pearson); one-sided for zero hits.
    pub limits_95: [f64; 2],
    /// Met, missed or open.
    pub status: Status,
    /// `seed:number` of the trials that count against it.
    pub against: Vec<String>,
}

/// Requirement on a share.
#[derive(Debug, Clone, Copy)]
enum Need {
    None,
    AtLeast(f64),
    AtMost(f64),
    Within(f64, f64),
}

/// `challenge.json` of the marks.
#[derive(Debug, Clone, Serialize)]
pub struct Scores {
    /// Format of this file.
    pub format: u32,
    /// Version of the tool.
    pub version: &'static str,
    /// Plan of the run.
    pub plan: Plan,
    /// Number of trials.
    pub trials: usize,
    /// Marks.
    pub marks: Vec<Mark>,
    /// Results by concealed effect.
    pub effects: Vec<EffectRow>,
    /// Counts by group of trials, nulls and positives apart.
    pub groups: BTreeMap<String, Counts>,
    /// Trials with an incorrect diagnosis.
    pub failures: Vec<Failure>,
}

fn status(need: Need, hits: usize, of: usize, [low, high]: [f64; 2]) -> Status {
    let share = hits as f64 / of.max(1) as f64;
    let (sure_met, sure_missed, met_now) = match need {
        Need::None => (high <= NONE_BELOW && hits == 0, hits > 0, false),
        Need::AtLeast(least) => (low >= least, high < least, share >= least),
        Need::AtMost(most) => (high <= most, low > most, share <= most),
        Need::Within(at, by) => (
            low >= at - by && high <= at + by,
            low > at + by || high < at - by,
            (share - at).abs() <= by,
        ),
    };
    let enough = of >= ENOUGH && !matches!(need, Need::None);
    match () {
        () if of == 0 => Status::Open,
        () if sure_met || (enough && met_now) => Status::Met,
        () if sure_missed || enough => Status::Missed,
        () => Status::Open,
    }
}

fn mark(name: &str, need: Need, hits: usize, of: usize, against: Vec<String>) -> Mark {
    let limits_95 = if hits == 0 {
        [0.0, upper_limit(0, of)]
    } else {
        limits(hits, of)
    };
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    Mark {
        mark: name.to_owned(),
        needed: match need {
            Need::None => "0".to_owned(),
            Need::AtLeast(least) => format!("≥ {}", percent(least)),
            Need::AtMost(most) => format!("≤ {}", percent(most)),
            Need::Within(at, by) => format!("{} ± {}", percent(at), percent(by)),
        },
        hits,
        of,
        limits_95,
        status: status(need, hits, of, limits_95),
        against,
    }
}

/// Selection of a mark's trials: a family, with or without a concealed effect.
type Of<'a> = dyn Fn(&Answer) -> bool + 'a;

fn false_names(name: &str, of: &Of, judged: &[Judged]) -> Mark {
    let answered = |judged: &&Judged| of(judged.0) && judged.1.score != Score::Unanswered;
    let own: Vec<&Judged> = judged.iter().filter(answered).collect();
    let wrong = own
        .iter()
        .filter(|(_, judgement)| judgement.score == Score::Wrong);
    let against: Vec<String> = wrong.map(|(answer, _)| id(answer)).collect();
    mark(name, Need::None, against.len(), own.len(), against)
}

fn right_names(name: &str, of: &Of, judged: &[Judged]) -> Mark {
    // "Or drift" is neither a false name nor a miss.
    let own: Vec<&Judged> = judged
        .iter()
        .filter(|(answer, judgement)| {
            of(answer) && !matches!(judgement.score, Score::Unanswered | Score::OrDrift)
        })
        .collect();
    let against: Vec<String> = own
        .iter()
        .filter(|(_, judgement)| judgement.score != Score::Right)
        .map(|(answer, _)| id(answer))
        .collect();
    let hits = own.len() - against.len();
    mark(name, Need::AtLeast(0.98), hits, own.len(), against)
}

fn second_passes(judged: &[Judged]) -> Mark {
    let asked = judged
        .iter()
        .filter_map(|(answer, judgement)| Some((answer, judgement.matches_again?)));
    let all: Vec<(&&Answer, bool)> = asked.collect();
    let failed = all.iter().filter(|(_, matches)| !matches);
    let against: Vec<String> = failed.map(|(answer, _)| id(answer)).collect();
    let hits = all.len() - against.len();
    let name = "second passes with the written model that match";
    mark(name, Need::AtLeast(0.98), hits, all.len(), against)
}

fn pulls(judged: &[Judged]) -> [Mark; 2] {
    let all: Vec<f64> = judged
        .iter()
        .flat_map(|(_, judgement)| judgement.pulls.iter().map(|pull| pull.abs()))
        .collect();
    let beyond = |sigmas: f64| all.iter().filter(|pull| **pull > sigmas).count();
    let far = judged
        .iter()
        .filter(|(_, judgement)| judgement.pulls.iter().any(|pull| pull.abs() > 3.0));
    let within = all.len() - beyond(1.0);
    [
        mark(
            "parameters more than 3 σ from the truth",
            Need::AtMost(0.01),
            beyond(3.0),
            all.len(),
            far.map(|(answer, _)| id(answer)).collect(),
        ),
        mark(
            "parameters within 1 σ of the truth",
            Need::Within(0.683, 0.02),
            within,
            all.len(),
            Vec::new(),
        ),
    ]
}

fn unanswered(judged: &[Judged]) -> Mark {
    let against: Vec<String> = judged
        .iter()
        .filter(|(_, judgement)| judgement.score == Score::Unanswered)
        .map(|(answer, _)| id(answer))
        .collect();
    let name = "recordings without an answer";
    mark(name, Need::None, against.len(), judged.len(), against)
}

/// Marks of trials without a concealed effect.
const NULLS: [(&str, Family); 10] = [
    (
        "false names, ordinary motions without effects",
        Family::Null,
    ),
    (
        "false names, drifting gyros (walks of 0.05 and 0.3 Hz, flicker)",
        Family::Drift,
    ),
    (
        "false names, weakest drift (walk of 0.01 Hz, 120 to 200 s)",
        Family::WeakDrift,
    ),
    (
        "false names, dithered counts at 4 kHz",
        Family::DitheredNull,
    ),
    ("false names, an hour", Family::Hour),
    ("false names, beside attitudes", Family::Attitude),
    ("false names, at rest, drift included", Family::Rest),
    ("false names, with accelerometers", Family::Force),
    (
        "false names, accelerometers in still positions",
        Family::Positions,
    ),
    (
        "false physics, a recording's own noise turned in blocks",
        Family::Recorded,
    ),
];

/// Marks of trials with a concealed effect.
const POSITIVES: [(&str, Family); 11] = [
    ("two motions: nothing is said of them", Family::Unrelated),
    (
        "one bias, scale error or delay: right name or class",
        Family::Basic,
    ),
    (
        "the same on drifting gyros, \"or drift\" not counted",
        Family::DriftBasic,
    ),
    (
        "one effect of another kind: right name or class",
        Family::Single,
    ),
    ("two effects: both right", Family::Pair),
    (
        "dithered counts at 4 kHz, one effect: right name or class",
        Family::Dithered,
    ),
    (
        "beside attitudes, one effect or fault: right name or class",
        Family::Attitude,
    ),
    (
        "at rest, effects or lines: all right, in name or class",
        Family::Rest,
    ),
    (
        "with accelerometers, one effect: right name or class",
        Family::Force,
    ),
    (
        "accelerometers in still positions: all right, in name or class",
        Family::Positions,
    ),
    (
        "planted into a recording of others: right name or class",
        Family::Recorded,
    ),
];

/// True if a trial is listed: it is not right, a parameter is far off, or the second pass does not match.
fn is_off(judgement: &Judgement) -> bool {
    let is_right = matches!(judgement.score, Score::Right | Score::OrDrift);
    !is_right || judgement.far().next().is_some() || judgement.matches_again == Some(false)
}

/// Scores a run.
pub fn score(plan: &Plan, answers: &[Answer], outcomes: &[Outcome]) -> Scores {
    let judged: Vec<Judged> = answers
        .iter()
        .zip(outcomes)
        .map(|(answer, outcome)| (answer, judge(answer, outcome)))
        .collect();
    let conceals = |family: Family, something: bool| {
        move |answer: &Answer| answer.family == family && answer.effects.is_empty() != something
    };
    let mut marks: Vec<Mark> = Vec::new();
    for (name, family) in NULLS {
        marks.push(false_names(name, &conceals(family, false), &judged));
    }
    for (name, family) in POSITIVES {
        marks.push(right_names(name, &conceals(family, true), &judged));
    }
    marks.push(second_passes(&judged));
    // Marks without trials in the plan are left out.
    marks.retain(|mark| mark.of > 0);
    marks.extend(pulls(&judged));
    marks.push(unanswered(&judged));
    Scores {
        format: 1,
        version: env!("CARGO_PKG_VERSION"),
        plan: plan.clone(),
        trials: judged.len(),
        marks,
        effects: rows(&judged),
        groups: groups(&judged),
        failures: judged
            .iter()
            .filter(|(_, judgement)| is_off(judgement))
            .map(failure)
            .collect(),
    }
}

impl Scores {
    /// Formats the table.
    pub fn table(&self) -> String {
        let mut text = String::new();
        for mark in &self.marks {
            let word = match mark.status {
                Status::Met => "met",
                Status::Missed => "MISSED",
                Status::Open => "open",
            };
            let figure = if mark.of == 0 {
                "no trials".to_owned()
            } else if mark.hits == 0 {
                format!("0 of {}: below {:.2} %", mark.of, 100.0 * mark.limits_95[1])
            } else {
                format!(
                    "{} of {}: {:.1} % ({:.1} to {:.1})",
                    mark.hits,
                    mark.of,
                    100.0 * mark.hits as f64 / mark.of as f64,
                    100.0 * mark.limits_95[0],
                    100.0 * mark.limits_95[1]
                )
            };
            let _ = writeln!(
                text,
                "{word:<7} {:<66} {:<15} {figure}",
                mark.mark, mark.needed
            );
        }
        text.push('\n');
        text + &words(&self.effects)
    }
}
