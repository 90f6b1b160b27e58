//! A calibration as functions of its parameters.

use crate::arrays::of_rows;
use crate::error::exception;
use crate::law::opener;
use crate::task::carry_out;
use crate::value;
use input::Error;
use law::Stop;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::sync::MutexExt as _;
use pyo3::types::PyDict;
use runs::calibration::{Options, Parameter, ResidualProblem};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Residuals of a calibration. The folder of a call is for runs of cases, and may go after it.
#[pyclass(frozen, module = "pilum")]
pub(crate) struct Residuals {
    problem: Mutex<ResidualProblem>,
}

/// Does something that may take long.
fn working<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&Stop) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let outcome = carry_out(py, |caller| work(&caller.stop()), |_, ()| Ok(()))?;
    outcome.map_err(|error| exception(py, &error, None))
}

impl Residuals {
    /// Threads wait for each other.
    fn locked(&self, py: Python<'_>) -> MutexGuard<'_, ResidualProblem> {
        let problem = self.problem.lock_py_attached(py);
        problem.unwrap_or_else(PoisonError::into_inner)
    }

    /// The same with the problem.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        folder: &Path,
        work: impl FnOnce(&mut ResidualProblem) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let problem = &mut *self.locked(py);
        working(py, move |stop| {
            problem.begin(folder, stop)?;
            work(problem)
        })
    }

    fn told<T>(&self, py: Python<'_>, what: impl Fn(&Parameter) -> T) -> Vec<T> {
        self.locked(py).parameters().iter().map(what).collect()
    }
}

#[pymethods]
impl Residuals {
    #[new]
    fn new(
        py: Python<'_>,
        file: PathBuf,
        settings: Option<&Bound<'_, PyDict>>,
        variant: Option<String>,
        folder: PathBuf,
    ) -> PyResult<Self> {
        let options = Options {
            variant,
            settings: value::settings(settings)?,
            out: None,
            stop: Stop::never(),
            opener: opener(None)?,
            anew: false,
        };
        let problem = working(py, |stop| {
            let stop = stop.clone();
            ResidualProblem::new(&file, &Options { stop, ..options }, &folder)
        })?;
        let problem = Mutex::new(problem);
        Ok(Self { problem })
    }

    #[getter]
    fn names(&self, py: Python<'_>) -> Vec<String> {
        self.told(py, |parameter| parameter.name.clone())
    }

    #[getter]
    fn bounds(&self, py: Python<'_>) -> Vec<[f64; 2]> {
        self.told(py, |parameter| parameter.bounds)
    }

    #[getter]
    fn start(&self, py: Python<'_>) -> Vec<f64> {
        self.told(py, |parameter| parameter.start)
    }

    #[getter]
    fn points(&self, py: Python<'_>) -> usize {
        self.locked(py).n_points()
    }

    fn residuals<'py>(
        &self,
        py: Python<'py>,
        theta: Vec<f64>,
        folder: PathBuf,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let residuals = self.with(py, &folder, |problem| problem.residuals(&theta))?;
        Ok(PyArray1::from_vec(py, residuals))
    }

    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        theta: Vec<f64>,
        folder: PathBuf,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let by_row = self.with(py, &folder, |problem| {
            Ok(problem.jacobian(&theta)?.transpose())
        })?;
        of_rows(py, by_row.as_slice(), theta.len())
    }

    fn log_likelihood(
        &self,
        py: Python<'_>,
        theta: Vec<f64>,
        scatter: f64,
        folder: PathBuf,
    ) -> PyResult<f64> {
        self.with(py, &folder, |problem| {
            problem.log_likelihood(&theta, scatter)
        })
    }
}
