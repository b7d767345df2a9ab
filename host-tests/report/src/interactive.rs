//! Writes the page's script: the plots' numbers, the foreign library that draws them, and our own part.
//!
//! The policy of the page names the two scripts by their sums, so that no other runs, whatever a recording's names say.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use serde_json::Value;
use sha2::{Digest as _, Sha256};

use super::chart::{Chart, Numbers};

/// uPlot; see `vendor/README.md`.
const LIBRARY: &str = include_str!("../vendor/uplot/uPlot.iife.min.js");

/// Its style.
const LIBRARY_STYLE: &str = include_str!("../vendor/uplot/uPlot.min.css");

/// What turns the page's figures into plots.
const OWN: &str = include_str!("page.js");

/// The policy of a page with these scripts, and the scripts.
pub fn scripts(charts: &[&Chart], numbers: &[Numbers]) -> (String, Markup) {
    let charts = charts.iter().map(|chart| chart.data());
    let data: Vec<Value> = charts.chain(numbers.iter().map(Numbers::data)).collect();
    // No text in JSON may end the element that holds it.
    let data = Value::Array(data).to_string().replace('<', "\\u003c");
    let sums = [LIBRARY, OWN].map(|script| {
        let sum = STANDARD.encode(Sha256::digest(script.as_bytes()));
        format!("'sha256-{sum}'")
    });
    let policy = format!(
        "default-src 'none'; style-src 'unsafe-inline'; script-src {}",
        sums.join(" ")
    );
    let scripts = html! {
        style { (PreEscaped(LIBRARY_STYLE)) }
        script type="application/json" id="charts" { (PreEscaped(data)) }
        script { (PreEscaped(LIBRARY)) }
        script { (PreEscaped(OWN)) }
    };
    (policy, scripts)
}
