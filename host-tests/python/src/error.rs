//! Exception of the package, the only one.

use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

create_exception!(
    rlg,
    InputError,
    PyValueError,
    "An input cannot be used. Its text is the command's sentence; file, problem, channel, row, value, expected are its parts."
);

/// Makes the exception with the parts of the error.
pub(crate) fn raised(py: Python<'_>, error: &rlg::error::InputError) -> PyErr {
    let raised = InputError::new_err(error.to_string());
    let exception = raised.value(py);
    let parts = [
        ("file", Some(error.file.display().to_string())),
        ("problem", Some(error.problem.clone())),
        ("channel", error.channel.clone()),
        ("value", error.value.clone()),
        ("expected", error.expected.clone()),
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
