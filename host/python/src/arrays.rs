//! Arrays of numbers between NumPy and the rooms: read where they lie, and handed out so that nobody writes in them.

use law::Strided;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// An array of points, one a row, that is read where it lies: in rows or in columns.
pub(crate) struct Rows<'py> {
    array: PyReadonlyArray2<'py, f64>,
}

impl<'py> Rows<'py> {
    /// Takes what is an array of `n_columns`, or can be made one; a single row is one point. What is neither of
    /// float64 nor of one piece is copied.
    ///
    /// # Errors
    /// `ValueError` that names the argument.
    pub(crate) fn of(written: &Bound<'py, PyAny>, name: &str, n_columns: usize) -> PyResult<Self> {
        let py = written.py();
        let direct = written.cast::<PyArray2<f64>>().ok();
        let array = if let Some(array) = direct.filter(|array| array.is_contiguous()) {
            array.clone()
        } else {
            let numpy = py.import("numpy")?;
            let options = PyDict::new(py);
            options.set_item("dtype", "float64")?;
            let array = numpy.call_method("ascontiguousarray", (written,), Some(&options));
            let array = array
                .map_err(|error| PyValueError::new_err(format!("{name}: {}", error.value(py))))?;
            let of_one = array.getattr("ndim")?.extract::<usize>()? == 1;
            let array = if of_one {
                array.call_method1("reshape", (1, -1))?
            } else {
                array
            };
            array.cast_into::<PyArray2<f64>>().map_err(|_| {
                PyValueError::new_err(format!(
                    "{name}: expected an array of shape (n, {n_columns})"
                ))
            })?
        };
        if array.shape()[1] != n_columns {
            let [n, found] = [array.shape()[0], array.shape()[1]];
            return Err(PyValueError::new_err(format!(
                "{name}: found shape ({n}, {found}), expected (n, {n_columns})"
            )));
        }
        let array = array
            .try_readonly()
            .map_err(|_| PyValueError::new_err(format!("{name}: the array is being written to")))?;
        Ok(Self { array })
    }

    /// The same, of so many rows.
    ///
    /// # Errors
    /// As [`Rows::of`].
    pub(crate) fn exactly(
        written: &Bound<'py, PyAny>,
        name: &str,
        [n_rows, n_columns]: [usize; 2],
    ) -> PyResult<Self> {
        let rows = Self::of(written, name, n_columns)?;
        if rows.n_rows() == n_rows {
            return Ok(rows);
        }
        Err(PyValueError::new_err(format!(
            "{name}: found {} rows, expected {n_rows}",
            rows.n_rows()
        )))
    }

    /// The array itself, if its values stand row by row.
    pub(crate) fn array(&self) -> Option<Bound<'py, PyArray2<f64>>> {
        let array: &Bound<'py, PyArray2<f64>> = &self.array;
        array.is_c_contiguous().then(|| array.clone())
    }

    /// Number of points.
    pub(crate) fn n_rows(&self) -> usize {
        self.array.shape()[0]
    }

    /// The values, and where those of a point are among them.
    ///
    /// # Errors
    /// `ValueError` if the array is not of one piece.
    pub(crate) fn view(&self) -> PyResult<(&[f64], Strided)> {
        let values = self
            .array
            .as_slice()
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        let [n_rows, n_columns] = [self.array.shape()[0], self.array.shape()[1]];
        let place = if self.array.is_c_contiguous() {
            Strided::rows(n_columns)
        } else {
            Strided {
                offset: 0,
                point: 1,
                component: n_rows,
            }
        };
        Ok((values, place))
    }
}

/// The same memory as an array that nobody can write in.
///
/// # Errors
/// Those of NumPy.
pub(crate) fn looked_at<'py>(array: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let view = array.call_method0("view")?;
    let options = PyDict::new(array.py());
    options.set_item("write", false)?;
    view.call_method("setflags", (), Some(&options))?;
    Ok(view)
}

/// An array of rows.
///
/// # Errors
/// Those of NumPy.
pub(crate) fn of_rows<'py>(
    py: Python<'py>,
    values: &[f64],
    n_columns: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let n = values.len().checked_div(n_columns).unwrap_or(0);
    numpy::PyArray1::from_slice(py, values).reshape([n, n_columns])
}
