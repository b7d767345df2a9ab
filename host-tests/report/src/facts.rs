//! Last two sections of the page: basis of the diagnosis (times, trials), and all numbers.

use maud::{Markup, html};

use super::words::{number, rounded, seconds};
use rlg_findings::result::{Diagnosis, RecordingEntry};

/// Largest number of intervals that are written out; a longer list is in the data.
const MOST_INTERVALS: usize = 20;

/// Section on times and trials.
pub fn facts(diagnosis: &Diagnosis) -> Markup {
    html! {
        section {
            h2 { "Data and method" }
            @let several = &diagnosis.fit.recordings;
            (recordings(several))
            @if several.is_empty() && !diagnosis.fit.fitted_on.is_empty() {
                p { b { "Fitted on " } (intervals(&diagnosis.fit.fitted_on)) "." }
            }
            @if several.is_empty() && !diagnosis.fit.held_out.is_empty() {
                p { b { "Held out " } (intervals(&diagnosis.fit.held_out)) "." }
            }
            @if let Some(whole) = &diagnosis.fit.whole {
                p {
                    b { "All other rows " }
                    "in sums, " (whole.blocks_per_s) " a second: " (seconds(whole.fitted_blocks_s)) " s fitted, "
                    (seconds(whole.held_out_blocks_s)) " s held out. The intervals above were analysed row by row; places "
                    "below " (0.5 * whole.blocks_per_s) " Hz, plots, drifts and their noise are of the sums."
                }
            }
            p {
                "rlg " (diagnosis.version) ", seed " (diagnosis.seed) ", "
                (diagnosis.trials) " hypotheses tried and counted. Body axes x, y, z; 1 °/h = 4.848 × 10⁻⁶ rad/s."
            }
        }
    }
}

/// Table of several recordings: fitted and held-out time of each, and residual power of each gyro.
fn recordings(several: &[RecordingEntry]) -> Markup {
    let seconds_of =
        |intervals: &[[f64; 2]]| seconds(intervals.iter().map(|[begin, end]| end - begin).sum());
    html! {
        @if !several.is_empty() {
            div.scroll { table {
                thead { tr { th { "recording" } th { "fitted [s]" } th { "held out [s]" } th { "residual power, gyro x" } th { "y" } th { "z" } } }
                tbody { @for one in several { tr {
                    td { (one.recording) }
                    td.number { @if one.held_out_whole { "none" } @else { (seconds_of(&one.fitted_on)) } }
                    td.number { @if one.held_out_whole { "all, " } (seconds_of(&one.held_out)) }
                    @for power in &one.normalised_power {
                        td.number { @match power { Some(power) => (number(rounded(*power))), None => "–" } }
                    }
                } } }
            } }
            p.note { "Residual power on held-out time over the noise, after the effects found; 1 = noise alone. Plots over time are of " (several[0].recording) "." }
        }
    }
}

fn intervals(intervals: &[[f64; 2]]) -> String {
    let mut words: Vec<String> = intervals
        .iter()
        .take(MOST_INTERVALS)
        .map(|[begin, end]| format!("{}–{} s", seconds(*begin), seconds(*end)))
        .collect();
    if intervals.len() > MOST_INTERVALS {
        words.push(format!("{} more", intervals.len() - MOST_INTERVALS));
    }
    words.join(", ")
}

/// `diagnosis.json` itself, so that a forwarded page is complete.
pub fn everything(diagnosis: &Diagnosis) -> Markup {
    let text = serde_json::to_string_pretty(diagnosis)
        .unwrap_or_else(|error| format!("The result has no JSON form ({error})."));
    html! {
        section.data {
            details {
                summary { "All numbers (diagnosis.json, SI units)" }
                pre { (text) }
            }
        }
    }
}
