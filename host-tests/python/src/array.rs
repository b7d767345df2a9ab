//! Arrays of doubles between Python and Rust, as bytes: the stable interface has the buffer protocol from Python 3.11 only.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Copies an array of doubles, by its `tobytes`.
pub(crate) fn column(values: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let bytes = values.call_method0("tobytes")?;
    let bytes = bytes.cast::<PyBytes>()?.as_bytes();
    let (doubles, rest) = bytes.as_chunks();
    if !rest.is_empty() {
        return Err(PyValueError::new_err("an array of doubles is expected"));
    }
    Ok(doubles.iter().copied().map(f64::from_ne_bytes).collect())
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
