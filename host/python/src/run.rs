//! Runs of cases, with their results in folders.

use crate::error::exception;
use crate::law::warn;
use crate::posed::Posed;
use crate::task::{Caller, carry_out};
use input::{Case, Error};
use law::Stop;
use mechanics::Place;
use mechanics::equilibrium::Reuse;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use results::report::Known;
use results::{Figures, remove_comparison, report};
use runs::run::{Observer, Options, check};
use runs::trade_off::run_accurately;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What a run says on its way.
enum Event {
    /// Phase, increment, of how many, iterations, steps that were repeated in the phase so far.
    Increment(String, usize, usize, usize, usize),
    Warning(String),
}

/// Hands on what happens.
struct Follower<'c> {
    caller: &'c Caller<Event>,
    cut_backs: usize,
    has_begun: bool,
    /// What the report need not read again.
    known: Known,
}

impl Observer for Follower<'_> {
    fn phase(&mut self, _name: &str, _increments: usize) {
        self.cut_backs = 0;
        self.has_begun = true;
    }

    fn increment(&mut self, place: &Place, of: usize, iterations: usize) {
        let phase = place.phase.clone();
        let event = Event::Increment(phase, place.increment, of, iterations, self.cut_backs);
        self.caller.tell(event);
    }

    fn cut_back(&mut self, _place: &Place, _reason: &str) {
        self.cut_backs += 1;
    }

    fn warning(&mut self, message: &str) {
        self.caller.tell(Event::Warning(message.to_owned()));
    }

    fn resumed(&mut self, _from: Option<&Place>) {
        self.has_begun = true;
    }

    fn written(&mut self, known: Known) {
        self.known = known;
    }

    fn stop(&self) -> Stop {
        self.caller.stop()
    }
}

/// Runs a case, or all its variants, and returns the names of the variants with their folders. `source` is a path
/// or a dictionary; `watch` is called after every increment.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "named in Python")]
pub(crate) fn run(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    name: String,
    mesh: Option<Vec<u8>>,
    settings: Option<&Bound<'_, PyDict>>,
    variant: Option<String>,
    results: Option<PathBuf>,
    resume: bool,
    checkpoints: Option<f64>,
    isolate: Option<f64>,
    watch: Option<Py<PyAny>>,
) -> PyResult<Vec<(Option<String>, PathBuf)>> {
    let is_one = variant.is_some();
    let posed = Posed::of(source, name, mesh, settings, variant, isolate)?;
    let checkpoints = checkpoints.map(Duration::try_from_secs_f64).transpose();
    let checkpoints = checkpoints.map_err(|_| {
        let message = "checkpoints: expected the seconds between them, or None for none";
        exception(py, &Error::usage(message), None)
    })?;
    let options = Options {
        resume,
        checkpoints,
        reports: true,
        ..Options::default()
    };
    let outcome = carry_out(
        py,
        |caller| -> Result<_, Error> {
            let cases = posed.cases()?;
            cases
                .iter()
                .try_for_each(|case| posed.check_laws_of(case))?;
            run_all(&cases, is_one, results.as_deref(), options, caller)
        },
        |py, event| match (event, &watch) {
            (Event::Warning(message), _) => warn(py, &message),
            (Event::Increment(phase, increment, of, iterations, cut_backs), Some(watch)) => {
                let class = py.import("pilum._run")?.getattr("Progress")?;
                let progress = class.call1((phase, increment, of, iterations, cut_backs))?;
                watch.call1(py, (progress,)).map(|_| ())
            }
            (Event::Increment(..), None) => Ok(()),
        },
    )?;
    outcome.map_err(|error| exception(py, &error, posed.written()))
}

/// Runs cases one after the other, with the report of each, and of all.
fn run_all(
    cases: &[Case],
    is_one: bool,
    results: Option<&Path>,
    options: Options,
    caller: &Caller<Event>,
) -> Result<Vec<(Option<String>, PathBuf)>, Error> {
    let folder_of = |case: &Case| match (results, &case.variant) {
        (None, _) => case.default_folder(),
        (Some(folder), Some(name)) if !is_one => folder.join(name),
        (Some(folder), _) => folder.to_owned(),
    };
    // All variants are checked before the first one runs.
    if cases.len() > 1 {
        cases.iter().try_for_each(check)?;
    }
    let together = match (results, cases.first()) {
        (Some(folder), _) => folder.to_owned(),
        (None, case) => Path::new("results").join(case.map(Case::name).unwrap_or_default()),
    };
    if let [case, _, ..] = cases {
        let figures = case.file.figures.iter();
        let figures: Vec<&str> = figures.map(|f| f.name.get_ref().as_str()).collect();
        remove_comparison(&together, &figures)?;
    }
    let (mut reuse, mut drawn, mut done) = (Reuse::default(), Vec::new(), Vec::new());
    for (number, case) in (1..).zip(cases) {
        reuse.is_last_run = number == cases.len();
        let folder = folder_of(case);
        let mut follower = Follower {
            caller,
            cut_backs: 0,
            has_begun: false,
            known: Known::default(),
        };
        let outcome = run_accurately(case, &folder, &mut follower, &mut reuse, options);
        if follower.has_begun {
            report::write_of(&folder, follower.known)?;
        }
        let figures = outcome?;
        drawn.extend(case.variant.clone().map(|variant| (variant, figures)));
        done.push((case.variant.clone(), folder));
    }
    if drawn.len() > 1 {
        Figures::draw_overlaid(&together, &drawn)?;
        let folders: Vec<PathBuf> = done.iter().map(|(_, folder)| folder.clone()).collect();
        report::write(&folders, &together)?;
    }
    Ok(done)
}
