//! Diagnosis as a Python object.

use std::path::PathBuf;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use rlg::command;
use rlg::report::{figure, page};

use crate::array::bytes;
use crate::error::{Names, raised};

/// A diagnosis with all that its report needs.
#[pyclass(frozen, module = "rlg._native")]
pub(crate) struct Diagnosed {
    diagnosed: command::Diagnosed,
    warnings: Vec<String>,
}

impl Diagnosed {
    pub(crate) fn new(diagnosed: command::Diagnosed, warnings: Vec<String>) -> Self {
        Self {
            diagnosed,
            warnings,
        }
    }
}

#[pymethods]
impl Diagnosed {
    /// Returns the text of `rlg diagnose --json`.
    fn json(&self) -> PyResult<String> {
        serde_json::to_string_pretty(&self.diagnosed.outcome.diagnosis)
            .map_err(|error| PyRuntimeError::new_err(format!("no JSON form ({error})")))
    }

    /// Returns the answer as the command prints it, a line each, with Python's names of arguments.
    fn lines(&self) -> Vec<String> {
        let lines = self.diagnosed.lines();
        lines.iter().map(|line| Names::Arguments.of(line)).collect()
    }

    /// Returns what the user should know beside the answer.
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// Returns the model with the found effects switched on, as text.
    fn model(&self) -> String {
        self.diagnosed.outcome.model.to_toml()
    }

    /// Draws the integrated residual of the three gyros, as SVG.
    fn residual_svg(&self) -> String {
        let outcome = &self.diagnosed.outcome;
        figure::residuals(&outcome.diagnosis, outcome.pictures.as_ref())
    }

    /// Writes the report, as HTML.
    fn page(&self) -> String {
        let outcome = &self.diagnosed.outcome;
        page(&outcome.diagnosis, outcome.pictures.as_ref())
    }

    /// Returns the report's curves: a list of doubles' bytes each, of one entry or one a gyro; null where there is no
    /// residual.
    fn curves<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(pictures) = &self.diagnosed.outcome.pictures else {
            return Ok(None);
        };
        let one = |values: &Vec<f64>| Ok(vec![bytes(py, values)?]);
        let three = |values: &[Vec<f64>; 3]| {
            let all: PyResult<Vec<Bound<'py, PyBytes>>> =
                values.iter().map(|values| bytes(py, values)).collect();
            all
        };
        let held_out: Vec<f64> = pictures.held_out_s.as_flattened().to_vec();
        let curves: [(&str, PyResult<Vec<Bound<'py, PyBytes>>>); 8] = [
            ("time_s", one(&pictures.time_s)),
            ("angle_before_rad", three(&pictures.angle_before_rad)),
            ("angle_after_rad", three(&pictures.angle_after_rad)),
            ("frequency_hz", one(&pictures.frequency_hz)),
            ("power_before", three(&pictures.power_before)),
            ("power_after", three(&pictures.power_after)),
            ("power_noise", three(&pictures.power_noise)),
            ("held_out_s", one(&held_out)),
        ];
        let entries = PyDict::new(py);
        for (name, values) in curves {
            entries.set_item(name, values?)?;
        }
        Ok(Some(entries))
    }

    /// Writes the files of `rlg diagnose --out` into a folder.
    fn write(&self, py: Python<'_>, out: PathBuf) -> PyResult<()> {
        py.detach(|| self.diagnosed.write(&out))
            .map_err(|error| raised(py, &error, Names::Arguments))
    }
}
