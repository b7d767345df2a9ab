//! The native half of the Python package `rlg`: calls of the command's own code, typed and documented in Python
//! (`python/rlg`). The numbers are those of the command, computed by the same code.

use std::ffi::OsString;

use pyo3::prelude::*;

use rlg::command;
use rlg::import::files::columns::Column;

use crate::array::column;
use crate::error::Names;
use crate::work::{AtInterrupt, work};

mod arguments;
mod array;
mod diagnosed;
mod error;
mod inputs;
mod work;

/// Runs `rlg ARGUMENTS`, a command that writes files. Sentences name Python's arguments, or with `as_command` the options.
///
/// # Returns
/// The result as the JSON of `--json`, and warnings.
#[pyfunction]
#[pyo3(signature = (arguments, progress=None, as_command=false))]
fn run(
    py: Python<'_>,
    arguments: Vec<OsString>,
    progress: Option<Py<PyAny>>,
    as_command: bool,
) -> PyResult<(Option<String>, Vec<String>)> {
    let names = match as_command {
        true => Names::Options,
        false => Names::Arguments,
    };
    let ((), heard) = work(py, progress, AtInterrupt::Wait, names, move |terminal| {
        command::run_in_process(arguments, terminal)
    })?;
    Ok((heard.json, heard.warnings))
}

/// Runs `rlg import ARGUMENTS` on columns of doubles, `(name, array)` each.
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
    let ((), heard) = work(
        py,
        progress,
        AtInterrupt::Wait,
        Names::Arguments,
        move |terminal| command::import_in_process(columns, arguments, terminal),
    )?;
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
    let (diagnosed, heard) = work(
        py,
        progress,
        AtInterrupt::Leave,
        Names::Arguments,
        move |terminal| command::diagnose_in_process(arguments, terminal),
    )?;
    Ok(diagnosed::Diagnosed::new(diagnosed, heard.warnings))
}

/// The module `rlg._native`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::{diagnose, import_columns, run};
    /// Version of the package.
    #[allow(non_upper_case_globals)]
    #[pymodule_export]
    const __version__: &str = env!("CARGO_PKG_VERSION");
    #[pymodule_export]
    use crate::diagnosed::Diagnosed;
    #[pymodule_export]
    use crate::error::{InputError, refusal};
    #[pymodule_export]
    use crate::inputs::{channels, ideal_model, read_model};
}
