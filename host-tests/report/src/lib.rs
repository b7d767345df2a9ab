//! Writes `report.html`: a diagnosis as one page that a navigation engineer can forward.
//!
//! It takes a [`Diagnosis`] and, where the recording was long enough to draw anything, [`Pictures`]; SI units, body
//! axes. The page is one HTML file without scripts and without anything from outside, in °/h and arcsec.
//!
//! verdict → findings (what differs, what was left out) → held-out time → limits (what else was
//! considered, what could not be seen) → facts
//!
//! Names in a recording are untrusted text and are escaped, every one, by the template. The same diagnosis
//! gives the same bytes. Out of scope: any judgement that `diagnosis.json` does not contain; the
//! page ends with that file word for word.

pub mod calibration;
mod cell_marks;
pub mod challenge;
mod curves;
mod facts;
pub mod figure;
mod findings;
mod limits;

mod held_out;
mod lines;
mod map;
pub mod navigation;
pub mod plot;
mod registration;
mod self_test;
pub mod terminal;
pub mod words;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use rlg_diagnosis::pictures::Pictures;
use rlg_findings::result::{Diagnosis, Verdict};

/// The whole page.
pub fn page(diagnosis: &Diagnosis, pictures: Option<&Pictures>) -> String {
    let title = format!("{}: {}", diagnosis.recording, word(diagnosis.verdict));
    let main = html! {
            (verdict(diagnosis))
            (findings::differences(diagnosis, pictures))
            (registration::section(diagnosis))
            (findings::effects(diagnosis))
            (held_out::held_out(diagnosis, pictures))
            (limits::considered(diagnosis))
            (limits::sensitivity(diagnosis))
            (limits::not_excluded(diagnosis))
            (limits::next_experiment(diagnosis))
            (facts::facts(diagnosis))
            (facts::everything(diagnosis))
    };
    document(&title, &main)
}

/// A page of this tool: needs no network, and follows the reader's colours and width.
pub fn document(title: &str, main: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(include_str!("style.css"))) }
            }
            body {
                main { (main) }
            }
        }
    };
    page.into_string()
}

/// Writes the recording's name, the verdict, and what it means.
fn verdict(diagnosis: &Diagnosis) -> Markup {
    html! {
        header {
            p.kicker { "Does the model explain the recording?" }
            h1 { (diagnosis.recording) }
            p.verdict data-verdict=(word(diagnosis.verdict)) { (word(diagnosis.verdict)) }
            // The first line of the summary is the verdict in a sentence; the others are told below.
            @if let Some(sentence) = diagnosis.summary.first() { p.lead { (sentence) } }
            @if let Some(short) = findings::in_short(diagnosis) { p { (short) } }
        }
    }
}

/// The verdict in words.
pub fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Matches => "Matches",
        Verdict::Explained => "Explained",
        Verdict::PartlyExplained => "Partly explained",
        Verdict::Unexplained => "Unexplained",
        Verdict::Unusable => "Unusable",
    }
}

/// Whether any effect was corrected, so that "after" differs from "before".
fn corrected(diagnosis: &Diagnosis) -> bool {
    diagnosis
        .effects
        .iter()
        .any(|effect| !effect.parameters.is_empty())
}
