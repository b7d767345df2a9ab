//! TOML files with a format number: `recording.toml`, `model.toml`.
//!
//! Enters: the path of a TOML file. Leaves: its text as a table and as a typed structure, or an
//! [`InputError`] that names the line. The format number is looked at before anything else, because a
//! file of another format may mean something different by the same keys.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use serde::de::DeserializeOwned;

use crate::error::InputError;

/// The only format number this version reads and writes, of recordings and of models.
pub const FORMAT: i64 = 1;

/// Reads `path`; the table holds every key as written, the structure what `T` knows.
pub(crate) fn read<T: DeserializeOwned>(path: &Path) -> Result<(toml::Table, T), InputError> {
    parse(path, &read_text(path)?)
}

/// As [`read`], of a text that `path` holds or will hold.
pub(crate) fn parse<T: DeserializeOwned>(
    path: &Path,
    text: &str,
) -> Result<(toml::Table, T), InputError> {
    let table: toml::Table = toml::from_str(text).map_err(|error| locate(path, text, &error))?;
    check_format(path, &table)?;
    let typed = toml::from_str(text).map_err(|error| locate(path, text, &error))?;
    Ok((table, typed))
}

/// A float as TOML writes it: the shortest digits that give the same f64 back. Needs a finite value.
pub(crate) fn float(value: f64) -> String {
    debug_assert!(value.is_finite());
    format!("{value:?}")
}

/// A string with TOML's quotes and escapes.
pub(crate) fn string(text: &str) -> String {
    toml::Value::from(text).to_string()
}

fn read_text(path: &Path) -> Result<String, InputError> {
    let bytes = fs::read(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => InputError::new(path, "does not exist"),
        _ => InputError::new(path, format!("cannot be read ({error})")),
    })?;
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
    let problem = error.message().replace('\n', ", ");
    let Some(span) = error.span() else {
        return InputError::new(path, problem);
    };
    let before = &text[..span.start.min(text.len())];
    let line = before.matches('\n').count();
    InputError::new(path, problem)
        .channel(format!("line {}", line + 1))
        .value(format!("`{}`", text.lines().nth(line).unwrap_or("").trim()))
}
