//! Writes a fleet as one HTML page, without scripts and external resources.
//!
//! unusable inputs → outliers → trends → every run

use maud::{Markup, html};

use super::statistics::Measured;
use super::summary::{Found, Line, Summary};
use rlg_findings::names::{plain, spaced};
use rlg_findings::numbers::{SIGNIFICANT_SIGMAS, Scale, number};

/// Formats the whole page.
pub fn page(summary: &Summary) -> String {
    let refused = summary.refused().count();
    let outliers: Vec<(&Line, &Found)> = all(summary).filter(|(_, one)| one.is_outlier).collect();
    let main = html! {
        header {
            p.kicker { "What models leave out of a fleet's recordings" }
            h1 { (summary.instruments().len()) " instruments, " (summary.lines.len()) " recordings" }
            p.verdict {
                @if outliers.is_empty() { "No instrument stands out" }
                @else { (counted(instruments(&outliers), "instrument stands out", "instruments stand out")) }
            }
            @if refused > 0 {
                p.caution { (counted(refused, "recording", "recordings")) " cannot be used." }
            }
        }
        @if refused > 0 { section {
            h2 { "Cannot be used" }
            ul { @for (run, sentence) in summary.refused() { li { b { (run.name) } ": " (sentence) } } }
        } }
        section {
            h2 { "Outliers" }
            @if outliers.is_empty() { p { "None, or fewer instruments than a median needs." } } @else {
                p { "Each instrument against the fleet's median; z is in standard deviations of the fleet (scaled median "
                    "absolute deviation) and of the value together." }
                div.scroll { table {
                    thead { tr { th { "instrument" } th { "recording" } th { "effect" } th { "value" } th { "fleet" } th { "z" } } }
                    tbody { @for (line, one) in &outliers { tr {
                        td { (line.run.instrument()) }
                        td { (line.run.name) }
                        td { (effect(one)) }
                        td.number { (value(one)) }
                        td.number { @if let Some(fleet) = one.fleet { (sized(one, Measured { value: fleet.median, std: fleet.spread })) } }
                        td.number { @if let Some(z) = one.fleet_z { (number(z)) } }
                    } } }
                } }
            }
        }
        (trends(summary))
        section {
            h2 { "Recordings" }
            div.scroll { table {
                thead { tr { th { "instrument" } th { "recording" } th { "start" } th { "temperature [°C]" } th { "verdict" } th { "effects" } } }
                tbody { @for line in &summary.lines { tr {
                    td { (line.run.instrument()) }
                    td { (line.run.name) }
                    td { @if let Some(start) = &line.run.about.start { (start) } }
                    td.number { @if let Some(kelvin) = line.run.about.temperature_k { (format!("{:.1}", kelvin - 273.15)) } }
                    td { @match &line.run.told { Ok(told) => (spaced(&told.verdict)), Err(_) => "cannot be used" } }
                    td { @for one in &line.found { div { (effect(one)) " " (value(one)) } } }
                } } }
            } }
        }
    };
    rlg_report::document("Fleet", &main)
}

fn all(summary: &Summary) -> impl Iterator<Item = (&Line, &Found)> {
    let found = |line| found_in(line);
    summary.lines.iter().flat_map(found)
}

fn found_in(line: &Line) -> impl Iterator<Item = (&Line, &Found)> {
    line.found.iter().map(move |one| (line, one))
}

fn instruments(of: &[(&Line, &Found)]) -> usize {
    let mut names: Vec<&str> = of.iter().map(|(line, _)| line.run.instrument()).collect();
    // Lines are sorted by instrument.
    names.dedup();
    names.len()
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

/// Lists the trends that exceed their own noise, once an instrument.
fn trends(summary: &Summary) -> Markup {
    let beyond = |trend: Option<Measured>| {
        trend.filter(|trend| trend.value.abs() > SIGNIFICANT_SIGMAS * trend.std)
    };
    let mut rows: Vec<[String; 4]> = all(summary)
        .filter_map(|(line, one)| {
            let trends = [beyond(one.per_day), beyond(one.per_kelvin)];
            let [day, kelvin] =
                trends.map(|trend| trend.map_or_else(String::new, |trend| sized(one, trend)));
            let said = !(day.is_empty() && kelvin.is_empty());
            said.then(|| [line.run.instrument().to_owned(), effect(one), day, kelvin])
        })
        .collect();
    // A trend is an instrument's and repeated in each of its recordings.
    rows.sort();
    rows.dedup_by(|one, other| one[..2] == other[..2]);
    html! {
        section {
            h2 { "Trends" }
            @if rows.is_empty() { p { "None beyond its noise, or too few recordings with a date or a temperature." } } @else {
                p { "Time and temperature are fitted together; the scatter about the fit counts in the standard deviation." }
                div.scroll { table {
                    thead { tr { th { "instrument" } th { "effect" } th { "a day" } th { "a kelvin" } } }
                    tbody { @for [instrument, effect, day, kelvin] in &rows { tr {
                        td { (instrument) } td { (effect) } td.number { (day) } td.number { (kelvin) }
                    } } }
                } }
            }
        }
    }
}
