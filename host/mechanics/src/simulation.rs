//! Leading a problem through its phases: increments, cut-back and regrowth, from equilibrium to
//! equilibrium.

mod beyond;
mod complete;
mod creeping;
mod history;
mod loads;
mod neighbour;
mod path;
mod phase;
mod record;
mod start;
mod state;
mod statics;
mod tangents;
mod ties;
mod warning;
mod watch;

pub use neighbour::Neighbour;
pub use record::PhaseRecord;
pub use state::State;
pub use warning::Warning;
pub use watch::{Increment, Part, Watch, When};

use crate::assembly::Tie;
use crate::equilibrium::{Clock, Guess, Newton, Reason, Reuse, Runaway, StepFailure, StepSuccess};
use crate::error::{Error, NoEquilibrium, Place, RunawayAt};
use crate::ground::{Acting, Loading};
use crate::group::Group;
use crate::mesh::Mesh;
use crate::model::Model;
use crate::problem::{Axis, Material, Problem};
use crate::settings::{Control, Method, Settings};
use beyond::Beyond;
use creeping::Lead;
use history::History;
use law::{Moment, Stop, custody};
use path::PathEnd;
use phase::PhaseEquations;
use state::PhaseCourse;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

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

/// What there is to see of a state of equilibrium.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Groups with their committed state.
    pub groups: &'a [Group],
    /// Middles of layers, which always follow their faces.
    pub ties: &'a [Tie],
    /// Displacements by degree of freedom (two a node), m, counted since the last reset.
    pub displacement: &'a [f64],
    /// Internal less external forces by degree of freedom: reactions where displacements are
    /// prescribed.
    pub reaction: &'a [f64],
    /// Weights and pore water.
    pub acting: &'a Acting,
    /// The problem.
    pub problem: &'a Problem,
}

/// A problem on its way through its phases.
#[derive(Debug)]
pub struct Simulation {
    problem: Problem,
    groups: Vec<Group>,
    /// Middles of layers, which always follow their faces.
    ties: Vec<Tie>,
    /// All that follows others in the present phase.
    tied: Vec<Tie>,
    swaps: Vec<Vec<(usize, Material)>>,
    first_materials: Vec<Material>,
    warnings: Vec<String>,
    /// Displacements by degree of freedom, as counted since the last reset.
    displacement: Vec<f64>,
    /// Prescribed displacements by degree of freedom.
    prescribed: BTreeMap<usize, f64>,
    /// What acts at the start of the phase, and at its end.
    loading: [Loading; 2],
    acting: Acting,
    /// Internal forces of the groups that the last phase to begin removed.
    released: Vec<f64>,
    /// External forces.
    force: Vec<f64>,
    /// Internal less external forces of the last state that was completed.
    reaction: Vec<f64>,
    /// Time at the start of the phase.
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
    reuse: Reuse,
    /// Who may want it to stop.
    stop: Stop,
    /// Phases that are over.
    done: usize,
    under_way: Option<UnderWay>,
    /// It came to an error from which it cannot go on.
    has_failed: bool,
}

/// A phase under way.
#[derive(Debug)]
struct UnderWay {
    number: usize,
    equations: PhaseEquations,
    course: PhaseCourse,
    record: PhaseRecord,
}

/// Results of an increment on its way.
#[derive(Debug, Default)]
struct Progress {
    iterations: usize,
    unreliable: Option<String>,
}

impl Simulation {
    /// A problem before its first phase, checked.
    ///
    /// # Errors
    /// [`Error::Refused`] with the part that does not fit; [`Error::CannotStart`].
    pub fn new(problem: Problem) -> Result<Self, Error> {
        let mut reuse = Reuse::default();
        reuse.is_last_run = true;
        Self::reusing(problem, reuse)
    }

    /// The same, with what earlier simulations have factorised.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn reusing(problem: Problem, mut reuse: Reuse) -> Result<Self, Error> {
        reuse.begin_run();
        let Model {
            groups,
            ties,
            swaps,
            warnings,
        } = Model::build(&problem)?;
        let n_dofs = 2 * problem.mesh.nodes.len();
        let nodes = &problem.mesh.nodes;
        // A line that is kept from turning takes up moments.
        let is_kept = problem.phases.iter().any(|phase| !phase.rigid.is_empty());
        let turns_freely = !is_kept && groups.iter().all(|group| phase::turns_freely(group, nodes));
        let mut simulation = Self {
            first_materials: groups.iter().map(|group| group.law.clone()).collect(),
            tied: ties.clone(),
            groups,
            ties,
            swaps,
            warnings,
            displacement: vec![0.0; n_dofs],
            prescribed: BTreeMap::new(),
            acting: Acting::before(&problem),
            loading: [Loading::before(&problem), Loading::before(&problem)],
            released: vec![0.0; n_dofs],
            force: vec![0.0; n_dofs],
            reaction: vec![0.0; n_dofs],
            time: 0.0,
            largest_force: 0.0,
            largest_forces: vec![0.0; n_dofs],
            beyond: Beyond::default(),
            turns_freely,
            reuse,
            stop: Stop::never(),
            done: 0,
            under_way: None,
            has_failed: false,
            problem,
        };
        simulation.beyond.knows(&simulation.groups);
        for (group, input) in simulation.groups.iter_mut().zip(&simulation.problem.groups) {
            if !input.is_active {
                group.disappear();
            }
        }
        simulation.force = simulation.loading[1].forces(&simulation.problem, &simulation.groups);
        for support in &simulation.problem.supports {
            for dof in simulation.dofs(&support.line, &support.fixed) {
                simulation.prescribed.insert(dof, 0.0);
            }
        }
        Ok(simulation)
    }

    /// What it has factorised, for other simulations.
    pub fn into_reuse(self) -> Reuse {
        self.reuse
    }

    /// The problem.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// Groups with their committed state, in the order of the problem.
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// Of every phase but the first, the groups that take another law.
    pub fn swaps(&self) -> &[Vec<(usize, Material)>] {
        &self.swaps
    }

    /// What is plausible in the problem but seldom meant, in words.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Results so far that the theory does not cover, in words.
    pub fn beyond_theory(&self) -> Vec<String> {
        self.beyond.warnings()
    }

    /// The time: that of the phases before the present one, and what is done of it.
    pub fn time(&self) -> f64 {
        let under_way = self.under_way.as_ref();
        under_way.map_or(self.time, |phase| {
            self.clock(phase.number).at(phase.course.lambda)
        })
    }

    /// Whether a phase has begun: its loads and laws are in force, even if no increment of it is done.
    pub fn is_on_its_way(&self) -> bool {
        self.under_way.is_some() || self.done > 0
    }

    /// The time of a phase that is under way.
    fn clock(&self, phase: usize) -> Clock {
        Clock {
            start: self.time,
            length: self.problem.phases[phase].length(),
        }
    }

    /// The present state, complete: all stresses, strains, displacements and reactions.
    pub fn snapshot(&self) -> Snapshot<'_> {
        Snapshot {
            mesh: &self.problem.mesh,
            groups: &self.groups,
            ties: &self.ties,
            displacement: &self.displacement,
            reaction: &self.reaction,
            acting: &self.acting,
            problem: &self.problem,
        }
    }

    /// Sum of the reactions at the nodes of a line, x and y: kN of the whole turn, or kN/m. `None`
    /// if there is no such line.
    pub fn reaction_of(&self, line: &str) -> Option<[f64; 2]> {
        let nodes = &self.problem.mesh.lines.get(line)?.nodes;
        Some([0, 1].map(|c| nodes.iter().map(|node| self.reaction[2 * node + c]).sum()))
    }

    /// Mean displacement of the nodes of a line, x and y, m. `None` if there is no such line.
    pub fn displacement_of(&self, line: &str) -> Option<[f64; 2]> {
        let nodes = &self.problem.mesh.lines.get(line)?.nodes;
        let n = nodes.len().max(1) as f64;
        let sum = |c: usize| {
            nodes
                .iter()
                .map(move |node| self.displacement[2 * node + c])
        };
        Some([0, 1].map(|c| sum(c).sum::<f64>() / n))
    }

    /// The method that iterates in the present phase.
    pub fn method(&self) -> Method {
        self.settings().method
    }

    /// The settings that the iterations are asked for.
    fn settings(&self) -> Settings {
        self.problem.settings.in_force()
    }

    /// Goes on to the end of the last phase.
    ///
    /// # Errors
    /// See [`Error`]. Whatever was in equilibrium has been handed to who watches.
    pub fn run(&mut self, watch: &mut dyn Watch) -> Result<(), Error> {
        while self.step_watched(watch)?.is_some() {}
        Ok(())
    }

    /// Starts the first phase and goes no further: whether the laws stand their initial stresses, and what
    /// they make of them.
    ///
    /// # Errors
    /// As [`Self::step`], as far as it comes before the first increment.
    pub fn try_start(mut self, watch: &mut dyn Watch) -> Result<(), Error> {
        if self.problem.phases.is_empty() {
            return Ok(());
        }
        self.begin_phase(watch)
    }

    /// Goes on by one increment, into the next phase where one is over. `None` after the last.
    ///
    /// # Errors
    /// See [`Error`]. The state is then the last one in equilibrium.
    pub fn step(&mut self) -> Result<Option<Increment>, Error> {
        self.step_watched(&mut ())
    }

    /// The same, while somebody watches.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_watched(&mut self, watch: &mut dyn Watch) -> Result<Option<Increment>, Error> {
        self.stop = watch.stop();
        if self.has_failed {
            let message = "the simulation has come to an error; it goes on from a state only";
            return Err(Error::OtherState(message.to_owned()));
        }
        loop {
            if self.under_way.is_none() {
                if self.done == self.problem.phases.len() {
                    return Ok(None);
                }
                self.begin_phase(watch)?;
            }
            let Some(mut phase) = self.under_way.take() else {
                continue;
            };
            let n = self.problem.phases[phase.number].increments;
            if phase.course.increment >= n {
                self.end_phase(&phase, watch);
                continue;
            }
            let outcome = self.increment(&mut phase, watch);
            self.under_way = Some(phase);
            let outcome = outcome.and_then(|increment| {
                self.hand_out_state(&increment, watch)?;
                Ok(increment)
            });
            if let Err(error) = &outcome
                && let Some(phase) = self.under_way.take()
            {
                self.report_phase(&phase, watch);
                // What was stopped goes on where it stands.
                self.has_failed = !error.is_stop() && !matches!(error, Error::Halted);
                self.under_way = Some(phase);
            }
            return outcome.map(Some);
        }
    }

    /// The state after an increment, if it is wanted; the end, if that was asked for.
    fn hand_out_state(
        &mut self,
        increment: &Increment,
        watch: &mut dyn Watch,
    ) -> Result<(), Error> {
        let stops = self.stop.is_asked();
        if watch.wants_state(stops) {
            self.note_course();
            let state = self.borrowed_state();
            let flow = state.map_or(ControlFlow::Continue(()), |state| watch.state(&state));
            self.forget_course();
            go_on(flow)?;
        }
        if stops {
            let place = increment.place.clone();
            return Err(Error::Interrupted { place });
        }
        Ok(())
    }

    /// The next increment of a phase.
    fn increment(
        &mut self,
        phase: &mut UnderWay,
        watch: &mut dyn Watch,
    ) -> Result<Increment, Error> {
        let input = &self.problem.phases[phase.number];
        let n = input.increments;
        let increment = phase.course.increment + 1;
        let place = Place {
            phase: input.name.clone(),
            increment,
        };
        for group in &mut self.groups {
            group.moment = Moment {
                step: phase.number as u32 + 1,
                increment: increment as u32,
                step_start: self.time,
                step_length: input.length(),
                is_undrained: group.is_undrained(),
            };
        }
        let done = match self.reach(&place, n, phase, watch) {
            Ok(done) => done,
            Err(error) => {
                let _ = custody::restore();
                // What led here matters more than trouble with the state before it.
                self.hand_out_last(&place, phase, watch);
                return Err(error);
            }
        };
        let when = When::Increment {
            place: &place,
            of: n,
        };
        let looked_at = watch.looks_at(when, &self.groups);
        let lambda = phase.course.lambda;
        self.complete(phase, looked_at.as_ref())
            .map_err(|reason| self.incomplete(phase, &place, lambda, reason))?;
        let restored = custody::restore().map_err(|why| Error::Process {
            place: place.clone(),
            why,
        })?;
        for change in restored {
            watch.warning(&Warning::Restored(place.clone(), change));
        }
        phase.record.iterations += done.iterations;
        phase.record.increments += 1;
        phase.course.increment = increment;
        let done = Increment {
            time: self.clock(phase.number).at(lambda),
            of: n,
            iterations: done.iterations,
            unreliable: done.unreliable,
            place,
        };
        go_on(watch.increment(&done, &self.snapshot()))?;
        Ok(done)
    }

    /// Hands out the last state of equilibrium of a phase that cannot go on.
    fn hand_out_last(&mut self, place: &Place, phase: &mut UnderWay, watch: &mut dyn Watch) {
        let lambda = phase.course.lambda;
        if self.complete(phase, None).is_ok() {
            let time = self.clock(phase.number).at(lambda);
            watch.last_equilibrium(place, lambda, time, &self.snapshot());
        }
    }

    /// Steps up to the end of an increment, one of `n`; as many as it takes.
    fn reach(
        &mut self,
        place: &Place,
        n: usize,
        phase: &mut UnderWay,
        watch: &mut dyn Watch,
    ) -> Result<Progress, Error> {
        let settings = self.settings();
        let easy = EASY * settings.method.max_iterations() as f64;
        let smallest = 1.0 / n as f64 / f64::powi(2.0, settings.max_halvings as i32);
        let target = if place.increment == n {
            1.0
        } else {
            place.increment as f64 / n as f64
        };
        let mut done = Progress::default();
        let mut lead = Lead::new(&settings);
        while phase.course.lambda < target {
            if phase.course.lambda >= phase.course.loads.leg[1] {
                self.turn(place, phase)?;
            }
            let target = target.min(phase.course.loads.leg[1]);
            let (start, mut step) = (phase.course.lambda, phase.course.step);
            if lead.creeps() {
                step = step.min(creeping::LONGEST / n as f64);
            }
            // A remainder that is hardly longer than the step is taken at once.
            let end = if target - start <= 1.0001 * step {
                target
            } else {
                start + step
            };
            let length = end - start;
            let guess = phase.course.history.guess(length);
            let attempt = self.attempt(phase, lead.control, [start, end], guess);
            match self.without_leap(attempt, phase, length) {
                Ok(success) => {
                    let period = (self.clock(phase.number), [start, end]);
                    self.look_after(&success, period, watch);
                    if success.relaxed {
                        self.note_motion(
                            &success,
                            [start, end],
                            lead.control,
                            (place, phase),
                            watch,
                        );
                    }
                    lead.goes_on();
                    // A motion takes many iterations, and steps of any length.
                    if success.was_motion || success.iterations.len() as f64 <= easy {
                        phase.course.step = (REGROWTH * step).min(1.0 / n as f64);
                    }
                    self.take_over(success, end, place, phase, watch, &mut done)?;
                }
                Err(failure) if failure.is_stop() => return Err(stopped(place)),
                Err(failure) => {
                    go_on(watch.iterations(place, end, &failure.iterations))?;
                    done.iterations += failure.iterations.len();
                    let period = (self.clock(phase.number), [start, end]);
                    if self.look_after_failure(&failure, period, watch) {
                        continue;
                    }
                    phase.record.cut_backs += 1;
                    let factor = failure.factor().unwrap_or(CUT[1]).clamp(CUT[0], CUT[1]);
                    let step = factor * length;
                    phase.course.step = step;
                    go_on(watch.cut_back(place, end, step, &failure.reason))?;
                    let follows = settings.control == Control::ArcLength
                        && phase.course.history.latest().is_some();
                    let is_small = step < smallest.max(PATIENCE / n as f64);
                    let is_out = step < smallest;
                    let stays = lead.stays(is_out, step * n as f64);
                    let turns = !stays && lead.turns(&failure, is_out);
                    if failure.defect().is_some() {
                        return Err(self.cannot_go_on(phase, place, start, failure));
                    } else if follows && is_small {
                        let goal = [n as f64, target];
                        let end = self.follow_path(place, goal, phase, watch, &mut done)?;
                        if let PathEnd::Stopped(failure, highest) = end {
                            return Err(self.cannot_go_on(phase, place, highest, *failure));
                        }
                    } else if turns && lead.creeps() {
                        if !lead.was_in_vain() {
                            phase.course.step = creeping::LONGEST / n as f64;
                        }
                        if phase.record.crept_from.is_none() {
                            phase.record.crept_from = Some(place.increment);
                            watch.warning(&Warning::Creeps(place.clone()));
                        }
                    } else if is_out && !stays {
                        return Err(self.cannot_go_on(phase, place, start, failure));
                    }
                }
            }
        }
        Ok(done)
    }

    /// Counts a motion that led to equilibrium, and speaks of the first one of its kind; the phase's end says how
    /// many there were.
    fn note_motion(
        &mut self,
        success: &StepSuccess,
        step: [f64; 2],
        control: Control,
        (place, phase): (&Place, &mut UnderWay),
        watch: &mut dyn Watch,
    ) {
        phase.record.relaxed += 1;
        if control == Control::Creep {
            phase.record.crept += 1;
            if phase.record.crept == 1 && self.problem.settings.control == Control::Creep {
                watch.warning(&Warning::Crept(place.clone()));
            }
        } else if phase.record.relaxed - phase.record.crept == 1 {
            let by_creep = self.neighbour(phase, success, step);
            watch.warning(&Warning::Relaxed(place.clone(), by_creep));
        }
    }

    /// Goes on to the next leg of the phase's course, from a complete state.
    fn turn(&mut self, place: &Place, phase: &mut UnderWay) -> Result<(), Error> {
        let lambda = phase.course.lambda;
        self.complete(phase, None)
            .map_err(|reason| self.incomplete(phase, place, lambda, reason))?;
        if self.next_leg(phase.number, &mut phase.course)
            && let Some(domain) = &mut phase.equations.domain
        {
            domain.start(&self.groups, &phase.course.loads, &self.displacement);
        }
        Ok(())
    }

    /// Takes over a step that reached equilibrium at load factor λ, with all that is to be said of
    /// it.
    fn take_over(
        &mut self,
        success: StepSuccess,
        lambda: f64,
        place: &Place,
        phase: &mut UnderWay,
        watch: &mut dyn Watch,
        done: &mut Progress,
    ) -> Result<(), Error> {
        let iterations = success.iterations.len();
        // Whoever wants no more has the state of this equilibrium: creep has committed its way to it.
        let flow = watch.iterations(place, lambda, &success.iterations);
        done.iterations += iterations;
        let record = &mut phase.record;
        let is_met = success.round_off <= self.problem.settings.force_tolerance;
        if success.round_off > 0.0 && is_met {
            let last = success.iterations.last().and_then(|last| last.correction);
            let above = last.filter(|left| *left > self.settings().displacement_tolerance);
            record.unsettled = record.unsettled.max(above.unwrap_or(0.0));
        }
        record.round_off = record.round_off.max(success.round_off);
        if success.tolerated > 0.0 {
            record.tolerated += 1;
            record.tolerated_residual = record.tolerated_residual.max(success.tolerated);
            let scale = success.scales.iter().copied().fold(0.0, f64::max);
            let force = success.tolerated * scale;
            record.tolerated_force = record.tolerated_force.max(force);
            if record.tolerated == 1 {
                watch.warning(&Warning::Tolerated {
                    place: place.clone(),
                    residual: success.tolerated,
                    force,
                    tolerance: self.problem.settings.force_tolerance,
                });
            }
        }
        if let Some(open) = &success.open
            && open.correction > self.problem.settings.displacement_tolerance
        {
            record.by_force += 1;
            record.open = record.open.and(open);
        }
        if let Some(why) = &success.unreliable {
            record.unreliable += 1;
            done.unreliable.get_or_insert_with(|| why.clone());
        }
        self.accept(&success, phase, lambda);
        let course = &mut phase.course;
        course.history.add(lambda - course.lambda, success);
        course.lambda = lambda;
        go_on(flow)?;
        if self.problem.settings.control == Control::ArcLength {
            self.hand_out_step(place, phase, iterations, watch)?;
        }
        Ok(())
    }

    /// The error of a phase that ends at load factor λ.
    fn cannot_go_on(
        &self,
        phase: &UnderWay,
        place: &Place,
        lambda: f64,
        failure: StepFailure,
    ) -> Error {
        if let Some(defect) = failure.defect() {
            return Error::Law {
                place: place.clone(),
                failure: Box::new(defect.clone()),
                however_small: false,
            };
        }
        let broken = failure.failed().filter(|point| {
            let mut groups = self.groups.iter();
            let group = groups.find(|group| group.name == point.group);
            group.is_some_and(|group| group.law.built.law.breaks_down(&point.failure))
        });
        if let Some(broken) = broken {
            return Error::Law {
                place: place.clone(),
                failure: Box::new(broken.clone()),
                however_small: true,
            };
        }
        let runaway = failure.runaway.map(|runaway| self.runaway_at(runaway));
        Error::NoEquilibrium(Box::new(NoEquilibrium {
            runaway,
            ..self.stopped_at(phase, place, lambda, failure)
        }))
    }

    /// No equilibrium of a phase beyond load factor λ.
    fn stopped_at(
        &self,
        phase: &UnderWay,
        place: &Place,
        lambda: f64,
        failure: StepFailure,
    ) -> NoEquilibrium {
        let of = self.problem.phases[phase.number].increments;
        NoEquilibrium {
            place: place.clone(),
            reached: lambda * of as f64,
            of,
            control: if phase.record.crept_from.is_some() {
                Control::Creep
            } else {
                self.problem.settings.control
            },
            failure,
            runaway: None,
        }
    }

    /// The same where a step is found not to be complete.
    fn incomplete(&self, phase: &UnderWay, place: &Place, lambda: f64, reason: Reason) -> Error {
        let none = self.stopped_at(phase, place, lambda, reason.into());
        Error::NoEquilibrium(Box::new(none))
    }

    /// Where a displacement ran away.
    fn runaway_at(&self, Runaway { dof, increment }: Runaway) -> RunawayAt {
        let node = dof / 2;
        let of_node = |group: &&Group| {
            let mut elements = 0..group.kinematics.n_elements();
            elements.any(|element| group.kinematics.nodes(element).contains(&node))
        };
        let groups = self.groups.iter().filter(of_node);
        RunawayAt {
            axis: if dof.is_multiple_of(2) {
                Axis::X
            } else {
                Axis::Y
            },
            increment,
            node: self.problem.mesh.nodes[node],
            groups: groups.map(|group| group.name.clone()).collect(),
        }
    }

    /// One step; from a guess if there is one, else from the tangent.
    fn attempt(
        &mut self,
        phase: &mut UnderWay,
        control: Control,
        [from, to]: [f64; 2],
        guess: Option<Guess>,
    ) -> Result<StepSuccess, StepFailure> {
        let settings = Settings {
            control,
            ..self.settings()
        };
        let clock = self.clock(phase.number);
        let equations = &mut phase.equations;
        let mut newton = Newton::new(
            (&equations.system, &equations.places),
            equations.domain.as_ref(),
            (&mut equations.solver, &mut equations.matrix),
            &mut self.groups,
            &settings,
            &mut phase.record.costs,
        );
        newton = newton.stopped_by(&self.stop);
        newton.step(&phase.course.loads, [from, to], clock, guess)
    }
}

/// Ends where whoever watches wants no more.
fn go_on(flow: ControlFlow<()>) -> Result<(), Error> {
    match flow {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Error::Halted),
    }
}

/// The error of an increment that was stopped on its way.
fn stopped(place: &Place) -> Error {
    let place = place.clone();
    Error::Stopped { place }
}
