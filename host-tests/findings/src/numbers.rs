//! Formats numbers with the digits justified by their standard deviations, in customary units.
//!
//! Values are in the SI units of the contract ("rad/s", "s^2"). A [`Scale`] converts those of one finding to the unit
//! of its field (°/h, ″, ppm, µs), selected by the largest of them.

use std::f64::consts::PI;

/// °/h in one rad/s.
pub const DEG_H: f64 = 180.0 / PI * 3600.0;

/// Arcseconds in one rad.
pub const ARCSEC_PER_RAD: f64 = DEG_H;

/// Standard gravity \[m/s²\].
const G: f64 = 9.806_65;

/// Powers of ten written without an exponent.
const PLAIN_EXPONENTS: std::ops::RangeInclusive<i32> = -3..=4;

/// Customary unit: smallest SI value for its use, factor from the SI unit, name.
type Rung = (f64, f64, &'static str);

/// Units by SI unit, the smallest first; a ratio ("1" of an axis) has its own entry.
const LADDERS: &[(&str, &[Rung])] = &[
    (
        "rad/s",
        &[(0.0, DEG_H, "°/h"), (PI / 1800.0, 180.0 / PI, "°/s")],
    ),
    (
        "rad",
        &[
            (0.0, DEG_H, "″"),
            (1e-3, 1e3, "mrad"),
            (0.1, 180.0 / PI, "°"),
        ],
    ),
    ("ratio", &[(0.0, 1e6, "ppm"), (1e-2, 1e2, "%")]),
    ("s", &[(0.0, 1e6, "µs"), (1e-3, 1e3, "ms"), (1.0, 1.0, "s")]),
    ("m", &[(0.0, 1e6, "µm"), (1e-3, 1e3, "mm"), (1.0, 1.0, "m")]),
    ("s^2", &[(0.0, 1e9, "10⁻⁹ s²"), (1e-6, 1e6, "ms²")]),
    ("rad/sqrt(s)", &[(0.0, 60.0 * 180.0 / PI, "°/√h")]),
    ("rad/√s", &[(0.0, 60.0 * 180.0 / PI, "°/√h")]),
    ("rad/s/√s", &[(0.0, 60.0 * DEG_H, "°/h/√h")]),
    ("m/s^2", &[(0.0, 1e6 / G, "µg"), (1e-2 * G, 1e3 / G, "mg")]),
    (
        "rad/s/K",
        &[(0.0, DEG_H, "°/h/K"), (PI / 1800.0, 180.0 / PI, "°/s/K")],
    ),
    ("rad/K", &[(0.0, DEG_H, "″/K")]),
    ("rad/s/T", &[(0.0, 1e-3 * DEG_H, "°/h/mT")]),
    (
        "rad/s per m/s^2",
        &[
            (0.0, DEG_H * G, "°/h/g"),
            (PI / 1800.0 / G, 180.0 / PI * G, "°/s/g"),
        ],
    ),
    ("rad/s per (m/s^2)^2", &[(0.0, DEG_H * G * G, "°/h/g²")]),
    (
        "rad per m/s^2",
        &[(0.0, DEG_H * G, "″/g"), (1e-3 / G, 1e3 * G, "mrad/g")],
    ),
    ("s/rad", &[(0.0, 1e6 * PI / 180.0, "ppm/(°/s)")]),
    (
        "s^2/rad^2",
        &[(0.0, 1e6 * (PI / 180.0) * (PI / 180.0), "ppm/(°/s)²")],
    ),
];

/// Conversion from the SI unit to a customary unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// Factor from the SI unit.
    pub factor: f64,
    /// Name; empty for a pure number.
    pub unit: String,
}

impl Scale {
    /// Selects the unit for values in `unit`, the largest of them `largest`, both SI.
    ///
    /// `parameter`: the contract's name of one of them. A dimensionless number of an axis is a ratio in ppm; others (an
    /// order, a damping) are pure numbers.
    pub fn of(parameter: &str, unit: &str, largest: f64) -> Self {
        let is_of_axes = |name: &str| {
            let mut letters = name.chars();
            name == "all" || letters.all(|letter| matches!(letter, 'x' | 'y' | 'z'))
        };
        let key = match unit {
            "1" if is_of_axes(parameter) => "ratio",
            unit => unit,
        };
        let known = LADDERS.iter().find(|(name, _)| *name == key);
        let rungs = known.map_or(&[][..], |(_, rungs)| rungs);
        let fits = |rung: &&Rung| largest.abs() >= rung.0;
        if let Some((_, factor, unit)) = rungs.iter().rfind(fits).or(rungs.first()) {
            return Self {
                factor: *factor,
                unit: (*unit).to_owned(),
            };
        }
        let plain = if unit == "1" {
            String::new()
        } else {
            raised(unit)
        };
        let power = exponent(largest);
        if PLAIN_EXPONENTS.contains(&power) {
            return Self {
                factor: 1.0,
                unit: plain,
            };
        }
        let power = 3 * power.div_euclid(3);
        Self {
            factor: 10f64.powi(-power),
            unit: format!("10{} {plain}", superscript(power))
                .trim_end()
                .to_owned(),
        }
    }

    /// Formats a value with its standard deviation, both SI, without the unit.
    pub fn pair(&self, value: f64, std: f64) -> String {
        with_spread(value * self.factor, std * self.factor)
    }

    /// Adds the unit to formatted values: "59.70 ± 0.25 ppm", "141.9 ± 3.7 in 10⁻⁹ s²".
    pub fn with_unit(&self, values: &str) -> String {
        match self.unit.as_str() {
            "" => values.to_owned(),
            "°" | "″" => format!("{values}{}", self.unit),
            unit if unit.starts_with("10") => match values.contains('±') {
                true => format!("{values} in {unit}"),
                false => format!("{values} × {unit}"),
            },
            unit => format!("{values} {unit}"),
        }
    }
}

/// Decimal exponent of a value, 0 for 0.
fn exponent(value: f64) -> i32 {
    if value == 0.0 || !value.is_finite() {
        0
    } else {
        // −400…400 fits an i32.
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

/// Formats a value with its standard deviation: two significant digits of the latter, as many decimals of the former.
pub fn with_spread(value: f64, std: f64) -> String {
    if !(value.is_finite() && std.is_finite() && std > 0.0) {
        return number(value);
    }
    let power = exponent(value.abs().max(std));
    // A power of ten shortens only numbers with leading zeros.
    let is_short = power >= 0 || exponent(std) >= -4;
    let scale = if PLAIN_EXPONENTS.contains(&power) && is_short {
        0
    } else {
        power
    };
    let of_scale = 10f64.powi(scale);
    let (value, std) = (
        rounded_like(value / of_scale, std / of_scale),
        two_digits(std / of_scale),
    );
    let decimals = usize::try_from(1 - exponent(std)).unwrap_or(0);
    let written = format!("{value:.decimals$}");
    // A value rounded to zero has no sign.
    let written = match written.contains(|digit: char| matches!(digit, '1'..='9')) {
        true => written.as_str(),
        false => written.trim_start_matches('-'),
    };
    let pair = format!("{} ± {std:.decimals$}", signed(written));
    if scale == 0 {
        pair
    } else {
        format!("({pair}) × 10{}", superscript(scale))
    }
}

/// Rounds a standard deviation to two significant digits: 0.0996 to 0.10, 339 to 340.
fn two_digits(std: f64) -> f64 {
    format!("{std:.1e}").parse().unwrap_or(std)
}

/// Rounds the value to the last digit of its standard deviation, if that digit is before the decimal point.
fn rounded_like(value: f64, std: f64) -> f64 {
    let power = exponent(two_digits(std)) - 1;
    if power <= 0 {
        return value;
    }
    let digit = 10f64.powi(power);
    (value / digit).round() * digit
}

/// Returns the verb for a change of size with standard deviation `std`: falls, rises or stays.
pub fn happened(before: f64, after: f64, std: f64) -> &'static str {
    match after.abs() - before.abs() {
        change if !change.is_finite() => "goes",
        change if change < -std => "falls",
        change if change > std => "rises",
        _ => "stays",
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

/// Formats a time \[s\].
pub fn seconds(time_s: f64) -> String {
    format!("{time_s:.1}")
}

/// Formats a band \[Hz\], as in "0–1 Hz".
pub fn band(low_hz: f64, high_hz: f64) -> String {
    format!("{}–{} Hz", rounded_hz(low_hz), rounded_hz(high_hz))
}

/// Formats a frequency rounded to 1 Hz, below 10 Hz to 0.1 Hz.
fn rounded_hz(frequency_hz: f64) -> String {
    if frequency_hz < 10.0 {
        number((frequency_hz * 10.0).round() / 10.0)
    } else {
        format!("{frequency_hz:.0}")
    }
}

/// Writes exponents as superscripts: "s^2" as "s²".
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

/// Formats an integer in superscript digits.
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

/// Formats a number with the typographic minus sign.
fn signed(text: &str) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of digits after the point, and of significant digits.
    fn digits(text: &str) -> (usize, usize) {
        let decimals = text.split_once('.').map_or(0, |(_, after)| after.len());
        let all: String = text.chars().filter(char::is_ascii_digit).collect();
        let all = all.trim_start_matches('0');
        let significant = if decimals == 0 {
            all.trim_end_matches('0')
        } else {
            all
        };
        (decimals, significant.len())
    }

    #[test]
    fn value_and_sigma_have_the_same_decimals_and_sigma_two_digits() {
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for _ in 0..20_000 {
            let std = 10f64.powf(24.0 * random() - 12.0);
            let value = std * (random() - 0.5) * 10f64.powf(7.0 * random());
            let text = with_spread(value, std);
            let inner = text.trim_start_matches('(');
            let (left, right) = inner.split_once(" ± ").expect("a pair");
            let right = right.split(')').next().expect("a number");
            let ((value_decimals, _), (std_decimals, std_digits)) = (digits(left), digits(right));
            assert_eq!(value_decimals, std_decimals, "{value:e} {std:e}: {text}");
            assert!((1..=2).contains(&std_digits), "{value:e} {std:e}: {text}");
            let shown: f64 = right.parse().expect("a number");
            let scale = text
                .split_once("× 10")
                .map_or(1.0, |_| 10f64.powi(exponent(value.abs().max(std))));
            assert!(
                (shown * scale / std - 1.0).abs() < 0.051,
                "{value:e} {std:e}: {text}"
            );
            let said: f64 = left.replace('−', "-").parse().expect("a number");
            assert!(
                (said * scale - value).abs() <= 0.51 * std,
                "{value:e} {std:e}: {text}"
            );
        }
    }

    #[test]
    fn units_are_those_of_the_field_and_grow_with_the_value() {
        let said = |name, unit, value: f64, std| {
            let scale = Scale::of(name, unit, value);
            scale.with_unit(&scale.pair(value, std))
        };
        assert_eq!(said("y", "1", 5.97e-5, 2.5e-7), "59.70 ± 0.25 ppm");
        assert_eq!(said("x", "1", -0.1281, 7.5e-6), "−12.81000 ± 0.00075 %");
        assert_eq!(said("all", "s", 4.0002e-3, 3e-7), "4.00020 ± 0.00030 ms");
        assert_eq!(said("x", "rad/s", 4.848e-6, 1e-7), "1.000 ± 0.021 °/h");
        assert_eq!(said("x", "rad/s", -0.0105, 9.96e-5), "−0.6016 ± 0.0057 °/s");
        assert_eq!(said("xy", "rad", 2e-5, 1e-6), "4.13 ± 0.21″");
        assert_eq!(said("xy", "rad", 0.0102, 3.8e-4), "10.20 ± 0.38 mrad");
        assert_eq!(
            said("xy", "s^2", 1.419e-7, 3.7e-9),
            "141.9 ± 3.7 in 10⁻⁹ s²"
        );
        assert_eq!(said("damping", "1", 0.12, 0.01), "0.120 ± 0.010");
        assert_eq!(
            said("x", "1/rad^2", 3.2e-5, 1e-6),
            "32.0 ± 1.0 in 10⁻⁶ 1/rad²"
        );
        assert_eq!(with_spread(1234.0, 339.0), "1230 ± 340");
        assert_eq!(with_spread(31.409_981_6, 5.9e-6), "31.4099816 ± 0.0000059");
        assert_eq!(with_spread(1.0, 0.0996), "1.00 ± 0.10");
        assert_eq!(with_spread(-0.001, 0.25), "0.00 ± 0.25");
    }
}
