//! Writes a fleet as one HTML page, without scripts and external resources.
//!
//! headline → unusable inputs → outliers → trends → pictures → every run

use std::path::{Component, Path};

use maud::{Markup, html};

use super::pictures;
use super::statistics::Measured;
use super::summary::{Found, Line, Summary, SummaryPlan};
use rlg_findings::names::{plain, spaced};
use rlg_findings::numbers::{Scale, chance, number};
use rlg_report::words::rounded;

/// Largest number of recordings listed unfolded.
const MOST_OPEN: usize = 12;

/// Largest number of outliers and trends named in the headline each.
const MOST_NAMED: usize = 2;

/// Formats the whole page, to be written to `target`: links to the recordings' pages are relative to it.
pub fn page(summary: &Summary, target: &Path) -> String {
    let refused = summary.refused().count();
    let main = html! {
        header {
            p.kicker { "What models leave out of a fleet's recordings" }
            h1 { (summary.instruments().len()) " instruments, " (summary.lines.len()) " recordings" }
            @for line in headline(summary) { p.verdict { (line) } }
            @if refused > 0 {
                p.caution { (counted(refused, "recording", "recordings")) " cannot be used." }
            }
        }
        @if refused > 0 { section {
            h2 { "Cannot be used" }
            ul { @for (run, sentence) in summary.refused() { li { b { (run.name) } ": " (sentence) } } }
        } }
        (outliers(summary))
        (trends(summary))
        (pictures::section(summary))
        (recordings(summary, target))
    };
    rlg_report::document("Fleet", &main)
}

/// Lines of the headline: instruments that stand out, then trends.
pub fn headline(summary: &Summary) -> Vec<String> {
    let outliers = summary.outliers();
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in &outliers {
        if !names.contains(name) {
            names.push(name);
        }
    }
    let mut lines = Vec::new();
    if !names.is_empty() {
        let which = names.iter().take(MOST_NAMED).map(|name| {
            let own = outliers.iter().find(|(one, _)| one == name);
            own.map_or_else(String::new, |(_, one)| {
                format!("{name} ({} {})", effect(one), own_value(one))
            })
        });
        let what = counted(
            names.len(),
            "instrument stands out",
            "instruments stand out",
        );
        lines.push(listed(&what, which.collect(), names.len()));
    }
    let trends = summary.trends();
    if !trends.is_empty() {
        let which = trends.iter().take(MOST_NAMED).map(|trend| {
            let size = sized(trend.of, trend.slope.measured);
            format!(
                "{} of {}, {size} a {}",
                effect(trend.of),
                trend.instrument,
                trend.a
            )
        });
        let what = counted(trends.len(), "trend", "trends");
        lines.push(listed(&what, which.collect(), trends.len()));
    }
    if lines.is_empty() {
        lines.push("No instrument stands out, and none has a trend".to_owned());
    }
    lines
}

/// Joins names after their number; `count` of them in all.
fn listed(what: &str, which: Vec<String>, count: usize) -> String {
    let more = match count - which.len() {
        0 => String::new(),
        more => format!("; {more} more below"),
    };
    format!("{what}: {}{more}", which.join("; "))
}

/// Section on the instruments that stand out, once an instrument and number.
fn outliers(summary: &Summary) -> Markup {
    let outliers = summary.outliers();
    let plan = SummaryPlan::default();
    html! {
        section {
            h2 { "Outliers" }
            @if outliers.is_empty() {
                p { "None; or fewer than " (plan.few_instruments) " instruments, or, of fewer than " (plan.least_instruments)
                    ", none with two recordings." }
            } @else {
                p { "The mean of each instrument's recordings. From " (plan.least_instruments) " instruments on it is compared with the "
                    "fleet's median, and z is in standard deviations of the fleet (scaled median absolute deviation) and of the value "
                    "together; of fewer with the mean of the others, and z is in standard deviations of the scatter of an "
                    "instrument's own recordings." }
                div.scroll { table {
                    thead { tr { th { "instrument" } th { "effect" } th { "value" } th { "others" } th { "z" } } }
                    tbody { @for (instrument, one) in &outliers { tr {
                        td { (instrument) }
                        td { (effect(one)) }
                        td.number { (own_value(one)) }
                        td.number { @if let Some(fleet) = one.fleet { (sized(one, Measured { value: fleet.median, std: fleet.spread })) } }
                        td.number { @if let Some(z) = one.fleet_z { (number(rounded(z))) } }
                    } } }
                } }
            }
        }
    }
}

/// Section on all recordings, folded by instrument if there are many.
fn recordings(summary: &Summary, target: &Path) -> Markup {
    let own = summary
        .lines
        .chunk_by(|a, b| a.run.instrument() == b.run.instrument());
    html! {
        section {
            h2 { "Recordings" }
            @if summary.lines.len() <= MOST_OPEN { (rows(&summary.lines, target)) } @else {
                @for lines in own {
                    details { summary { b { (lines[0].run.instrument()) } ": " (verdicts(lines)) } (rows(lines, target)) }
                }
            }
        }
    }
}

/// Number of recordings, then of each verdict.
fn verdicts(lines: &[Line]) -> String {
    let mut counts: Vec<(String, usize)> = Vec::new();
    for line in lines {
        let verdict = verdict(line);
        match counts.iter_mut().find(|(known, _)| *known == verdict) {
            Some((_, count)) => *count += 1,
            None => counts.push((verdict, 1)),
        }
    }
    let each = counts
        .iter()
        .map(|(verdict, count)| format!("{count} {verdict}"));
    let each: Vec<String> = each.collect();
    format!(
        "{}, {}",
        counted(lines.len(), "recording", "recordings"),
        each.join(", ")
    )
}

fn verdict(line: &Line) -> String {
    match &line.run.told {
        Ok(told) => spaced(&told.verdict),
        Err(_) => "cannot be used".to_owned(),
    }
}

fn rows(lines: &[Line], target: &Path) -> Markup {
    html! {
        div.scroll { table {
            thead { tr { th { "instrument" } th { "recording" } th { "start" } th { "temperature [°C]" } th { "verdict" } th { "effects" } } }
            tbody { @for line in lines { tr {
                td { @if line.run.has_instrument() { (line.run.instrument()) } @else { "not known" } }
                td { @match line.run.page.as_deref().and_then(|page| link(target, page)) {
                    Some(link) => a href=(link) { (line.run.name) },
                    None => (line.run.name),
                } }
                td { @if let Some(start) = &line.run.about.start { (start) } }
                td.number { @if let Some(kelvin) = line.run.about.temperature_k { (format!("{:.1}", kelvin - 273.15)) } }
                td { (verdict(line)) }
                td { @for one in &line.found { div { (effect(one)) " " (value(one)) } } }
            } } }
        } }
    }
}

/// Link from the page at `target` to a file, relative and percent-encoded (RFC 3986, §2.1); `None` where there is no way.
fn link(target: &Path, file: &Path) -> Option<String> {
    let from = std::path::absolute(target).ok()?;
    let to = std::path::absolute(file).ok()?;
    let from: Vec<Component<'_>> = from.parent()?.components().collect();
    let to: Vec<Component<'_>> = to.components().collect();
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    if shared == 0 || from[shared..].contains(&Component::ParentDir) {
        return None;
    }
    let up = std::iter::repeat_n("..".to_owned(), from.len() - shared);
    let down = to[shared..]
        .iter()
        .map(|part| encoded(&part.as_os_str().to_string_lossy()));
    // A first part with a colon would be read as a scheme.
    Some(format!(
        "./{}",
        up.chain(down).collect::<Vec<_>>().join("/")
    ))
}

fn encoded(part: &str) -> String {
    let byte = |byte: u8| match byte {
        b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' => {
            char::from(byte).to_string()
        }
        other => format!("%{other:02X}"),
    };
    part.bytes().map(byte).collect()
}

fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

fn effect(one: &Found) -> String {
    let texts = if one.texts.is_empty() {
        String::new()
    } else {
        format!(" ({})", one.texts)
    };
    format!("{} {}{texts}", plain(&one.kind), one.parameter)
}

fn value(one: &Found) -> String {
    sized(one, one.measured)
}

/// Formats a value in the usual unit of this parameter, at the scale of this one.
fn sized(one: &Found, measured: Measured) -> String {
    let scale = Scale::of(&one.parameter, &one.unit, one.measured.value);
    scale.with_unit(&scale.pair(measured.value, measured.std))
}

/// Mean of the instrument's recordings.
fn own_value(one: &Found) -> String {
    sized(one, one.own.unwrap_or(one.measured))
}

/// Section on the trends that exceed their own noise, once an instrument and number.
fn trends(summary: &Summary) -> Markup {
    let trends = summary.trends();
    html! {
        section {
            h2 { "Trends" }
            @if trends.is_empty() { p { "None beyond its noise, or too few recordings with a date or a temperature." } } @else {
                p { "Time and temperature are fitted together; the scatter about the fit counts in the standard deviation. Chance: of "
                    "noise alone, for one slope." }
                div.scroll { table {
                    thead { tr { th { "instrument" } th { "effect" } th { "change" } th { "chance" } } }
                    tbody { @for trend in &trends { tr {
                        td { (trend.instrument) } td { (effect(trend.of)) }
                        td.number { (sized(trend.of, trend.slope.measured)) " a " (trend.a) }
                        td.number { (chance(trend.slope.chance())) }
                    } } }
                } }
            }
        }
    }
}
