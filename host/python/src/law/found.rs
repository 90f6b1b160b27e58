//! The laws that there are, and what they say of themselves.

use super::opener;
use crate::error::{InputError, exception};
use law::SearchPath;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// Description of a law: name, version, parameters with units, bounds and meaning, hypotheses, internal
/// variables.
#[pyfunction]
#[pyo3(signature = (id, /, *, law_path=None))]
pub(crate) fn describe(
    py: Python<'_>,
    id: &str,
    law_path: Option<Vec<PathBuf>>,
) -> PyResult<Py<PyAny>> {
    let opener = opener(None)?;
    let folders = law_path.unwrap_or_default();
    let found = py.detach(|| SearchPath::of(&opener, &folders).law(id));
    let found = found.map_err(|error| exception(py, &error.into(), None))?;
    let text = serde_json::to_string(found.description());
    let text = text.map_err(|error| InputError::new_err(error.to_string()))?;
    Ok(py.import("json")?.call_method1("loads", (text,))?.unbind())
}

/// Ids of all laws found, with their libraries, which are not executed.
#[pyfunction]
#[pyo3(signature = (*, law_path=None))]
pub(crate) fn laws(py: Python<'_>, law_path: Option<Vec<PathBuf>>) -> PyResult<Bound<'_, PyDict>> {
    let found = SearchPath::new(&law_path.unwrap_or_default()).installed();
    let all = PyDict::new(py);
    for (id, library) in found {
        all.set_item(id, library)?;
    }
    Ok(all)
}
