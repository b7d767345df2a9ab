//! Reader of one section, `[[motion]]` or `[[effect]]` of a scenario or instrument, key by key.
//!
//! An entry is the parsed table and its place. Each key is read once; a key that is never read is unknown and reported with
//! its line.

use rlg_recording::error::InputError;
use std::path::Path;

/// Largest edit distance of a misspelt key, or of one in another unit, from the expected key.
const MISSPELT: usize = 3;

/// Table of which every key must be read.
#[derive(Debug, Clone)]
pub struct Entry<'a> {
    path: &'a Path,
    text: &'a str,
    begin: usize,
    remaining: toml::Table,
}

impl<'a> Entry<'a> {
    /// `begin`: byte of `text` at which the entry starts.
    pub fn new(path: &'a Path, text: &'a str, begin: usize, table: &toml::Table) -> Self {
        Self {
            path,
            text,
            begin,
            remaining: table.clone(),
        }
    }

    /// Error at `key`, with the line of the key, or of the entry if the key is absent.
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

    /// True if the key is present and not yet read.
    pub fn has(&self, key: &str) -> bool {
        self.remaining.contains_key(key)
    }

    fn take(&mut self, key: &str) -> Result<toml::Value, InputError> {
        self.remaining.remove(key).ok_or_else(|| self.missing(key))
    }

    /// Error for an absent key. If a similar key is present, the error names that one: `angle_deg` for an expected
    /// `angle_rad`.
    fn missing(&self, key: &str) -> InputError {
        let near = |other: &&String| strsim::damerau_levenshtein(other, key) <= MISSPELT;
        match self.remaining.keys().find(near) {
            Some(other) => self
                .error(other, "is an unknown key here")
                .expected(format!("`{key}`")),
            None => self.error(key, "is missing"),
        }
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

    /// A finite number, 0 if the key is absent.
    pub fn number_or_zero(&mut self, key: &str) -> Result<f64, InputError> {
        let present = self.has(key);
        self.number_if(key, present)
    }

    /// Reads a finite number if `wanted`; otherwise returns 0 and leaves the key, which is then reported as unknown.
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

    /// One or more finite numbers.
    pub fn list(&mut self, key: &str) -> Result<Vec<f64>, InputError> {
        let value = self.take(key)?;
        match value.as_array().filter(|list| !list.is_empty()) {
            Some(list) => list.iter().map(|item| self.to_number(key, item)).collect(),
            None => Err(self
                .error(key, "is not a list of numbers")
                .value(value)
                .expected("[first, second, ...]")),
        }
    }

    /// A nested table under `key`, as rows of two numbers; empty if absent.
    pub fn pairs(&mut self, key: &str) -> Result<Vec<[f64; 2]>, InputError> {
        if !self.has(key) {
            return Ok(Vec::new());
        }
        let value = self.take(key)?;
        let fault = |entry: &Self| {
            entry
                .error(key, "is not a table of pairs")
                .value(&value)
                .expected("[[Hz, density], [Hz, density], ...]")
        };
        let rows = value.as_array().ok_or_else(|| fault(self))?;
        rows.iter()
            .map(|row| {
                let pair = row.as_array().filter(|pair| pair.len() == 2);
                let pair = pair.ok_or_else(|| fault(self))?;
                Ok([
                    self.to_number(key, &pair[0])?,
                    self.to_number(key, &pair[1])?,
                ])
            })
            .collect()
    }

    /// A finite number from `low` to `high` \[`unit`\].
    pub fn within(
        &mut self,
        key: &str,
        [low, high]: [f64; 2],
        unit: &str,
    ) -> Result<f64, InputError> {
        let number = self.number(key)?;
        self.check(key, number, [low, high], unit)?;
        Ok(number)
    }

    /// A finite number from `low` to `high` \[`unit`\], `default` if the key is absent.
    pub fn within_or(
        &mut self,
        key: &str,
        range: [f64; 2],
        unit: &str,
        default: f64,
    ) -> Result<f64, InputError> {
        if self.has(key) {
            self.within(key, range, unit)
        } else {
            Ok(default)
        }
    }

    /// Three numbers from `low` to `high` \[`unit`\].
    pub fn triple_within(
        &mut self,
        key: &str,
        range: [f64; 2],
        unit: &str,
    ) -> Result<[f64; 3], InputError> {
        let numbers = self.triple(key)?;
        for number in numbers {
            self.check(key, number, range, unit)?;
        }
        Ok(numbers)
    }

    /// Three numbers in a range \[`unit`\], `default` if the key is absent.
    pub fn triple_within_or(
        &mut self,
        key: &str,
        range: [f64; 2],
        unit: &str,
        default: [f64; 3],
    ) -> Result<[f64; 3], InputError> {
        if self.has(key) {
            self.triple_within(key, range, unit)
        } else {
            Ok(default)
        }
    }

    /// Checks that a value of `key` is in its range.
    pub fn check(
        &self,
        key: &str,
        number: f64,
        [low, high]: [f64; 2],
        unit: &str,
    ) -> Result<(), InputError> {
        if (low..=high).contains(&number) {
            return Ok(());
        }
        Err(self.error(key, "is out of range").value(number).expected(
            if low == f64::MIN_POSITIVE {
                format!("above 0 and at most {high} {unit}")
            } else {
                format!("{low} to {high} {unit}")
            },
        ))
    }

    /// A table inside this one, as an entry at the same place; `None` if absent.
    pub fn inner(&mut self, key: &str) -> Result<Option<Self>, InputError> {
        if !self.has(key) {
            return Ok(None);
        }
        match self.take(key)? {
            toml::Value::Table(remaining) => Ok(Some(Self {
                remaining,
                ..self.clone()
            })),
            other => Err(self
                .error(key, "is not a table")
                .value(other)
                .expected("{ ... }")),
        }
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

    /// true or false, `default` if absent.
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

    /// Place of the entry in the text, for a later error.
    pub fn begin(&self) -> usize {
        self.begin
    }

    /// Checks that every key has been read.
    pub fn finish(self) -> Result<(), InputError> {
        match self.remaining.keys().next() {
            None => Ok(()),
            Some(key) => Err(self.error(key, "is an unknown key here")),
        }
    }
}

/// Line of a byte of `text`, from 1.
pub fn line_of(text: &str, byte: usize) -> usize {
    1 + text[..byte.min(text.len())].matches('\n').count()
}
