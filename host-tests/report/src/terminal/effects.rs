//! Text on the findings, a line each: physics by its share of the difference, then data faults, then unexplained stretches.
//! Many of one kind are one line with their number.

use std::collections::BTreeSet;

use rlg_findings::names::{plain, spaced};
use rlg_findings::numbers::seconds;
use rlg_findings::own_mode;
use rlg_findings::result::{Diagnosis, EffectEntry, UNLISTED, number_of, text_of};
use rlg_plan::FindingsPlan;

use super::sizes::{strength, words};
use crate::lines::{frequency, is_band, is_line};

/// Group of entries that share a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Group<'a> {
    /// Physics of one kind.
    Kind(&'a str),
    /// An expression, on a separate line.
    Expression(&'a str, &'a str),
    /// Steady lines of a unit at rest.
    Lines,
    /// Bands of noise of a unit at rest.
    Bands,
    /// Rows of one fault.
    Fault(&'a str),
    /// Corrected channels, described in a sentence.
    Sentence(&'a str),
    /// Stretches without an explanation.
    Unexplained,
}

fn group(effect: &EffectEntry) -> Group<'_> {
    let parameters = &effect.parameters;
    let kind = effect.kind.as_str();
    match &effect.expression {
        _ if is_line(effect) => Group::Lines,
        _ if is_band(effect) => Group::Bands,
        Some(expression) if kind == UNLISTED => {
            Group::Expression(text_of(parameters, "axis").unwrap_or_default(), expression)
        }
        None if kind == UNLISTED => Group::Unexplained,
        _ if text_of(parameters, "channel").is_some()
            && number_of(parameters, "start_s").is_some() =>
        {
            Group::Fault(kind)
        }
        _ if kind.starts_with("channel_") => Group::Sentence(kind),
        _ => Group::Kind(kind),
    }
}

/// Faults of the data that are alike: many places of one kind, and their line.
pub(crate) fn fault_groups(diagnosis: &Diagnosis) -> Vec<(String, Vec<&EffectEntry>)> {
    let mut groups: Vec<(&str, Vec<&EffectEntry>)> = Vec::new();
    for effect in &diagnosis.effects {
        if let Group::Fault(kind) = group(effect) {
            match groups.iter_mut().find(|(known, _)| *known == kind) {
                Some((_, members)) => members.push(effect),
                None => groups.push((kind, vec![effect])),
            }
        }
    }
    groups.retain(|(_, members)| members.len() > 1);
    let members = groups.into_iter().map(|(_, members)| members);
    members.map(|members| (faults(&members), members)).collect()
}

/// Names and sizes of all effects and of the registration, in the order of their lines.
pub(super) fn said(diagnosis: &Diagnosis) -> Vec<(String, String)> {
    let mut groups: Vec<(Group<'_>, Vec<&EffectEntry>)> = Vec::new();
    for effect in &diagnosis.effects {
        let own = group(effect);
        match groups.iter_mut().find(|(known, _)| *known == own) {
            Some((_, members)) => members.push(effect),
            None => groups.push((own, vec![effect])),
        }
    }
    let plan = &diagnosis.thresholds().findings;
    let share = |members: &[&EffectEntry]| {
        let evidence = members[0].evidence.as_ref();
        evidence.map_or(f64::INFINITY, |one| one.share)
    };
    let rank = |group: &Group<'_>| match group {
        Group::Sentence(_) => 0,
        Group::Kind(_) | Group::Expression(..) | Group::Lines | Group::Bands => 1,
        Group::Fault(_) => 2,
        Group::Unexplained => 3,
    };
    groups.sort_by(|(a, of_a), (b, of_b)| {
        rank(a)
            .cmp(&rank(b))
            .then(share(of_b).total_cmp(&share(of_a)))
    });
    let mut said: Vec<(String, String)> = groups
        .iter()
        .map(|(group, members)| one(*group, members, plan))
        .collect();
    let kinds: Vec<&str> = diagnosis
        .effects
        .iter()
        .map(|one| one.kind.as_str())
        .collect();
    let registration = diagnosis.registration.iter();
    let registration =
        registration.filter(|one| one.supported && !kinds.contains(&one.kind.as_str()));
    said.extend(registration.map(|one| {
        let words = words(
            &one.kind,
            &one.parameters,
            None,
            plan.significant_deviations,
        );
        (words.name, words.sizes)
    }));
    said
}

/// Lines of all effects and of the registration, at most `room`.
pub(super) fn lines(diagnosis: &Diagnosis, room: usize) -> Vec<String> {
    let mut said = said(diagnosis);
    let hidden = said.len().saturating_sub(room);
    if hidden > 0 {
        said.truncate(room.saturating_sub(1));
    }
    let width = said.iter().map(|(name, _)| name.chars().count()).max();
    let width = width.unwrap_or(0);
    let mut lines: Vec<String> = said
        .iter()
        .map(|(name, sizes)| format!("  {name:<width$}   {sizes}"))
        .collect();
    if hidden > 0 {
        lines.push(format!("  and {} more, all in diagnosis.json", hidden + 1));
    }
    lines
}

/// Alternative causes of each effect.
pub(super) fn not_distinguishable(diagnosis: &Diagnosis) -> Option<String> {
    let plan = &diagnosis.thresholds().findings;
    let mut said: Vec<String> = Vec::new();
    for effect in &diagnosis.effects {
        let rivals = rivals(effect, plan);
        if !rivals.is_empty() {
            let words = format!("{} or {}", plain(&effect.kind), rivals.join(" or "));
            if !said.contains(&words) {
                said.push(words);
            }
        }
    }
    let apart = (!said.is_empty()).then(|| format!("Not distinguishable: {}.", said.join("; ")));
    let own: BTreeSet<String> = diagnosis
        .effects
        .iter()
        .filter_map(|one| own_mode::sentence(one, plan))
        .collect();
    let all: Vec<String> = apart.into_iter().chain(own).collect();
    (!all.is_empty()).then(|| all.join(" "))
}

/// Alternative causes of one effect in words.
fn rivals(effect: &EffectEntry, plan: &FindingsPlan) -> Vec<String> {
    let alike = effect.indistinguishable_from.iter();
    let alike = alike.filter(|kind| !effect.gravity_speaks_against.contains(kind));
    let has_own = own_mode::sentence(effect, plan).is_some();
    let alike = alike.filter(|kind| !own_mode::is_own_physics(effect, kind, plan));
    let mut words: Vec<String> = alike
        .map(|kind| match &effect.expression {
            Some(expression) if kind == UNLISTED && effect.kind != UNLISTED => expression.clone(),
            _ => plain(kind),
        })
        .collect();
    let is_class = effect
        .evidence
        .as_ref()
        .is_some_and(|one| one.label == "class");
    if words.is_empty() && is_class && !has_own {
        words.push("drift of the gyro".to_owned());
    }
    words
}

/// Line of a group: its name and description.
fn one(group: Group<'_>, members: &[&EffectEntry], plan: &FindingsPlan) -> (String, String) {
    match group {
        Group::Kind(kind) => sized(plain(kind), members, plan),
        Group::Expression(axis, expression) => {
            let deviations = plan.significant_deviations;
            let words = words(
                UNLISTED,
                &members[0].parameters,
                Some(members[0]),
                deviations,
            );
            let who = match axis {
                "" => "the gyros follow".to_owned(),
                axis => format!("gyro {axis} follows"),
            };
            (
                format!("{who} {expression}"),
                format!("{}; no effect of the catalogue", words.sizes),
            )
        }
        Group::Lines => ("spectral lines".to_owned(), strongest_of(members, plan)),
        Group::Bands => ("noise in a band".to_owned(), strongest_of(members, plan)),
        Group::Fault(kind) => (plain(kind), faults(members)),
        Group::Sentence(kind) => (plain(kind), members[0].what_was_left_out.clone()),
        Group::Unexplained => {
            let said = &members[0].what_was_left_out;
            match members.len() {
                1 => ("not explained".to_owned(), said.clone()),
                count => (
                    "not explained".to_owned(),
                    format!("{count} stretches; the first: {said}"),
                ),
            }
        }
    }
}

/// Size of the strongest line or band, and their number.
fn strongest_of(members: &[&EffectEntry], plan: &FindingsPlan) -> String {
    let (_, sizes) = sized(String::new(), &members[..1], plan);
    let hz = frequency(members[0]);
    match members.len() {
        1 => format!("{hz} Hz: {sizes}"),
        count => format!("{count} of them, the strongest at {hz} Hz: {sizes}"),
    }
}

/// Sizes of one kind; of several effects the strongest, and their number.
fn sized(name: String, members: &[&EffectEntry], plan: &FindingsPlan) -> (String, String) {
    let strongest = members
        .iter()
        .max_by(|a, b| strength(a).total_cmp(&strength(b)));
    let Some(strongest) = strongest else {
        return (name, String::new());
    };
    let deviations = plan.significant_deviations;
    let words = words(
        &strongest.kind,
        &strongest.parameters,
        Some(strongest),
        deviations,
    );
    match members.len() {
        1 if words.sizes.is_empty() => (name, strongest.what_was_left_out.clone()),
        1 => (words.name, words.sizes),
        count if words.sizes.is_empty() => (
            name,
            format!(
                "{count} of them; the first: {}",
                members[0].what_was_left_out
            ),
        ),
        count => (
            name,
            format!(
                "{count} of them, the largest: {} {}",
                words.name, words.sizes
            ),
        ),
    }
}

/// Data faults of one kind, of whole rows or by channel: rows, places, times.
fn faults(members: &[&EffectEntry]) -> String {
    let rows_of = |effect: &EffectEntry| effect.text("rows_of").map(str::to_owned);
    let (whole, members): (Vec<&EffectEntry>, Vec<&EffectEntry>) =
        members.iter().partition(|effect| rows_of(effect).is_some());
    let owner = whole.first().and_then(|effect| rows_of(effect));
    let mut each: Vec<String> = owner
        .map(|owner| in_words(&whole, &format!(" of {owner}")))
        .into_iter()
        .collect();
    let mut channels: Vec<(String, Vec<&EffectEntry>)> = Vec::new();
    for effect in members {
        let channel = spaced(effect.text("channel").unwrap_or_default());
        match channels.iter_mut().find(|(known, _)| *known == channel) {
            Some((_, places)) => places.push(effect),
            None => channels.push((channel, vec![effect])),
        }
    }
    let mut said: Vec<(Vec<String>, String)> = Vec::new();
    for (channel, places) in channels {
        let words = in_words(&places, "");
        match said.iter_mut().find(|(_, known)| *known == words) {
            Some((alike, _)) => alike.push(channel),
            None => said.push((vec![channel], words)),
        }
    }
    let of_channels = said
        .iter()
        .map(|(alike, words)| format!("{}: {words}", alike.join(", ")));
    each.extend(of_channels);
    each.join("; ")
}

/// Rows, places and times of faults; `of_owner`: their owner, after the number of rows.
fn in_words(places: &[&EffectEntry], of_owner: &str) -> String {
    let of = |name: &'static str| {
        let values = places.iter();
        values.filter_map(move |one| Some(one.number(name)?.0))
    };
    let from_s = of("start_s").fold(f64::INFINITY, f64::min);
    let to_s = of("end_s").fold(0.0, f64::max);
    let between = format!("{}–{} s", seconds(from_s), seconds(to_s));
    if let Some(rows) = of("rows").next() {
        // The standard deviation of a time is that of one sample.
        let age_ms = 1e3 * 0.5 * (1.0 - 1.0 / rows) * row_s(places[0]);
        return format!("each sample held for {rows:.4} rows (mean age {age_ms:.1} ms), {between}")
            .replace(".0000 rows", " rows");
    }
    let rows: f64 = places
        .iter()
        .map(|one| {
            let at = |name: &str| Some(one.number(name)?.0);
            let long_s = at("end_s").unwrap_or(0.0) - at("start_s").unwrap_or(0.0);
            let counted = at("row_count");
            counted.unwrap_or_else(|| (long_s / row_s(one)).round())
        })
        .sum();
    let count = of("count").sum::<f64>();
    let places = if count > 0.0 {
        count
    } else {
        places.len() as f64
    };
    let word = if rows == 1.0 { "row" } else { "rows" };
    match (rows.is_finite(), places == 1.0 || places == rows) {
        (true, true) => format!("{rows} {word}{of_owner}, {between}"),
        (true, false) => format!("{rows} {word}{of_owner} in {places} places, {between}"),
        _ => format!("{places} places, {between}"),
    }
}

/// Length of a row \[s\]: a fault is located to the row.
fn row_s(fault: &EffectEntry) -> f64 {
    fault.number("start_s").map_or(f64::NAN, |(_, std)| std)
}
