//! Small marks in table rows: an amplitude with its error bar, a length on a logarithmic scale.
//!
//! Each is inline SVG as wide as its cell, without text: the names in the row are untrusted and belong in the table, where
//! they wrap and can be copied.

use maud::{Markup, html};

/// Width and height of a mark \[drawing units\].
const SIZE: (f64, f64) = (160.0, 14.0);

/// `value` ± `std` on `low..high`, with a line at `expected`.
pub fn error_bar(value: f64, std: f64, low: f64, high: f64, expected: f64) -> Markup {
    let place = |value: f64| place(value, low, high);
    let middle = SIZE.1 / 2.0;
    html! {
        svg.bar viewBox=(view_box()) aria-hidden="true" {
            line.expected x1=(place(expected)) x2=(place(expected)) y1="0" y2=(SIZE.1) {}
            @if value.is_finite() && std.is_finite() {
                line.reach x1=(place(value - std)) x2=(place(value + std)) y1=(middle) y2=(middle) {}
                circle.dot cx=(place(value)) cy=(middle) r="3.5" {}
            }
        }
    }
}

/// `value` on a logarithmic scale `low..high`, with a line at `needed`.
pub fn log_bar(value: f64, low: f64, high: f64, needed: f64) -> Markup {
    let place = |value: f64| place(value.max(low).ln(), low.ln(), high.ln());
    let middle = SIZE.1 / 2.0;
    html! {
        svg.bar viewBox=(view_box()) aria-hidden="true" {
            line.scale x1=(place(low)) x2=(place(high)) y1=(middle) y2=(middle) {}
            line.expected x1=(place(needed)) x2=(place(needed)) y1="0" y2=(SIZE.1) {}
            @if value.is_finite() {
                circle.dot.weak[value < needed] cx=(place(value)) cy=(middle) r="3.5" {}
            }
        }
    }
}

fn view_box() -> String {
    format!("0 0 {} {}", SIZE.0, SIZE.1)
}

/// Formats a coordinate to a tenth of a unit, finer than any screen, which keeps the page small.
fn place(value: f64, low: f64, high: f64) -> String {
    let margin = 5.0;
    let share = if high > low {
        ((value - low) / (high - low)).clamp(0.0, 1.0)
    } else {
        0.5
    };
    format!("{:.1}", margin + share * (SIZE.0 - 2.0 * margin))
}
