//! The native half of the Python package `rlg`: calls of the command's own code, typed and documented in Python
//! (`python/rlg`). The numbers are those of the command, computed by the same code.

use std::ffi::OsString;

use pyo3::prelude::*;

use rlg::command;
use rlg::import::files::columns::Column;

use crate::array::column;
use crate::work::{AtInterrupt, work};

mod array;
mod diagnosed;
mod error;
mod inputs;
mod work;

/// Runs `rlg ARGUMENTS`, a command that writes files.
///
/// # Returns
/// The result as the JSON of `--json`, and warnings.
#[pyfunction]
#[pyo3(signature = (arguments, progress=None))]
fn run(
    py: Python<'_>,
    arguments: Vec<OsString>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Option<String>, Vec<String>)> {
    let ((), heard) = work(py, progress, AtInterrupt::Wait, move |terminal| {
        command::run_in_process(arguments, terminal)
    })?;
    Ok((heard.json, heard.warnings))
}

/// Runs `rlg import ARGUMENTS` on columns of doubles, `(name, buffer)` each.
///
/// # Returns
/// As [`run`].
#[pyfunction]
#[pyo3(signature = (columns, arguments, progress=None))]
fn import_columns(
    py: Python<'_>,
    columns: Vec<(String, Bound<'_, PyAny>)>,
    arguments: Vec<OsString>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Option<String>, Vec<String>)> {
    let columns = columns
        .into_iter()
        .map(|(name, values)| Ok(Column::new(name, column(&values)?)))
        .collect::<PyResult<Vec<_>>>()?;
    let ((), heard) = work(py, progress, AtInterrupt::Wait, move |terminal| {
        command::import_in_process(columns, arguments, terminal)
    })?;
    Ok((heard.json, heard.warnings))
}

/// Runs `rlg diagnose ARGUMENTS`; writes nothing.
#[pyfunction]
#[pyo3(signature = (arguments, progress=None))]
fn diagnose(
    py: Python<'_>,
    arguments: Vec<OsString>,
    progress: Option<Py<PyAny>>,
) -> PyResult<diagnosed::Diagnosed> {
    // Nothing is on disk before the result is, so there is no need to wait for the work to stop.
    let (diagnosed, heard) = work(py, progress, AtInterrupt::Leave, move |terminal| {
        command::diagnose_in_process(arguments, terminal)
    })?;
    Ok(diagnosed::Diagnosed::new(diagnosed, heard.warnings))
}

/// The module `rlg._native`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::{diagnose, import_columns, run};
    #[pymodule_export]
    use crate::diagnosed::Diagnosed;
    #[pymodule_export]
    use crate::error::InputError;
    #[pymodule_export]
    use crate::inputs::{channels, ideal_model, read_model};
}
