//! Formatting of numbers, units and symbols.
//!
//! SI values, units and names in the contract's spelling ("s^2", "delta_ij") become text with the digits justified by the
//! standard deviation, °/h for rates, arcsec for angles, typographic symbols.
//!
//! Out of scope: any judgement; a value is never rounded to look better.

use maud::{Markup, html};

pub use rlg_findings::names::{plain, spaced};
use rlg_findings::numbers::DEG_H;
pub use rlg_findings::numbers::{
    ARCSEC_PER_RAD, Scale, band, chance, happened, number, raised, seconds, superscript,
    with_spread,
};
pub use rlg_recording::units::MICRO_G_PER_M_S2;

/// °/h in one rad/s.
pub const DEG_H_PER_RAD_S: f64 = DEG_H;

/// °/√h in one rad/√s: 180/π × √3600.
pub const DEG_SQRT_H_PER_RAD_SQRT_S: f64 = 180.0 / std::f64::consts::PI * 60.0;

/// Greek letters by their spelling in the contract.
const LETTERS: [(&str, &str); 12] = [
    ("alpha", "α"),
    ("beta", "β"),
    ("delta", "δ"),
    ("eps", "ε"),
    ("epsilon", "ε"),
    ("tau", "τ"),
    ("theta", "θ"),
    ("omega", "ω"),
    ("Omega", "Ω"),
    ("zeta", "ζ"),
    ("phi", "φ"),
    ("Sum", "Σ"),
];

/// Factor and unit in which a value of the SI unit `unit` is displayed.
pub fn display_unit(unit: &str) -> (f64, String) {
    match unit {
        "rad/s" => (DEG_H_PER_RAD_S, "°/h".to_owned()),
        "rad" => (ARCSEC_PER_RAD, "″".to_owned()),
        "rad/sqrt(s)" | "rad/√s" => (DEG_SQRT_H_PER_RAD_SQRT_S, "°/√h".to_owned()),
        "m/s^2" => (MICRO_G_PER_M_S2, "µg".to_owned()),
        "1" => (1.0, String::new()),
        other => (1.0, raised(other)),
    }
}

/// Formats an equation of the contract with its letters: "delta_ij = -K_ij alpha_j" as δ with index ij and so on. Other
/// names (channels of a recording) stay unchanged.
pub fn symbols(text: &str) -> Markup {
    let text = raised(text);
    let mut parts: Vec<String> = Vec::new();
    for letter in text.chars() {
        let word = letter.is_alphanumeric() || letter == '_';
        match parts.last_mut() {
            Some(part) if word && part.ends_with(|c: char| c.is_alphanumeric() || c == '_') => {
                part.push(letter);
            }
            _ => parts.push(letter.to_string()),
        }
    }
    html! {
        @for part in &parts { (symbol(part)) }
    }
}

fn symbol(word: &str) -> Markup {
    let (base, index) = word.split_once('_').unwrap_or((word, ""));
    let letter = LETTERS.iter().find(|(name, _)| *name == base);
    let shown = letter.map_or(base, |(_, letter)| *letter);
    match (letter.is_some() || base.chars().count() == 1, index) {
        (true, "") if word == "*" => html! { "\u{2009}·\u{2009}" },
        (true, "") if word == "-" => html! { "−" },
        (true, "") => html! { (shown) },
        (true, index) => html! { (shown) sub { (index) } },
        (false, _) => html! { (word) },
    }
}

/// Rounds a size to three digits.
pub fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
