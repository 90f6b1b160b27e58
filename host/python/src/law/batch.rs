//! Memory of a batch of points: what an increment starts from and ends in, and where its points lie.

use super::Law;
use crate::arrays::Rows;
use crate::error::{InputError, NoMemoryError, of_batch};
use crate::state::{Memory, State};
use law::{BatchSuccess, End, Moment, Operator, Site, Start, Strided};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
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

/// Rows point by point; a single row is for all points.
pub(super) fn repeated(
    rows: &Rows<'_>,
    name: &str,
    [n_points, n]: [usize; 2],
) -> PyResult<Vec<f64>> {
    let n_rows = rows.n_rows();
    if n_rows != n_points && n_rows != 1 {
        let message = format!("{name}: found {n_rows} rows, expected {n_points}");
        return Err(InputError::new_err(message));
    }
    let mut values = vec![0.0; n_rows * n];
    copied(rows.view()?, &mut values, n);
    if n_rows != n_points {
        values = values.repeat(n_points);
    }
    Ok(values)
}

impl Law {
    /// An increment starts from a state of this law, and does not end in its memory.
    ///
    /// # Errors
    /// `ValueError` that names the argument.
    pub(super) fn refuse_misfit(
        &self,
        py: Python<'_>,
        state: Option<&Bound<'_, State>>,
        out: Option<&Bound<'_, State>>,
    ) -> PyResult<()> {
        let Some(state) = state else { return Ok(()) };
        let from = state.get();
        let n = self.law().n_components();
        if from.names != self.variables || from.n_components(py) != n {
            return Err(InputError::new_err(
                "state: it is one of another law, or of another hypothesis",
            ));
        }
        if out.is_some_and(|out| state.is(out)) {
            let message =
                "out: the increment starts from this state; give one that is not needed any more";
            return Err(InputError::new_err(message));
        }
        Ok(())
    }

    /// Carries points over an increment of length `dt` into the memory of its end, which is that of `out`.
    ///
    /// # Errors
    /// `LawError`; `ValueError` if memory is in use.
    pub(super) fn carry(
        &self,
        py: Python<'_>,
        [from, end]: [&State; 2],
        (gradient, dt): (&Rows<'_>, f64),
        (wanted, sites): (Operator, &[Site]),
        out: Option<&State>,
    ) -> PyResult<BatchSuccess> {
        let [start_gradient, start_flux, start_internal] = from.read(py)?;
        let busy = |_| InputError::new_err("out: its memory is in use");
        let own = (!end.is_lent).then(|| end.gradient.bind(py).try_readwrite());
        let mut own = own.transpose().map_err(busy)?;
        let mut end_flux = end.flux.bind(py).try_readwrite().map_err(busy)?;
        let mut end_internal = end.internal.bind(py).try_readwrite().map_err(busy)?;
        let operator: &Bound<'_, PyArray1<f64>> = end.operator.bind(py);
        let mut operator = operator.try_readwrite().map_err(busy)?;
        let rows = Strided::rows(end.n_components(py));
        let note = |memory| out.map_or((), |out| out.note(memory));
        note(Memory::Spoilt);
        let start = Start {
            n_points: from.n_points(py),
            gradient: (start_gradient.as_slice()?, rows),
            gradient_end: gradient.view()?,
            flux: (start_flux.as_slice()?, rows),
            state: start_internal.as_slice()?,
            time: from.time,
            time_increment: dt,
            moment: moment(end),
            sites,
        };
        let results = End {
            flux: (end_flux.as_slice_mut()?, rows),
            state: end_internal.as_slice_mut()?,
            operator: operator.as_slice_mut()?,
        };
        let reached = own.as_mut().map(|own| own.as_slice_mut()).transpose()?;
        let outcome = self.calling(py, |law| {
            let outcome = law.integrate(&start, wanted, results);
            // The caller may use its array for the next increment.
            if let (Ok(_), Some(reached)) = (&outcome, reached) {
                copied(start.gradient_end, reached, law.n_components());
            }
            outcome
        })?;
        let success = outcome.map_err(|failure| of_batch(py, self.law(), &failure))?;
        note(Memory::Given);
        Ok(success)
    }

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

/// All increments are of one step.
fn moment(end: &State) -> Moment {
    Moment {
        step: 1,
        increment: end.increment,
        step_start: 0.0,
        step_length: end.time,
        is_undrained: false,
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
