//! A law with its parameters, called for arrays of points.

mod batch;
pub(crate) mod found;

use crate::arrays::{Rows, looked_at};
use crate::error::{InputError, exception, of_batch};
use crate::state::State;
use crate::{task, value};
use abi::Hypothesis;
use batch::{has_room, repeated};
use input::material::law_alone;
use law::{BuiltLaw, Opener, Operator, Strided};
use numpy::PyArrayMethods;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use text::Source;

/// Opens libraries as the program does: what is not known is tried in another process first.
pub(crate) fn opener(isolate: Option<f64>) -> PyResult<Opener> {
    let isolate = isolate.map(Duration::try_from_secs_f64).transpose();
    let isolate = isolate
        .map_err(|_| InputError::new_err("isolate: expected the seconds that a call may take"))?;
    Ok(Opener::new(law::Trust {
        probe: true,
        isolate,
    }))
}

/// Says something that the user should know.
///
/// # Errors
/// The warning, if warnings are errors.
pub(crate) fn warn(py: Python<'_>, message: &str) -> PyResult<()> {
    let warn = py.import("pilum._errors")?.getattr("warn")?;
    warn.call1((message,)).map(|_| ())
}

/// A law with its parameters, for any number of points.
///
/// Parameters are given by name; omitted ones take their default. Other keys are those of a law in a case
/// file, such as `adapter`, `library`, `initial`; a parameter of such a name goes into `parameters`.
#[pyclass(frozen, module = "pilum")]
pub(crate) struct Law {
    built: Arc<BuiltLaw>,
    initial: Vec<(usize, f64)>,
    table: toml::Table,
    variables: Vec<String>,
    /// Its library is called in separate processes.
    is_apart: bool,
    /// It was made for a hypothesis that was named.
    is_chosen: bool,
    /// Folders searched first.
    folders: Vec<PathBuf>,
    /// Seconds that a call may take in a separate process.
    isolate: Option<f64>,
}

/// Keys of a table of laws that are no parameters.
const KEYS: [&str; 12] = [
    "adapter",
    "library",
    "sidecar",
    "in_process",
    "record",
    "externals",
    "scratch",
    "tangent_order",
    "thickness",
    "lateral_ratio",
    "sha256",
    "initial",
];

/// The table that a case file would have for a law. Arguments that are no keys of that table are parameters.
fn table_of(
    py: Python<'_>,
    id: &str,
    parameters: Option<&Bound<'_, PyAny>>,
    values: Option<&Bound<'_, PyDict>>,
) -> PyResult<toml::Table> {
    let mut table = toml::Table::new();
    table.insert("law".to_owned(), id.into());
    let named = parameters.map(value::table).transpose()?;
    let mut named = named.unwrap_or_default();
    let values = values.map(|values| value::table(values.as_any()));
    for (key, value) in values.transpose()?.into_iter().flatten() {
        if KEYS.contains(&key.as_str()) {
            table.insert(key, value);
        } else if named.contains_key(&key) {
            let message =
                format!("parameter `{key}` is given twice: by its name, and in `parameters`");
            return Err(exception(py, &input::Error::usage(message), None));
        } else {
            named.insert(key, value);
        }
    }
    table.insert("parameters".to_owned(), named.into());
    Ok(table)
}

fn hypothesis_named(name: &str) -> PyResult<Hypothesis> {
    law::hypothesis_named(name).ok_or_else(|| {
        let names = Hypothesis::ALL.map(Hypothesis::name);
        let hint = text::suggestion(name, names.to_vec());
        InputError::new_err(format!("there is no hypothesis `{name}`: {hint}"))
    })
}

fn operator_named(name: Option<&str>) -> PyResult<Operator> {
    match name {
        None => Ok(Operator::None),
        Some("consistent") => Ok(Operator::Consistent),
        Some("elastic") => Ok(Operator::Elastic),
        Some(other) => Err(InputError::new_err(format!(
            "tangent: `{other}` is none of \"consistent\", \"elastic\" and None"
        ))),
    }
}

impl Law {
    /// What a file would say of it.
    pub(crate) fn table(&self) -> &toml::Table {
        &self.table
    }

    /// The hypothesis that it was made for, if that was named.
    pub(crate) fn chosen_hypothesis(&self) -> Option<Hypothesis> {
        self.is_chosen.then(|| self.law().hypothesis())
    }

    fn law(&self) -> &law::Law {
        &self.built.law
    }

    /// Calls the library without the interpreter's lock. Worker processes live as long as the
    /// thread that has started them, which may end before the law.
    fn calling<T: Send>(
        &self,
        py: Python<'_>,
        call: impl FnOnce(&law::Law) -> T + Send,
    ) -> PyResult<T> {
        let threads = self.is_apart.then(task::threads).transpose()?;
        let law = self.law();
        Ok(py.detach(|| match threads {
            None => call(law),
            Some(threads) => threads.install(|| call(law)),
        }))
    }

    /// Internal variables of points that carry these fluxes before anything has happened, point by point.
    fn own_internal(&self, py: Python<'_>, flux: &[f64]) -> PyResult<Vec<f64>> {
        let law = self.law();
        let (n, rows) = (law.n_components(), Strided::rows(law.n_components()));
        let started = self.calling(py, |law| law.initial_state(flux.len() / n, (flux, rows)))?;
        let mut internal = started.map_err(|failure| of_batch(py, law, &failure))?;
        for values in internal.chunks_exact_mut(self.variables.len().max(1)) {
            for (number, value) in &self.initial {
                values[*number] = *value;
            }
        }
        Ok(internal)
    }
}

#[pymethods]
impl Law {
    #[new]
    #[pyo3(signature = (id, /, *, hypothesis=None, parameters=None, law_path=None, isolate=None, **values))]
    fn new(
        py: Python<'_>,
        id: &str,
        hypothesis: Option<&str>,
        parameters: Option<&Bound<'_, PyAny>>,
        law_path: Option<Vec<PathBuf>>,
        isolate: Option<f64>,
        values: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut table = table_of(py, id, parameters, values)?;
        let name = format!("Law(\"{id}\")");
        let source = Source::in_memory(&name, value::text_of(&table)?);
        let hypothesis = hypothesis.map(hypothesis_named).transpose()?;
        let is_chosen = hypothesis.is_some();
        let opener = opener(isolate)?;
        let folders = law_path.unwrap_or_default();
        let threads = task::threads()?;
        let built =
            py.detach(|| threads.install(|| law_alone(&opener, &source, hypothesis, &folders)));
        let (built, initial) = built.map_err(|error| of_parameters(py, &error, &name))?;
        for warning in &built.warnings {
            warn(py, warning)?;
        }
        let variables = built.law.formulation().internal_variables.iter();
        let variables = variables.map(|variable| variable.id.clone()).collect();
        let library = built.law.library();
        let is_apart = library.foreign().is_some() || isolate.is_some();
        // What stands in a case is this library and no other of its name.
        if !folders.is_empty() && !table.contains_key("adapter") {
            table.insert("sha256".to_owned(), library.sha256().into());
        }
        Ok(Self {
            built: Arc::new(built),
            initial,
            table,
            variables,
            is_apart,
            is_chosen,
            folders,
            isolate,
        })
    }

    /// Folders searched first.
    #[getter]
    fn law_path(&self) -> Vec<PathBuf> {
        self.folders.clone()
    }

    /// Seconds that a call may take in a separate process; None in this process.
    #[getter]
    fn isolate(&self) -> Option<f64> {
        self.isolate
    }

    /// Points that carry these fluxes.
    ///
    /// `points` is their number. `flux` has tractions or stresses (kPa; default 0), shape (n, components)
    /// or (components,) for all; `gradient` likewise jumps or strains. `internal`, shape (n, variables),
    /// replaces the law's initial values. `time` and `increment` are those of a saved state.
    #[pyo3(signature = (points=None, *, flux=None, gradient=None, internal=None, time=0.0, increment=0))]
    #[expect(clippy::too_many_arguments, reason = "named in Python")]
    fn initial(
        &self,
        py: Python<'_>,
        points: Option<usize>,
        flux: Option<&Bound<'_, PyAny>>,
        gradient: Option<&Bound<'_, PyAny>>,
        internal: Option<&Bound<'_, PyAny>>,
        time: f64,
        increment: u32,
    ) -> PyResult<State> {
        let n = self.law().n_components();
        if !(time >= 0.0 && time.is_finite()) {
            return Err(InputError::new_err(format!("time: {time} is no time")));
        }
        let n_variables = self.variables.len();
        let rows = |of: Option<_>, name, n| of.map(|of| Rows::of(of, name, n)).transpose();
        let internal = rows(internal, "internal", n_variables)?;
        let flux = rows(flux, "flux", n)?;
        let gradient = rows(gradient, "gradient", n)?;
        let given = [&flux, &gradient, &internal].into_iter().flatten();
        let n_points = points.or(given.map(Rows::n_rows).max()).unwrap_or(1);
        has_room(n_points, 2 * n + n_variables)?;
        let full = |rows: Option<Rows<'_>>, name, n| match rows {
            None => Ok(vec![0.0; n_points * n]),
            Some(rows) => repeated(&rows, name, [n_points, n]),
        };
        let flux = full(flux, "flux", n)?;
        let gradient = full(gradient, "gradient", n)?;
        // A state that was kept may be none to start from: a joint that is open, say.
        let internal = match internal {
            None => self.own_internal(py, &flux)?,
            some => full(some, "internal", n_variables)?,
        };
        let mut state = State::zeros(py, n_points, n, 0, &self.variables);
        for (array, values) in [
            (&state.gradient, gradient),
            (&state.flux, flux),
            (&state.internal, internal),
        ] {
            let mut array = array.bind(py).readwrite();
            array.as_slice_mut()?.copy_from_slice(&values);
        }
        state.time = time;
        state.increment = increment;
        Ok(state)
    }

    /// Carries points over an increment: `(flux, tangents, state)`.
    ///
    /// `gradient` has the jumps (m) or strains at its end, as totals, shape (n, components); `state` is the
    /// start (default: points without a history), `dt` the duration. Returns tractions or stresses (kPa),
    /// shape (n, components); tangents ∂flux/∂gradient, shape (n, components, components), None if
    /// `tangent` is None; and the state at the end.
    ///
    /// The law works on the arrays without the interpreter's lock. The call reuses the memory of `out`, a
    /// state not needed any more, and of the results returned with it. With `copy=False` the state keeps
    /// the array of gradients, which nobody may change then. `positions`, shape (n, 2), is for routines
    /// that need coordinates.
    ///
    /// Raises LawError with `point` (from 0) and `outcome`; "cut_step": a smaller increment may help.
    #[pyo3(
        signature = (gradient, state=None, *, dt=1.0, tangent=Some("consistent"), out=None, copy=true, positions=None),
        text_signature = "($self, gradient, state=None, *, dt=1.0, tangent='consistent', out=None, copy=True, positions=None)"
    )]
    #[expect(clippy::too_many_arguments, reason = "named in Python")]
    fn integrate<'py>(
        &self,
        py: Python<'py>,
        gradient: &Bound<'py, PyAny>,
        state: Option<&Bound<'py, State>>,
        dt: f64,
        tangent: Option<&str>,
        out: Option<&Bound<'py, State>>,
        copy: bool,
        positions: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let n = self.law().n_components();
        if !(dt >= 0.0 && dt.is_finite()) {
            return Err(InputError::new_err(format!("dt: {dt} is no time")));
        }
        let wanted = operator_named(tangent)?;
        let n_operator = if wanted == Operator::None { 0 } else { n * n };
        let fresh;
        let from = if let Some(state) = state {
            state.get()
        } else {
            let points = Rows::of(gradient, "gradient", n)?.n_rows();
            fresh = self.initial(py, Some(points), None, None, None, 0.0, 0)?;
            &fresh
        };
        let n_points = from.n_points(py);
        let gradient = Rows::exactly(gradient, "gradient", [n_points, n])?;
        self.refuse_misfit(py, state, out)?;
        let mut end = self.memory_for(py, from, (&gradient, copy), out, n_operator)?;
        end.time = from.time + dt;
        end.increment = from.increment + 1;
        let sites = self.sites(n_points, positions)?;
        let out = out.map(Bound::get);
        let success = self.carry(py, [from, &end], (&gradient, dt), (wanted, &sites), out)?;
        if let Some((point, why)) = success.unreliable {
            let place = format!("law `{}`, point {point} (from 0)", self.id());
            warn(py, &format!("{place}: inaccurate: {why}"))?;
        }
        let tangents = if n_operator == 0 {
            py.None().into_bound(py)
        } else {
            let all = end.operator.bind(py).as_any();
            looked_at(&all.call_method1("reshape", ((n_points, n, n),))?)?
        };
        let flux = looked_at(end.flux.bind(py).as_any())?;
        let end = Bound::new(py, end)?.into_any();
        PyTuple::new(py, [flux, tangents, end])
    }

    /// Id of the law.
    #[getter]
    fn id(&self) -> &str {
        &self.law().description().id
    }

    /// Name of its hypothesis.
    #[getter]
    fn hypothesis(&self) -> &'static str {
        self.law().hypothesis().name()
    }

    /// Components, in the order of the arrays' columns.
    #[getter]
    fn components(&self) -> Vec<&'static str> {
        self.law().hypothesis().components().to_vec()
    }

    /// Ids of the internal variables, in the order of `State.internal`.
    #[getter]
    fn variables(&self) -> Vec<String> {
        self.variables.clone()
    }

    /// Values of all parameters, defaults included: numbers, of choices their names.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        let declared = &self.law().description().parameters;
        let with_value = self.built.parameters.iter().zip(declared);
        for (parameter, declared) in with_value.filter(|(p, _)| !p.value.is_nan()) {
            match declared.choices.get(parameter.value as usize) {
                Some(choice) => all.set_item(&parameter.id, choice)?,
                None => all.set_item(&parameter.id, parameter.value)?,
            }
        }
        Ok(all)
    }

    /// Its library.
    #[getter]
    fn library(&self) -> PathBuf {
        self.law().library().path().to_owned()
    }

    /// SHA-256 of its library, hexadecimal.
    #[getter]
    fn sha256(&self) -> &str {
        self.law().library().sha256()
    }

    /// Data for making it again: another process searches its library as this one did.
    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let named = value::to_python(py, &toml::Value::Table(self.table.clone()))?;
        let named = named.cast_into::<PyDict>()?;
        named.del_item("law")?;
        // It says which library is meant, and is no key that is given.
        if !self.folders.is_empty() && !self.table.contains_key("adapter") {
            named.del_item("sha256")?;
        }
        if let Some(hypothesis) = self.chosen_hypothesis() {
            named.set_item("hypothesis", hypothesis.name())?;
        }
        if !self.folders.is_empty() {
            named.set_item("law_path", &self.folders)?;
        }
        if let Some(isolate) = self.isolate {
            named.set_item("isolate", isolate)?;
        }
        ((self.id(),), named).into_pyobject(py)
    }

    fn __copy__(this: Bound<'_, Self>) -> Bound<'_, Self> {
        this
    }

    fn __deepcopy__<'py>(this: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        this
    }

    fn __repr__(&self) -> String {
        let given = self.built.parameters.iter().filter(|p| !p.by_default);
        let given: Vec<String> = given.map(|p| format!(", {}={}", p.id, p.value)).collect();
        format!(
            "pilum.Law(\"{}\", hypothesis=\"{}\"{})",
            self.id(),
            self.hypothesis(),
            given.join("")
        )
    }
}

/// The exception for what is wrong with a law's values: a parameter has its name for a key.
fn of_parameters(py: Python<'_>, error: &input::Error, name: &str) -> PyErr {
    let raised = exception(py, error, Some(name));
    let key = error.place().and_then(text::InputError::key);
    let own = key
        .as_deref()
        .and_then(|key| key.strip_prefix("parameters."));
    if let Some(own) = own
        && let Err(wrong) = raised.value(py).setattr("key", own)
    {
        return wrong;
    }
    raised
}
