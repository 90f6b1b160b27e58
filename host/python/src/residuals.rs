//! A calibration as functions of its parameters.

use crate::error::exception;
use crate::law::opener;
use crate::task::carry_out;
use crate::value;
use input::Error;
use law::Stop;
use pyo3::prelude::*;
use pyo3::sync::MutexExt as _;
use pyo3::types::PyDict;
use runs::calibration::{Options, ResidualProblem};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Residuals of a calibration. The folder of a call is for runs of cases, and may go after it.
#[pyclass(frozen, module = "pilum")]
pub(crate) struct Residuals {
    problem: Mutex<ResidualProblem>,
}

/// Does something that may take long.
fn working<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(Stop) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let outcome = carry_out(py, |caller| work(caller.stop()), |_, ()| Ok(()))?;
    outcome.map_err(|error| exception(py, &error, None))
}

impl Residuals {
    /// Threads wait for each other.
    fn locked(&self, py: Python<'_>) -> MutexGuard<'_, ResidualProblem> {
        let problem = self.problem.lock_py_attached(py);
        problem.unwrap_or_else(PoisonError::into_inner)
    }

    fn with<T: Send>(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        work: impl FnOnce(&mut ResidualProblem) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let problem = &mut *self.locked(py);
        working(py, move |stop| {
            problem.begin(&folder, &stop)?;
            work(problem)
        })
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
        let (settings, opener) = (value::settings(settings)?, opener(None)?);
        let options = |stop| Options {
            variant,
            settings,
            out: Some(folder),
            stop,
            opener,
            anew: false,
        };
        let problem = working(py, |stop| ResidualProblem::new(&file, &options(stop)))?;
        let problem = Mutex::new(problem);
        Ok(Self { problem })
    }

    /// Name, bounds and start of each parameter.
    #[getter]
    fn parameters(&self, py: Python<'_>) -> Vec<(String, [f64; 2], f64)> {
        let problem = self.locked(py);
        let all = problem.parameters().iter();
        all.map(|p| (p.name.clone(), p.bounds, p.start)).collect()
    }

    #[getter]
    fn points(&self, py: Python<'_>) -> usize {
        self.locked(py).n_points()
    }

    fn residuals(&self, py: Python<'_>, theta: Vec<f64>, folder: PathBuf) -> PyResult<Vec<f64>> {
        self.with(py, folder, |problem| problem.residuals(&theta))
    }

    /// The columns, one after the other.
    fn jacobian(&self, py: Python<'_>, theta: Vec<f64>, folder: PathBuf) -> PyResult<Vec<f64>> {
        self.with(py, folder, |problem| {
            Ok(problem.jacobian(&theta)?.as_slice().to_vec())
        })
    }

    fn log_likelihood(
        &self,
        py: Python<'_>,
        theta: Vec<f64>,
        folder: PathBuf,
        scatter: f64,
    ) -> PyResult<f64> {
        self.with(py, folder, |p| p.log_likelihood(&theta, scatter))
    }
}
