//! Running a case under changed settings, without output.

use super::clock::cpu_seconds;
use super::division::divide;
use super::progress::in_words;
use super::sampled::Sampled;
use super::scheme::{Values, short};
use super::trial_cache::Kept;
use crate::Error;
use crate::run::{Observer, run};
use input::Case;
use input::material::set_parameters;
use law::Stop;
use mechanics::Place;
use mechanics::Settings as Solver;
use mechanics::problem::{Formulation, Integration};
use mechanics::settings::{Control, Convergence, Equations, Method};
use results::output_request::Output;
use serde_json::Value;
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A choice of the solver: key and value in the case file, and how it is set.
pub(super) struct SolverChoice {
    pub(super) key: &'static str,
    pub(super) value: &'static str,
    pub(super) set: fn(&mut Solver),
}

impl std::fmt::Debug for SolverChoice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} = {:?}", self.key, self.value)
    }
}

/// Equilibrium of forces alone. That differs most where little of it is asked for.
pub(super) const BY_FORCE: SolverChoice = choice("convergence", "force", |s| {
    s.convergence = Convergence::Force;
});

/// All choices of the solver that a study tries.
pub(super) const SOLVER_CHOICES: &[SolverChoice] = &[
    choice("method", "auto", |s| s.method = Method::Auto),
    choice("method", "newton", |s| s.method = Method::Newton),
    choice("method", "modified_newton", |s| {
        s.method = Method::ModifiedNewton;
    }),
    choice("method", "initial_stress", |s| {
        s.method = Method::InitialStress;
    }),
    choice("method", "quasi_newton", |s| s.method = Method::QuasiNewton),
    choice("equations", "auto", |s| s.equations = Equations::Auto),
    choice("equations", "condensed", |s| {
        s.equations = Equations::Condensed;
    }),
    choice("equations", "sparse", |s| s.equations = Equations::Sparse),
    choice("line_search", "true", |s| s.line_search = true),
    choice("line_search", "false", |s| s.line_search = false),
    choice("control", "auto", |s| s.control = Control::Auto),
    choice("control", "load", |s| s.control = Control::Load),
    choice("control", "viscous", |s| s.control = Control::Viscous),
    choice("convergence", "both", |s| {
        s.convergence = Convergence::Both;
    }),
    BY_FORCE,
];

const fn choice(key: &'static str, value: &'static str, set: fn(&mut Solver)) -> SolverChoice {
    SolverChoice { key, value, set }
}

/// Settings that differ from those of the case file.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    /// Factor of the increments of every phase.
    pub(super) increments: f64,
    /// Tolerance of the residual; that of the correction keeps its ratio to it.
    pub(super) tolerance: Option<f64>,
    /// The mesh is divided by this.
    pub(super) division: usize,
    /// Integration of thin layers.
    pub(super) integration: Option<Integration>,
    /// Parameters of a law, with words for them.
    pub(super) law: Option<(String, Values, String)>,
    /// A choice of the solver.
    pub(super) solver: Option<&'static SolverChoice>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            increments: 1.0,
            tolerance: None,
            division: 1,
            integration: None,
            law: None,
            solver: None,
        }
    }
}

impl Settings {
    /// Whether they are the same.
    pub(super) fn is(&self, other: &Self) -> bool {
        key(self, 0) == key(other, 0)
    }

    /// In words, as far as they differ from the file.
    pub(super) fn label(&self) -> String {
        let mut words = Vec::new();
        words.extend(self.law.as_ref().map(|(_, _, label)| label.clone()));
        if (self.increments - 1.0).abs() > 0.0 {
            words.push(format!("increments × {}", short(self.increments)));
        }
        words.extend(self.tolerance.map(|t| format!("tolerance {}", short(t))));
        if self.division > 1 {
            words.push(format!("mesh / {}", self.division));
        }
        let integration = self.integration.map(|integration| match integration {
            Integration::Full => "integration full",
            Integration::Reduced => "integration reduced",
            Integration::Projected => "integration projected",
            Integration::BBar => "integration b_bar",
            Integration::Mean => "integration mean",
            Integration::Nodes => "integration nodes",
        });
        words.extend(integration.map(str::to_owned));
        words.extend(self.solver.map(|c| format!("{} {}", c.key, c.value)));
        if words.is_empty() {
            return "as in the file".to_owned();
        }
        words.join(", ")
    }

    /// The case with these settings.
    ///
    /// # Errors
    /// Those of building the mesh.
    pub(super) fn apply(&self, case: &Case) -> Result<Case, Error> {
        let mut case = case.clone();
        if self.division > 1 {
            divide(&mut case, self.division)?;
        }
        let file = &mut case.file;
        for phase in &mut file.phases {
            let n = *phase.increments.get_ref();
            let scaled = scaled(n, self.increments);
            *phase.increments.get_mut() = scaled;
            let figures = file.figures.iter_mut().filter(|figure| {
                let named = figure.phase.as_ref();
                named.is_none_or(|p| p.get_ref() == phase.name.get_ref())
            });
            for increments in figures.filter_map(|figure| figure.increments()) {
                let moved = |k: &mut usize| *k = (*k * scaled).div_ceil(n);
                increments.iter_mut().for_each(moved);
            }
        }
        if let Some(tolerance) = self.tolerance {
            let solver = file.solver.get_mut();
            let ratio = solver.displacement_tolerance / solver.force_tolerance;
            solver.force_tolerance = tolerance;
            solver.displacement_tolerance = (ratio * tolerance).clamp(1e-14, 1.0);
        }
        if let Some(integration) = self.integration {
            let layers = file.groups.values_mut().map(toml::Spanned::get_mut);
            for group in layers.filter(|g| g.formulation == Formulation::ThinLayer) {
                group.integration = Some(toml::Spanned::new(0..0, integration));
            }
        }
        if let Some((name, values, _)) = &self.law {
            let laws = file.laws.iter_mut();
            for (_, law) in laws.filter(|(key, _)| key.get_ref() == name) {
                set_parameters(&mut law.get_mut().parameters, values);
            }
        }
        if let Some(choice) = self.solver {
            (choice.set)(file.solver.get_mut());
        }
        Ok(case)
    }
}

/// A number of increments times a factor. Fewer ones are, where there is such a number nearby,
/// a divisor, so that all their rows stay rows.
fn scaled(n: usize, factor: f64) -> usize {
    let wanted = n as f64 * factor;
    let distance = |d: usize| (d as f64 / wanted).ln().abs();
    if factor < 1.0
        && let Some(divisor) = (1..=n)
            .filter(|d| n.is_multiple_of(*d))
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        && distance(divisor) <= f64::ln(1.6)
    {
        return divisor;
    }
    (wanted.round() as usize).max(1)
}

/// A folder that is gone when this is dropped.
#[derive(Debug)]
pub(crate) struct Scratch {
    folder: PathBuf,
    /// A request to stop.
    pub(crate) stop: Stop,
    /// Trials that are done.
    kept: Option<RefCell<Kept>>,
}

impl Scratch {
    /// A folder inside another one, which is made if needed.
    ///
    /// # Errors
    /// [`text::Error::Unwritable`].
    pub(crate) fn new(within: &Path, stop: &Stop) -> Result<Self, Error> {
        let folder = within.join(".trial");
        std::fs::create_dir_all(&folder).map_err(|source| text::Error::Unwritable {
            path: folder.clone(),
            source,
        })?;
        Ok(Self {
            folder,
            stop: stop.clone(),
            kept: None,
        })
    }

    /// Keeps what is done, and does not do again what was.
    pub(super) fn keeping(mut self, kept: Kept) -> Self {
        self.kept = Some(RefCell::new(kept));
        self
    }

    /// Whether a trial is done.
    pub(super) fn has(&self, settings: &Settings, round: usize) -> bool {
        let key = key(settings, round);
        let kept = self.kept.as_ref();
        kept.is_some_and(|kept| kept.borrow().find(&key).is_some())
    }

    /// How many trials are done.
    pub(super) fn kept(&self) -> usize {
        self.kept.as_ref().map_or(0, |kept| kept.borrow().len())
    }

    /// The study has come to its end: its trials are not kept any longer.
    pub(super) fn end(mut self) {
        if let Some(kept) = self.kept.take() {
            kept.into_inner().end();
        }
    }

    /// Runs a case under some settings as [`trial`] does, unless that was done before: in the same
    /// round, if it is done several times.
    ///
    /// # Errors
    /// Those of the run; what is done cannot be kept.
    pub(super) fn trial(
        &self,
        case: &Case,
        settings: &Settings,
        timing: Timing,
        round: usize,
    ) -> Result<Trial, Error> {
        let Some(kept) = &self.kept else {
            return trial(case, settings, self, timing);
        };
        let key = key(settings, round);
        if let Some(found) = kept.borrow().find(&key) {
            return Ok(found.clone());
        }
        let done = trial(case, settings, self, timing)?;
        kept.borrow_mut().keep(key, &done)?;
        Ok(done)
    }

    /// The folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }
}

/// Key of a stored trial.
fn key(settings: &Settings, round: usize) -> String {
    format!("{settings:?}, round {round}")
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // Results of trials are worth nothing; what cannot be removed does no harm.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// The quantity that is counted.
pub(super) const COUNTS: &[&str] = &["iterations", "factorisations", "law_calls", "cut_backs"];

/// What came out of a trial.
#[derive(Clone, Debug)]
pub(crate) struct Trial {
    /// Probes by phase and increment.
    pub(crate) rows: Sampled,
    /// CPU time from the first phase on, s; the least of the repetitions.
    pub(super) seconds: f64,
    /// Counts, in the order of [`COUNTS`].
    pub(super) counts: Vec<u64>,
    /// For every phase, whether no step took a second iteration: it is linear, and increments do not matter to it.
    pub(super) linear: Vec<bool>,
}

impl Trial {
    /// Steps that were cut back.
    pub(super) fn cut_backs(&self) -> u64 {
        let counts = COUNTS.iter().zip(&self.counts);
        let of_cut_backs = counts.filter(|(name, _)| **name == "cut_backs");
        of_cut_backs.map(|(_, count)| count).sum()
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
pub(super) fn repetitions(seconds: f64) -> f64 {
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

/// Runs a case under some settings.
///
/// # Errors
/// Those of the run; it takes too long.
pub(super) fn trial(
    case: &Case,
    settings: &Settings,
    scratch: &Scratch,
    timing: Timing,
) -> Result<Trial, Error> {
    let mut case = settings.apply(case)?;
    case.file.output = Output::default();
    let Timing::Within(most) = timing else {
        return measure(&mut case, scratch, timing, &scratch.stop);
    };
    let (asked, beat) = (scratch.stop.clone(), scratch.stop.clone());
    let started = cpu_seconds();
    let stop = Stop::asked_by(
        move || asked.is_asked() || cpu_seconds() - started > most.as_secs_f64(),
        move |took| beat.beat(took),
    );
    let outcome = measure(&mut case, scratch, timing, &stop);
    outcome.map_err(|error| {
        if error.is_stop() && !scratch.stop.is_asked() {
            return Error::usage(format!(
                "takes more than {} of CPU time, given up",
                in_words(most.as_secs_f64())
            ));
        }
        error
    })
}

/// Runs a case unchanged, but for its figures.
///
/// # Errors
/// Those of the run.
pub(crate) fn measure(
    case: &mut Case,
    scratch: &Scratch,
    timing: Timing,
    stop: &Stop,
) -> Result<Trial, Error> {
    case.file.figures.clear();
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
        run(case, scratch.folder(), &mut meter)?;
        let took = cpu_seconds() - meter.started.unwrap_or_default();
        seconds = seconds.min(took);
        spent += took;
        if spent > LONG_ENOUGH {
            break;
        }
    }
    let phases: Vec<&str> = case
        .file
        .phases
        .iter()
        .map(|phase| phase.name.get_ref().as_str())
        .collect();
    let summary = summary(scratch.folder())?;
    let mut rows = history(&scratch.folder().join("history.csv"), &phases)?;
    let share = (TOLERATED * case.file.solver.get_ref().force_tolerance).clamp(ZERO[0], ZERO[1]);
    let magnitude = |name: &String| summary["probe_magnitudes"][name].as_f64();
    let zeros = rows
        .names
        .iter()
        .map(|name| share * magnitude(name).unwrap_or_default());
    rows.zeros = zeros.collect();
    Ok(Trial {
        rows,
        seconds,
        counts: counts(&summary),
        linear: linear(&summary),
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

    fn increment(&mut self, _: &Place, _: usize, _: usize) {}

    fn cut_back(&mut self, _: &Place, _: &str) {}

    fn warning(&mut self, _: &str) {}

    fn stop(&self) -> Stop {
        self.stop.clone()
    }
}

/// Probes of a history by phase and increment.
fn history(path: &Path, phases: &[&str]) -> Result<Sampled, Error> {
    let broken = |error: csv::Error| Error::internal(format!("{}: {error}", path.display()));
    let mut reader = csv::Reader::from_path(path).map_err(broken)?;
    let headers = reader.headers().map_err(broken)?.clone();
    let probes: Vec<usize> = (0..headers.len())
        .filter(|&i| !["phase", "increment", "time", "iterations"].contains(&&headers[i]))
        .collect();
    let mut sampled = Sampled {
        names: probes.iter().map(|&i| headers[i].to_owned()).collect(),
        stretches: vec![Vec::new(); phases.len()],
        zeros: Vec::new(),
    };
    for row in reader.records() {
        let row = row.map_err(broken)?;
        if let Some(number) = phases.iter().position(|name| *name == &row[0]) {
            let value = |&i: &usize| row[i].parse().unwrap_or(f64::NAN);
            sampled.stretches[number].push(probes.iter().map(value).collect());
        }
    }
    Ok(sampled)
}

/// `summary.json` of a run.
pub(super) fn summary(folder: &Path) -> Result<Value, Error> {
    let path = folder.join("summary.json");
    let text = std::fs::read_to_string(&path).map_err(|source| text::Error::Unreadable {
        path: path.clone(),
        source,
    })?;
    serde_json::from_str(&text).map_err(|error| Error::internal(error.to_string()))
}

fn counts(summary: &Value) -> Vec<u64> {
    let phases = summary["phases"].as_array().map_or(&[][..], Vec::as_slice);
    let of_phases = |key: &str| phases.iter().filter_map(|p| p[key].as_u64()).sum();
    let calls = summary["law_calls_by_group"].as_object();
    let calls = calls.map_or(0, |calls| calls.values().filter_map(Value::as_u64).sum());
    vec![
        of_phases("iterations"),
        of_phases("factorisations"),
        calls,
        of_phases("cut_backs"),
    ]
}

/// For every phase that ended, whether each of its increments took one iteration.
fn linear(summary: &Value) -> Vec<bool> {
    let phases = summary["phases"].as_array().map_or(&[][..], Vec::as_slice);
    let count = |phase: &Value, key: &str| phase[key].as_u64().unwrap_or_default();
    let is_linear = |phase| count(phase, "iterations") <= count(phase, "increments");
    phases.iter().map(is_linear).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_choice_of_the_solver_sets_what_it_is_called() {
        for choice in SOLVER_CHOICES {
            let mut solver = Solver::default();
            (choice.set)(&mut solver);
            let set = serde_json::to_value(solver).unwrap();
            let value = match &set[choice.key] {
                Value::String(text) => text.clone(),
                other => other.to_string(),
            };
            assert_eq!(value, choice.value, "{}", choice.key);
        }
    }

    #[test]
    fn fewer_increments_divide_the_given_ones() {
        let cases = [(50, 0.25, 10), (50, 0.5, 25), (1, 0.25, 1), (37, 0.25, 9)];
        for (n, factor, expected) in cases {
            assert_eq!(scaled(n, factor), expected, "{n} × {factor}");
        }
        assert_eq!(scaled(50, 4.0), 200);
    }
}
