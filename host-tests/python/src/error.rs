//! Exception of the package, the only one.

use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rlg::import::mapping::questions::without_command;

use crate::arguments::in_python;

create_exception!(
    rlg,
    InputError,
    PyValueError,
    "An input cannot be used. Its text is the command's sentence; file, problem, channel, row, value, expected are its parts."
);

/// Names by which sentences refer to the inputs of a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Names {
    /// Arguments of Python's functions.
    Arguments,
    /// Options of the command line.
    Options,
}

impl Names {
    /// Returns a sentence of the command with these names.
    pub(crate) fn of(self, sentence: &str) -> String {
        match self {
            Self::Arguments => in_python(&without_command(sentence)),
            Self::Options => sentence.to_owned(),
        }
    }
}

/// Makes the exception with the parts of the error.
pub(crate) fn raised(py: Python<'_>, error: &rlg::error::InputError, names: Names) -> PyErr {
    let raised = InputError::new_err(names.of(&error.to_string()));
    let exception = raised.value(py);
    let given = |part: &Option<String>| part.as_deref().map(|part| names.of(part));
    let parts = [
        ("file", Some(names.of(&error.file.display().to_string()))),
        ("problem", Some(names.of(&error.problem))),
        ("channel", given(&error.channel)),
        ("value", given(&error.value)),
        ("expected", given(&error.expected)),
    ];
    let set = parts
        .into_iter()
        .try_for_each(|(name, part)| exception.setattr(name, part))
        .and_then(|()| exception.setattr("row", error.row));
    match set {
        Ok(()) => raised,
        Err(other) => other,
    }
}

/// Makes the exception for an input that Python's half refuses, in the command's form.
#[pyfunction]
#[pyo3(signature = (file, problem, channel=None, row=None, value=None, expected=None))]
pub(crate) fn refusal(
    py: Python<'_>,
    file: &str,
    problem: &str,
    channel: Option<&str>,
    row: Option<u64>,
    value: Option<&str>,
    expected: Option<&str>,
) -> PyErr {
    let mut error = rlg::error::InputError::new(file, problem);
    if let Some(channel) = channel {
        error = error.channel(channel);
    }
    if let Some(row) = row {
        error = error.row(row);
    }
    if let Some(value) = value {
        error = error.value(value);
    }
    if let Some(expected) = expected {
        error = error.expected(expected);
    }
    raised(py, &error, Names::Arguments)
}
