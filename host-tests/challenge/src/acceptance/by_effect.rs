//! Results by concealed effect: share named correctly, normalised errors of the parameters, outcome of a second pass.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Serialize;

use super::groups::{Counts, Judged};
use crate::acceptance::record::Answer;

/// Results of trials with the same concealed effect.
#[derive(Debug, Clone, Serialize)]
pub struct EffectRow {
    /// Concealed effect.
    pub effect: String,
    /// Trials by score.
    pub counts: Counts,
    /// Number of identifiable parameters.
    pub numbers: usize,
    /// Root mean square of (estimate − truth)/σ.
    pub pull_rms: f64,
    /// Number of parameters more than 3 σ from the truth.
    pub beyond_3: usize,
    /// Number of recordings that match the updated model.
    pub match_again: usize,
    /// Number of recordings diagnosed again.
    pub again: usize,
}

/// Returns one row for each concealed effect.
pub fn rows(judged: &[Judged]) -> Vec<EffectRow> {
    let mut by_effect: BTreeMap<String, Vec<&Judged>> = BTreeMap::new();
    for one in judged {
        by_effect.entry(name(one.0)).or_default().push(one);
    }
    by_effect
        .into_iter()
        .map(|(effect, list)| row(effect, &list))
        .collect()
}

fn name(answer: &Answer) -> String {
    let kinds: Vec<&str> = answer.effects.iter().map(|one| one.kind.as_str()).collect();
    match &answer.planted {
        Some(planted) => planted.clone(),
        None if kinds.is_empty() => "none".to_owned(),
        None => kinds.join(" + "),
    }
}

fn row(effect: String, list: &[&Judged]) -> EffectRow {
    let mut counts = Counts::default();
    list.iter()
        .for_each(|(_, judgement)| counts.add(judgement.score));
    let of_all = || list.iter().map(|(_, judgement)| judgement);
    let squares: Vec<f64> = of_all()
        .flat_map(|judgement| judgement.pulls.iter().map(|pull| pull * pull))
        .collect();
    let again: Vec<bool> = of_all()
        .filter_map(|judgement| judgement.matches_again)
        .collect();
    EffectRow {
        effect,
        counts,
        numbers: squares.len(),
        pull_rms: (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt(),
        beyond_3: of_all().map(|judgement| judgement.far().count()).sum(),
        match_again: again.iter().filter(|matches| **matches).count(),
        again: again.len(),
    }
}

/// Formats the table.
pub fn words(rows: &[EffectRow]) -> String {
    let mut text = format!(
        "{:<36} {:>6} {:>6} {:>8} {:>6} {:>6} {:>7}   {:<24} {}\n",
        "concealed",
        "trials",
        "right",
        "or drift",
        "wrong",
        "missed",
        "refused",
        "pulls: rms, beyond 3 σ",
        "second pass matches"
    );
    for row in rows {
        let counts = &row.counts;
        let pulls = match row.numbers {
            0 => "–".to_owned(),
            numbers => format!("{:.2}, {} of {numbers}", row.pull_rms, row.beyond_3),
        };
        let again = match row.again {
            0 => "–".to_owned(),
            again => format!("{} of {again}", row.match_again),
        };
        let _ = writeln!(
            text,
            "{:<36} {:>6} {:>6} {:>8} {:>6} {:>6} {:>7}   {pulls:<24} {again}",
            row.effect,
            counts.all(),
            counts.right,
            counts.or_drift,
            counts.wrong,
            counts.missed,
            counts.unanswered,
        );
    }
    text
}
