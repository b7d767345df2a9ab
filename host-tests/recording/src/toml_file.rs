//! Reads TOML files with a format number: `recording.toml`, `model.toml`.
//!
//! The result is a table and a typed structure, or an [`InputError`] with the line. The format number is checked first,
//! because the same keys may have another meaning in another format.

use std::fs;
use std::path::Path;

use serde::de::DeserializeOwned;

use crate::error::InputError;

/// Only format number supported by this version, for recordings and models.
pub const FORMAT: i64 = 1;

/// Parses the text as a table and checks its format.
pub fn table(path: &Path, text: &str) -> Result<toml::Table, InputError> {
    let table = toml::from_str(text).map_err(|error| locate(path, text, &error))?;
    check_format(path, &table)?;
    Ok(table)
}

/// Reads `path`; the table holds every key as written, the structure the keys of `T`.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<(toml::Table, T), InputError> {
    parse(path, &read_text(path)?)
}

/// Parses a text of the present or future content of `path`, as [`read`] does.
pub fn parse<T: DeserializeOwned>(path: &Path, text: &str) -> Result<(toml::Table, T), InputError> {
    let table = table(path, text)?;
    let typed = toml::from_str(text).map_err(|error| locate(path, text, &error))?;
    Ok((table, typed))
}

/// Formats a float in TOML: the shortest digits that give the same f64 on reading. Needs a finite value.
pub fn float(value: f64) -> String {
    debug_assert!(value.is_finite());
    format!("{value:?}")
}

/// Formats a string with TOML's quotes and escapes.
pub fn string(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// Checks that the value of `key` is finite and in `range`, both ends included.
pub fn within(
    path: &Path,
    key: &str,
    value: f64,
    range: [f64; 2],
    unit: &str,
) -> Result<(), InputError> {
    if value.is_finite() && value >= range[0] && value <= range[1] {
        return Ok(());
    }
    let expected = match range {
        [low, f64::MAX] => format!("a finite number of at least {low} {unit}"),
        [f64::MIN_POSITIVE, high] => format!("a positive number up to {high} {unit}"),
        [low, high] => format!("{low} to {high} {unit}"),
    };
    Err(InputError::new(path, "is out of range")
        .channel(key)
        .value(value)
        .expected(expected))
}

pub(crate) fn read_text(path: &Path) -> Result<String, InputError> {
    let bytes = fs::read(path).map_err(|error| InputError::unreadable(path, &error))?;
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(InputError::new(path, "is empty").expected("a TOML file with `format = 1`"));
    }
    String::from_utf8(bytes)
        .map_err(|_| InputError::new(path, "is not UTF-8 text").expected("a TOML file"))
}

fn check_format(path: &Path, table: &toml::Table) -> Result<(), InputError> {
    match table.get("format") {
        Some(toml::Value::Integer(FORMAT)) => Ok(()),
        Some(other) => Err(
            InputError::new(path, "is of a format this version does not read")
                .channel("format")
                .value(other)
                .expected(format!("format = {FORMAT}")),
        ),
        None => Err(InputError::new(path, "has no format number")
            .channel("format")
            .expected(format!("format = {FORMAT}"))),
    }
}

fn locate(path: &Path, text: &str, error: &toml::de::Error) -> InputError {
    let message = error.message().replace('\n', ", ");
    let (problem, expected) = message.split_once(", expected ").unwrap_or((&message, ""));
    let mut located = InputError::new(path, problem);
    if !expected.is_empty() {
        located = located.expected(if expected == "f64" {
            "a number"
        } else {
            expected
        });
    }
    let Some(span) = error.span() else {
        return located;
    };
    let before = &text[..span.start.min(text.len())];
    let line = before.matches('\n').count();
    located
        .channel(format!("line {}", line + 1))
        .value(format!("`{}`", text.lines().nth(line).unwrap_or("").trim()))
}
