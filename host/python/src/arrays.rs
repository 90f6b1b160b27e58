//! Arrays of numbers between NumPy and the rooms: read where they lie, and handed out so that nobody writes in them.

use crate::error::InputError;
use law::Strided;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMemoryView};

/// An array of points, one a row, that is read where it lies: in rows or in columns.
pub(crate) struct Rows<'py> {
    array: PyReadonlyArray2<'py, f64>,
}

impl<'py> Rows<'py> {
    /// Takes what is an array of `n_columns`, or can be made one; a single row is one point. Arrays
    /// that are not contiguous float64 are copied.
    ///
    /// # Errors
    /// `ValueError` that names the argument.
    pub(crate) fn of(written: &Bound<'py, PyAny>, name: &str, n_columns: usize) -> PyResult<Self> {
        refuse_masked(written, name)?;
        let direct = written.cast::<PyArray2<f64>>().ok();
        let array = if let Some(array) = direct.filter(|array| array.is_contiguous()) {
            array.clone()
        } else {
            let array = as_numbers(written, name)?;
            let of_one = array.getattr("ndim")?.extract::<usize>()? == 1;
            let array = if of_one {
                array.call_method1("reshape", (1, -1))?
            } else {
                array
            };
            array.cast_into::<PyArray2<f64>>().map_err(|_| {
                InputError::new_err(format!(
                    "{name}: expected an array of shape (n, {n_columns})"
                ))
            })?
        };
        if array.shape()[1] != n_columns {
            let [n, found] = [array.shape()[0], array.shape()[1]];
            return Err(InputError::new_err(format!(
                "{name}: found shape ({n}, {found}), expected (n, {n_columns})"
            )));
        }
        if !array.is_aligned() && !array.is_empty() {
            return Err(InputError::new_err(format!(
                "{name}: its numbers do not lie at multiples of 8 bytes (they are not aligned); a copy does: `{name}.copy()`"
            )));
        }
        let array = array
            .try_readonly()
            .map_err(|_| InputError::new_err(format!("{name}: the array is being written to")))?;
        Ok(Self { array })
    }

    /// The same, of this many rows.
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
        Err(InputError::new_err(format!(
            "{name}: found {} rows, expected {n_rows}",
            rows.n_rows()
        )))
    }

    /// The array itself, if its values stand row by row.
    pub(crate) fn array(&self) -> Option<Bound<'py, PyArray2<f64>>> {
        let array: &Bound<'py, PyArray2<f64>> = &self.array;
        array.is_c_contiguous().then(|| array.clone())
    }

    /// Whether its values are in the memory of another array.
    pub(crate) fn shares_memory_with(&self, other: &Bound<'py, PyArray2<f64>>) -> bool {
        share_memory(&self.array, other)
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
            .map_err(|error| InputError::new_err(error.to_string()))?;
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

/// Refuses an array some of whose values are masked: what stands behind the mask is no value.
fn refuse_masked(written: &Bound<'_, PyAny>, name: &str) -> PyResult<()> {
    if !written.hasattr("mask")? {
        return Ok(());
    }
    let numpy = written.py().import("numpy")?.getattr("ma")?;
    if numpy.call_method1("is_masked", (written,))?.is_truthy()? {
        let message =
            format!("{name}: some values of the array are masked; `filled` gives them some");
        return Err(InputError::new_err(message));
    }
    Ok(())
}

/// Converts other objects to an array of float64, row by row. Texts, dates and objects are no numbers, though NumPy makes some of
/// them.
fn as_numbers<'py>(written: &Bound<'py, PyAny>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    let py = written.py();
    let numpy = py.import("numpy")?;
    let wrong = |error: PyErr| InputError::new_err(format!("{name}: {}", error.value(py)));
    let array = numpy.call_method1("asarray", (written,)).map_err(wrong)?;
    let dtype = array.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    if !"biuf".contains(&kind) {
        let message = format!("{name}: found an array of {dtype}, expected numbers");
        return Err(InputError::new_err(message));
    }
    let options = PyDict::new(py);
    options.set_item("dtype", "float64")?;
    let array = numpy.call_method("ascontiguousarray", (array,), Some(&options));
    array.map_err(wrong)
}

/// The same memory as an array that nobody can write in, nor allow to be written in.
///
/// # Errors
/// Those of NumPy.
pub(crate) fn looked_at<'py>(array: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let memory = PyMemoryView::from(array)?.call_method0("toreadonly")?;
    let numpy = array.py().import("numpy")?;
    numpy.call_method1("asarray", (memory,))
}

/// Whether the values of two arrays are in one memory. Values handed out of an array are not a NumPy view of it.
pub(crate) fn share_memory(a: &Bound<'_, PyArray2<f64>>, b: &Bound<'_, PyArray2<f64>>) -> bool {
    let range = |array: &Bound<'_, PyArray2<f64>>| {
        let start = array.data() as usize;
        start..start + array.len() * size_of::<f64>()
    };
    let (a, b) = (range(a), range(b));
    a.start < b.end && b.start < a.end
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
