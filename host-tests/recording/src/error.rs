//! One error for everything a user hands to `rlg`: which file, which channel, which row, what stood
//! there and what was expected. It ends the command with exit code 2 and one sentence on standard error.

use std::fmt;
use std::io;
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// Why an input cannot be used. Every part that is known is printed; parts that do not apply are absent.
///
/// The parts read as fields (`error.channel`). They lie behind one pointer, so that a `Result` on the
/// good path stays small.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct InputError(Box<Parts>);

/// The parts of an [`InputError`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Parts {
    /// The file or folder at fault.
    pub file: PathBuf,
    /// The channel (column) at fault, or the key in a TOML file.
    pub channel: Option<String>,
    /// The row, counted from 0 at the first row of data.
    pub row: Option<u64>,
    /// The value found, as it stood in the file.
    pub value: Option<String>,
    /// What is wrong, as a clause: "is text, not a number".
    pub problem: String,
    /// What was expected, as a noun phrase: "a number in rad".
    pub expected: Option<String>,
}

impl InputError {
    /// An error about `file` as a whole.
    pub fn new(file: impl AsRef<Path>, problem: impl Into<String>) -> Self {
        Self(Box::new(Parts {
            file: file.as_ref().to_path_buf(),
            problem: problem.into(),
            ..Parts::default()
        }))
    }
    /// An error about `file`, which the system would not let be read.
    pub fn unreadable(file: impl AsRef<Path>, error: &io::Error) -> Self {
        Self::new(
            file,
            match error.kind() {
                io::ErrorKind::NotFound => "does not exist".to_owned(),
                kind => format!("cannot be read ({kind})"),
            },
        )
    }
    /// An error about `file`, which the system would not let be written.
    pub fn unwritable(file: impl AsRef<Path>, error: &io::Error) -> Self {
        Self::new(file, format!("cannot be written ({})", error.kind()))
            .expected("a place this user may write to")
    }
    /// Names the channel or key at fault.
    pub fn channel(mut self, channel: impl Into<String>) -> Self {
        self.0.channel = Some(channel.into());
        self
    }
    /// Names the row at fault, from 0.
    pub fn row(mut self, row: u64) -> Self {
        self.0.row = Some(row);
        self
    }
    /// Quotes the value found.
    pub fn value(mut self, value: impl ToString) -> Self {
        self.0.value = Some(value.to_string());
        self
    }
    /// Says what was expected.
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.0.expected = Some(expected.into());
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
        Ok(())
    }
}

impl std::error::Error for InputError {}
