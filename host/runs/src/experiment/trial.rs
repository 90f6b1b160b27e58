//! Running a case for its numbers alone.

use super::Rows;
use super::bits;
use super::clock::cpu_seconds;
use super::progress::in_words;
use crate::Error;
use crate::run::{Observer, run};
use input::Case;
use law::Stop;
use results::study::History;
use results::{Phase, Summary};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A folder that is gone when this is dropped.
#[derive(Debug)]
pub(crate) struct Scratch {
    folder: PathBuf,
    /// A request to stop.
    pub(crate) stop: Stop,
}

impl Scratch {
    /// A folder inside another one, which is made if needed.
    ///
    /// # Errors
    /// [`text::Error::Unwritable`].
    pub(crate) fn new(within: &Path, stop: &Stop) -> Result<Self, Error> {
        let folder = within.join(".trial");
        std::fs::create_dir_all(&folder).map_err(|why| text::Error::unwritable(&folder, why))?;
        Ok(Self {
            folder,
            stop: stop.clone(),
        })
    }

    /// The folder, with the results of the last run.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Who may want a run to stop: whoever wants the work to, and the time.
    fn stop_of(&self, timing: Timing) -> Stop {
        let Timing::Within(most) = timing else {
            return self.stop.clone();
        };
        let (asked, beat) = (self.stop.clone(), self.stop.clone());
        let started = cpu_seconds();
        Stop::asked_by(
            move || asked.is_asked() || cpu_seconds() - started > most.as_secs_f64(),
            move |took| beat.beat(took),
        )
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // Results of trials are worth nothing; what cannot be removed does no harm.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// What came out of a trial.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Trial {
    /// Probes by phase and increment.
    pub(crate) rows: Rows,
    /// CPU time from the first phase on, s; the least of the repetitions.
    #[serde(with = "bits")]
    pub(crate) seconds: f64,
    pub(crate) counts: Counts,
    /// For every phase, whether no step took a second iteration: it is linear, and increments do not matter to it.
    pub(crate) linear: Vec<bool>,
}

/// What a trial took, of all phases.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Counts {
    pub(crate) iterations: u64,
    pub(crate) factorisations: u64,
    pub(crate) law_calls: u64,
    pub(crate) cut_backs: u64,
}

impl Counts {
    /// Names of what is counted, in the order of [`Self::all`].
    pub(crate) const NAMES: &[&str] = &["iterations", "factorisations", "law_calls", "cut_backs"];

    pub(crate) fn all(self) -> Vec<u64> {
        vec![
            self.iterations,
            self.factorisations,
            self.law_calls,
            self.cut_backs,
        ]
    }
}

/// A probe is zero that never exceeds this share of what its quantity has in the model: this many times the tolerance of
/// equilibrium, within bounds.
const TOLERATED: f64 = 10.0;
const ZERO: [f64; 2] = [1e-8, 1e-6];

/// Repetitions of a trial end after this many, or when they took this many seconds.
const MOST_REPETITIONS: usize = 8;
const LONG_ENOUGH: f64 = 0.5;

/// How often a trial of this length is repeated for its CPU time.
pub(crate) fn repetitions(seconds: f64) -> f64 {
    (LONG_ENOUGH / seconds)
        .ceil()
        .clamp(1.0, MOST_REPETITIONS as f64)
}

/// How often a case runs, and how long it may.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Timing {
    /// Until its CPU time is known.
    Repeated,
    /// Once.
    Once,
    /// Once, unless it takes more CPU time.
    Within(Duration),
}

/// Runs a case unchanged, but for its figures.
///
/// # Errors
/// Those of the run; it takes too long.
pub(crate) fn measure(mut case: Case, scratch: &Scratch, timing: Timing) -> Result<Trial, Error> {
    case.file.figures.clear();
    let stop = scratch.stop_of(timing);
    let mut seconds = f64::INFINITY;
    let mut spent = 0.0;
    let most = if timing == Timing::Repeated {
        MOST_REPETITIONS
    } else {
        1
    };
    for _ in 0..most {
        scratch.stop.check("the study")?;
        let mut meter = Meter {
            started: None,
            stop: stop.clone(),
        };
        let outcome = run(&case, &scratch.folder, &mut meter);
        outcome.map_err(|error| match timing {
            Timing::Within(most) if error.is_stop() && !scratch.stop.is_asked() => {
                Error::usage(format!(
                    "takes more than {} of CPU time, given up",
                    in_words(most.as_secs_f64())
                ))
            }
            _ => error,
        })?;
        let took = cpu_seconds() - meter.started.unwrap_or_default();
        seconds = seconds.min(took);
        spent += took;
        if spent > LONG_ENOUGH {
            break;
        }
    }
    let summary = Summary::read(&scratch.folder)?;
    let phases = case.file.phases.iter().map(|phase| phase.name.get_ref());
    let phases: Vec<&str> = phases.map(String::as_str).collect();
    let history = History::read(&scratch.folder);
    if history.names.is_empty() {
        let file = scratch.folder.join("history.csv");
        return Err(Error::usage(format!("cannot read {}", file.display())));
    }
    let mut rows = rows_of(&history, &phases);
    let share = (TOLERATED * case.file.solver.get_ref().force_tolerance).clamp(ZERO[0], ZERO[1]);
    let magnitude = |name: &String| summary.probe_magnitudes.get(name).copied().flatten();
    let zeros = rows.names.iter();
    rows.zeros = zeros
        .map(|name| share * magnitude(name).unwrap_or_default())
        .collect();
    let sum = |of: fn(&Phase) -> Option<u64>| summary.phases.iter().filter_map(of).sum();
    let is_linear = |phase: &Phase| phase.iterations <= phase.increments;
    Ok(Trial {
        rows,
        seconds,
        counts: Counts {
            iterations: sum(|phase| phase.iterations),
            factorisations: sum(|phase| phase.factorisations),
            law_calls: summary.law_calls_by_group.values().sum(),
            cut_backs: sum(|phase| phase.cut_backs),
        },
        linear: summary.phases.iter().map(is_linear).collect(),
    })
}

/// Takes the time when the first phase begins: reading input and opening libraries do not count.
#[derive(Debug, Default)]
struct Meter {
    started: Option<f64>,
    stop: Stop,
}

impl Observer for Meter {
    fn phase(&mut self, _: &str, _: usize) {
        self.started.get_or_insert_with(cpu_seconds);
    }

    fn stop(&self) -> Stop {
        self.stop.clone()
    }
}

/// Probes of a history by phase and increment.
fn rows_of(history: &History, phases: &[&str]) -> Rows {
    let is_probe = |name: &&String| !["increment", "time", "iterations"].contains(&name.as_str());
    let names: Vec<String> = history.names.iter().filter(is_probe).cloned().collect();
    let columns = names.iter().filter_map(|name| history.column(name));
    let columns: Vec<&[Option<f64>]> = columns.collect();
    let mut stretches = vec![Vec::new(); phases.len()];
    for (row, phase) in history.phases.iter().enumerate() {
        if let Some(number) = phases.iter().position(|name| name == phase) {
            let values = columns.iter().map(|column| column[row].unwrap_or(f64::NAN));
            stretches[number].push(values.collect());
        }
    }
    Rows {
        names,
        stretches,
        zeros: Vec::new(),
    }
}
