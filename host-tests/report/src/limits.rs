//! Writes the sections on what else was considered, what this recording could not have shown, and how to find out.

use maud::{Markup, html};

use super::cell_marks::log_bar;
use super::self_test::self_test;
use super::words::{display_unit, number, plain, raised};
use rlg_findings::result::{Diagnosis, Verdict};
use rlg_findings::sentences::NEEDED_SNR;

/// Most rival kinds that are listed; further ones explain even less.
const MOST_RIVALS: usize = 8;

/// Evidence (ln) behind the winner below which another name is not ruled out: odds of 150 to 1, "very
/// strong" on Kass and Raftery's scale.
const DECISIVE_GAIN: f64 = 5.0;

/// Beginning of a summary line about a name that was refused.
const NOT_NAMED_PREFIX: &str = "Not named: ";

/// Beginning of a summary line about noise that drifts.
const DRIFTS: &str = "Drift: ";

/// Lists what else was considered, and why it was not named.
pub fn considered(diagnosis: &Diagnosis) -> Markup {
    let refused: Vec<&str> = diagnosis
        .summary
        .iter()
        .filter_map(|line| line.strip_prefix(NOT_NAMED_PREFIX))
        .collect();
    let drifts: Vec<&String> = diagnosis
        .summary
        .iter()
        .filter(|line| line.starts_with(DRIFTS))
        .collect();
    let behind = if diagnosis.effects.is_empty() {
        &[][..]
    } else {
        &diagnosis.runners_up[..]
    };
    if refused.is_empty() && behind.is_empty() && drifts.is_empty() {
        return html! {};
    }
    html! {
        section {
            h2 { "What else was considered" }
            @for line in &drifts { p { (line) } }
            @if !refused.is_empty() {
                ul { @for line in &refused { li { (line) } } }
            }
            @if !behind.is_empty() {
                div.scroll { table {
                    thead { tr { th { "instead of the first finding" } th { "evidence behind it (ln)" } th {} } }
                    tbody {
                        @for rival in behind.iter().take(MOST_RIVALS) {
                            tr {
                                td { (plain(&rival.kind)) }
                                td.number { (number((rival.behind * 10.0).round() / 10.0)) }
                                td { @if rival.behind < DECISIVE_GAIN { "not ruled out" } @else { "explains less of the residual" } }
                            }
                        }
                    }
                } }
                @if behind.len() > MOST_RIVALS {
                    p.note { "And " (behind.len() - MOST_RIVALS) " further kinds, further behind. A step of 5 is odds of 150 to 1." }
                }
            }
        }
    }
}

/// Lists how large each kind would have had to be to be found.
pub fn sensitivity(diagnosis: &Diagnosis) -> Markup {
    let mut reach: Vec<_> = diagnosis.sensitivity.iter().collect();
    reach.sort_by(|a, b| b.snr.total_cmp(&a.snr));
    let (low, high) = super::plot::ends(reach.iter().map(|entry| entry.snr))
        .map_or((1.0, 10.0), |(low, high)| {
            (low.clamp(0.1, 1.0), high.max(10.0))
        });
    html! {
        @if !reach.is_empty() {
            section {
                h2 { "How sensitive this recording is" }
                p {
                    @if diagnosis.verdict == Verdict::Matches {
                        "Nothing was found. That is worth as much as what would have been found. "
                    }
                    "Below, each kind at a size that such instruments show, with the signal-to-noise ratio that this recording's motion and noise give it. "
                    "From " (number(NEEDED_SNR)) " on (the line; logarithmic scale) it is found reliably; the last column is the size at which that happens."
                }
                div.scroll { table.bars.reach {
                    thead { tr { th { "kind" } th { "typical size" } th { "signal to noise" } th {} th { "found from" } } }
                    tbody {
                        @for entry in &reach {
                            @let (factor, unit) = display_unit(&entry.unit);
                            @let from = entry.typical * NEEDED_SNR / entry.snr;
                            tr {
                                td { (plain(&entry.kind)) }
                                td.number { (two_digits(entry.typical * factor)) " " (unit) }
                                td.number { (two_digits(entry.snr)) }
                                td.wide { (log_bar(entry.snr, low, high, NEEDED_SNR)) }
                                td.number { (two_digits(from * factor)) " " (unit) }
                            }
                        }
                    }
                } }
                @if let Some(test) = diagnosis.self_test.as_ref().filter(|test| test.slides > 0) { (self_test(test)) }
            }
        }
    }
}

fn two_digits(value: f64) -> String {
    number(format!("{value:.1e}").parse().unwrap_or(value))
}

/// Lists the kinds that could not have been found, by reason.
pub fn not_excluded(diagnosis: &Diagnosis) -> Markup {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for line in &diagnosis.not_excluded {
        let (kind, reason) = line.split_once(": ").unwrap_or((line, ""));
        match reasons.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, kinds)) => kinds.push(kind),
            None => reasons.push((reason, vec![kind])),
        }
    }
    html! {
        @if !reasons.is_empty() {
            section {
                h2 { "What this recording could not have shown" }
                ul {
                    @for (reason, kinds) in &reasons {
                        li {
                            @for (place, kind) in kinds.iter().enumerate() {
                                @if place > 0 { ", " }
                                b { (plain(kind)) }
                            }
                            @if !reason.is_empty() { ": " (raised(reason)) }
                        }
                    }
                }
            }
        }
    }
}

/// Describes the motion that separates what is confused.
pub fn next_experiment(diagnosis: &Diagnosis) -> Markup {
    html! {
        @if !diagnosis.next_experiment.is_empty() {
            section {
                h2 { "The next experiment" }
                p { (diagnosis.next_experiment) }
            }
        }
    }
}
