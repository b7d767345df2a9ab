//! Script of the page: the plots' data, the third-party plot library, and our own part.
//!
//! The page's policy identifies the two scripts by their hashes, so that no other runs, whatever names a recording
//! contains.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use serde_json::Value;
use sha2::{Digest as _, Sha256};

use super::chart::{Chart, Numbers};

/// uPlot; see `vendor/README.md`.
const LIBRARY: &str = include_str!("../vendor/uplot/uPlot.iife.min.js");

/// Style of the library.
const LIBRARY_STYLE: &str = include_str!("../vendor/uplot/uPlot.min.css");

/// Script that turns the page's figures into plots.
const OWN: &str = include_str!("page.js");

/// Policy of a page with these scripts, and the scripts.
pub fn scripts(charts: &[&Chart], numbers: &[Numbers]) -> (String, Markup) {
    let charts = charts.iter().map(|chart| chart.data());
    let data: Vec<Value> = charts.chain(numbers.iter().map(Numbers::data)).collect();
    // JSON text must not close its element.
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
