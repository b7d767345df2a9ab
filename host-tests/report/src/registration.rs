//! Section on the alignment of an attitude reference with the gyros.

use maud::{Markup, html};

use super::words::{Scale, number, plain};
use rlg_findings::result::{Diagnosis, ParameterEntry, RegistrationEntry};

/// Table of all alignment parameters, with the support of each by the recording.
pub fn section(diagnosis: &Diagnosis) -> Markup {
    if diagnosis.registration.is_empty() {
        return html! {};
    }
    let deviations = diagnosis.thresholds().findings.significant_deviations;
    html! {
        section {
            h2 { "Alignment of gyros and reference" }
            div.scroll { table {
                thead { tr { th { "registration" } th { "value ± standard deviation" } th { "supported" } } }
                tbody {
                    @for entry in &diagnosis.registration {
                        tr {
                            td { (plain(&entry.kind)) }
                            td { (values(entry, deviations)) }
                            td { @if entry.supported { "yes" } @else { "no" } }
                        }
                    }
                }
            } }
            p.note { "Relative to the model, all fitted together; bold: beyond " (number(deviations)) " σ. A wide ± is not determined by this motion. Supported: confirmed by blocks of rows that were not fitted; the findings are fitted without the others, with smaller ±." }
        }
    }
}

/// Formats each parameter ± σ in its own unit, since observable and unobservable ones differ by orders of magnitude;
/// significant ones in bold.
fn values(entry: &RegistrationEntry, deviations: f64) -> Markup {
    let each = entry.parameters.iter().filter_map(|parameter| {
        let ParameterEntry::Number {
            name,
            value,
            std,
            unit,
        } = parameter
        else {
            return None;
        };
        let scale = Scale::of(name, unit, value.abs().max(*std));
        let said = scale.with_unit(&format!("{name} {}", scale.pair(*value, *std)));
        Some((said, value.abs() > deviations * std))
    });
    html! {
        @for (place, (said, stands_out)) in each.enumerate() {
            @if place > 0 { ", " }
            @if stands_out { b { (said) } } @else { (said) }
        }
    }
}
