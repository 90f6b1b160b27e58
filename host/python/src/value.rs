//! Python's values as those of files, so that a dictionary says what a file would.

use crate::error::{InputError, WrongTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyMapping, PyString};
use std::path::PathBuf;
use toml::{Table, Value};

/// Dictionaries and lists in one another, at most: those of files are not as deep, one that holds itself is deeper.
const DEPTH: usize = 100;

/// The keys of a dictionary. Values `None` are omitted.
///
/// # Errors
/// `TypeError` with the key that has no value of a file.
pub(crate) fn table(written: &Bound<'_, PyAny>) -> PyResult<Table> {
    table_at(written, 0)
}

fn table_at(written: &Bound<'_, PyAny>, depth: usize) -> PyResult<Table> {
    let mut table = Table::new();
    for item in written.cast::<PyMapping>()?.items()? {
        let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
        let key = key.str()?.to_string();
        if let Some(value) = value_of(&value, depth).map_err(|error| in_key(&value, &key, error))? {
            table.insert(key, value);
        }
    }
    Ok(table)
}

fn in_key(value: &Bound<'_, PyAny>, key: &str, error: PyErr) -> PyErr {
    let py = value.py();
    WrongTypeError::new_err(format!("{key}: {}", error.value(py)))
}

/// A value; nothing of `None`.
fn value_of(written: &Bound<'_, PyAny>, depth: usize) -> PyResult<Option<Value>> {
    if depth > DEPTH {
        return Err(WrongTypeError::new_err(format!(
            "dictionaries and lists are more than {DEPTH} deep, or hold themselves"
        )));
    }
    if written.is_none() {
        return Ok(None);
    }
    // Of a law its table.
    if let Ok(law) = written.cast::<crate::law::Law>() {
        return Ok(Some(Value::Table(law.get().table().clone())));
    }
    if written.is_instance_of::<PyBool>() {
        return Ok(Some(Value::Boolean(written.extract()?)));
    }
    if written.is_instance_of::<PyInt>() {
        return Ok(Some(Value::Integer(written.extract()?)));
    }
    if written.is_instance_of::<PyFloat>() {
        return Ok(Some(Value::Float(written.extract()?)));
    }
    if written.is_instance_of::<PyString>() {
        return Ok(Some(Value::String(written.extract()?)));
    }
    if written.cast::<PyMapping>().is_ok() {
        return Ok(Some(Value::Table(table_at(written, depth + 1)?)));
    }
    // Numbers and arrays of NumPy.
    if written.hasattr("tolist")? {
        return value_of(&written.call_method0("tolist")?, depth + 1);
    }
    if written.hasattr("__fspath__")? {
        let path: PathBuf = written.extract()?;
        let text = path.to_str();
        let text = text.ok_or_else(|| InputError::new_err("the path is not Unicode"))?;
        return Ok(Some(Value::String(text.to_owned())));
    }
    let Ok(items) = written.try_iter() else {
        let kind = written.get_type().name()?;
        let message = format!("a file has no values of the type `{kind}`");
        return Err(WrongTypeError::new_err(message));
    };
    let items = items.map(|item| {
        let value = value_of(&item?, depth + 1)?;
        value.ok_or_else(|| WrongTypeError::new_err("None in a list"))
    });
    Ok(Some(Value::Array(items.collect::<PyResult<_>>()?)))
}

/// The text of a file with these keys.
///
/// # Errors
/// `ValueError` if they cannot be written.
pub(crate) fn text_of(table: &Table) -> PyResult<String> {
    toml::to_string(table).map_err(|error| InputError::new_err(error.to_string()))
}

/// Settings over a file, as the command line has them: `KEY=VALUE`.
///
/// # Errors
/// As [`table`].
pub(crate) fn settings(written: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<String>> {
    let Some(written) = written else {
        return Ok(Vec::new());
    };
    let table = table(written.as_any())?;
    let settings = table.iter().map(|(key, value)| format!("{key}={value}"));
    Ok(settings.collect())
}

/// A value of a file as one of Python.
///
/// # Errors
/// Those of Python.
pub(crate) fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::String(text) => text.into_pyobject(py)?.into_any(),
        Value::Integer(number) => number.into_pyobject(py)?.into_any(),
        Value::Float(number) => number.into_pyobject(py)?.into_any(),
        Value::Boolean(value) => value.into_pyobject(py)?.to_owned().into_any(),
        Value::Datetime(time) => time.to_string().into_pyobject(py)?.into_any(),
        Value::Array(values) => {
            let values: PyResult<Vec<_>> = values.iter().map(|v| to_python(py, v)).collect();
            values?.into_pyobject(py)?.into_any()
        }
        Value::Table(table) => {
            let all = PyDict::new(py);
            for (key, value) in table {
                all.set_item(key, to_python(py, value)?)?;
            }
            all.into_any()
        }
    })
}
