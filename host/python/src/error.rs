//! Errors of the rooms as exceptions of Python, with what they are about as attributes.

use abi::status::Outcome;
use input::{Error, Kind};
use law::BatchFailure;
use law::capsule::status;
use mechanics::group::PointFailure;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::error::Error as _;

pyo3::import_exception!(pilum._errors, BusyError);
pyo3::import_exception!(pilum._errors, InputError);
pyo3::import_exception!(pilum._errors, NoMemoryError);
pyo3::import_exception!(pilum._errors, NoSuchNameError);
pyo3::import_exception!(pilum._errors, WrongTypeError);

/// Name of an outcome.
fn outcome_name(outcome: Outcome) -> String {
    status(outcome).replace(' ', "_")
}

/// The exception for an error. `written` is the name of a text that no file has.
pub(crate) fn exception(py: Python<'_>, error: &Error, written: Option<&str>) -> PyErr {
    if error.is_stop() {
        return PyKeyboardInterrupt::new_err(error.to_string());
    }
    let class = match error.kind() {
        Kind::Input => "InputError",
        Kind::NoEquilibrium | Kind::Stopped => "NoEquilibriumError",
        Kind::Library => "LawError",
        Kind::Internal => "InternalError",
    };
    let attributes = PyDict::new(py);
    let filled = fill(&attributes, error, written);
    filled
        .and_then(|()| make(py, class, &message(error), &attributes))
        .unwrap_or_else(|wrong| wrong)
}

/// The exception for a batch that a law does not carry over an increment. The point is counted from 0, as in the
/// arrays.
pub(crate) fn of_batch(py: Python<'_>, law: &law::Law, failure: &BatchFailure) -> PyErr {
    let attributes = PyDict::new(py);
    let id = &law.description().id;
    let reason = match failure.message.as_str() {
        "" => "no reason given",
        reason => reason,
    };
    let name = outcome_name(failure.outcome);
    let fill = || -> PyResult<()> {
        attributes.set_item("law", id)?;
        attributes.set_item("point", failure.point)?;
        attributes.set_item("outcome", &name)?;
        attributes.set_item("cause", reason)?;
        attributes.set_item("factor", failure.factor)
    };
    let message = format!(
        "law `{id}`, point {} (from 0): {name}: {reason}",
        failure.point
    );
    fill()
        .and_then(|()| make(py, "LawError", &message, &attributes))
        .unwrap_or_else(|wrong| wrong)
}

fn make(
    py: Python<'_>,
    class: &str,
    message: &str,
    attributes: &Bound<'_, PyDict>,
) -> PyResult<PyErr> {
    let class = py.import("pilum._errors")?.getattr(class)?;
    let exception = class.call((message,), Some(attributes))?;
    Ok(PyErr::from_value(exception))
}

/// The error and what is behind it.
fn message(error: &Error) -> String {
    let mut message = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let inner_message = inner.to_string();
        // What is passed on as it is says the same.
        if !message.ends_with(&inner_message) {
            message = format!("{message}: {inner_message}");
        }
        cause = inner.source();
    }
    message
}

fn fill(to: &Bound<'_, PyDict>, error: &Error, written: Option<&str>) -> PyResult<()> {
    if let Some(hint) = error.help() {
        to.set_item("hint", hint)?;
    }
    place_in_file(to, error, written)?;
    match error {
        Error::Simulation { error, .. } => of_simulation(to, error),
        Error::Point(error) => of_driver(to, error),
        Error::Text(text::Error::OutOfBounds { name, .. }) => to.set_item("key", name),
        _ => Ok(()),
    }
}

/// File, line and column, of what is in no file the key; and the line itself.
fn place_in_file(to: &Bound<'_, PyDict>, error: &Error, written: Option<&str>) -> PyResult<()> {
    let Some(place) = error.place() else {
        return Ok(());
    };
    let text::Line {
        file,
        at: (line, column),
        text,
        label,
    } = place.line();
    to.set_item("text", text.trim())?;
    if let Some(label) = label {
        to.set_item("cause", label)?;
    }
    // Lines of a text that was made of a dictionary, or of settings, tell its user nothing.
    if place.setting().is_some() || Some(file) == written {
        to.set_item("key", place.key())?;
    } else {
        to.set_item("file", file)?;
        to.set_item("line", line)?;
        to.set_item("column", column)?;
    }
    Ok(())
}

fn of_simulation(to: &Bound<'_, PyDict>, error: &mechanics::Error) -> PyResult<()> {
    use mechanics::Error as E;
    let place = match error {
        E::NoEquilibrium(none) => {
            to.set_item("reached", none.reached)?;
            to.set_item("cause", none.failure.reason.to_string())?;
            Some(&none.place)
        }
        E::Law { place, .. } | E::Process { place, .. } => Some(place),
        E::Singular { phase } => {
            to.set_item("phase", phase)?;
            to.set_item("place", format!("phase `{phase}`"))?;
            None
        }
        _ => None,
    };
    if let Some(place) = place {
        to.set_item("place", place.to_string())?;
        to.set_item("phase", &place.phase)?;
        to.set_item("increment", place.increment)?;
    }
    error
        .failed_point()
        .map_or(Ok(()), |failure| of_point(to, failure))
}

fn of_point(to: &Bound<'_, PyDict>, failure: &PointFailure) -> PyResult<()> {
    to.set_item("law", &failure.law_id)?;
    to.set_item("group", &failure.group)?;
    to.set_item("element", failure.element)?;
    to.set_item("point", failure.point)?;
    to.set_item("position", failure.position)?;
    to.set_item("outcome", outcome_name(failure.failure.outcome))?;
    to.set_item("cause", &failure.failure.message)
}

fn of_driver(to: &Bound<'_, PyDict>, error: &point::Error) -> PyResult<()> {
    match error {
        point::Error::Misuse { segment, .. } => to.set_item("segment", *segment),
        point::Error::InitialState { law, reason } => {
            to.set_item("law", law)?;
            to.set_item("cause", reason)
        }
        point::Error::Failure(failure) => {
            to.set_item("place", failure.place.to_string())?;
            if let point::Place::Increment {
                segment, increment, ..
            } = failure.place
            {
                to.set_item("segment", segment)?;
                to.set_item("increment", increment)?;
            }
            to.set_item("law", &failure.law)?;
            if let Some((_, _)) = error.failed_call() {
                to.set_item("point", 1)?;
            }
            let refusal = match &failure.cause {
                point::Cause::NoEquilibrium(none) => {
                    to.set_item("reached", none.reached)?;
                    none.refusal.as_deref()
                }
                point::Cause::InitialState(batch)
                | point::Cause::Law(batch)
                | point::Cause::LawInSmallSteps(batch) => Some(batch),
                point::Cause::Stopped => None,
            };
            if let Some(refusal) = refusal {
                to.set_item("outcome", outcome_name(refusal.outcome))?;
                to.set_item("cause", &refusal.message)?;
            }
            Ok(())
        }
    }
}
