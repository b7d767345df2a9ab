//! Table of steady spectral lines, since a section for each would hide everything else.

use maud::{Markup, html};

use super::words::{display_unit, number, with_spread};
use rlg_findings::result::{Diagnosis, EffectEntry, ParameterEntry};

/// True if an effect is a spectral line on several gyros.
pub fn is_line(effect: &EffectEntry) -> bool {
    let expression = effect.expression.as_deref();
    expression.is_some_and(|text| text.starts_with("sine(") || text.starts_with("line("))
        && effect.equation.starts_with("omega_i")
}

/// True if an effect is a band of noise.
pub fn is_band(effect: &EffectEntry) -> bool {
    let expression = effect.expression.as_deref();
    expression.is_some_and(|text| text.starts_with("band("))
}

/// Number of unfolded lines; weaker ones are folded.
const OPEN: usize = 6;

/// Table of all lines, the strongest first.
pub fn table(diagnosis: &Diagnosis) -> Markup {
    let lines: Vec<&EffectEntry> = diagnosis.effects.iter().filter(|e| is_line(e)).collect();
    let (strong, weak) = lines.split_at(lines.len().min(OPEN));
    html! {
        @if !lines.is_empty() {
            article {
                h3 { "spectral lines " code { "unlisted" } }
                p { "Frequencies in hertz of the nominal clock. Amplitudes on the fitted rows; a line is here only if it keeps its phase through them, or follows others that do." }
                (rows(strong))
                @if !weak.is_empty() {
                    details { summary { (weak.len()) " weaker lines" } (rows(weak)) }
                }
            }
        }
    }
}

fn rows(lines: &[&EffectEntry]) -> Markup {
    let (factor, unit) = display_unit("rad/s");
    html! {
        div.scroll { table.values {
            thead { tr { th { "line [Hz]" } th { "x [" (unit) "]" } th { "y" } th { "z" } th { "ln evidence" } th { "what it is" } } }
            tbody { @for line in lines { tr {
                td { (frequency(line)) }
                @for parameter in &line.parameters {
                    @if let ParameterEntry::Number { value, std, unit, .. } = parameter && unit == "rad/s" {
                        td.number { @if *value > 0.0 { (with_spread(value * factor, std * factor)) } @else { "–" } }
                    }
                }
                td.number { (number(line.log_evidence_gain.round())) }
                td { (line.what_was_left_out.split_once(" on x, y, z. ").map_or("", |(_, what)| what)) }
            } } }
        } }
    }
}

/// Frequency of a line \[Hz\], from its expression if there is no such parameter.
pub fn frequency(line: &EffectEntry) -> String {
    let written = line.expression.as_deref().unwrap_or_default();
    match line.number("frequency_hz") {
        Some((hz, _)) => format!("{hz:.5}"),
        None => written
            .trim_start_matches("sine(")
            .trim_end_matches(')')
            .to_owned(),
    }
}
