//! Tables for programs that take them by the Arrow C stream interface, such as pandas, polars and `DuckDB`.

use crate::error::InputError;
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{
    ArrayRef, Float64Array, Int64Array, RecordBatch, RecordBatchIterator, StringArray,
};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use std::sync::Arc;

/// A capsule `arrow_array_stream` with a copy of named columns: arrays of float64 or int64, or lists of texts.
#[pyfunction]
pub(crate) fn stream<'py>(
    py: Python<'py>,
    columns: Vec<(String, Bound<'py, PyAny>)>,
) -> PyResult<Bound<'py, PyCapsule>> {
    let mut named: Vec<(String, ArrayRef)> = Vec::new();
    for (name, values) in columns {
        let array: ArrayRef = if let Ok(values) = values.cast::<PyArray1<f64>>() {
            Arc::new(Float64Array::from(values.readonly().to_vec()?))
        } else if let Ok(values) = values.cast::<PyArray1<i64>>() {
            Arc::new(Int64Array::from(values.readonly().to_vec()?))
        } else {
            let texts: Vec<String> = values.extract()?;
            Arc::new(StringArray::from(texts))
        };
        named.push((name, array));
    }
    let wrong = |error: arrow_schema::ArrowError| InputError::new_err(error.to_string());
    let batch = RecordBatch::try_from_iter(named).map_err(wrong)?;
    let schema = batch.schema();
    let batches = RecordBatchIterator::new([Ok(batch)], schema);
    let stream = FFI_ArrowArrayStream::new(Box::new(batches));
    PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
}
