//! Columns of times, by their names, their units and their values.

use super::column_names::{bracketed, lower_words, words};
use super::known_forms::Form;
use super::name_table;
use crate::import::files::columns::{Block, Column};
use crate::recording::units::{Dimension, Unit};
use rlg_signal::quantiles;

/// Returns the unit text of a column of times, `Some(None)` if the name means time but has no unit.
pub fn time_unit(name: &str) -> Option<Option<String>> {
    let (rest, unit) = bracketed(name);
    let words = words(&rest);
    let lower = lower_words(&rest);
    let is_of_time =
        |unit: &str| Unit::parse(unit).is_some_and(|unit| unit.dimension == Dimension::Time);
    let (first, last) = (words.first()?, words.last()?);
    if let Some(unit) = unit {
        let is_named = is_of_time(&unit) && words.iter().any(|word| is_time(word));
        return is_named.then_some(Some(unit));
    }
    // ArduPilot's TimeUS.
    let small = last.to_lowercase();
    if words.len() > 1 && is_of_time(&small) && words.iter().any(|word| is_time(word)) {
        return Some(Some(small));
    }
    if let [unit, elapsed] = &lower[..]
        && elapsed == "elapsed"
        && is_of_time(unit)
    {
        return Some(Some(unit.clone()));
    }
    // `Micros` of an Arduino names its unit.
    if let [word] = &lower[..]
        && word.len() > 3
        && is_of_time(word)
    {
        return Some(Some(word.clone()));
    }
    let is_offset = name_table::no_measurement(&lower).is_some();
    let is_named = is_time(first) || is_time(last) || lower.concat() == "sampletimefine";
    let alone = matches!(words.len(), 1..=3) && is_named && !is_offset;
    alone.then_some(None)
}

/// Returns the unit text of a column of times in its file, by its name or by the form of the file.
pub fn time_in(block: &Block, column: &Column) -> Option<Option<String>> {
    if let Some(meaning) = Form::takes(block, column) {
        let unit = meaning.strip_prefix("time:")?.rsplit(':').next()?;
        return Some(Some(unit.to_owned()));
    }
    let named = match time_unit(&column.name) {
        Some(named) => named,
        None => Some(growing_time(column)?),
    };
    let by_form = || Form::unit_in(block, "time").map(|(unit, _)| unit.to_owned());
    Some(named.or(column.unit.clone()).or_else(by_form))
}

/// Returns the unit of a column in a unit of time whose values grow evenly, whatever its name.
fn growing_time(column: &Column) -> Option<String> {
    let (rest, unit) = bracketed(&column.name);
    let lower = lower_words(&rest);
    let unit = unit.or_else(|| column.unit.clone())?;
    let is_of_time = Unit::parse(&unit).is_some_and(|unit| unit.dimension == Dimension::Time);
    let is_offset = name_table::no_measurement(&lower).is_some();
    (is_of_time && !is_offset && is_even(&column.values)).then_some(unit)
}

/// Share of steps within a factor of [`EVEN`] of their median, in a column of stamps.
const MOST: f64 = 0.9;

/// Largest ratio of an even step to the median step.
const EVEN: f64 = 5.0;

/// True if values grow evenly, as stamps do.
pub fn is_even(values: &[f64]) -> bool {
    let steps = steps(values);
    let middle = median(steps.clone());
    let even = (middle / EVEN)..=(middle * EVEN);
    let count = steps.iter().filter(|step| even.contains(step)).count();
    middle > 0.0
        && steps.iter().all(|step| *step >= 0.0)
        && count as f64 > MOST * steps.len() as f64
}

/// Returns the steps from value to value.
pub fn steps(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// Returns the median of the finite values; NaN without any.
pub fn median(values: Vec<f64>) -> f64 {
    let finite = values.into_iter().filter(|value| value.is_finite());
    quantiles::median(finite).unwrap_or(f64::NAN)
}

/// True if a word means time; a capital T is a temperature as often.
fn is_time(word: &str) -> bool {
    let names = [
        "time",
        "times",
        "timestamp",
        "timestamps",
        "stamp",
        "stamps",
        "chiptime",
        "tow",
        "epoch",
        "elapsed",
        "uptime",
        "zeit",
        "zeitstempel",
    ];
    word == "t" || names.contains(&word.to_lowercase().as_str())
}
