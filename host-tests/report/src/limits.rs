//! Sections on the alternatives considered, and on the effects undetectable in this recording.

use maud::{Markup, html};

use super::cell_marks::log_bar;
use super::self_test::self_test;
use super::words::{Scale, number, plain, raised};
use rlg_findings::result::{Diagnosis, RunnerUp, SelfTestEntry, Sensitivity, Verdict};
use rlg_findings::sentences::REJECTED;

/// Difference of ln evidence below which another name is not ruled out: odds of 150 to 1, "very strong" on Kass and
/// Raftery's scale.
const DECISIVE_GAIN: f64 = 5.0;

/// Start of a summary line about noise that drifts.
const DRIFTS: &str = "Drift: ";

/// Lists the alternatives: those not ruled out, those the evidence disfavours, and the reasons for rejected names.
pub fn considered(diagnosis: &Diagnosis) -> Markup {
    let summary = diagnosis.summary.iter();
    let refused = summary
        .clone()
        .filter_map(|line| line.strip_prefix(REJECTED));
    let refused: Vec<&str> = refused.collect();
    let drifts: Vec<&String> = summary.filter(|line| line.starts_with(DRIFTS)).collect();
    let behind = if diagnosis.effects.is_empty() {
        &[][..]
    } else {
        &diagnosis.runners_up[..]
    };
    // A kind that the recording does not excite is not testable.
    let excited = behind
        .iter()
        .filter(|rival| is_excited(diagnosis, &rival.kind));
    let (open, disfavoured): (Vec<&RunnerUp>, Vec<&RunnerUp>) =
        excited.partition(|rival| rival.behind < DECISIVE_GAIN);
    if refused.is_empty() && open.is_empty() && disfavoured.is_empty() && drifts.is_empty() {
        return html! {};
    }
    html! {
        section {
            h2 { "Alternatives considered" }
            @for line in &drifts { p { (line) } }
            @if !refused.is_empty() {
                ul { @for line in &refused { li { (line) } } }
            }
            @if !open.is_empty() {
                p { b { "Not ruled out" } " instead of a finding above: " (rivals(&open)) "." }
            }
            @if !disfavoured.is_empty() {
                p { b { "Disfavoured" } " by this recording, which would show them: " (rivals(&disfavoured)) "." }
            }
            @if !open.is_empty() || !disfavoured.is_empty() {
                p.note { "In brackets: loss of ln evidence where it replaces the nearest finding; 5 is odds of 150 to 1." }
            }
        }
    }
}

/// True if a kind of its typical size is detectable in this recording, or its sensitivity is unknown.
fn is_excited(diagnosis: &Diagnosis, kind: &str) -> bool {
    let own = diagnosis
        .sensitivity
        .iter()
        .find(|entry| entry.kind == kind);
    own.is_none_or(|entry| entry.snr >= diagnosis.thresholds().findings.needed_snr)
}

/// Formats kinds with their evidence, as "gyro bias (1484), gyro scale (2009)".
fn rivals(of: &[&RunnerUp]) -> String {
    let each = of.iter().map(|rival| {
        let behind = (rival.behind * 10.0).round() / 10.0;
        format!("{} ({})", plain(&rival.kind), number(behind))
    });
    each.collect::<Vec<_>>().join(", ")
}

/// Self-test of a recording; `None` if it had none.
pub fn self_test_shown(diagnosis: &Diagnosis) -> Option<&SelfTestEntry> {
    let test = diagnosis.self_test.as_ref();
    test.filter(|test| test.slides > 0 && !diagnosis.sensitivity.is_empty())
}

/// Table of the smallest detectable size of each kind.
pub fn sensitivity(diagnosis: &Diagnosis) -> Markup {
    let needed_snr = diagnosis.thresholds().findings.needed_snr;
    let mut reach: Vec<_> = diagnosis.sensitivity.iter().collect();
    reach.sort_by(|a, b| b.snr.total_cmp(&a.snr));
    let (low, high) = super::plot::ends(reach.iter().map(|entry| entry.snr))
        .map_or((1.0, 10.0), |(low, high)| {
            (low.clamp(0.1, 1.0), high.max(10.0))
        });
    html! {
        @if !reach.is_empty() {
            section {
                h2 { "Sensitivity of this recording" }
                details open[diagnosis.effects.is_empty()] {
                summary { "Detectable size of each kind" }
                p {
                    @if diagnosis.verdict == Verdict::Matches {
                        "No effect was found: those present are below the detectable sizes. "
                    }
                    "Each kind at a size typical of such instruments, with the signal-to-noise ratio of its best determined parameter under this recording's motion and noise. "
                    "From " (number(needed_snr)) " on (the line; logarithmic scale) it is found reliably; the last column is the size at which that happens, for the best and for the worst determined parameter."
                }
                div.scroll { table.bars.reach {
                    thead { tr { th { "kind" } th { "typical size" } th { "signal to noise" } th {} th { "found from" } } }
                    tbody {
                        @for entry in &reach {
                            tr {
                                td { (plain(&entry.kind)) }
                                td.number { (sized(entry, &[entry.typical])) }
                                td.number { (two_digits(entry.snr)) }
                                td.wide { (log_bar(entry.snr, low, high, needed_snr)) }
                                td { (found_from(entry, needed_snr)) }
                            }
                        }
                    }
                } }
                }
                @if let Some(test) = self_test_shown(diagnosis) { (self_test(test)) }
            }
        }
    }
}

/// Smallest detectable sizes of a kind's parameters, best to worst.
fn found_from(entry: &Sensitivity, needed_snr: f64) -> String {
    let from = |snr: f64| entry.typical * needed_snr / snr;
    let best = from(entry.snr);
    if entry.snr_weakest == 0.0 {
        format!("{}, some never", sized(entry, &[best]))
    } else {
        sized(entry, &[best, from(entry.snr_weakest)])
    }
}

/// Formats sizes of a kind with their unit, equal ones once.
fn sized(entry: &Sensitivity, sizes: &[f64]) -> String {
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let scale = Scale::of("x", &entry.unit, largest);
    let mut shown: Vec<String> = sizes
        .iter()
        .map(|size| two_digits(size * scale.factor))
        .collect();
    shown.dedup();
    scale.with_unit(&shown.join(" to "))
}

fn two_digits(value: f64) -> String {
    number(format!("{value:.1e}").parse().unwrap_or(value))
}

/// Lists the undetectable kinds by reason: too weak here, no channel, not tested.
pub fn not_excluded(diagnosis: &Diagnosis) -> Markup {
    let needed_snr = diagnosis.thresholds().findings.needed_snr;
    let weak = diagnosis
        .sensitivity
        .iter()
        .filter(|entry| entry.snr < needed_snr);
    let weak: Vec<&Sensitivity> = weak.collect();
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for line in &diagnosis.not_excluded {
        let (kind, reason) = line.split_once(": ").unwrap_or((line, ""));
        if weak.iter().any(|entry| entry.kind == kind) {
            continue;
        }
        match reasons.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, kinds)) => kinds.push(kind),
            None => reasons.push((reason, vec![kind])),
        }
    }
    html! {
        @if !reasons.is_empty() || !weak.is_empty() {
            section {
                h2 { "Not excited here" }
                ul {
                    @if !weak.is_empty() {
                        li {
                            "Below a signal-to-noise ratio of " (number(needed_snr)) " at their typical size: "
                            @for (place, entry) in weak.iter().enumerate() {
                                @if place > 0 { ", " }
                                b { (plain(&entry.kind)) } " (" (two_digits(entry.snr)) ")"
                            }
                        }
                    }
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
