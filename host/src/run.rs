//! Running a case: phases, increments, cut-back and regrowth, results.

mod beyond;
mod history;
mod keeper;
mod method;
mod path;
mod start;
mod statics;

use crate::assembly::{Bodies, Places, System, fold};
use crate::capsule::{self, Capsule};
use crate::case::{Axis, Case, CaseFile, Control, Equations, Method, PhaseInput, SolverInput};
use crate::checkpoint::{PhaseCourse, RunState, identity};
use crate::custody;
use crate::error::{Error, Place};
use crate::group::{Group, GroupLaw};
use crate::mesh::Mesh;
use crate::model::{Model, unit_pressure};
use crate::output::{Figures, IncrementRecord, PhaseRecord, Results, check_figures};
use crate::plugin::{Library, Moment};
use crate::probe::{Probes, Snapshot};
use crate::solver::{
    Costs, Guess, LinearDomain, Loads, LookedAt, Matrix, Newton, ROUND_OFF, Reuse, Runaway,
    StepFailure, StepSuccess, norm,
};
use crate::stop::Stop;
use algebra::{LinearSolver, Singular, mesh_lines};
use beyond::Beyond;
pub(crate) use history::History;
use keeper::Keeper;
use path::PathEnd;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

/// Progress of a run, for whoever shows it.
pub trait Observer {
    /// A phase begins.
    fn phase(&mut self, name: &str, increments: usize);
    /// An increment reached equilibrium.
    fn increment(&mut self, place: &Place, of: usize, iterations: usize);
    /// An increment is repeated with smaller steps.
    fn cut_back(&mut self, place: &Place, reason: &str);
    /// Something the user should know.
    fn warning(&mut self, message: &str);
    /// An earlier run is gone on with after this increment; `None`: it had come to its end.
    fn resumed(&mut self, _from: Option<&Place>) {}
    /// Who may want the run to stop: after the increment under way, or within it if that takes
    /// long.
    fn stop(&self) -> Stop {
        Stop::never()
    }
}

/// How a run begins, and what it keeps to go on from.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Go on from the checkpoint in the folder, if there is one.
    pub resume: bool,
    /// Time between checkpoints; `None`: there are none.
    pub checkpoints: Option<Duration>,
}

/// Step, as a fraction of an increment, below which arc-length control takes over, if a step may
/// be halved so often.
const PATIENCE: f64 = 0.2;
/// Fastest growth of steps after a cut-back.
const REGROWTH: f64 = 2.0;
/// Share of the method's own limit of iterations up to which a step counts as easy, so that the
/// next one may be larger.
const EASY: f64 = 0.34;
/// Smallest and largest reduction of a step at a cut-back.
const CUT: [f64; 2] = [0.1, 0.5];

/// Checks everything about a case that can be checked without running it.
///
/// # Errors
/// [`Error::Input`] or [`Error::Plugin`].
pub fn check(case: &Case) -> Result<(), Error> {
    let model = Model::build(case)?;
    let probes = Probes::new(case, &model)?;
    check_figures(case, &probes)
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
/// As [`run`]; a checkpoint to go on from that is damaged or belongs to another run;
/// [`Error::Interrupted`].
pub fn run_reusing(
    case: &Case,
    folder: &Path,
    observer: &mut dyn Observer,
    reuse: &mut Reuse,
    options: Options,
) -> Result<Figures, Error> {
    let started = Instant::now();
    let model = Model::build(case)?;
    let probes = Probes::new(case, &model)?;
    check_figures(case, &probes)?;
    let mut observer = Noting {
        observer,
        warnings: Vec::new(),
    };
    let mut keeper = Keeper::new(identity(case, &model), folder, options.checkpoints);
    let found = if options.resume {
        keeper.found()?
    } else {
        None
    };
    let (mut results, state) = if let Some(checkpoint) = found {
        let from = checkpoint.place(case);
        let Some(state) = checkpoint.run else {
            checkpoint.results.check(folder)?;
            observer.resumed(None);
            return Ok(checkpoint.results.figures(case, &probes));
        };
        observer.resumed(from.as_ref());
        observer.warnings = checkpoint.warnings.into_owned();
        let results = Results::resume(folder, case, &model, &probes, checkpoint.results)?;
        (results, Some(state))
    } else {
        let of_laws = model.laws.values().flat_map(|law| &law.warnings);
        for warning in of_laws.chain(&model.warnings) {
            observer.warning(warning);
        }
        (Results::create(folder, case, &model, &probes)?, None)
    };
    let mut run = Run::new(case, model, probes, reuse);
    run.stop = observer.stop();
    let outcome = run.phases(state, &mut results, &mut observer, &mut keeper);
    for warning in run
        .beyond
        .warnings()
        .into_iter()
        .chain(results.unreliable())
    {
        observer.warning(&warning);
    }
    let error = outcome.as_ref().err();
    let finished = results.finish(&run.groups, started.elapsed(), &observer.warnings, error);
    let is_done = outcome.is_ok();
    outcome.and(finished)?;
    if is_done {
        keeper.end(&results, &observer.warnings)?;
    }
    Ok(results.figures().clone())
}

/// An observer that also keeps the warnings, for the summary.
struct Noting<'a> {
    observer: &'a mut dyn Observer,
    warnings: Vec<String>,
}

impl Noting<'_> {
    /// A warning, unless it has been given.
    fn warning_once(&mut self, message: &str) {
        if !self.warnings.iter().any(|given| given == message) {
            self.warning(message);
        }
    }
}

impl Observer for Noting<'_> {
    fn phase(&mut self, name: &str, increments: usize) {
        self.observer.phase(name, increments);
    }

    fn increment(&mut self, place: &Place, of: usize, iterations: usize) {
        self.observer.increment(place, of, iterations);
    }

    fn cut_back(&mut self, place: &Place, reason: &str) {
        self.observer.cut_back(place, reason);
    }

    fn warning(&mut self, message: &str) {
        self.warnings.push(message.to_owned());
        self.observer.warning(message);
    }

    fn resumed(&mut self, from: Option<&Place>) {
        self.observer.resumed(from);
    }

    fn stop(&self) -> Stop {
        self.observer.stop()
    }
}

struct Run<'a> {
    case: &'a Case,
    mesh: Mesh,
    groups: Vec<Group>,
    model: ModelRest,
    probes: Probes,
    /// Groups and degrees of freedom that the probes look at.
    looked_at: (Vec<bool>, Vec<usize>),
    /// Displacements by degree of freedom, as counted since the last reset.
    displacement: Vec<f64>,
    /// Prescribed displacements by degree of freedom.
    prescribed: BTreeMap<usize, f64>,
    /// Pressures by line.
    pressure: BTreeMap<String, f64>,
    /// External forces.
    force: Vec<f64>,
    /// Pseudo-time: one unit for every phase.
    time: f64,
    /// Largest of the forces (2-norms) at the start of any phase so far.
    largest_force: f64,
    /// The same at every degree of freedom.
    largest_forces: Vec<f64>,
    /// Results that the theory does not cover.
    beyond: Beyond,
    /// Rotations call forth no stresses in any group.
    turns_freely: bool,
    /// Factors of linear parts.
    reuse: &'a mut Reuse,
    /// Who may want it to stop.
    stop: Stop,
}

/// The equations of one phase.
#[derive(Debug)]
struct PhaseEquations {
    /// Unknowns of the groups that iterate.
    system: System,
    places: Places,
    /// The groups that do not.
    domain: Option<LinearDomain>,
    solver: LinearSolver,
    /// What the solver holds factorised.
    matrix: Matrix,
    /// What the residual of the last step was measured against, by body, and its tolerance; nothing
    /// before the first step.
    measured: Option<(Vec<f64>, f64)>,
    /// Forces out of balance at the start, relative to the forces in play.
    out_of_balance: f64,
    n_unknowns: usize,
    /// Factorisations and fallbacks in the phase that the solver does not count, modulo 2⁶⁴.
    counted: [u64; 2],
}

impl PhaseEquations {
    fn n(&self) -> usize {
        self.n_unknowns
    }

    /// Factorisations and fallbacks since the equations were set up.
    fn counts(&self) -> [u64; 2] {
        let domain = self.domain.as_ref().is_some_and(|domain| domain.factorised);
        let factorisations = self.solver.factorisations + u64::from(domain);
        [factorisations, self.solver.fallbacks]
    }

    /// The record of the phase with all that has been counted.
    fn counted_in(&self, record: &PhaseRecord) -> PhaseRecord {
        let [factorisations, fallbacks] = self.counts();
        PhaseRecord {
            factorisations: self.counted[0].wrapping_add(factorisations),
            fallbacks: self.counted[1].wrapping_add(fallbacks),
            ..record.clone()
        }
    }
}

/// What is left of a model once mesh and groups are taken out.
struct ModelRest {
    ties: Vec<crate::assembly::Tie>,
    swaps: Vec<Vec<(usize, GroupLaw)>>,
}

impl<'a> Run<'a> {
    fn new(case: &'a Case, model: Model, probes: Probes, reuse: &'a mut Reuse) -> Self {
        let Model {
            mesh,
            groups,
            ties,
            swaps,
            ..
        } = model;
        let n_dofs = 2 * mesh.nodes.len();
        let looked_at = probes.looks_at(&groups);
        let turns_freely = groups.iter().all(|group| turns_freely(group, &mesh.nodes));
        let mut run = Self {
            case,
            mesh,
            groups,
            model: ModelRest { ties, swaps },
            probes,
            looked_at,
            displacement: vec![0.0; n_dofs],
            prescribed: BTreeMap::new(),
            pressure: BTreeMap::new(),
            force: vec![0.0; n_dofs],
            time: 0.0,
            largest_force: 0.0,
            beyond: Beyond::default(),
            largest_forces: vec![0.0; n_dofs],
            turns_freely,
            reuse,
            stop: Stop::never(),
        };
        run.beyond.knows(&run.groups);
        for support in &case.file.supports {
            for dof in run.dofs(support.line.get_ref(), &support.fixed) {
                run.prescribed.insert(dof, 0.0);
            }
        }
        run
    }

    fn file(&self) -> &'a CaseFile {
        &self.case.file
    }

    /// The settings of the solver, with the method that suits the laws of the present phase.
    fn solver(&self) -> SolverInput {
        let given = self.file().solver;
        SolverInput {
            method: method::resolved(given.method, &self.groups),
            ..given
        }
    }

    /// Passes on what laws have to say beside their answers.
    fn pass_on_notes(&self, observer: &mut Noting<'_>) {
        for group in &self.groups {
            for note in group.law.built.law.take_notes() {
                observer.warning(&note);
            }
        }
    }

    /// Degrees of freedom of a line's nodes.
    fn dofs(&self, line: &str, components: &[Axis]) -> Vec<usize> {
        let nodes = self
            .mesh
            .lines
            .get(line)
            .map_or(&[][..], |line| &line.nodes);
        let offset = |axis: &Axis| usize::from(*axis == Axis::Y);
        nodes
            .iter()
            .flat_map(|&n| components.iter().map(move |c| 2 * n + offset(c)))
            .collect()
    }

    fn phases(
        &mut self,
        state: Option<RunState<'_>>,
        results: &mut Results,
        observer: &mut Noting<'_>,
        keeper: &mut Keeper,
    ) -> Result<(), Error> {
        let file = self.file();
        let first = state.as_ref().map_or(0, |state| state.phase);
        let mut course = match state {
            Some(state) => Some(self.restore(state)?),
            None => None,
        };
        for (number, phase) in file.phases.iter().enumerate().skip(first) {
            observer.phase(phase.name.get_ref(), *phase.increments.get_ref());
            self.phase(number, course.take(), results, observer, keeper)?;
        }
        Ok(())
    }

    fn phase(
        &mut self,
        number: usize,
        course: Option<PhaseCourse>,
        results: &mut Results,
        observer: &mut Noting<'_>,
        keeper: &mut Keeper,
    ) -> Result<(), Error> {
        let phase = &self.file().phases[number];
        let name = phase.name.get_ref();
        let loads = match &course {
            Some(course) => course.loads.clone(),
            None => self.begin(number, phase, results, observer)?,
        };
        let is_prescribed: Vec<bool> = (0..self.displacement.len())
            .map(|dof| self.prescribed.contains_key(&dof))
            .collect();
        let (mut equations, loads) = self
            .equations(number, &is_prescribed, loads, course.as_ref())
            .map_err(|Singular| Error::NoEquilibrium {
                message: format!("phase `{name}`: the equations are singular"),
                hint: Some("a part of the model is not supported".to_owned()),
            })?;
        let course = course.unwrap_or_else(|| {
            let imbalance = equations.out_of_balance;
            if imbalance > 1e-6 {
                observer.warning(&format!(
                    "phase `{name}` starts out of balance: {:.2} % of the forces in play, carried \
                     to equilibrium in its course",
                    100.0 * imbalance
                ));
            }
            PhaseCourse {
                loads,
                increment: 0,
                lambda: 0.0,
                step: 1.0 / *phase.increments.get_ref() as f64,
                history: History::default(),
                domain: None,
                has_matrix: false,
                largest: 0.0,
                record: PhaseRecord {
                    method: self.solver().method,
                    ..PhaseRecord::new(name, equations.n(), imbalance)
                },
            }
        });
        if let Some(why) = method::reason(self.file().solver.method, &self.groups) {
            observer.warning_once(&why);
        }
        let mut record = course.record.clone();
        let outcome = self.increments(
            number,
            course,
            &mut equations,
            &mut record,
            results,
            (observer, keeper),
        );
        self.pass_on_notes(observer);
        let of_domain = equations
            .domain
            .as_ref()
            .map_or(0.0, |d| d.standing().round_off);
        let round_off = of_domain.max(record.round_off);
        if round_off > 0.0 {
            observer.warning(&format!(
                "phase `{name}`: `force_tolerance` {:.1e} is below round-off: a residual of \
                 {round_off:.1e} is left, which is the last bit of the displacements",
                self.file().solver.force_tolerance
            ));
        }
        self.time += 1.0;
        let (mesh, analysis) = (&self.mesh, self.file().analysis);
        self.beyond
            .look(mesh, analysis, &self.groups, &self.displacement);
        results.phase(equations.counted_in(&record));
        outcome
    }

    fn increments(
        &mut self,
        number: usize,
        mut course: PhaseCourse,
        equations: &mut PhaseEquations,
        record: &mut PhaseRecord,
        results: &mut Results,
        (observer, keeper): (&mut Noting<'_>, &mut Keeper),
    ) -> Result<(), Error> {
        let phase = &self.file().phases[number];
        let n = *phase.increments.get_ref();
        for increment in course.increment + 1..=n {
            for group in &mut self.groups {
                group.moment = Moment {
                    step: self.time as u32 + 1,
                    increment: increment as u32,
                    step_start: self.time,
                };
            }
            let place = Place {
                phase: phase.name.get_ref().clone(),
                increment,
            };
            let reached = self.reach(&place, n, &mut course, equations, record, results, observer);
            let lambda = course.lambda;
            let mut done = match reached {
                Ok(done) => done,
                Err(error) => {
                    let _ = custody::restore();
                    // What led here matters more than trouble with the state before it.
                    let _ = self.last_equilibrium(&place, equations, &course, record, results);
                    return Err(error);
                }
            };
            let looked_at = results.looks_at(&place, n, &self.looked_at.0, &self.groups);
            let reaction = self
                .complete(
                    equations,
                    &course.loads,
                    lambda,
                    looked_at.as_deref(),
                    record,
                )
                .map_err(|why| {
                    Self::no_equilibrium(&place, lambda, n, &StepFailure::because(why), None)
                })?;
            custody::restore()
                .map_err(|why| Error::plugin(format!("{place}: {why}")))?
                .iter()
                .for_each(|change| observer.warning(&format!("{place}: {change}")));
            let snapshot = self.snapshot(&reaction);
            done.probes = self.probes.values(&snapshot);
            self.probes.check(self.case, &place, &done.probes)?;
            done.time = self.time + lambda;
            record.iterations += done.iterations;
            record.increments += 1;
            results.increment(&place, n, &done, &snapshot, &self.mesh)?;
            observer.increment(&place, n, done.iterations);
            course.increment = increment;
            let stops = self.stop.is_asked();
            if stops || keeper.is_due() {
                course.domain = equations.domain.as_ref().map(|d| d.standing().clone());
                course.has_matrix = equations.matrix.is_kept(self.solver().method);
                course.largest = equations.matrix.largest();
                course.record = equations.counted_in(record);
                keeper.keep(self.state(number, &course), results, &observer.warnings)?;
                course.domain = None;
            }
            if stops {
                return Err(Error::Interrupted { place });
            }
        }
        Ok(())
    }

    /// What probes and results look at.
    fn snapshot<'s>(&'s self, reaction: &'s [f64]) -> Snapshot<'s> {
        Snapshot {
            groups: &self.groups,
            ties: &self.model.ties,
            displacement: &self.displacement,
            reaction,
        }
    }

    /// Writes the last state of equilibrium of a phase that cannot go on.
    fn last_equilibrium(
        &mut self,
        place: &Place,
        equations: &mut PhaseEquations,
        course: &PhaseCourse,
        record: &mut PhaseRecord,
        results: &mut Results,
    ) -> Result<(), Error> {
        let lambda = course.lambda;
        let reaction = self
            .complete(equations, &course.loads, lambda, None, record)
            .map_err(Error::Internal)?;
        let snapshot = self.snapshot(&reaction);
        let probes = self.probes.values(&snapshot);
        results.last_equilibrium(
            place,
            lambda,
            self.time + lambda,
            probes,
            &snapshot,
            &self.mesh,
        )
    }

    /// Steps up to the end of an increment, one of `n`; as many as it takes.
    #[expect(clippy::too_many_arguments, reason = "what a phase works on, apart")]
    fn reach(
        &mut self,
        place: &Place,
        n: usize,
        course: &mut PhaseCourse,
        equations: &mut PhaseEquations,
        record: &mut PhaseRecord,
        results: &mut Results,
        observer: &mut Noting<'_>,
    ) -> Result<IncrementRecord, Error> {
        let settings = self.solver();
        let easy = EASY * settings.method.max_iterations() as f64;
        let smallest = 1.0 / n as f64 / f64::powi(2.0, settings.max_halvings as i32);
        let target = if place.increment == n {
            1.0
        } else {
            place.increment as f64 / n as f64
        };
        let mut done = IncrementRecord::default();
        while course.lambda < target {
            let (start, step) = (course.lambda, course.step);
            // A remainder that is hardly longer than the step is taken at once.
            let end = if target - start <= 1.0001 * step {
                target
            } else {
                start + step
            };
            let length = end - start;
            let guess = course.history.guess(length);
            let attempt = self.attempt(&course.loads, [start, end], guess, equations, record);
            match self.without_leap(attempt, course, equations, length) {
                Ok(success) => {
                    if success.relaxed {
                        record.relaxed += 1;
                        observer.warning(&format!(
                            "{place}: Newton iterations came to a standstill; viscous relaxation \
                             led to the next equilibrium; others may lie near, and which one is \
                             found depends on the course of the relaxation: run it with other \
                             increments, or in another unit of stress, and hold the results against \
                             each other"
                        ));
                    }
                    if success.iterations.len() as f64 <= easy {
                        course.step = (REGROWTH * step).min(1.0 / n as f64);
                    }
                    self.take_over(
                        success, end, place, course, equations, record, results, &mut done,
                    )?;
                }
                Err(failure) if failure.is_stop => return Err(Self::stopped(place)),
                Err(failure) => {
                    results.iterations(place, end, &failure.iterations)?;
                    done.iterations += failure.iterations.len();
                    record.cut_backs += 1;
                    let factor = failure.factor.unwrap_or(CUT[1]).clamp(CUT[0], CUT[1]);
                    course.step = factor * length;
                    results.cut_back(place, end, course.step, &failure.reason)?;
                    observer.cut_back(place, &failure.reason);
                    let follows =
                        settings.control == Control::ArcLength && course.history.latest().is_some();
                    if failure.defect.is_some() {
                        return Err(self.cannot_go_on(place, start, n, &failure, results)?);
                    } else if follows && course.step < smallest.max(PATIENCE / n as f64) {
                        let goal = [n as f64, target];
                        let end = self.follow_path(
                            place, goal, course, equations, record, results, observer, &mut done,
                        )?;
                        if let PathEnd::Stopped(failure, highest) = end {
                            return Err(self.cannot_go_on(place, highest, n, &failure, results)?);
                        }
                    } else if course.step < smallest {
                        return Err(self.cannot_go_on(place, start, n, &failure, results)?);
                    }
                }
            }
        }
        Ok(done)
    }

    /// Takes over a step that reached equilibrium at load factor λ, with all that is to be said of
    /// it.
    #[expect(clippy::too_many_arguments, reason = "what a phase works on, apart")]
    fn take_over(
        &mut self,
        success: StepSuccess,
        lambda: f64,
        place: &Place,
        course: &mut PhaseCourse,
        equations: &mut PhaseEquations,
        record: &mut PhaseRecord,
        results: &mut Results,
        done: &mut IncrementRecord,
    ) -> Result<(), Error> {
        let iterations = success.iterations.len();
        results.iterations(place, lambda, &success.iterations)?;
        done.iterations += iterations;
        record.round_off = record.round_off.max(success.round_off);
        if let Some(why) = &success.unreliable {
            record.unreliable += 1;
            done.warning.get_or_insert_with(|| why.clone());
        }
        self.accept(&success, &course.loads, equations, lambda);
        course.history.add(lambda - course.lambda, success);
        course.lambda = lambda;
        if self.file().solver.control == Control::ArcLength {
            self.write_step(place, course, equations, record, results, iterations)?;
        }
        Ok(())
    }

    /// The error of an increment that was stopped on its way.
    fn stopped(place: &Place) -> Error {
        Error::Stopped {
            message: format!(
                "{place}: stopped as asked, within the increment; everything before it is written"
            ),
            hint: Some(
                "the last equilibrium is `stopped_at` in summary.json; go on with --resume"
                    .to_owned(),
            ),
        }
    }

    /// The error of a phase that ends at load factor λ, with the call of the law that failed.
    fn cannot_go_on(
        &self,
        place: &Place,
        lambda: f64,
        n: usize,
        failure: &StepFailure,
        results: &Results,
    ) -> Result<Error, Error> {
        let kept = self.keep_capsule(place, failure, results)?;
        if let Some(defect) = &failure.defect {
            return Ok(Error::Plugin {
                message: format!("{place}: {defect}"),
                hint: kept,
            });
        }
        let broken = failure.failed.as_ref().filter(|point| {
            let mut groups = self.groups.iter();
            let group = groups.find(|group| group.name == point.group);
            group.is_some_and(|group| group.law.built.law.breaks_down(&point.failure))
        });
        if let Some(broken) = broken {
            return Ok(Error::Plugin {
                message: format!("{place}: {broken}\n  however small the step"),
                hint: kept,
            });
        }
        let hint = kept.or_else(|| self.suspicion(failure));
        let known = [self.what_ran_away(failure), failure.culprit.clone()];
        let known: Vec<String> = known.into_iter().flatten().collect();
        let failure = StepFailure {
            culprit: (!known.is_empty()).then(|| known.join("\n  ")),
            ..failure.clone()
        };
        Ok(Self::no_equilibrium(place, lambda, n, &failure, hint))
    }

    /// The displacement that ran away in a failed step, in words.
    fn what_ran_away(&self, failure: &StepFailure) -> Option<String> {
        let Runaway { dof, increment } = failure.runaway?;
        let node = dof / 2;
        let of_node = |group: &&Group| {
            let mut elements = 0..group.kinematics.n_elements();
            elements.any(|element| group.kinematics.nodes(element).contains(&node))
        };
        let groups = self.groups.iter().filter(of_node);
        let groups: Vec<String> = groups.map(|group| format!("`{}`", group.name)).collect();
        let [x, y] = self.mesh.nodes[node];
        let axis = if dof.is_multiple_of(2) { "x" } else { "y" };
        Some(format!(
            "the displacement in {axis} ran away: {increment:.1e} m in one step at node ({x:.4}, \
             {y:.4}), group {}: a mechanism, which next to nothing resists",
            groups.join(", ")
        ))
    }

    /// Where to look if a law of the user's own may have kept the iterations from converging: a
    /// wrong tangent does that.
    fn suspicion(&self, failure: &StepFailure) -> Option<String> {
        let asks_for_tangents = self.solver().method != Method::InitialStress;
        let iterates = failure.failed.is_none() && !failure.iterations.is_empty();
        let mut libraries: Vec<&Path> = self
            .groups
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

    /// One step; from a guess if there is one, else from the tangent.
    fn attempt(
        &mut self,
        loads: &Loads,
        [from, to]: [f64; 2],
        guess: Option<Guess>,
        equations: &mut PhaseEquations,
        record: &mut PhaseRecord,
    ) -> Result<StepSuccess, StepFailure> {
        let settings = self.solver();
        let mut newton = Newton::new(
            (&equations.system, &equations.places),
            equations.domain.as_ref(),
            (&mut equations.solver, &mut equations.matrix),
            &mut self.groups,
            &settings,
            &mut record.costs,
        );
        newton = newton.stopped_by(&self.stop);
        newton.step(loads, from, to, self.time + from, guess)
    }

    /// Takes over a step: the groups that took part in it, and the displacements they know.
    fn accept(
        &mut self,
        success: &StepSuccess,
        loads: &Loads,
        equations: &mut PhaseEquations,
        lambda: f64,
    ) {
        for (number, group) in self.groups.iter_mut().enumerate() {
            if equations.system.includes(number) {
                group.commit();
            }
        }
        let tolerance = self.file().solver.force_tolerance.max(success.round_off);
        equations.measured = Some((success.scales.clone(), tolerance));
        if let Some(domain) = &mut equations.domain {
            let boundary = equations.places.boundary.iter();
            let moved: Vec<f64> = boundary.map(|&place| success.increment[place]).collect();
            domain.follow(&moved);
        }
        let places = &equations.places;
        places.add(&success.increment, &mut self.displacement);
        let ends = loads.force_start.iter().zip(&loads.force_end);
        for (force, (start, end)) in self.force.iter_mut().zip(ends) {
            *force = start + lambda * (end - start);
        }
        if lambda >= 1.0 {
            // Totals that were asked for are met exactly, whatever the increments added up to.
            for &(dof, _, end) in &loads.prescribed {
                self.displacement[dof] = end;
            }
        }
    }

    /// Completes the state at load factor λ: what a linear domain left out of the iterations, and
    /// the reactions (internal less external forces, by degree of freedom). Where only some groups
    /// are `looked_at`, the rest of the domain may stay where it was.
    ///
    /// # Errors
    /// Why the domain is not in equilibrium.
    fn complete(
        &mut self,
        equations: &mut PhaseEquations,
        loads: &Loads,
        lambda: f64,
        looked_at: Option<&[bool]>,
        record: &mut PhaseRecord,
    ) -> Result<Vec<f64>, String> {
        let started = Instant::now();
        let mut reaction = vec![0.0; self.displacement.len()];
        for (number, group) in self.groups.iter().enumerate() {
            if equations.system.includes(number) {
                let stress = &group.stress.committed;
                group.kinematics.add_forces(stress, &mut reaction);
            }
        }
        fold(&self.model.ties, &mut reaction);
        // Where a part of a domain is looked at, the forces on its boundary stand for the rest.
        let mut beside = None;
        if let Some(domain) = &mut equations.domain {
            let tolerance = self.case.file.solver.force_tolerance;
            let looked_at = looked_at.map(|groups| LookedAt {
                groups,
                dofs: &self.looked_at.1,
            });
            let (groups, displacement) = (&mut self.groups, &mut self.displacement);
            let internal =
                domain.bring_up(looked_at, groups, loads, lambda, displacement, tolerance)?;
            beside = domain.forces_beside();
            if beside.is_none() {
                for (reaction, internal) in reaction.iter_mut().zip(&internal) {
                    *reaction += internal;
                }
            }
            self.check_balance(equations, loads, lambda, &reaction, beside.as_deref())?;
            if beside.is_some() {
                for (reaction, internal) in reaction.iter_mut().zip(&internal) {
                    *reaction += internal;
                }
            }
        } else {
            self.check_balance(equations, loads, lambda, &reaction, beside.as_deref())?;
        }
        equations.system.follow(&mut self.displacement);
        for (force, external) in reaction.iter_mut().zip(&self.force) {
            *force -= external;
        }
        record.costs.laws += started.elapsed();
        Ok(reaction)
    }

    /// Holds reactions against loads, by the internal forces of the groups that were evaluated and
    /// those that the domain `beside` them takes.
    ///
    /// # Errors
    /// What does not balance.
    fn check_balance(
        &self,
        equations: &PhaseEquations,
        loads: &Loads,
        lambda: f64,
        internal: &[f64],
        beside: Option<&[(usize, f64)]>,
    ) -> Result<(), String> {
        let Some((scales, tolerance)) = &equations.measured else {
            return Ok(());
        };
        let mut external = loads.external(lambda);
        for &(dof, force) in beside.unwrap_or_default() {
            external[dof] -= force;
        }
        let mut is_free = vec![false; external.len()];
        let of_domain = equations.domain.iter().filter(|_| beside.is_none());
        let of_domain = of_domain.flat_map(LinearDomain::unknowns);
        for &dof in equations.system.free().iter().chain(of_domain) {
            is_free[dof] = true;
        }
        let supports = || {
            let prescribed = self.prescribed.keys();
            prescribed.map(|&dof| (dof, internal[dof]))
        };
        let unknowns = || {
            let numbered = is_free.iter().enumerate().filter(|(_, is_free)| **is_free);
            numbered.map(|(dof, _)| (dof, external[dof]))
        };
        // Supports may be those of several bodies: they are added up together.
        let bound = statics::Bound {
            scale: scales.iter().copied().fold(0.0, f64::hypot),
            tolerance: *tolerance,
            with_domain: equations.domain.is_some() && beside.is_none(),
            last_bit: equations
                .domain
                .iter()
                .filter(|_| beside.is_none())
                .map(|domain| domain.stiffest * norm(&self.displacement))
                .sum(),
        };
        let model = statics::Model {
            analysis: self.case.file.analysis,
            nodes: &self.mesh.nodes,
            turns_freely: self.turns_freely,
        };
        match statics::complaint(model, supports(), unknowns(), bound) {
            None => Ok(()),
            Some(complaint) => Err(complaint),
        }
    }

    /// Loads of a phase; takes over its changes of constraints.
    fn loads(&mut self, phase: &PhaseInput) -> Loads {
        if phase.reset_displacements {
            self.displacement.fill(0.0);
            self.prescribed.values_mut().for_each(|value| *value = 0.0);
        }
        for input in &phase.free {
            for dof in self.dofs(input.line.get_ref(), &input.components) {
                self.prescribed.remove(&dof);
            }
        }
        for input in &phase.displacement {
            for (value, axis) in [(input.x, Axis::X), (input.y, Axis::Y)] {
                if let Some(value) = value {
                    for dof in self.dofs(input.line.get_ref(), &[axis]) {
                        self.prescribed.insert(dof, value);
                    }
                }
            }
        }
        let force_start = self.force.clone();
        for input in &phase.pressure {
            self.pressure
                .insert(input.line.get_ref().clone(), input.value);
        }
        let mut force_end = vec![0.0; self.displacement.len()];
        for (line, value) in &self.pressure {
            if let Some(line) = self.mesh.lines.get(line) {
                let unit = unit_pressure(self.case.file.analysis, &self.mesh, &line.edges);
                force_end
                    .iter_mut()
                    .zip(unit)
                    .for_each(|(force, unit)| *force += value * unit);
            }
        }
        Loads {
            force_start,
            force_end,
            prescribed: self
                .prescribed
                .iter()
                .map(|(&dof, &end)| (dof, self.displacement[dof], end))
                .collect(),
            out_of_balance: Vec::new(),
            scale: 0.0,
            largest: Vec::new(),
        }
    }

    /// The equations of a phase, at its start or where it stands; the loads with what is out of
    /// balance at its start.
    fn equations(
        &mut self,
        number: usize,
        is_prescribed: &[bool],
        mut loads: Loads,
        course: Option<&PhaseCourse>,
    ) -> Result<(PhaseEquations, Loads), Singular> {
        let (case, groups, ties) = (self.case, &self.groups, &self.model.ties);
        let lines = mesh_lines(&self.mesh.nodes);
        self.reuse.is_last_phase = number + 1 == case.file.phases.len();
        let wanted = case.file.solver.equations;
        let condensed = if wanted == Equations::Sparse {
            None
        } else {
            // Groups that are held by the others alone cannot be condensed.
            let always = wanted == Equations::Condensed;
            let reuse = Some(&mut *self.reuse);
            LinearDomain::new(groups, is_prescribed, ties, &lines, always, reuse).unwrap_or(None)
        };
        self.reuse.forget();
        let (system, mut domain) = match condensed {
            Some((domain, system)) => (system, Some(domain)),
            None => (
                System::new(groups, |_| true, is_prescribed, ties, None),
                None,
            ),
        };
        let all_symmetric = groups
            .iter()
            .all(|group| group.is_linear() && group.is_symmetric());
        let symmetric = domain.is_none() && all_symmetric;
        let own_lines = system.lines(&lines);
        let own_lines = Some(own_lines.as_slice());
        let solver = match &domain {
            Some(domain) => {
                LinearSolver::with_block(&system.pattern, own_lines, domain.block(&system))?
            }
            None => LinearSolver::new(&system.pattern, symmetric, own_lines)?,
        };
        #[cfg(unix)]
        crate::memory::expect(solver.bytes(), "factorising the equations");
        let mut unknowns = system.free().to_vec();
        unknowns.extend(domain.iter().flat_map(LinearDomain::unknowns));
        unknowns.sort_unstable();
        unknowns.dedup();
        let out_of_balance = match course {
            Some(course) => course.record.out_of_balance,
            None => self.out_of_balance(&unknowns, &mut loads),
        };
        let standing = course.and_then(|course| course.domain.as_ref());
        if let Some(domain) = &mut domain {
            match standing {
                Some(standing) => domain.restart(&self.groups, &loads, standing),
                None => domain.start(&self.groups, &loads, &self.displacement),
            }
        }
        let bodies = Bodies::new(
            &self.groups,
            &self.model.ties,
            &self.mesh.nodes,
            is_prescribed,
        );
        let mut equations = PhaseEquations {
            places: Places::new(&system, is_prescribed).of(&bodies, &system),
            system,
            domain,
            solver,
            matrix: Matrix::resumed(course.map_or(0.0, |course| course.largest)),
            measured: None,
            out_of_balance,
            n_unknowns: unknowns.len(),
            counted: [0; 2],
        };
        if let Some(course) = course {
            if course.has_matrix {
                let settings = self.solver();
                let restored = Newton::new(
                    (&equations.system, &equations.places),
                    equations.domain.as_ref(),
                    (&mut equations.solver, &mut equations.matrix),
                    &mut self.groups,
                    &settings,
                    &mut Costs::default(),
                )
                .restore_matrix();
                restored.map_err(|_| Singular)?;
            }
            // What was counted before counts on, without what it took to get here again.
            let [factorisations, fallbacks] = equations.counts();
            equations.counted = [
                course.record.factorisations.wrapping_sub(factorisations),
                course.record.fallbacks.wrapping_sub(fallbacks),
            ];
        }
        Ok((equations, loads))
    }

    /// Internal less external forces at the start of a phase where nothing holds them (after a
    /// swap of laws, a support given up, an initial stress). Returns their size relative to the
    /// forces in play.
    fn out_of_balance(&mut self, unknowns: &[usize], loads: &mut Loads) -> f64 {
        let n_dofs = self.displacement.len();
        let mut internal = vec![0.0; n_dofs];
        for group in &self.groups {
            group
                .kinematics
                .add_forces(&group.stress.committed, &mut internal);
        }
        fold(&self.model.ties, &mut internal);
        loads.out_of_balance = vec![0.0; n_dofs];
        let (mut rest, mut against_end, mut play) = (0.0, 0.0, 0.0);
        for &dof in unknowns {
            let difference = internal[dof] - loads.force_start[dof];
            loads.out_of_balance[dof] = difference;
            rest += difference * difference;
            against_end += (internal[dof] - loads.force_end[dof]).powi(2);
        }
        for (internal, external) in internal.iter().zip(&loads.force_start) {
            play += f64::max(internal * internal, external * external);
        }
        // Where nothing is left of earlier forces, what remains of them is round-off.
        let left_of = |earlier: f64| ROUND_OFF * earlier / self.case.file.solver.force_tolerance;
        let now = f64::sqrt(play);
        loads.scale = now.max(left_of(self.largest_force));
        let both = internal.iter().zip(&loads.force_start);
        let now_by_dof = both.map(|(internal, external)| internal.abs().max(external.abs()));
        let now_by_dof: Vec<f64> = now_by_dof.collect();
        let earlier = now_by_dof.iter().zip(&self.largest_forces);
        loads.largest = earlier
            .map(|(now, &earlier)| now.max(left_of(earlier)))
            .collect();
        self.largest_force = self.largest_force.max(now);
        for (largest, now) in self.largest_forces.iter_mut().zip(now_by_dof) {
            *largest = largest.max(now);
        }
        // An initial stress that the loads of its own phase balance is in balance.
        let rest = rest.min(against_end);
        if play > 0.0 {
            f64::sqrt(rest) / self.largest_force
        } else {
            0.0
        }
    }

    /// Writes the call of a law that failed for good. Returns what the user can do with it.
    fn keep_capsule(
        &self,
        place: &Place,
        failure: &StepFailure,
        results: &Results,
    ) -> Result<Option<String>, Error> {
        let Some(point) = &failure.failed else {
            return Ok(None);
        };
        let group = self.groups.iter().find(|group| group.name == point.group);
        let number = |n: usize| toml::Value::from(n as i64);
        let mut origin = vec![("case", self.case.source.path().display().to_string().into())];
        origin.extend(
            self.case
                .variant
                .iter()
                .map(|v| ("variant", v.as_str().into())),
        );
        origin.extend([
            ("phase", place.phase.as_str().into()),
            ("increment", number(place.increment)),
            ("group", point.group.as_str().into()),
            ("element", number(point.element)),
            ("point", number(point.point)),
            ("position", point.position.to_vec().into()),
        ]);
        let capsule =
            group.and_then(|group| Capsule::of(&group.law.built.law, &point.failure, origin));
        let Some(capsule) = capsule else {
            return Ok(None);
        };
        let file = results.folder().join(capsule::FILE_NAME);
        capsule.write(&file)?;
        Ok(Some(format!(
            "`pilum replay {}` repeats the call that failed",
            file.display()
        )))
    }

    fn no_equilibrium(
        place: &Place,
        lambda: f64,
        n: usize,
        failure: &StepFailure,
        kept: Option<String>,
    ) -> Error {
        let reached = lambda * n as f64;
        let culprit = failure
            .culprit
            .as_ref()
            .map(|culprit| format!("\n  {culprit}"))
            .unwrap_or_default();
        Error::NoEquilibrium {
            message: format!(
                "{place}: no equilibrium beyond {reached:.4} of {n} increments\n  last attempt: \
                 {}{culprit}",
                failure.reason
            ),
            hint: Some(
                "results up to the last whole increment in equilibrium are written, the last \
                 equilibrium itself is `stopped_at` in summary.json; log.jsonl lists the iterations"
                    .to_owned()
                    + &kept.map_or(String::new(), |kept| format!("; {kept}")),
            ),
        }
    }
}

/// Whether a rotation of all nodes about one of them is no strain in a group's elements.
fn turns_freely(group: &Group, nodes: &[[f64; 2]]) -> bool {
    let Some(&[x, y]) = nodes.first() else {
        return true;
    };
    let gradients = |turn: [f64; 4]| {
        let moved = |node: &[f64; 2]| {
            let (x, y) = (node[0] - x, node[1] - y);
            [turn[0] * x + turn[1] * y, turn[2] * x + turn[3] * y]
        };
        let displacement: Vec<f64> = nodes.iter().flat_map(moved).collect();
        let mut strains = vec![0.0; group.strain.committed.len()];
        group.kinematics.add_gradients(&displacement, &mut strains);
        strains
            .iter()
            .fold(0.0, |largest: f64, e| largest.max(e.abs()))
    };
    // A shear of the same displacements for comparison.
    let (turned, sheared) = (
        gradients([0.0, -1.0, 1.0, 0.0]),
        gradients([0.0, 1.0, 1.0, 0.0]),
    );
    turned <= 1e-6 * sheared.max(1.0)
}
