//! Memory of a batch of points: what an increment starts from and ends in, and where its points lie.

use super::Law;
use crate::arrays::Rows;
use crate::error::{InputError, NoMemoryError};
use crate::state::{Memory, State};
use law::{Site, Strided};
use numpy::PyArray2;
use pyo3::prelude::*;

/// Whether there is memory for this many points with this many values.
///
/// # Errors
/// `MemoryError` if not.
pub(super) fn has_room(n_points: usize, n_values: usize) -> PyResult<()> {
    let all = n_points.saturating_mul(n_values);
    Vec::<f64>::new()
        .try_reserve_exact(all)
        .map_err(|_| NoMemoryError::new_err(format!("points: no memory for {n_points} of them")))
}

/// Copies values point by point.
pub(super) fn copied((from, place): (&[f64], Strided), to: &mut [f64], n: usize) {
    if (place.offset, place.point, place.component) == (0, n, 1) {
        to.copy_from_slice(&from[..to.len()]);
        return;
    }
    for (point, values) in to.chunks_exact_mut(n.max(1)).enumerate() {
        for (c, value) in values.iter_mut().enumerate() {
            *value = from[place.offset + point * place.point + c * place.component];
        }
    }
}

impl Law {
    /// The state at the end of an increment, before it has values: in the memory of `out`, with the array of gradients
    /// itself where that is not copied.
    pub(super) fn memory_for<'py>(
        &self,
        py: Python<'py>,
        from: &State,
        (gradient, copy): (&Rows<'py>, bool),
        out: Option<&Bound<'py, State>>,
        n_operator: usize,
    ) -> PyResult<State> {
        let (n_points, n) = (from.n_points(py), from.n_components(py));
        let mut end = match out {
            None => State::zeros(py, n_points, n, n_operator, &self.variables),
            Some(out) => reused(py, out.get(), from)?,
        };
        if end.operator.bind(py).len()? != n_points * n_operator {
            end.operator = numpy::PyArray1::zeros(py, n_points * n_operator, false).unbind();
        }
        if let Some(array) = gradient.array().filter(|_| !copy) {
            end.gradient = array.unbind();
            end.is_lent = true;
        }
        let is_shared = |own: &Py<PyArray2<f64>>| gradient.shares_memory_with(own.bind(py));
        let is_own = !end.is_lent && is_shared(&end.gradient);
        if out.is_some() && (is_own || is_shared(&end.flux) || is_shared(&end.internal)) {
            let message = "out: its memory is in use, by `gradient`";
            return Err(InputError::new_err(message));
        }
        Ok(end)
    }

    /// Where points lie, if the law asks.
    pub(super) fn sites(
        &self,
        n_points: usize,
        positions: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<Site>> {
        let positions = positions.map(|at| Rows::exactly(at, "positions", [n_points, 2]));
        let positions = positions.transpose()?;
        if !self.law().asks_for_sites() {
            return Ok(Vec::new());
        }
        let mut at = vec![0.0; 2 * n_points];
        if let Some(positions) = positions {
            copied(positions.view()?, &mut at, 2);
        }
        let site = |(number, at): (usize, &[f64])| Site {
            position: [at[0], at[1]],
            element: number as u32 + 1,
            ..Site::default()
        };
        Ok(at.chunks_exact(2).enumerate().map(site).collect())
    }
}

/// The memory of a state once more.
fn reused(py: Python<'_>, out: &State, from: &State) -> PyResult<State> {
    if out.memory() == Memory::Given {
        let message =
            "out: the state was given as `out` before: give the one that was returned then";
        return Err(InputError::new_err(message));
    }
    out.reused(py, from)
        .ok_or_else(|| InputError::new_err("out: a state of other points, or of another law"))
}
