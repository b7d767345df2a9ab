//! Correlations of the parameters of one effect, from their covariance.

use maud::{Markup, html};

use rlg_findings::result::{EffectEntry, ParameterEntry};

/// Largest number of parameters for which all pairs are written out; more are in the data.
const MOST: usize = 12;

/// Least absolute correlation for which a pair is highlighted.
const STRONG: f64 = 0.9;

/// Table of the correlations of one effect's parameters \[1\], folded; empty for a single parameter.
pub fn table(effect: &EffectEntry) -> Markup {
    let names = effect.parameters.iter().filter_map(|one| match one {
        ParameterEntry::Number { name, .. } => Some(name.as_str()),
        ParameterEntry::Text { .. } => None,
    });
    let names: Vec<&str> = names.collect();
    let covariance = &effect.covariance;
    let square =
        covariance.len() == names.len() && covariance.iter().all(|row| row.len() == names.len());
    if !square || !(2..=MOST).contains(&names.len()) {
        return html! {};
    }
    let of = |row: usize, column: usize| {
        covariance[row][column] / (covariance[row][row] * covariance[column][column]).sqrt()
    };
    html! {
        details {
            summary { "Correlations of its numbers" }
            div.scroll { table.correlations {
                thead { tr { th {} @for name in &names { th { (name) } } } }
                tbody {
                    @for (row, name) in names.iter().enumerate() {
                        tr {
                            th { (name) }
                            @for column in 0..=row {
                                @let value = of(row, column);
                                @if value.is_finite() {
                                    td.number.strong[row != column && value.abs() > STRONG] {
                                        (format!("{value:.2}").replace('-', "−"))
                                    }
                                } @else { td { "–" } }
                            }
                        }
                    }
                }
            } }
        }
    }
}
