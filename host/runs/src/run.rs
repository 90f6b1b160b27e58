//! One run: from a case to a folder with results.

mod failure;
mod keeper;

use crate::Error;
use crate::run_status::{ending, process};
use failure::explained;
use input::Case;
use input::build::{Laws, Posed};
use input::mesh::MeshFile;
use keeper::Keeper;
use law::{Stop, hexadecimal_sha256};
use mechanics::equilibrium::{Iteration, Reason, Reuse};
use mechanics::group::Group;
use mechanics::problem::Drainage;
use mechanics::simulation::{Increment, Part, PhaseRecord, Reached, Snapshot, Warning, When};
use mechanics::{Place, Problem, Simulation, State, Watch};
use results::output_request::OutputRequest;
use results::pile::Resistances;
use results::{About, Checkpoint, Fault, Figures, Recorder, report};
use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Progress of a run, for whoever shows it.
pub trait Observer {
    /// A phase begins.
    fn phase(&mut self, _name: &str, _increments: usize) {}
    /// An increment reached equilibrium.
    fn increment(&mut self, _place: &Place, _of: usize, _iterations: usize) {}
    /// An increment is repeated with smaller steps.
    fn cut_back(&mut self, _place: &Place, _reason: &str) {}
    /// Something the user should know.
    fn warning(&mut self, _message: &str) {}
    /// Activity before the first phase.
    fn note(&mut self, _message: &str) {}
    /// The ground was found at rest in this phase but for a share of its weight, which the phase
    /// carries to equilibrium.
    fn at_rest(&mut self, _phase: &str, _share: f64) {}
    /// An earlier run is gone on with after this increment; `None`: it had come to its end.
    fn resumed(&mut self, _from: Option<&Place>) {}
    /// The run has ended, well or not; this is what its report need not read again.
    fn written(&mut self, _known: report::Known) {}
    /// The run has ended; this is the resistance of its pile.
    fn pile(&mut self, _resistances: &Resistances) {}
    /// A request to stop: after the current increment, or within it if that takes long.
    fn stop(&self) -> Stop {
        Stop::never()
    }
}

/// How a run begins, and what it keeps to go on from.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Go on from the checkpoint in the folder, if there is one.
    pub resume: bool,
    /// Time between checkpoints; `None`: none exist.
    pub checkpoints: Option<Duration>,
    /// A run that has come to its end leaves no checkpoint that reports it.
    pub ends_without: bool,
    /// A report is written while the run goes on, if that takes more than a second, and one at its end by this
    /// process.
    pub reports: bool,
}

/// A case's simulation before its first phase, with its laws.
///
/// # Errors
/// Bad input, or trouble with a library.
pub(crate) fn begin(case: &Case) -> Result<(Simulation, Laws), Error> {
    let Posed { problem, laws, .. } = case.pose()?;
    let simulation = Simulation::new(problem).map_err(|error| case.place(error))?;
    Ok((simulation, laws))
}

/// Checks everything about a case that can be checked without running it.
///
/// # Errors
/// Bad input, or trouble with a library.
pub fn check(case: &Case) -> Result<(), Error> {
    let (simulation, _) = begin(case)?;
    case.wanted(&simulation)?;
    Ok(())
}

/// Reads, builds and checks a case as a run would, computes nothing, and writes the report of what there
/// is into `folder`, which must not hold results. Returns the report's path.
///
/// # Errors
/// As [`check`]; results in the folder, or a folder that cannot be written.
pub fn dry_run(case: &Case, folder: &Path, observer: &mut dyn Observer) -> Result<PathBuf, Error> {
    let Posed {
        problem,
        laws,
        mesh_file,
        notes,
    } = case.pose_closely()?;
    let simulation = Simulation::new(problem.clone()).map_err(|error| case.place(error))?;
    let wanted = case.wanted(&simulation)?;
    let about = case.about(&laws, mesh_file.as_ref());
    let mut warnings = tell_warnings(case, &laws, (&simulation, &wanted), notes, observer);
    // What the laws make of the initial stress is known once the first phase starts. The report shows
    // what is before that, so another simulation starts.
    let mut start = Start {
        observer: &mut *observer,
        warnings: &mut warnings,
    };
    let started = Simulation::new(problem).and_then(|trial| trial.try_start(&mut start));
    started.map_err(|error| case.place(error))?;
    let report = report::write_dry(folder, &about, &wanted, &simulation, &warnings)?;
    Ok(report)
}

/// Follows the start of a phase that goes no further.
struct Start<'a> {
    observer: &'a mut dyn Observer,
    warnings: &'a mut Vec<String>,
}

impl Watch for Start<'_> {
    fn at_rest(&mut self, phase: &str, share: f64) {
        self.observer.at_rest(phase, share);
    }

    fn warning(&mut self, warning: &Warning) {
        if was_said(warning) {
            return;
        }
        let message = warning.to_string();
        self.observer.warning(&message);
        self.warnings.push(message);
    }
}

/// Whether a case has said it before its first phase, with its place in the file.
fn was_said(warning: &Warning) -> bool {
    matches!(warning, Warning::NoTime { .. })
}

/// Tells the warnings about a case before its first phase, and returns them.
fn tell_warnings(
    case: &Case,
    laws: &Laws,
    (simulation, wanted): (&Simulation, &OutputRequest),
    notes: Vec<String>,
    observer: &mut dyn Observer,
) -> Vec<String> {
    let of_laws = laws.values().flat_map(|law| law.warnings.iter().cloned());
    let mut all: Vec<String> = of_laws.chain(simulation.warnings().to_vec()).collect();
    all.extend(notes);
    all.extend(case.warnings(simulation));
    let pile = wanted.pile.iter();
    all.extend(pile.flat_map(|pile| pile.warnings(simulation)));
    for warning in &all {
        observer.warning(warning);
    }
    all
}

/// Runs a case and writes its results into `folder`.
///
/// # Errors
/// Bad input before anything is written; no equilibrium or plugin trouble after the last state
/// of equilibrium has been written.
pub fn run(case: &Case, folder: &Path, observer: &mut dyn Observer) -> Result<Figures, Error> {
    let options = Options::default();
    let mut reuse = Reuse::default();
    reuse.is_last_run = true;
    run_reusing(case, folder, observer, &mut reuse, options)
}

/// As [`run`], with what earlier runs have factorised, and with checkpoints.
///
/// # Errors
/// As [`run`]; a checkpoint to go on from that is damaged or belongs to another run; stopped as
/// asked.
pub fn run_reusing(
    case: &Case,
    folder: &Path,
    observer: &mut dyn Observer,
    reuse: &mut Reuse,
    options: Options,
) -> Result<Figures, Error> {
    ready(case)?.run(folder, observer, reuse, options)
}

/// A case whose problem is posed, with its laws opened.
#[derive(Debug)]
pub struct Ready<'c> {
    case: &'c Case,
    posed: Posed,
    identity: String,
    started: Instant,
}

/// Poses the problem of a case.
///
/// # Errors
/// Bad input, or trouble with a library.
pub fn ready(case: &Case) -> Result<Ready<'_>, Error> {
    let started = Instant::now();
    let posed = case.pose()?;
    Ok(Ready {
        identity: identity(case, &posed.laws, posed.mesh_file.as_ref()),
        case,
        posed,
        started,
    })
}

impl Ready<'_> {
    /// What the results depend on: program, case with its settings, mesh, libraries.
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// The files that the case names, each with the sum of what is in it: libraries with their sidecars by their law,
    /// and the mesh.
    pub fn files(&self) -> impl Iterator<Item = (String, String)> {
        let libraries = self.posed.laws.values().map(|built| {
            let library = built.law.library();
            let sidecar = library.sidecar_sha256().unwrap_or_default();
            let name = format!("the library of law `{}`", built.law.description().id);
            (name, format!("{} {sidecar}", library.sha256()))
        });
        let mesh = self.posed.mesh_file.iter();
        libraries.chain(mesh.map(|mesh| ("the mesh".to_owned(), mesh.sha256.clone())))
    }

    /// The problem alone.
    pub fn into_problem(self) -> Problem {
        self.posed.problem
    }

    /// Runs it, as [`run_reusing`].
    ///
    /// # Errors
    /// As [`run_reusing`].
    pub fn run(
        self,
        folder: &Path,
        observer: &mut dyn Observer,
        reuse: &mut Reuse,
        options: Options,
    ) -> Result<Figures, Error> {
        let Self { case, posed, .. } = self;
        announce_memory(reuse);
        let mut simulation = Simulation::reusing(posed.problem, std::mem::take(reuse))
            .map_err(|error| case.place(error))?;
        let wanted = case.wanted(&simulation)?;
        let about = case.about(&posed.laws, posed.mesh_file.as_ref());
        let keeper = Keeper::new(self.identity, folder, options);
        let (mut results, warnings) = match keeper.found()? {
            Some(checkpoint) if checkpoint.run.is_none() => {
                checkpoint.results.check(folder)?;
                observer.resumed(None);
                return Ok(checkpoint.results.figures(&wanted));
            }
            Some(checkpoint) => {
                let (folder, wanted) = (folder, (wanted, &about));
                resume(checkpoint, folder, wanted, &mut simulation, observer)?
            }
            None => {
                check_start(case, simulation.problem())?;
                let seen = (&simulation, &wanted);
                let warnings = tell_warnings(case, &posed.laws, seen, posed.notes, observer);
                let results = Recorder::create(folder, wanted, &about, &simulation)?;
                (results, warnings)
            }
        };
        if !options.reports {
            results.makes_no_report();
        }
        process::writes(Some(folder));
        let mut follower = Follower {
            stop: observer.stop(),
            observer,
            results,
            keeper,
            warnings,
            report: options.reports.then(|| report::Running::new(folder)),
            fault: None,
        };
        let outcome = follower.follow(case, &mut simulation);
        let outcome = follower.finish(outcome, &simulation, self.started);
        *reuse = simulation.into_reuse();
        outcome
    }
}

/// Refuses what would be refused once the first phase starts, before anything is written.
fn check_start(case: &Case, problem: &Problem) -> Result<(), Error> {
    let may_refuse = (0..problem.groups.len()).any(|group| {
        let is_at_rest = problem.groups[group].initial_stress.is_some();
        is_at_rest || problem.drainage(group, 0) == Drainage::Undrained
    });
    if !may_refuse {
        return Ok(());
    }
    let trial = Simulation::new(problem.clone()).and_then(Simulation::check_start);
    trial.map_err(|error| case.place(error))
}

/// Has the solver say how much memory it is about to need.
fn announce_memory(reuse: &mut Reuse) {
    #[cfg(unix)]
    {
        reuse.announces = Some(crate::memory::expect);
    }
}

/// Goes on from a checkpoint in the middle of a run. Returns its results and warnings until there.
fn resume(
    checkpoint: Checkpoint<'_>,
    folder: &Path,
    (wanted, about): (OutputRequest, &About),
    simulation: &mut Simulation,
    observer: &mut dyn Observer,
) -> Result<(Recorder, Vec<String>), Error> {
    let Some(state) = checkpoint.run else {
        return Err(Error::internal("a checkpoint without a state"));
    };
    let phase = &simulation.problem().phases[state.phase];
    let (name, increments) = (phase.name.clone(), phase.increments);
    observer.resumed(Some(&Place {
        phase: name.clone(),
        increment: state.increment(),
    }));
    let results = Recorder::resume(folder, wanted, about, simulation, checkpoint.results)?;
    observer.phase(&name, increments);
    simulation.go_to(state.into_owned())?;
    Ok((results, checkpoint.warnings.into_owned()))
}

/// Records a simulation in its folder, and shows how it goes.
struct Follower<'a> {
    observer: &'a mut dyn Observer,
    results: Recorder,
    keeper: Keeper,
    /// Warnings so far, for the summary.
    warnings: Vec<String>,
    stop: Stop,
    /// The report of what there is so far.
    report: Option<report::Running>,
    /// Why no more is wanted.
    fault: Option<Fault>,
}

impl Follower<'_> {
    /// Carries the simulation out.
    fn follow(&mut self, case: &Case, simulation: &mut Simulation) -> Result<(), Error> {
        let outcome = simulation.run(self);
        let (beyond, unreliable) = (simulation.beyond_theory(), self.results.unreliable());
        let soft = self.results.soft_shaft();
        for warning in beyond.iter().chain(&unreliable).chain(&soft) {
            self.say(warning);
        }
        if let Some(left) = self.results.out_of_balance() {
            self.observer.note(&left);
        }
        let outcome = outcome.map_err(|error| {
            if let mechanics::Error::NoEquilibrium(none) = &error
                && let Some(plunge) = self.results.plunge(simulation, none)
            {
                self.observer.note(&plunge);
            }
            explained(case, simulation, error, self.fault.take(), &self.results)
        });
        self.tell_results(outcome.is_ok());
        outcome
    }

    /// Writes what is left to write after this outcome.
    fn finish(
        mut self,
        outcome: Result<(), Error>,
        simulation: &Simulation,
        started: Instant,
    ) -> Result<Figures, Error> {
        let finished = self.results.finish(
            simulation.groups(),
            started.elapsed(),
            &self.warnings,
            &ending(outcome.as_ref().err()),
        );
        process::writes(None);
        self.observer.written(self.results.known());
        let is_done = outcome.is_ok();
        outcome.and(finished.map_err(Error::from))?;
        if is_done {
            self.keeper.end(&self.results, &self.warnings)?;
        }
        Ok(self.results.figures().clone())
    }

    fn say(&mut self, message: &str) {
        self.warnings.push(message.to_owned());
        self.observer.warning(message);
    }

    /// Tells what has come out: the resistances of a pile, the error of the mesh.
    fn tell_results(&mut self, is_done: bool) {
        let resistances = self.results.resistances();
        // A run that ends in its first increments has no pile to tell of.
        if let Some(resistances) = resistances.filter(|pile| is_done || pile.phase.is_some()) {
            self.observer.pile(&resistances);
        }
        if let Some(of_mesh) = self.results.mesh_error() {
            self.observer.note(&of_mesh);
        }
    }

    /// Wants no more after a fault.
    fn kept(&mut self, outcome: Result<(), impl Into<Fault>>) -> ControlFlow<()> {
        match outcome {
            Ok(()) => ControlFlow::Continue(()),
            Err(fault) => {
                self.fault.get_or_insert(fault.into());
                ControlFlow::Break(())
            }
        }
    }
}

impl Watch for Follower<'_> {
    fn phase(&mut self, name: &str, increments: usize) {
        self.observer.phase(name, increments);
    }

    fn iterations(
        &mut self,
        place: &Place,
        load_factor: f64,
        iterations: &[Iteration],
    ) -> ControlFlow<()> {
        let written = self.results.iterations(place, load_factor, iterations);
        self.kept(written)
    }

    fn cut_back(
        &mut self,
        place: &Place,
        load_factor: f64,
        next: f64,
        reason: &Reason,
    ) -> ControlFlow<()> {
        let reason = reason.to_string();
        let written = self.results.cut_back(place, load_factor, next, &reason);
        self.observer.cut_back(place, &reason);
        self.kept(written)
    }

    fn looks_at(&self, when: When<'_>, groups: &[Group]) -> Option<Part> {
        self.results.looks_at(when, groups)
    }

    fn increment(&mut self, increment: &Increment, state: &Snapshot<'_>) -> ControlFlow<()> {
        let written = self.results.increment(increment, state);
        if written.is_ok() {
            let place = &increment.place;
            self.observer
                .increment(place, increment.of, increment.iterations);
            if let Some(report) = &mut self.report
                && report.write_if_due().is_err()
            {
                // A run does not end for its sake; the report at the end says what is wrong.
                self.report = None;
            }
        }
        self.kept(written)
    }

    fn step(
        &mut self,
        place: &Place,
        load_factor: f64,
        iterations: usize,
        state: &Snapshot<'_>,
    ) -> ControlFlow<()> {
        let written = self.results.step(place, load_factor, iterations, state);
        self.kept(written)
    }

    fn last_equilibrium(
        &mut self,
        place: &Place,
        load_factor: f64,
        time: f64,
        state: &Snapshot<'_>,
    ) {
        // What led here matters more than trouble with the state before it.
        let _ = self
            .results
            .last_equilibrium(place, load_factor, time, state);
    }

    fn at_rest(&mut self, phase: &str, share: f64) {
        self.results.at_rest(phase, share);
        self.observer.at_rest(phase, share);
    }

    fn quantity(&mut self, phase: &str, name: &str, state: &Snapshot<'_>) -> Option<f64> {
        self.results.quantity(phase, name, state)
    }

    fn reached(&mut self, end: &Reached) {
        self.observer.note(&end.to_string());
    }

    fn phase_ends(&mut self, record: PhaseRecord) {
        self.results.phase(record);
    }

    fn warning(&mut self, warning: &Warning) {
        if was_said(warning) {
            return;
        }
        let message = warning.to_string();
        if !(warning.is_said_once() && self.warnings.contains(&message)) {
            self.say(&message);
        }
    }

    fn wants_state(&self, stops: bool) -> bool {
        stops || self.keeper.is_due()
    }

    fn state(&mut self, state: &State<'_>) -> ControlFlow<()> {
        let kept = self.keeper.keep(state, &self.results, &self.warnings);
        self.kept(kept)
    }

    fn stop(&self) -> Stop {
        self.stop.clone()
    }
}

/// What must be the same for a study of a case to go on.
pub(crate) fn identity_of(case: &Case) -> Result<String, Error> {
    let Posed {
        laws, mesh_file, ..
    } = case.pose()?;
    Ok(identity(case, &laws, mesh_file.as_ref()))
}

/// What must be the same for a run to go on: the program, the case with its variant, the bytes of
/// its mesh, of its libraries and of their sidecars, and the parameters.
fn identity(case: &Case, laws: &Laws, mesh: Option<&MeshFile>) -> String {
    let mut text = format!("pilum {}\n", env!("CARGO_PKG_VERSION"));
    text += case.variant.as_deref().unwrap_or_default();
    text += "\n";
    for ((name, hypothesis), built) in laws {
        let library = built.law.library();
        let (sha256, sidecar) = (library.sha256(), library.sidecar_sha256());
        // What a sidecar says of a library is not part of its bytes.
        let sidecar = sidecar.unwrap_or_default();
        let _ = writeln!(text, "{name} {hypothesis} {sha256} {sidecar}");
        for parameter in &built.parameters {
            let _ = writeln!(text, "{} {:x}", parameter.id, parameter.value.to_bits());
        }
    }
    if let Some(mesh) = mesh {
        let _ = writeln!(text, "{}", mesh.sha256);
    }
    let _ = writeln!(text, "{:?}", case.file.chosen);
    text += case.source.text();
    hexadecimal_sha256(text.as_bytes())
}
