//! Reads recordings and models for Python.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use rlg::command::ideal;
use rlg::model::Model;
use rlg::recording::{Clock, Recording};

use crate::array::bytes;
use crate::error::{Names, raised};

/// Reads a recording's channels, in SI units.
///
/// # Returns
/// A dictionary a channel: table, column, quantity, unit, axis, `start_s`, `period_s`, and the bytes of `stamps_s` (null
/// where rows are even) and `values`.
#[pyfunction]
pub(crate) fn channels<'py>(py: Python<'py>, folder: PathBuf) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let recording = py
        .detach(|| Recording::read(&folder))
        .map_err(|error| raised(py, &error, Names::Arguments))?;
    let mut all = Vec::new();
    for table in &recording.tables {
        let stamps: Option<Bound<'_, PyBytes>> = match &table.clock {
            Clock::Uniform { .. } => None,
            Clock::Stamped { stamps_s, .. } => Some(bytes(py, stamps_s)?),
        };
        for channel in &table.channels {
            let entry = PyDict::new(py);
            entry.set_item("table", &table.file)?;
            entry.set_item("column", &channel.column)?;
            entry.set_item("quantity", channel.quantity.name())?;
            entry.set_item("unit", channel.quantity.unit())?;
            entry.set_item("axis", &channel.axis)?;
            entry.set_item("start_s", table.start_s())?;
            entry.set_item("period_s", table.clock.period_s(table.rows))?;
            entry.set_item("stamps_s", &stamps)?;
            entry.set_item("values", bytes(py, &channel.values)?)?;
            all.push(entry);
        }
    }
    Ok(all)
}

/// Reads a model.
///
/// # Returns
/// Its text as `rlg` writes it, and warnings.
#[pyfunction]
pub(crate) fn read_model(py: Python<'_>, file: PathBuf) -> PyResult<(String, Vec<String>)> {
    let (model, warnings) =
        Model::read_with_warnings(&file).map_err(|error| raised(py, &error, Names::Arguments))?;
    let warnings = warnings.iter().map(|one| Names::Arguments.of(one));
    Ok((model.to_toml(), warnings.collect()))
}

/// Makes the ideal unit that is assumed of a recording where no model is given.
///
/// # Returns
/// Its text.
#[pyfunction]
pub(crate) fn ideal_model(py: Python<'_>, recording: PathBuf) -> PyResult<String> {
    let model = ideal(&recording).map_err(|error| raised(py, &error, Names::Arguments))?;
    Ok(model.to_toml())
}
