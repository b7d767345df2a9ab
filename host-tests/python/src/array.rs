//! Arrays of doubles between Python and Rust, by the buffer protocol and as bytes.

use pyo3::buffer::PyBuffer;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Copies a buffer of doubles, such as a numpy array.
pub(crate) fn column(values: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    PyBuffer::<f64>::get(values)?.to_vec(values.py())
}

/// Returns doubles as bytes, for `numpy.frombuffer`.
pub(crate) fn bytes<'py>(py: Python<'py>, values: &[f64]) -> PyResult<Bound<'py, PyBytes>> {
    PyBytes::new_with(py, size_of_val(values), |bytes| {
        for (place, value) in bytes.chunks_exact_mut(size_of::<f64>()).zip(values) {
            place.copy_from_slice(&value.to_ne_bytes());
        }
        Ok(())
    })
}
