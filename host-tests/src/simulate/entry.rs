//! One `[[motion]]` or `[[effect]]` of a scenario, read key by key.
//!
//! Enters: the parsed table and where it stands. Leaves: its values, each asked for once; what nobody
//! asked for is an unknown key, reported with its line.

use super::scenario::line_of;
use crate::error::InputError;
use std::path::Path;

/// A table of which every key must be asked for.
pub struct Entry<'a> {
    path: &'a Path,
    text: &'a str,
    begin: usize,
    remaining: toml::Table,
}

impl<'a> Entry<'a> {
    /// `begin` is the byte of `text` at which the entry stands.
    pub fn new(path: &'a Path, text: &'a str, begin: usize, table: &toml::Table) -> Self {
        Self {
            path,
            text,
            begin,
            remaining: table.clone(),
        }
    }

    /// An error at `key`, with the line of the key, or of the entry where the key is absent.
    pub fn error(&self, key: &str, problem: &str) -> InputError {
        let mut begin = self.begin.min(self.text.len());
        let entry_line = line_of(self.text, begin);
        let mut line = entry_line;
        for (index, content) in self.text[begin..].split_inclusive('\n').enumerate() {
            let trimmed = content.trim_start();
            if index > 0 && trimmed.starts_with('[') {
                break;
            }
            let rest = trimmed.strip_prefix(key).map(str::trim_start);
            if rest.is_some_and(|rest| rest.starts_with('=')) {
                line = line_of(self.text, begin);
                break;
            }
            begin += content.len();
        }
        InputError::new(self.path, format!("line {line}: {problem}")).channel(key)
    }

    /// Whether the key stands there and was not yet asked for.
    pub fn has(&self, key: &str) -> bool {
        self.remaining.contains_key(key)
    }

    fn take(&mut self, key: &str) -> Result<toml::Value, InputError> {
        self.remaining
            .remove(key)
            .ok_or_else(|| self.error(key, "is missing"))
    }

    fn to_number(&self, key: &str, value: &toml::Value) -> Result<f64, InputError> {
        let number = match value {
            toml::Value::Float(number) => *number,
            toml::Value::Integer(number) => *number as f64,
            other => {
                return Err(self
                    .error(key, "is not a number")
                    .value(other)
                    .expected("a number"));
            }
        };
        if number.is_finite() {
            Ok(number)
        } else {
            Err(self.error(key, "is not finite").value(number))
        }
    }

    /// A finite number.
    pub fn number(&mut self, key: &str) -> Result<f64, InputError> {
        let value = self.take(key)?;
        self.to_number(key, &value)
    }

    /// A finite number, 0 where the key is absent.
    pub fn number_or_zero(&mut self, key: &str) -> Result<f64, InputError> {
        let present = self.has(key);
        self.number_if(key, present)
    }

    /// A finite number if `wanted`, else 0 without looking: a key that stands there is then left over.
    pub fn number_if(&mut self, key: &str, wanted: bool) -> Result<f64, InputError> {
        if wanted { self.number(key) } else { Ok(0.0) }
    }

    /// A number above 0.
    pub fn positive(&mut self, key: &str) -> Result<f64, InputError> {
        let number = self.number(key)?;
        if number > 0.0 {
            Ok(number)
        } else {
            Err(self
                .error(key, "is not positive")
                .value(number)
                .expected("a number above 0"))
        }
    }

    /// Three finite numbers.
    pub fn triple(&mut self, key: &str) -> Result<[f64; 3], InputError> {
        let value = self.take(key)?;
        let list = value.as_array().filter(|list| list.len() == 3);
        let Some(list) = list else {
            return Err(self
                .error(key, "is not three numbers")
                .value(value)
                .expected("[x, y, z]"));
        };
        let mut numbers = [0.0; 3];
        for (number, item) in numbers.iter_mut().zip(list) {
            *number = self.to_number(key, item)?;
        }
        Ok(numbers)
    }

    /// Text.
    pub fn text(&mut self, key: &str) -> Result<String, InputError> {
        match self.take(key)? {
            toml::Value::String(text) => Ok(text),
            other => Err(self
                .error(key, "is not text")
                .value(other)
                .expected("text in quotes")),
        }
    }

    /// true or false, `default` where absent.
    pub fn flag(&mut self, key: &str, default: bool) -> Result<bool, InputError> {
        if !self.has(key) {
            return Ok(default);
        }
        match self.take(key)? {
            toml::Value::Boolean(flag) => Ok(flag),
            other => Err(self
                .error(key, "is neither true nor false")
                .value(other)
                .expected("true or false")),
        }
    }

    /// An axis as its index and its letter.
    pub fn axis(&mut self, key: &str) -> Result<(usize, String), InputError> {
        let letter = self.text(key)?;
        match ["x", "y", "z"].iter().position(|axis| *axis == letter) {
            Some(index) => Ok((index, letter)),
            None => Err(self
                .error(key, "is no axis")
                .value(letter)
                .expected("\"x\", \"y\" or \"z\"")),
        }
    }

    /// Every key must have been asked for.
    pub fn finish(self) -> Result<(), InputError> {
        match self.remaining.keys().next() {
            None => Ok(()),
            Some(key) => Err(self.error(key, "is an unknown key here")),
        }
    }
}
