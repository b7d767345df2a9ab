//! Formatting of estimates: two significant digits of σ, and the value to the same decimal place.
//!
//! Decimal shifts use the shortest decimal form of a number, so the text does not depend on rounding in intermediate
//! multiplications.

/// Decimal exponents written without a power of ten: values from 0.01 up to 9999.
const PLAIN_EXPONENTS: std::ops::RangeInclusive<i32> = -2..=3;

/// Largest number of decimals: the precision of an f64.
const MOST_DECIMALS: i32 = 15;

/// Smallest probability that is written as a number.
const LEAST_P: f64 = 1e-300;

/// Writes a value with its standard deviation to the same decimal place, as in `(7.03 ± 0.39)e-8`.
pub fn estimate(value: f64, std: f64) -> String {
    if !(value.is_finite() && std.is_finite() && std > 0.0) {
        return format!("{} ± {std}", six_digits(value));
    }
    let last = exponent(std) - 1;
    let first = exponent(value).max(exponent(std));
    let power = if PLAIN_EXPONENTS.contains(&first) && last <= 0 {
        0
    } else {
        first
    };
    let decimals = (power - last).clamp(0, MOST_DECIMALS) as usize;
    let digits = |number: f64| format!("{:.decimals$}", shift(number, -power));
    let (value, std) = (digits(value), digits(std));
    if power == 0 {
        format!("{value} ± {std}")
    } else {
        format!("({value} ± {std})e{power}")
    }
}

/// Writes a number that has no standard deviation to at most six significant digits.
fn six_digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    let (_, power) = parts(&format!("{rounded:e}"));
    if PLAIN_EXPONENTS.contains(&power) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// Writes a probability to two significant digits.
pub fn probability(p: f64) -> String {
    if p < LEAST_P {
        format!("<{LEAST_P:e}")
    } else {
        format!("{p:.1e}")
    }
}

/// Decimal exponent of a number rounded to two significant digits; for 0 the smallest.
fn exponent(number: f64) -> i32 {
    if number == 0.0 {
        return i32::MIN;
    }
    parts(&format!("{number:.1e}")).1
}

/// Number times ten to the power `by`, correctly rounded.
fn shift(number: f64, by: i32) -> f64 {
    let text = format!("{number:e}");
    let (mantissa, exponent) = parts(&text);
    format!("{mantissa}e{}", exponent + by)
        .parse()
        .unwrap_or(f64::NAN)
}

/// Mantissa and exponent of a number in exponent notation.
fn parts(text: &str) -> (&str, i32) {
    let (mantissa, exponent) = text.split_once('e').unwrap_or((text, "0"));
    (mantissa, exponent.parse().unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_and_its_deviation_have_the_same_decimals() {
        assert_eq!(estimate(7.034e-8, 3.9e-9), "(7.03 ± 0.39)e-8");
        assert_eq!(estimate(-7.0e-8, 3.9e-8), "(-7.0 ± 3.9)e-8");
        assert_eq!(estimate(1.0e-9, 3.91e-8), "(0.1 ± 3.9)e-8");
        assert_eq!(estimate(0.0, 2.5e-7), "(0.0 ± 2.5)e-7");
        assert_eq!(estimate(40.26, 0.0314), "40.260 ± 0.031");
        assert_eq!(estimate(0.998, 0.0996), "1.00 ± 0.10");
        assert_eq!(estimate(1.234e6, 5.0e3), "(1.2340 ± 0.0050)e6");
        assert_eq!(estimate(250.0, 120.0), "(2.5 ± 1.2)e2");
    }

    #[test]
    fn numbers_without_a_deviation_are_written_as_they_are() {
        assert_eq!(estimate(12.5, 0.0), "12.5 ± 0");
        assert_eq!(estimate(0.0, 0.0), "0 ± 0");
        assert_eq!(estimate(1.234_567_8e-7, 0.0), "1.23457e-7 ± 0");
        assert_eq!(estimate(f64::NAN, 1.0), "NaN ± 1");
    }

    #[test]
    fn a_probability_that_underflows_is_a_limit() {
        assert_eq!(probability(0.0), "<1e-300");
        assert_eq!(probability(3.24e-13), "3.2e-13");
        assert_eq!(probability(1.0), "1.0e0");
    }
}
