//! Leading a problem through its phases: increments, cut-back and regrowth, from equilibrium to
//! equilibrium.

mod activation;
mod arc_length;
mod commit;
mod continuation;
mod history;
mod loads;
mod observer;
mod path_dependence;
mod phase;
mod phase_failure;
mod phase_statistics;
mod start;
mod state;
mod statics;
mod steps;
mod tangents;
mod ties;
mod until;
mod validity;
mod warning;

pub use observer::{Increment, Part, Watch, When};
pub use path_dependence::Neighbour;
pub use phase_statistics::PhaseRecord;
pub use state::State;
pub use until::Reached;
pub use warning::Warning;

use crate::assembly::Tie;
use crate::equilibrium::{Clock, Reuse};
use crate::error::{Error, Place};
use crate::ground::{Acting, Loading};
use crate::group::{Group, tied_nodes};
use crate::mesh::Mesh;
use crate::model::Model;
use crate::problem::{Material, Problem};
use crate::settings::{Method, Settings};
use algebra::mesh_lines;
use history::History;
use law::{Moment, Stop, process_state};
use phase::PhaseEquations;
use state::PhaseCourse;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use validity::Validity;

/// View of a state of equilibrium.
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
    /// Prescribed displacements of the present phase that follow others, whose reactions are those of the others.
    led: Vec<Tie>,
    swaps: Vec<Vec<(usize, Material)>>,
    first_materials: Vec<Material>,
    warnings: Vec<String>,
    /// Displacements by degree of freedom, as counted since the last reset.
    displacement: Vec<f64>,
    /// Prescribed displacements by degree of freedom.
    prescribed: BTreeMap<usize, f64>,
    /// Degrees of freedom that some phases prescribe and others do not.
    sometimes_held: Vec<bool>,
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
    beyond: Validity,
    /// Rotations call forth no stresses in any group.
    turns_freely: bool,
    /// Mesh lines of the nodes.
    lines: Vec<[u32; 2]>,
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
            led: Vec::new(),
            groups,
            ties,
            swaps,
            warnings,
            displacement: vec![0.0; n_dofs],
            prescribed: BTreeMap::new(),
            sometimes_held: Vec::new(),
            acting: Acting::before(&problem),
            loading: [Loading::before(&problem), Loading::before(&problem)],
            released: vec![0.0; n_dofs],
            force: vec![0.0; n_dofs],
            reaction: vec![0.0; n_dofs],
            time: 0.0,
            largest_force: 0.0,
            largest_forces: vec![0.0; n_dofs],
            beyond: Validity::default(),
            turns_freely,
            lines: mesh_lines(nodes),
            reuse,
            stop: Stop::never(),
            done: 0,
            under_way: None,
            has_failed: false,
            problem,
        };
        simulation.begin()?;
        Ok(simulation)
    }

    /// What is there and held before the first phase.
    fn begin(&mut self) -> Result<(), Error> {
        self.beyond.knows(&self.groups);
        for (group, input) in self.groups.iter_mut().zip(&self.problem.groups) {
            if !input.is_active {
                group.disappear();
            }
        }
        self.force = self.loading[1].forces(&self.problem, &self.groups);
        for support in &self.problem.supports {
            for dof in self.dofs(&support.line, &support.fixed) {
                self.prescribed.insert(dof, 0.0);
            }
        }
        self.check_alike()?;
        self.sometimes_held = self.held_in_some_phases();
        Ok(())
    }

    /// Its factors, for other simulations.
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

    /// For every phase but the first, the groups that take another law.
    pub fn swaps(&self) -> &[Vec<(usize, Material)>] {
        &self.swaps
    }

    /// Warnings about implausible input.
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
        let nodes = tied_nodes(&self.groups, &self.problem.mesh.lines.get(line)?.nodes);
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

    /// Bad input that shows only as laws start from their initial stresses.
    ///
    /// # Errors
    /// [`Error::Refused`]; other errors are left to the run.
    pub fn check_start(mut self) -> Result<(), Error> {
        if self.problem.phases.is_empty() {
            return Ok(());
        }
        match self.start(0, &mut ()) {
            Err(error @ Error::Refused(_)) => Err(error),
            _ => Ok(()),
        }
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
            if phase.course.is_over || phase.course.increment >= n {
                self.end_phase(&phase, watch);
                continue;
            }
            let outcome = self.increment(&mut phase, watch);
            self.under_way = Some(phase);
            let outcome = match outcome {
                Ok(None) => continue,
                Ok(Some(increment)) => self.hand_out_state(&increment, watch).map(|()| increment),
                Err(error) => Err(error),
            };
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

    /// When laws are called in an increment of a phase.
    fn moment(&self, phase: usize, increment: usize) -> Moment {
        Moment {
            step: phase as u32 + 1,
            increment: increment as u32,
            step_start: self.time,
            step_length: self.problem.phases[phase].length(),
            is_undrained: false,
        }
    }

    /// Leaves an increment that ended in an error.
    fn leave(&mut self, error: &Error, place: &Place, phase: &mut UnderWay, watch: &mut dyn Watch) {
        let _ = process_state::restore();
        if matches!(error, Error::NoEquilibrium(_)) {
            self.tell_torn(place, false, watch);
        }
        // What led here matters more than trouble with the state before it.
        self.hand_out_last(place, phase, watch);
    }

    /// The next increment of a phase; `None` if the phase turns out to have none.
    fn increment(
        &mut self,
        phase: &mut UnderWay,
        watch: &mut dyn Watch,
    ) -> Result<Option<Increment>, Error> {
        let input = &self.problem.phases[phase.number];
        let n = input.increments;
        let increment = phase.course.increment + 1;
        let place = Place {
            phase: input.name.clone(),
            increment,
        };
        let moment = self.moment(phase.number, increment);
        for group in &mut self.groups {
            let is_undrained = group.is_undrained();
            group.moment = Moment {
                is_undrained,
                ..moment
            };
        }
        let done = match self.reach(&place, n, phase, watch) {
            Ok(done) => done,
            Err(error) => {
                self.leave(&error, &place, phase, watch);
                return Err(error);
            }
        };
        if phase.course.is_over && phase.course.lambda <= 0.0 {
            return Ok(None);
        }
        let of = if phase.course.is_over { increment } else { n };
        let when = When::Increment { place: &place, of };
        let looked_at = watch.looks_at(when, &self.groups);
        let lambda = phase.course.lambda;
        self.complete(phase, looked_at.as_ref())
            .map_err(|reason| self.incomplete(phase, &place, lambda, reason))?;
        self.tell_torn(&place, true, watch);
        let restored = process_state::restore().map_err(|why| Error::Process {
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
            of,
            iterations: done.iterations,
            unreliable: done.unreliable,
            place,
        };
        go_on(watch.increment(&done, &self.snapshot()))?;
        Ok(Some(done))
    }

    /// Says, once of each, which bonds that began without normal stress have opened.
    fn tell_torn(&mut self, place: &Place, reached: bool, watch: &mut dyn Watch) {
        for group in self.groups.iter_mut().filter(|group| group.is_active) {
            if let Some(torn) = group.torn(reached) {
                watch.warning(&Warning::BrokenBond(place.clone(), torn));
            }
        }
    }

    /// Hands out the last state of equilibrium of a phase that cannot go on.
    fn hand_out_last(&mut self, place: &Place, phase: &mut UnderWay, watch: &mut dyn Watch) {
        let lambda = phase.course.lambda;
        if self.complete(phase, None).is_ok() {
            let time = self.clock(phase.number).at(lambda);
            watch.last_equilibrium(place, lambda, time, &self.snapshot());
        }
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
