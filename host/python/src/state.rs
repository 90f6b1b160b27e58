//! Points on their way: what a law needs to carry them over an increment.

use crate::arrays::looked_at;
use crate::error::{InputError, NoSuchNameError};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::sync::atomic::{AtomicU8, Ordering};

/// Points of a law: gradients, fluxes, internal variables, and the time.
///
/// `Law.initial` and `Law.integrate` make it. Do not write into its arrays.
#[pyclass(frozen, module = "pilum")]
pub(crate) struct State {
    /// Jumps or strains, a row a point.
    pub(crate) gradient: Py<PyArray2<f64>>,
    /// That array is the user's, and is not to be written in.
    pub(crate) is_lent: bool,
    /// Tractions or stresses, a row a point.
    pub(crate) flux: Py<PyArray2<f64>>,
    /// Internal variables, a row a point.
    pub(crate) internal: Py<PyArray2<f64>>,
    /// Operators, row-major, point by point; memory that is used again.
    pub(crate) operator: Py<PyArray1<f64>>,
    pub(crate) time: f64,
    /// Increments so far.
    pub(crate) increment: u32,
    /// Ids of the internal variables.
    pub(crate) names: Vec<String>,
    /// State of its memory: see [`Memory`].
    pub(crate) memory: AtomicU8,
}

/// Condition of the memory of a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Memory {
    /// It has the state's values.
    Own,
    /// An increment that came to no end has written in it.
    Spoilt,
    /// It is that of another state now.
    Given,
}

#[pymethods]
impl State {
    /// Jumps (m) or strains, shape (n, components).
    #[getter]
    fn gradient<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.refuse_given()?;
        looked_at(self.gradient.bind(py).as_any())
    }

    /// Tractions or stresses (kPa), shape (n, components).
    #[getter]
    fn flux<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.refuse_given()?;
        looked_at(self.flux.bind(py).as_any())
    }

    /// Internal variables, shape (n, variables), in the order of `Law.variables`.
    #[getter]
    fn internal<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.refuse_given()?;
        looked_at(self.internal.bind(py).as_any())
    }

    /// Their time.
    #[getter]
    fn time(&self) -> f64 {
        self.time
    }

    /// Number of increments so far.
    #[getter]
    fn increment(&self) -> u32 {
        self.increment
    }

    /// One internal variable of all points, shape (n,).
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let Some(column) = self.names.iter().position(|known| known == name) else {
            return Err(NoSuchNameError::new_err(format!(
                "there is no internal variable `{name}`: {}",
                text::suggestion(
                    name,
                    self.names.iter().map(String::as_str).collect::<Vec<_>>()
                )
            )));
        };
        let all = self.internal(py)?;
        let every = pyo3::types::PySlice::full(py);
        all.get_item((every, column))
    }

    /// Number of points.
    fn __len__(&self, py: Python<'_>) -> usize {
        self.n_points(py)
    }

    /// Its arrays, time and variables: what another process makes one of.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        self.refuse_given()?;
        let copied = |array: &Py<PyArray2<f64>>| array.bind(py).call_method0("copy");
        let values = (
            copied(&self.gradient)?,
            copied(&self.flux)?,
            copied(&self.internal)?,
            self.time,
            self.increment,
            self.names.clone(),
        );
        let make = py.import("pilum._pilum")?.getattr("state_of")?;
        (make, values).into_pyobject(py)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        if self.memory() != Memory::Own {
            return "<pilum.State: given as `out`, it is none any more>".to_owned();
        }
        format!(
            "<pilum.State: {} points, increment {}, time {:?}>",
            self.n_points(py),
            self.increment,
            self.time
        )
    }
}

/// A state of its values, as [`State::__reduce__`] names them.
#[pyfunction]
pub(crate) fn state_of(
    gradient: Py<PyArray2<f64>>,
    flux: Py<PyArray2<f64>>,
    internal: Py<PyArray2<f64>>,
    time: f64,
    increment: u32,
    names: Vec<String>,
) -> PyResult<State> {
    let of_both = Python::attach(|py| {
        let rows = |array: &Py<PyArray2<f64>>| array.bind(py).shape()[0];
        let columns = |array: &Py<PyArray2<f64>>| array.bind(py).shape()[1];
        rows(&gradient) == rows(&flux)
            && rows(&internal) == rows(&flux)
            && columns(&gradient) == columns(&flux)
            && columns(&internal) == names.len()
    });
    if !of_both {
        return Err(InputError::new_err("these are no arrays of one state"));
    }
    let operator = Python::attach(|py| PyArray1::zeros(py, 0, false).unbind());
    Ok(State {
        gradient,
        is_lent: false,
        flux,
        internal,
        operator,
        time,
        increment,
        names,
        memory: AtomicU8::new(Memory::Own as u8),
    })
}

impl State {
    /// Condition of its memory.
    pub(crate) fn memory(&self) -> Memory {
        match self.memory.load(Ordering::Relaxed) {
            0 => Memory::Own,
            1 => Memory::Spoilt,
            _ => Memory::Given,
        }
    }

    /// Notes what has become of its memory.
    pub(crate) fn note(&self, memory: Memory) {
        self.memory.store(memory as u8, Ordering::Relaxed);
    }

    /// Number of components of gradients and fluxes.
    pub(crate) fn n_components(&self, py: Python<'_>) -> usize {
        self.flux.bind(py).shape()[1]
    }

    /// Refuses a state that has no values any more.
    fn refuse_given(&self) -> PyResult<()> {
        match self.memory() {
            Memory::Own => Ok(()),
            Memory::Spoilt => Err(InputError::new_err(
                "the state was given as `out` of an increment that came to no end: it has no values any more",
            )),
            Memory::Given => Err(InputError::new_err(
                "the state was given as `out`: its memory is that of the state which was returned",
            )),
        }
    }

    /// Gradients, fluxes and internal variables, to be read.
    ///
    /// # Errors
    /// `ValueError` if another thread writes in them, or they are no values of it any more.
    pub(crate) fn read<'py>(&self, py: Python<'py>) -> PyResult<[PyReadonlyArray2<'py, f64>; 3]> {
        self.refuse_given()?;
        let read = |array: &Py<PyArray2<f64>>| {
            let busy = |_| InputError::new_err("state: its memory is in use");
            array.bind(py).try_readonly().map_err(busy)
        };
        Ok([
            read(&self.gradient)?,
            read(&self.flux)?,
            read(&self.internal)?,
        ])
    }

    /// Number of points.
    pub(crate) fn n_points(&self, py: Python<'_>) -> usize {
        self.flux.bind(py).shape()[0]
    }

    /// A state of zeros, with room for operators if they are wanted.
    pub(crate) fn zeros(
        py: Python<'_>,
        n_points: usize,
        n_components: usize,
        n_operator: usize,
        names: &[String],
    ) -> Self {
        let zeros = |columns: usize| PyArray2::zeros(py, [n_points, columns], false).unbind();
        Self {
            gradient: zeros(n_components),
            is_lent: false,
            flux: zeros(n_components),
            internal: zeros(names.len()),
            operator: PyArray1::zeros(py, n_points * n_operator, false).unbind(),
            time: 0.0,
            increment: 0,
            names: names.to_vec(),
            memory: AtomicU8::new(Memory::Own as u8),
        }
    }

    /// The memory of this one once more, if it is of this size and nobody looks at it in this moment.
    pub(crate) fn reused(&self, py: Python<'_>, like: &Self) -> Option<Self> {
        let same =
            |a: &Py<PyArray2<f64>>, b: &Py<PyArray2<f64>>| a.bind(py).shape() == b.bind(py).shape();
        let fits = same(&self.gradient, &like.gradient)
            && same(&self.flux, &like.flux)
            && same(&self.internal, &like.internal);
        let gradient = if self.is_lent {
            let shape = self.gradient.bind(py).shape();
            PyArray2::zeros(py, [shape[0], shape[1]], false).unbind()
        } else {
            self.gradient.clone_ref(py)
        };
        let is_its_own = self.memory() != Memory::Given;
        (fits && is_its_own).then_some(Self {
            gradient,
            is_lent: false,
            flux: self.flux.clone_ref(py),
            internal: self.internal.clone_ref(py),
            operator: self.operator.clone_ref(py),
            time: like.time,
            increment: like.increment,
            names: like.names.clone(),
            memory: AtomicU8::new(Memory::Own as u8),
        })
    }
}
