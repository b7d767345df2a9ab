//! Page `report.html`: a diagnosis that a navigation engineer can forward.
//!
//! Takes a [`Diagnosis`], [`Pictures`] if the recording was long enough for a drawing, and additional content in
//! [`Beside`]; SI units, body axes. The page is one HTML file without external content, in °/h and arcsec. Its one script
//! redraws the plots for zooming; without scripts and on paper the static drawings remain.
//!
//! first screen (verdict, findings, provenance, residual) → held-out time → locations → missing effects → noise → rates →
//! limits (alternatives considered, undetectable effects) → facts
//!
//! Names in a recording are untrusted text and are all escaped by the template; the page's policy permits no other script.
//! The same diagnosis gives the same bytes. Out of scope: any judgement not contained in `diagnosis.json`; the page ends
//! with that file verbatim.

mod allan;
pub mod beside;
pub mod calibration;
mod cell_marks;
pub mod challenge;
mod chart;
mod correlations;
mod curves;
mod facts;
pub mod figure;
mod findings;
mod first_screen;
mod held_out;
mod interactive;
mod limits;
mod lines;
mod map;
pub mod navigation;
mod noise;
mod places;
pub mod plot;
mod registration;
mod self_test;
pub mod terminal;
pub mod words;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use beside::Beside;
use chart::{Chart, Numbers};
use rlg_diagnosis::tiles::pictures::Pictures;
use rlg_findings::result::{Diagnosis, Verdict};

/// Complete page of a diagnosis alone.
pub fn page(diagnosis: &Diagnosis, pictures: Option<&Pictures>) -> String {
    page_beside(diagnosis, pictures, &Beside::default())
}

/// Complete page, with additional content.
pub fn page_beside(diagnosis: &Diagnosis, pictures: Option<&Pictures>, beside: &Beside) -> String {
    let both = corrected(diagnosis);
    let angles = pictures.map_or_else(Vec::new, |pictures| curves::angles(pictures, both));
    let spectra = pictures.map_or_else(Vec::new, |pictures| curves::spectra(pictures, both));
    let allan = curves::allan_deviations(diagnosis, pictures, beside);
    let rates = curves::rates(pictures, beside);
    let title = format!("{}: {}", diagnosis.recording, word(diagnosis.verdict));
    let main = html! {
        (first_screen::header(diagnosis, beside))
        (chart::row(&angles))
        (held_out::held_out(diagnosis, &spectra, &places::section(diagnosis, pictures)))
        (findings::effects(diagnosis))
        (registration::section(diagnosis))
        (noise::section(diagnosis, beside, &allan))
        @if !rates.is_empty() { section { h2 { "As recorded" } (chart::row(&rates)) } }
        div.abreast {
            (limits::considered(diagnosis))
            (limits::not_excluded(diagnosis))
            (limits::sensitivity(diagnosis))
            (facts::facts(diagnosis))
        }
        (facts::everything(diagnosis))
        @if !beside.timings.is_empty() { section { h2 { "Timings" } pre { (beside.timings.join("\n")) } } }
    };
    let charts: Vec<&Chart> = [&angles, &spectra, &allan, &rates]
        .into_iter()
        .flatten()
        .collect();
    let maps = pictures.map_or_else(Vec::new, |pictures| places::numbers(diagnosis, pictures));
    let tests = limits::self_test_shown(diagnosis).and_then(self_test::numbers);
    let numbers: Vec<Numbers> = maps.into_iter().chain(tests).collect();
    if charts.is_empty() && numbers.is_empty() {
        return document(&title, &main);
    }
    let (policy, scripts) = interactive::scripts(&charts, &numbers);
    written(&title, &main, Some(&policy), &scripts)
}

/// Page of this tool without scripts, without network access, in the reader's colours and width.
pub fn document(title: &str, main: &Markup) -> String {
    written(title, main, None, &html! {})
}

fn written(title: &str, main: &Markup, policy: Option<&str>, scripts: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                @if let Some(policy) = policy {
                    meta http-equiv="Content-Security-Policy" content=(policy);
                }
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(include_str!("style.css"))) }
            }
            body {
                main { (main) }
                (scripts)
            }
        }
    };
    page.into_string()
}

/// Verdict in words.
pub fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Matches => "Matches",
        Verdict::Explained => "Explained",
        Verdict::PartlyExplained => "Partly explained",
        Verdict::Unexplained => "Unexplained",
        Verdict::Unusable => "Unusable",
    }
}

/// True if any effect was corrected, so that "after" differs from "before".
fn corrected(diagnosis: &Diagnosis) -> bool {
    diagnosis
        .effects
        .iter()
        .any(|effect| !effect.parameters.is_empty())
}
