//! [`Array`]: numbers that NumPy sees where they are.

use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Numbers in their order, the last index running fastest. NumPy takes them by `__array_interface__` (version 3 of its array interface
/// protocol): nothing is copied, the array keeps this object, and cannot be written to.
#[pyclass(frozen, module = "odyn._odyn")]
pub(crate) struct Array {
    values: Vec<f64>,
    shape: Vec<usize>,
}

impl Array {
    /// A list.
    pub(crate) fn list(values: Vec<f64>) -> Self {
        Self { shape: vec![values.len()], values }
    }

    /// A matrix by its entries.
    pub(crate) fn matrix([rows, columns]: [usize; 2], entry: impl Fn(usize, usize) -> f64) -> Self {
        let entry = &entry;
        let values = (0..rows).flat_map(|row| (0..columns).map(move |column| entry(row, column))).collect();
        Self { values, shape: vec![rows, columns] }
    }

    /// The numbers.
    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }
}

#[pymethods]
impl Array {
    /// Where and what the numbers are.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("typestr", if cfg!(target_endian = "little") { "<f8" } else { ">f8" })?;
        interface.set_item("shape", pyo3::types::PyTuple::new(py, &self.shape)?)?;
        let read_only = true;
        interface.set_item("data", (self.values.as_ptr() as usize, read_only))?;
        Ok(interface)
    }
}
