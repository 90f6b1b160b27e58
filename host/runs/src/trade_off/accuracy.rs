//! Settings that reach an accuracy: `accuracy = 0.01` in a case file.
//!
//! Increments are doubled from a quarter of the file's on until the estimated error of the finest run is
//! below the target. The coarsest run that is good enough is chosen, else the finest that came to its end.
//! With `accuracy_with_mesh` half of the target is for that, and the rest for the mesh, which is refined
//! until its error is below it. Every run is a row of `accuracy.csv` as soon as it is done, and kept, so
//! that a study that is stopped goes on from there.

mod levels;
mod mesh;
pub(super) mod messages;
mod search;
mod table;

use super::scheme::Values;
use super::trials::Trials;
use crate::Error;
use crate::run::{Observer, Options, run_reusing};
use input::Case;
use input::accuracy_settings::{AccuracySettings, Verdict};
use input::material::ParameterValue;
use law::Stop;
use mechanics::equilibrium::Reuse;
use results::Figures;
use search::Search;
use std::path::Path;
use text::Spanned;

/// Share of the target for increments and tolerance where the mesh has the rest.
const WITHOUT_MESH: f64 = 0.5;
/// Its name in progress messages.
const STUDY: &str = "accuracy";

/// Runs a case; where it asks for an accuracy, with settings that reach it.
///
/// # Errors
/// As [`reach_until`] and [`run_reusing`].
pub fn run_accurately(
    case: &Case,
    folder: &Path,
    observer: &mut dyn Observer,
    reuse: &mut Reuse,
    options: Options,
) -> Result<Figures, Error> {
    let stop = observer.stop();
    let studied = reach_until(case, (folder, options.resume), &stop, &mut |doing| {
        observer.note(doing);
    })
    .map_err(of_trials)?;
    let case = studied.as_ref().unwrap_or(case);
    match case.file.chosen.as_ref().map(messages::outcome) {
        Some(Ok(reached)) => observer.note(&reached),
        Some(Err(short)) => observer.warning(&short),
        None => (),
    }
    run_reusing(case, folder, observer, reuse, options)
}

/// The error of a study none of whose trials came to its end: none of them is a run with results.
fn of_trials(error: Error) -> Error {
    match error {
        Error::Simulation { error, .. } if matches!(*error, mechanics::Error::NoEquilibrium(_)) => {
            Error::Simulation {
                error,
                hint: Some(format!(
                    "this was the last trial of `accuracy`, and none came to its end ({STUDY}.csv has them); without \
                     `accuracy` the run itself is written as far as it comes"
                )),
            }
        }
        other => other,
    }
}

/// The case with settings that reach the accuracy it asks for; `None` if it asks for none. `folder` is where the study
/// may write; with `resume` it goes on with what is kept there of an earlier one. `say` takes what is being done.
///
/// # Errors
/// Bad input before anything is written; no equilibrium with any increments; [`text::Error::Unwritable`];
/// [`law::Stopped`]; what is kept belongs to another case.
pub fn reach_until(
    case: &Case,
    (folder, resume): (&Path, bool),
    stop: &Stop,
    say: &mut dyn FnMut(&str),
) -> Result<Option<Case>, Error> {
    let Some(accuracy) = &case.file.accuracy else {
        return Ok(None);
    };
    check(case, accuracy)?;
    if !resume {
        results::make_way(folder)?;
    }
    let trials = Trials::begin(case, folder, resume, stop)?;
    let asked = *accuracy.get_ref();
    let with_mesh = case.file.accuracy_with_mesh.as_ref();
    let with_mesh = with_mesh.is_some_and(|with| *with.get_ref());
    let share = if with_mesh { WITHOUT_MESH } else { 1.0 };
    let mut search = Search::new(&trials, share * asked, folder, say)?;
    let (settings, found) = search.best()?;
    // What a looser tolerance does on one mesh says little about a finer one.
    let (settings, without_mesh, mesh) = if with_mesh {
        let most = asked - found.error.unwrap_or_default();
        let (settings, mesh) = mesh::refine(&mut search, settings, most)?;
        (settings, found.error, Some(mesh))
    } else {
        let (settings, more) = search.loosened(settings, &found)?;
        (settings, found.error.map(|error| error + more), None)
    };
    let of_mesh = mesh.as_ref().map_or(Some(0.0), |mesh| mesh.error);
    let reached = without_mesh.zip(of_mesh).map(|(a, b)| a + b);
    let verdict = Verdict::of(reached, asked);
    let mut chosen = settings.apply(case)?;
    let solver = chosen.file.solver.get_ref();
    chosen.file.chosen = Some(AccuracySettings {
        asked,
        reached,
        without_mesh,
        mesh,
        is_reached: verdict == Verdict::Reached,
        verdict,
        difference: found.difference,
        worst: found.worst,
        failed: search.failed,
        estimate: found.estimate,
        cut_back: found.cut_back,
        increments: increments(&chosen),
        force_tolerance: solver.force_tolerance,
        displacement_tolerance: solver.displacement_tolerance,
        parameters: settings.law.iter().flat_map(parameters).collect(),
        zero: found.trial.rows.zero(),
        runs: search.runs,
    });
    Ok(Some(chosen))
}

/// `law.parameter = value`.
fn parameters((law, values, _): &(String, Values, String)) -> Vec<String> {
    let written = |(id, value): &(String, ParameterValue)| {
        let value = match value {
            ParameterValue::Number(number) => number.to_string(),
            ParameterValue::Integer(number) => number.to_string(),
            ParameterValue::Label(label) => format!("{label:?}"),
            ParameterValue::Varying(over) => format!("{:?}", over.z),
        };
        format!("{law}.{id} = {value}")
    };
    values.iter().map(written).collect()
}

/// Checks all that can be without a run, and that there is something whose error `accuracy` may be.
fn check(case: &Case, accuracy: &Spanned<f64>) -> Result<(), Error> {
    crate::run::check(case)?;
    if case.file.probes.is_empty() && case.file.pile.is_none() {
        let message =
            "`accuracy` is the error of the [probes] and of the [pile], and there are none";
        return Err(case.source.error(accuracy.span(), message).into());
    }
    Ok(())
}

/// The increments of all phases, by name.
fn increments(case: &Case) -> Vec<(String, usize)> {
    let phases = case.file.phases.iter();
    let increments = phases.map(|phase| {
        let name = phase.name.get_ref().clone();
        (name, *phase.increments.get_ref())
    });
    increments.collect()
}
