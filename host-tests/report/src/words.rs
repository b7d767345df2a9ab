//! Formats numbers, units and symbols as people read them.
//!
//! SI values, units and names as the contract spells them ("s^2", "delta_ij") become text with the digits that the
//! spread justifies, °/h for rates, arcsec for angles, typographic symbols.
//!
//! Out of scope: any judgement; a value is shown, never rounded to what would look better.

use maud::{Markup, html};

/// °/h in one rad/s.
pub const DEG_H_PER_RAD_S: f64 = 180.0 / std::f64::consts::PI * 3600.0;

/// Arcseconds in one rad.
pub const ARCSEC_PER_RAD: f64 = DEG_H_PER_RAD_S;

/// °/√h in one rad/√s: 180/π × √3600.
pub const DEG_SQRT_H_PER_RAD_SQRT_S: f64 = 180.0 / std::f64::consts::PI * 60.0;

/// Powers of ten that are still read without an exponent.
const PLAIN_EXPONENTS: std::ops::RangeInclusive<i32> = -3..=4;

/// Greek letters that the contract spells out, and what stands for them.
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

/// The factor and the unit in which a value of the SI unit `unit` is displayed.
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

/// m/s² to millionths of standard gravity.
pub const MICRO_G_PER_M_S2: f64 = 1e6 / 9.80665;

/// The decimal exponent of a value, 0 for 0.
fn exponent(value: f64) -> i32 {
    if value == 0.0 {
        0
    } else {
        // −400…400 fits
        value.abs().log10().floor() as i32
    }
}

/// Formats a value alone with four significant digits.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "not known".to_owned();
    }
    let power = exponent(value);
    if PLAIN_EXPONENTS.contains(&power) {
        let decimals = usize::try_from(3 - power).unwrap_or(0);
        let text = format!("{value:.decimals$}");
        if text.contains('.') {
            return signed(text.trim_end_matches('0').trim_end_matches('.'));
        }
        return signed(&text);
    }
    let mantissa = format!("{:.3}", value / 10f64.powi(power));
    let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
    format!("{} × 10{}", signed(mantissa), superscript(power))
}

/// Formats a value with its standard deviation, to two digits of the latter.
pub fn with_spread(value: f64, std: f64) -> String {
    if !(value.is_finite() && std.is_finite() && std > 0.0) {
        return number(value);
    }
    let power = exponent(value.abs().max(std));
    let scale = if PLAIN_EXPONENTS.contains(&power) && exponent(std) >= -4 {
        0
    } else {
        power
    };
    let (value, std) = (value / 10f64.powi(scale), std / 10f64.powi(scale));
    let decimals = usize::try_from(1 - exponent(std)).unwrap_or(0).min(9);
    let pair = format!(
        "{} ± {std:.decimals$}",
        signed(&format!("{value:.decimals$}"))
    );
    if scale == 0 {
        pair
    } else {
        format!("({pair}) × 10{}", superscript(scale))
    }
}

/// Formats a probability: as a decimal number, or as a power of ten where it is small.
pub fn chance(p_value: f64) -> String {
    if p_value <= 0.0 {
        "< 10⁻³⁰⁰".to_owned()
    } else if p_value >= 0.001 {
        format!("{p_value:.3}")
    } else {
        format!("10{}", superscript(p_value.log10().round() as i32))
    }
}

/// A time \[s\].
pub fn seconds(time_s: f64) -> String {
    format!("{time_s:.1}")
}

/// A band \[Hz\], as in "0–1 Hz".
pub fn band(low_hz: f64, high_hz: f64) -> String {
    format!("{}–{} Hz", rounded_hz(low_hz), rounded_hz(high_hz))
}

/// A frequency to the hertz, to a tenth below ten.
fn rounded_hz(frequency_hz: f64) -> String {
    if frequency_hz < 10.0 {
        number((frequency_hz * 10.0).round() / 10.0)
    } else {
        format!("{frequency_hz:.0}")
    }
}

/// "gyro_x" as "gyro x", "axis_flexure" as "axis flexure".
pub fn spaced(name: &str) -> String {
    name.replace('_', " ")
}

/// "s^2" as "s²".
pub fn raised(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text.chars().peekable();
    while let Some(letter) = rest.next() {
        if letter != '^' {
            out.push(letter);
            continue;
        }
        let mut digits = String::new();
        while let Some(digit) =
            rest.next_if(|c| c.is_ascii_digit() || (digits.is_empty() && *c == '-'))
        {
            digits.push(digit);
        }
        match digits.parse::<i32>() {
            Ok(power) => out.push_str(&superscript(power)),
            Err(_) => out.push_str(&format!("^{digits}")),
        }
    }
    out
}

/// An integer in superscript digits.
pub fn superscript(power: i32) -> String {
    power
        .to_string()
        .chars()
        .map(|digit| match digit {
            '-' => '⁻',
            '0' => '⁰',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            other => char::from_u32('⁴' as u32 + (other as u32 - '4' as u32)).unwrap_or(other),
        })
        .collect()
}

/// An equation of the contract with its letters: "delta_ij = -K_ij alpha_j" as δ with index ij and so on.
/// Names that are no symbols (channels of a recording) stay as they are.
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

/// Formats a number with the typographic minus sign.
fn signed(text: &str) -> String {
    text.replace('-', "−")
}
