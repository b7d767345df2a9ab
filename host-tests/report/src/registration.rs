//! Writes the section on what aligns a reference of attitudes with the gyros.

use maud::{Markup, html};

use super::words::{Scale, plain};
use rlg_findings::result::{Diagnosis, ParameterEntry, RegistrationEntry};

/// Every number of the registration, and whether the recording supports it.
pub fn section(diagnosis: &Diagnosis) -> Markup {
    if diagnosis.registration.is_empty() {
        return html! {};
    }
    html! {
        section {
            h2 { "How gyros and reference are aligned" }
            div.scroll { table {
                thead { tr { th { "registration" } th { "value ± standard deviation" } th { "supported" } } }
                tbody {
                    @for entry in &diagnosis.registration {
                        tr {
                            td { (plain(&entry.kind)) }
                            td { (values(entry)) }
                            td { @if entry.supported { "yes" } @else { "no" } }
                        }
                    }
                }
            } }
            p.note { "Each beside all others, and beyond what the model says. Supported: blocks of rows that were not fitted say so; the findings hold those, fitted without the others." }
        }
    }
}

fn values(entry: &RegistrationEntry) -> String {
    let numbers = entry
        .parameters
        .iter()
        .filter_map(|parameter| match parameter {
            ParameterEntry::Number { value, .. } => Some(value.abs()),
            ParameterEntry::Text { .. } => None,
        });
    let largest = numbers.fold(0.0, f64::max);
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
        let scale = Scale::of(name, unit, largest);
        Some(scale.with_unit(&format!("{name} {}", scale.pair(*value, *std))))
    });
    each.collect::<Vec<_>>().join(", ")
}
