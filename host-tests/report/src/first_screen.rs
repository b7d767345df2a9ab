//! Writes what must be seen first: verdict, findings with their sizes, where it all comes from, what to do next.

use maud::{Markup, html};

use super::beside::Beside;
use super::{terminal, word};
use rlg_findings::result::Diagnosis;

/// Findings of the first screen; more are below.
const MOST_FINDINGS: usize = 8;

/// Writes the recording's name, the verdict, and what it means.
pub fn header(diagnosis: &Diagnosis, beside: &Beside) -> Markup {
    let findings = terminal::findings(diagnosis);
    html! {
        header.first {
            div {
                div.title {
                    h1 { (diagnosis.recording) }
                    p.verdict data-verdict=(word(diagnosis.verdict)) { (word(diagnosis.verdict)) }
                }
                // The first line of the summary is the verdict in a sentence; the others are told below.
                @if let Some(sentence) = diagnosis.summary.first() { p.lead { (sentence) } }
                @if let Some(note) = &beside.note { p.note { (note) } }
                @if !findings.is_empty() {
                    table.findings { tbody {
                        @for (name, sizes) in findings.iter().take(MOST_FINDINGS) {
                            tr { th { (name) } td { (sizes) } }
                        }
                    } }
                    @if findings.len() > MOST_FINDINGS {
                        p.note { "And " (findings.len() - MOST_FINDINGS) " more, below." }
                    }
                }
                @for line in terminal::beside_findings(diagnosis) { p { (line) } }
                @if !diagnosis.next_experiment.is_empty() {
                    p { b { "Next: " } (diagnosis.next_experiment) }
                }
            }
            (provenance(diagnosis, beside))
        }
    }
}

/// Where the numbers come from.
fn provenance(diagnosis: &Diagnosis, beside: &Beside) -> Markup {
    html! {
        dl.provenance {
            @for (label, text) in &beside.provenance {
                dt { (label) } dd { (text) }
            }
            dt { "version" } dd { "rlg " (diagnosis.version) ", seed " (diagnosis.seed) }
        }
    }
}
