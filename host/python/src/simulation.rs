//! Simulations that are led from Python, increment by increment.

use crate::arrays::of_rows;
use crate::error::{BusyError, NoSuchNameError, WrongTypeError, exception};
use crate::law::warn;
use crate::posed::Posed;
use crate::task::{Caller, carry_out};
use input::{Case, Error};
use law::Stop;
use mechanics::check::Compatibility;
use mechanics::group::Group;
use mechanics::simulation::{Increment, Snapshot, Warning};
use mechanics::{State, Watch};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use results::HistoryValues;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};

/// A problem on its way through its phases, in memory.
///
/// `source` is a case file, a folder with `case.toml`, or a dictionary; `variant` names one of several.
/// `pilum.Problem.start` makes one, too.
#[pyclass(frozen, module = "pilum")]
pub(crate) struct Simulation {
    inner: Mutex<Inner>,
}

struct Inner {
    simulation: mechanics::Simulation,
    /// For the first nodes, the place in the mesh that the case names; `None` of a grid.
    kept: Option<Arc<[usize]>>,
    /// What states of it depend on, once one was taken.
    likeness: Option<Arc<Compatibility>>,
    /// The last increment of the last phase is done. The simulation is not led beyond it: a state could not be taken
    /// of it any more.
    is_done: bool,
    /// What the case measures, if that may end a phase, or depends on the states before.
    values: Option<HistoryValues>,
    case: Case,
    written: Option<String>,
}

/// A state for `Simulation.go_to`: after a whole increment, or the last one in equilibrium of an unfinished
/// one.
#[pyclass(frozen, module = "pilum")]
pub(crate) struct SimulationState {
    state: State<'static>,
    likeness: Arc<Compatibility>,
    values: Option<HistoryValues>,
    /// Number of the phase, from 0.
    #[pyo3(get)]
    phase: usize,
    /// Whole increments done.
    #[pyo3(get)]
    increment: usize,
    /// Increments of the phase with the part of an unfinished one.
    #[pyo3(get)]
    reached: f64,
}

#[pymethods]
impl SimulationState {
    #[expect(clippy::unused_self, reason = "of an object, in Python")]
    fn __reduce__(&self) -> PyResult<()> {
        Err(WrongTypeError::new_err(
            "a state of a simulation cannot be pickled; `pilum.run` keeps checkpoints, and `resume=True` goes on from them",
        ))
    }

    fn __repr__(&self) -> String {
        let Self {
            phase,
            increment,
            reached,
            ..
        } = self;
        let part = reached - *increment as f64;
        let part = if part > 0.0 {
            format!(" and {part:.4} of the next, which could not be finished")
        } else {
            String::new()
        };
        format!("<pilum.SimulationState: phase {phase} (from 0), increment {increment}{part}>")
    }
}

/// Hands on requests to stop and warnings, and measures what may end a phase.
struct Follower<'c> {
    caller: &'c Caller<String>,
    values: Option<&'c mut HistoryValues>,
}

impl Watch for Follower<'_> {
    fn warning(&mut self, warning: &Warning) {
        self.caller.tell(warning.to_string());
    }

    fn increment(&mut self, done: &Increment, state: &Snapshot<'_>) -> ControlFlow<()> {
        if let Some(values) = &mut self.values {
            values.increment(&done.place.phase, state);
        }
        ControlFlow::Continue(())
    }

    fn quantity(&mut self, phase: &str, name: &str, state: &Snapshot<'_>) -> Option<f64> {
        self.values.as_mut()?.quantity(phase, name, state)
    }

    fn stop(&self) -> Stop {
        self.caller.stop()
    }
}

impl Simulation {
    fn inner(&self) -> PyResult<MutexGuard<'_, Inner>> {
        match self.inner.try_lock() {
            Ok(inner) => Ok(inner),
            Err(TryLockError::Poisoned(inner)) => Ok(inner.into_inner()),
            Err(TryLockError::WouldBlock) => {
                let message = "the simulation is at work in another thread";
                Err(BusyError::new_err(message))
            }
        }
    }

    /// Goes on by one increment, unless all is done.
    fn advance(&self, py: Python<'_>) -> PyResult<Option<Increment>> {
        if self.inner()?.is_done {
            return Ok(None);
        }
        let done = self.working(py, mechanics::Simulation::step_watched)?;
        let mut inner = self.inner()?;
        inner.is_done = done.as_ref().is_none_or(|done| {
            let last = inner.simulation.problem().phases.last();
            done.place.increment == done.of
                && last.is_some_and(|last| last.name == done.place.phase)
        });
        Ok(done)
    }

    /// Does something that may take long.
    fn working<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut mechanics::Simulation, &mut dyn Watch) -> Result<T, mechanics::Error>
        + Send,
    ) -> PyResult<T> {
        let mut inner = self.inner()?;
        let Inner {
            simulation,
            values,
            case,
            written,
            ..
        } = &mut *inner;
        let values = values.as_mut();
        let outcome = carry_out(
            py,
            |caller| work(simulation, &mut Follower { caller, values }),
            |py, warning: String| warn(py, &warning),
        )?;
        outcome.map_err(|error| exception(py, &case.place(error), written.as_deref()))
    }
}

impl Inner {
    fn likeness(&mut self) -> Arc<Compatibility> {
        let problem = self.simulation.problem();
        let likeness = self
            .likeness
            .get_or_insert_with(|| Arc::new(problem.likeness()));
        Arc::clone(likeness)
    }

    fn group(&self, name: &str) -> PyResult<&Group> {
        let mut groups = self.simulation.groups().iter();
        groups.find(|group| group.name == name).ok_or_else(|| {
            let groups = self.simulation.groups().iter();
            let known: Vec<&str> = groups.map(|group| group.name.as_str()).collect();
            let hint = text::suggestion(name, known);
            NoSuchNameError::new_err(format!("there is no group `{name}`: {hint}"))
        })
    }

    fn no_line(&self, name: &str) -> PyErr {
        let lines = self.simulation.problem().mesh.lines.keys();
        let hint = text::suggestion(name, lines.map(String::as_str).collect::<Vec<_>>());
        NoSuchNameError::new_err(format!("there is no line `{name}`: {hint}"))
    }
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(
        signature = (source, *, name="problem".to_owned(), mesh=None, set=None, variant=None, isolate=None),
        text_signature = "(source, *, name='problem', mesh=None, set=None, variant=None, isolate=None)"
    )]
    fn new(
        py: Python<'_>,
        source: &Bound<'_, PyAny>,
        name: String,
        mesh: Option<Vec<u8>>,
        set: Option<&Bound<'_, PyDict>>,
        variant: Option<String>,
        isolate: Option<f64>,
    ) -> PyResult<Self> {
        let posed = Posed::of(source, name, mesh, set, variant, isolate)?;
        let made = carry_out(
            py,
            |caller: &Caller<String>| -> Result<_, Error> {
                let mut cases = posed.cases()?;
                let (Some(case), true) = (cases.pop(), cases.is_empty()) else {
                    let message = "the case has several variants: name one with `variant`";
                    return Err(Error::usage(message));
                };
                let ready = case.pose()?;
                posed.check_laws(&ready.laws)?;
                let simulation = mechanics::Simulation::new(ready.problem);
                let simulation = simulation.map_err(|error| case.place(error))?;
                let of_laws = ready.laws.values().flat_map(|law| law.warnings.iter());
                let all = of_laws.chain(simulation.warnings()).chain(&ready.notes);
                all.for_each(|warning| caller.tell(warning.clone()));
                let kept = ready.mesh_file.map(|file| file.kept.into());
                let phases = &simulation.problem().phases;
                let measures = phases.iter().any(|phase| phase.until.is_some());
                let wanted = (measures || case.file.pile.is_some())
                    .then(|| case.wanted(&simulation))
                    .transpose()?;
                let values = wanted.map(|wanted| HistoryValues::new(wanted, &simulation));
                Ok((simulation, values, kept, case))
            },
            |py, warning| warn(py, &warning),
        )?;
        let written = posed.written().map(str::to_owned);
        let (simulation, values, kept, case) =
            made.map_err(|error| exception(py, &error, written.as_deref()))?;
        Ok(Self {
            inner: Mutex::new(Inner {
                simulation,
                kept,
                likeness: None,
                is_done: false,
                values,
                case,
                written,
            }),
        })
    }

    /// Goes on by one increment.
    ///
    /// Returns a `Step`; None after the last. After an exception the state is the last one in equilibrium,
    /// perhaps within the increment (`state().reached`). `go_to` leads back to one taken before.
    fn step<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let done = self.advance(py)?;
        done.map(|increment| told(py, &increment)).transpose()
    }

    /// Goes on to the end of the last phase.
    fn run(&self, py: Python<'_>) -> PyResult<()> {
        // Many increments take less time than signals are looked for within one.
        while self.advance(py)?.is_some() {
            py.check_signals()?;
        }
        Ok(())
    }

    /// The time that is reached.
    #[getter]
    fn time(&self) -> PyResult<f64> {
        Ok(self.inner()?.simulation.time())
    }

    /// Names of the groups.
    #[getter]
    fn groups(&self) -> PyResult<Vec<String>> {
        let inner = self.inner()?;
        let groups = inner.simulation.groups().iter();
        Ok(groups.map(|group| group.name.clone()).collect())
    }

    /// Names of the lines.
    #[getter]
    fn lines(&self) -> PyResult<Vec<String>> {
        let inner = self.inner()?;
        Ok(inner
            .simulation
            .problem()
            .mesh
            .lines
            .keys()
            .cloned()
            .collect())
    }

    /// Coordinates of the nodes, m, shape (n, 2).
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.inner()?;
        let nodes = inner.simulation.problem().mesh.nodes.as_flattened();
        Ok(of_rows(py, nodes, 2)?.into_any())
    }

    /// For every row of `nodes` its row in the mesh or its place in the file, from 0; -1 for nodes made by
    /// interfaces and divisions. Results have no nodes without an element.
    #[getter]
    fn mesh_rows<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<i64>>> {
        let inner = self.inner()?;
        let n = inner.simulation.problem().mesh.nodes.len();
        let row = |number: usize| match &inner.kept {
            None => number as i64,
            Some(kept) => kept.get(number).map_or(-1, |row| *row as i64),
        };
        Ok(PyArray1::from_iter(py, (0..n).map(row)))
    }

    /// Displacements of the nodes, m, shape (n, 2), counted since the last reset.
    #[getter]
    fn displacements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.inner()?;
        Ok(of_rows(py, inner.simulation.snapshot().displacement, 2)?.into_any())
    }

    /// Internal less external forces at the nodes, shape (n, 2): kN of the whole turn, or kN/m.
    #[getter]
    fn reactions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.inner()?;
        Ok(of_rows(py, inner.simulation.snapshot().reaction, 2)?.into_any())
    }

    /// Sum of the reactions at the nodes of a line, x and y: kN of the whole turn, or kN/m.
    fn reaction(&self, line: &str) -> PyResult<[f64; 2]> {
        let inner = self.inner()?;
        let found = inner.simulation.reaction_of(line);
        found.ok_or_else(|| inner.no_line(line))
    }

    /// Mean displacement of the nodes of a line, x and y, m.
    fn displacement(&self, line: &str) -> PyResult<[f64; 2]> {
        let inner = self.inner()?;
        let found = inner.simulation.displacement_of(line);
        found.ok_or_else(|| inner.no_line(line))
    }

    /// Integration points of a group: a dictionary of arrays with a row a point.
    ///
    /// `element` and `point` count from 1; `position` (n, 2), m. Solids and layers have `stress` (11 22 33
    /// 12, kPa, global axes) and `strain`; interfaces and layers `jump` (normal, tangential, m) and
    /// `traction` (kPa); all have the internal variables of their law, by id.
    fn group<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
        let inner = self.inner()?;
        let group = inner.group(name)?;
        let points = 0..group.kinematics.n_points();
        let all = PyDict::new(py);
        let places = points.clone().map(|point| group.kinematics.place_of(point));
        let (elements, numbers): (Vec<i64>, Vec<i64>) = places
            .map(|(element, point)| (element as i64 + 1, point as i64 + 1))
            .unzip();
        all.set_item("element", PyArray1::from_vec(py, elements))?;
        all.set_item("point", PyArray1::from_vec(py, numbers))?;
        let position = points.clone().flat_map(|p| group.kinematics.position(p));
        let position: Vec<f64> = position.collect();
        all.set_item("position", of_rows(py, &position, 2)?)?;
        let rows = |of: &dyn Fn(usize) -> Option<Vec<f64>>| -> Option<Vec<f64>> {
            let rows: Option<Vec<Vec<f64>>> = points.clone().map(of).collect();
            rows.map(|rows| rows.concat())
        };
        let jump = |p| group.jump_and_traction(p).map(|(jump, _)| jump.to_vec());
        let traction = |p| {
            group
                .jump_and_traction(p)
                .map(|(_, traction)| traction.to_vec())
        };
        for (name, n, values) in [
            (
                "stress",
                4,
                rows(&|p| Some(group.global_stress(p)?.to_vec())),
            ),
            (
                "strain",
                4,
                rows(&|p| Some(group.global_strain(p)?.to_vec())),
            ),
            ("jump", 2, rows(&jump)),
            ("traction", 2, rows(&traction)),
        ] {
            if let Some(values) = values {
                all.set_item(name, of_rows(py, &values, n)?)?;
            }
        }
        for variable in &group.law.built.law.formulation().internal_variables {
            let values = rows(&|p| group.internal_variable(p, &variable.id).map(|v| vec![v]));
            if let Some(values) = values {
                all.set_item(&variable.id, PyArray1::from_vec(py, values))?;
            }
        }
        Ok(all)
    }

    /// The present state, to go back to; None before the end of the first increment. After an exception it
    /// is the last one in equilibrium.
    fn state(&self) -> PyResult<Option<SimulationState>> {
        let mut inner = self.inner()?;
        let Some(state) = inner.simulation.state() else {
            return Ok(None);
        };
        let n = inner.simulation.problem().phases[state.phase].increments;
        let increment = state.increment();
        // Round-off is no part of an increment.
        let reached = state.part_of_phase() * n as f64;
        let is_whole = (reached - increment as f64).abs() < 1e-9 * n as f64;
        Ok(Some(SimulationState {
            phase: state.phase,
            increment,
            reached: if is_whole { increment as f64 } else { reached },
            likeness: inner.likeness(),
            values: inner.values.clone(),
            state,
        }))
    }

    /// Goes to a state of a simulation of the same problem. Later phases and solver settings may differ;
    /// another mesh, other parameters or other phases up to the state raise InputError.
    fn go_to(&self, py: Python<'_>, state: &SimulationState) -> PyResult<()> {
        let own = self.inner()?.likeness();
        if let Some(unlike) = own.unlike(&state.likeness, state.phase) {
            let message = format!("the state is one of a simulation with {unlike}");
            return Err(exception(py, &Error::usage(message), None));
        }
        let to = state.state.clone();
        self.working(py, |simulation, _| simulation.go_to(to))?;
        let mut inner = self.inner()?;
        if let (Some(values), Some(there)) = (&mut inner.values, &state.values) {
            values.go_to(there);
        }
        let phases = &inner.simulation.problem().phases;
        let (number, phase) = (state.phase + 1, &phases[state.phase]);
        inner.is_done = number == phases.len() && state.increment == phase.increments;
        Ok(())
    }

    /// A separate simulation in the same state.
    fn copy(&self, py: Python<'_>) -> PyResult<Self> {
        let mut inner = self.inner()?;
        let Inner {
            simulation,
            is_done,
            values,
            case,
            written,
            likeness,
            kept,
        } = &mut *inner;
        let copied = carry_out(
            py,
            |_: &Caller<()>| {
                let state = simulation.state();
                if state.is_none() && simulation.is_on_its_way() {
                    return Err(mechanics::Error::OtherState(
                        "the first increment of the phase was not finished: there is no state that a copy could go on from"
                            .to_owned(),
                    ));
                }
                let mut copy = mechanics::Simulation::new(simulation.problem().clone())?;
                if let Some(state) = state {
                    copy.go_to(state)?;
                }
                Ok(copy)
            },
            |_, ()| Ok(()),
        )?;
        let copy = copied.map_err(|error| exception(py, &case.place(error), written.as_deref()))?;
        Ok(Self {
            inner: Mutex::new(Inner {
                simulation: copy,
                kept: kept.clone(),
                likeness: likeness.clone(),
                is_done: *is_done,
                values: values.clone(),
                case: case.clone(),
                written: written.clone(),
            }),
        })
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        self.copy(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.copy(py)
    }

    #[expect(clippy::unused_self, reason = "of an object, in Python")]
    fn __reduce__(&self) -> PyResult<()> {
        Err(WrongTypeError::new_err(
            "a simulation cannot be pickled: its laws are at work in this process; pickle its Problem, and start it there",
        ))
    }

    fn __iter__(this: Bound<'_, Self>) -> Bound<'_, Self> {
        this
    }

    /// The next increment, as `step` does it.
    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.step(py)
    }

    fn __repr__(&self) -> PyResult<String> {
        let inner = self.inner()?;
        let problem = inner.simulation.problem();
        Ok(format!(
            "<pilum.Simulation: {} nodes, {} groups, {} phases, time {:?}>",
            problem.mesh.nodes.len(),
            problem.groups.len(),
            problem.phases.len(),
            inner.simulation.time()
        ))
    }
}

fn told<'py>(py: Python<'py>, done: &Increment) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    all.set_item("phase", &done.place.phase)?;
    all.set_item("increment", done.place.increment)?;
    all.set_item("of", done.of)?;
    all.set_item("time", done.time)?;
    all.set_item("iterations", done.iterations)?;
    all.set_item("unreliable", &done.unreliable)?;
    Ok(all)
}
