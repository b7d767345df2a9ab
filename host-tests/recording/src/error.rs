//! Error for every input of `rlg`: file, channel, row, value found and value expected. It ends the command with exit
//! code 2 and one sentence on standard error.

use std::fmt;
use std::io;
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// Reason for rejecting an input. Every known part is printed; parts that do not apply are absent.
///
/// The parts are read as fields (`error.channel`). They are boxed, so that a `Result` stays small in the success case.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct InputError(Box<Parts>);

/// Parts of an [`InputError`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Parts {
    /// Faulty file or folder.
    pub file: PathBuf,
    /// Faulty channel (column), or key in a TOML file.
    pub channel: Option<String>,
    /// Row, counted from 0 at the first row of data.
    pub row: Option<u64>,
    /// Value found, as written in the file.
    pub value: Option<String>,
    /// Problem, as a clause: "is text, not a number".
    pub problem: String,
    /// Expected value, as a noun phrase: "a number in rad".
    pub expected: Option<String>,
    /// Result of the same command with `--anyway`, as a clause without its subject: "takes them as they are".
    pub anyway: Option<&'static str>,
}

impl InputError {
    /// Error about `file` as a whole.
    pub fn new(file: impl AsRef<Path>, problem: impl Into<String>) -> Self {
        Self(Box::new(Parts {
            file: file.as_ref().to_path_buf(),
            problem: problem.into(),
            ..Parts::default()
        }))
    }
    /// Error about a `file` that the system cannot read.
    pub fn unreadable(file: impl AsRef<Path>, error: &io::Error) -> Self {
        Self::new(
            file,
            match error.kind() {
                io::ErrorKind::NotFound => "does not exist".to_owned(),
                kind => format!("cannot be read ({kind})"),
            },
        )
    }
    /// Error about a `file` that the system cannot write.
    pub fn unwritable(file: impl AsRef<Path>, error: &io::Error) -> Self {
        Self::new(file, format!("cannot be written ({})", error.kind()))
            .expected("a place this user may write to")
    }
    /// Adds the faulty channel or key.
    pub fn channel(mut self, channel: impl Into<String>) -> Self {
        self.0.channel = Some(channel.into());
        self
    }
    /// Adds the faulty row, from 0.
    pub fn row(mut self, row: u64) -> Self {
        self.0.row = Some(row);
        self
    }
    /// Adds the value found.
    pub fn value(mut self, value: impl ToString) -> Self {
        self.0.value = Some(value.to_string());
        self
    }
    /// Adds the expected value.
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.0.expected = Some(expected.into());
        self
    }
    /// Adds the result of the same command with `--anyway`.
    pub fn or_anyway(mut self, does: &'static str) -> Self {
        self.0.anyway = Some(does);
        self
    }
}

impl Deref for InputError {
    type Target = Parts;
    fn deref(&self) -> &Parts {
        &self.0
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(channel) = &self.channel {
            write!(f, ", {channel}")?;
        }
        if let Some(row) = self.row {
            write!(f, ", row {row}")?;
        }
        write!(f, ": {}", self.problem)?;
        if let Some(value) = &self.value {
            write!(f, ", found {value}")?;
        }
        if let Some(expected) = &self.expected {
            write!(f, "; expected {expected}")?;
        }
        if let Some(does) = self.anyway {
            write!(f, "; --anyway {does}")?;
        }
        Ok(())
    }
}

impl std::error::Error for InputError {}
