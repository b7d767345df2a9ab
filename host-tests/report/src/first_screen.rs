//! First screen of the page: verdict, findings with their sizes, provenance, next experiment.

use maud::{Markup, html};

use super::beside::Beside;
use super::{terminal, word};
use rlg_findings::result::Diagnosis;

/// Largest number of findings on the first screen; more are below.
const MOST_FINDINGS: usize = 8;

/// Header with the recording's name, the verdict and its sentence.
pub fn header(diagnosis: &Diagnosis, beside: &Beside) -> Markup {
    let findings = terminal::findings(diagnosis);
    html! {
        header.first {
            div {
                div.title {
                    h1 { (diagnosis.recording) }
                    p.verdict data-verdict=(word(diagnosis.verdict)) { (word(diagnosis.verdict)) }
                }
                // The first line of the summary is the verdict in a sentence; the others follow below.
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

/// Provenance of the numbers.
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
