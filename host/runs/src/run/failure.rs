//! The error of a run, and the call of a law behind it.

use crate::Error;
use input::{Case, Kind, probes};
use law::Library;
use law::capsule::{self, Capsule};
use mechanics::group::PointFailure;
use mechanics::settings::Method;
use mechanics::{Place, Simulation};
use results::{Fault, Recorder};
use std::path::Path;

/// The error of a run with its place in the file, and what the user can do about it.
pub(super) fn explained(
    case: &Case,
    simulation: &Simulation,
    error: mechanics::Error,
    fault: Option<Fault>,
    results: &Recorder,
) -> Error {
    let kept = keep_capsule(case, simulation, &error, results);
    let suspicion = || suspicion(simulation, &error);
    let hint = match &kept {
        Ok(kept) => kept.clone().or_else(suspicion),
        Err(_) => None,
    };
    match (error, fault, kept) {
        (mechanics::Error::Halted, Some(Fault::Overflow { probe, place }), _) => {
            probes::overflow(case, &probe, &place)
        }
        (mechanics::Error::Halted, Some(Fault::File(error)), _) | (_, _, Err(error)) => {
            error.into()
        }
        (error, _, Ok(_)) => {
            let error = case.place(error);
            match hint {
                Some(hint) if error.kind() != Kind::Input => error.with_hint(&hint),
                _ => error,
            }
        }
    }
}

/// Writes the call of a law that failed for good. Returns what the user can do with it.
fn keep_capsule(
    case: &Case,
    simulation: &Simulation,
    error: &mechanics::Error,
    results: &Recorder,
) -> Result<Option<String>, text::Error> {
    let (place, point): (&Place, &PointFailure) = match error {
        mechanics::Error::Law { place, failure, .. } => (place, failure),
        mechanics::Error::NoEquilibrium(none) => match none.failure.failed() {
            Some(point) => (&none.place, point),
            None => return Ok(None),
        },
        _ => return Ok(None),
    };
    let mut groups = simulation.groups().iter();
    let group = groups.find(|group| group.name == point.group);
    let number = |n: usize| toml::Value::from(n as i64);
    let mut origin = vec![("case", case.source.path().display().to_string().into())];
    origin.extend(case.variant.iter().map(|v| ("variant", v.as_str().into())));
    origin.extend([
        ("phase", place.phase.as_str().into()),
        ("increment", number(place.increment)),
        ("group", point.group.as_str().into()),
        ("element", number(point.element)),
        ("point", number(point.point)),
        ("position", point.position.to_vec().into()),
    ]);
    let capsule = group.and_then(|group| Capsule::of(&group.law.built.law, &point.failure, origin));
    let Some(capsule) = capsule else {
        return Ok(None);
    };
    let file = results.folder().join(capsule::FILE_NAME);
    capsule.write(&file).map_err(|error| match error {
        law::Error::Text(error) => error,
        other => text::Error::Internal(other.to_string()),
    })?;
    Ok(Some(format!(
        "`pilum replay {}` repeats the call that failed",
        file.display()
    )))
}

/// Hint if a user's law may have prevented convergence: a wrong tangent does that.
fn suspicion(simulation: &Simulation, error: &mechanics::Error) -> Option<String> {
    let mechanics::Error::NoEquilibrium(none) = error else {
        return None;
    };
    let asks_for_tangents = simulation.method() != Method::InitialStress;
    let iterates = none.failure.failed().is_none() && !none.failure.iterations.is_empty();
    let mut libraries: Vec<&Path> = simulation
        .groups()
        .iter()
        .filter(|group| !group.is_linear())
        .map(|group| group.law.built.law.library())
        .filter(|library| library.foreign().is_none() && !library.is_beside_program())
        .map(Library::path)
        .collect();
    libraries.sort_unstable();
    libraries.dedup();
    let checks = libraries
        .iter()
        .map(|library| format!("`pilum check {}`", library.display()));
    let checks: Vec<String> = checks.collect();
    (asks_for_tangents && iterates && !checks.is_empty()).then(|| {
        format!(
            "{} tells whether a wrong tangent is a cause",
            checks.join(", ")
        )
    })
}
