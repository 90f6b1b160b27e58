//! A law led along a path at one point.

use crate::error::exception;
use crate::law::warn;
use crate::posed::Posed;
use crate::task::carry_out;
use input::Error;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use runs::point::write_csv;
use std::path::Path;

/// A driver's table: the name of its variant, rows as comma-separated values, increments, calls, cut-backs.
type Led = (Option<String>, String, usize, usize, usize);

/// Follows a driver, or all its variants. `source` is a path or a dictionary.
#[pyfunction]
pub(crate) fn point(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    settings: Option<&Bound<'_, PyDict>>,
    variant: Option<String>,
    isolate: Option<f64>,
) -> PyResult<Vec<Led>> {
    let posed = Posed::of(
        source,
        "driver".to_owned(),
        None,
        settings,
        variant,
        isolate,
    )?;
    let outcome = carry_out(
        py,
        |caller| -> Result<Vec<Led>, Error> {
            let mut led = Vec::new();
            for mut driver in posed.drivers()? {
                driver.point_mut().stop_on(&caller.stop());
                let mut rows = Vec::new();
                let report = write_csv(&driver, &mut rows, Path::new("the table"))?;
                report.warnings.into_iter().for_each(|w| caller.tell(w));
                let rows = String::from_utf8_lossy(&rows).into_owned();
                led.push((
                    report.variant,
                    rows,
                    report.increments,
                    report.calls,
                    report.cut_backs,
                ));
            }
            Ok(led)
        },
        |py, warning: String| warn(py, &warning),
    )?;
    outcome.map_err(|error| exception(py, &error, posed.written()))
}
