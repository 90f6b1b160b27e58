//! Newton iterations and a line search; with consistent tangents, or with a matrix that is kept.
//! Viscous relaxation where full Newton iterations come to a standstill, or arc-length control.
//!
//! | | |
//! |---|---|
//! | [`iterate`] | the loop: predict, evaluate, accept, correct |
//! | [`load`], [`path`] | what it asks: steps to a load factor, steps along the path of equilibrium |
//! | [`kept`], [`acceleration`], [`relaxation`], [`viscous_control`] | strategies of steps to a load factor |
//! | [`line_search`] | how far a correction is followed |
//! | [`residual`], [`matrix`] | evaluation; assembly, factorisation, solution |
//! | [`acceptance`] | when a state counts as equilibrium, of numbers alone |
//! | [`verdict`], [`given`], [`round_off`] | those numbers: sizes, references, what rounding leaves |
//! | [`failure`], [`cause`] | why a step failed; what is found out about that |
//! | [`loads`], [`outcome`] | what goes in and what comes out |
//!
//! Displacements and forces are vectors by place ([`Places`]) unless stated otherwise.

mod acceleration;
mod acceptance;
mod arc_length;
mod convergence;
mod failure;
mod failure_cause;
mod iterate;
mod line_search;
mod load_step;
mod loads;
mod matrix;
mod matrix_reuse;
mod outcome;
mod reference;
mod residual;
mod round_off;
mod viscous_control;
mod viscous_relaxation;

pub use arc_length::Measure;
pub use failure::{
    Criterion, Culprit, DomainFailure, Imbalance, Iterations, Motion, PointPlace, Reason, Runaway,
    Singularity, StepFailure, Symptom, Unmet,
};
pub use loads::Loads;
pub use matrix::Matrix;
pub(super) use matrix::noise;
pub use outcome::{Costs, Guess, Iteration, Open, StepSuccess};
pub(super) use round_off::{ACCEPTED_ROUND_OFF, last_bit_scattered};
pub(crate) use round_off::{ROUND_OFF, STILL_SMALL};

use super::condensation::LinearDomain;
use crate::assembly::{Places, System, norms};
use crate::group::Group;
use crate::settings::Settings;
use acceptance::Change;
use algebra::LinearSolver;
use arc_length::ArcLength;
use iterate::Equilibrium;
use law::Operator;
use law::Stop;
use load_step::LoadControl;
use matrix_reuse::Kept;
use reference::Given;
use residual::Task;
use std::time::Instant;

/// The time of a phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    /// When it starts.
    pub start: f64,
    /// How long it takes.
    pub length: f64,
}

impl Clock {
    /// The time at a load factor of the phase.
    pub fn at(&self, lambda: f64) -> f64 {
        self.start + lambda * self.length
    }

    /// When a step from this load factor starts, and how long it takes. One that goes back along the path
    /// takes its time, too.
    fn period(&self, lambda: f64, rise: f64) -> (f64, f64) {
        (self.at(lambda), rise.abs() * self.length)
    }
}

/// What iterations work on.
#[derive(Debug)]
pub struct Newton<'a> {
    /// Unknowns.
    system: &'a System,
    places: &'a Places,
    /// Linear groups, condensed to one element next to the system.
    domain: Option<&'a LinearDomain>,
    /// Equations.
    solver: &'a mut LinearSolver,
    /// The equations that are factorised.
    matrix: &'a mut Matrix,
    /// Elements and their state.
    groups: &'a mut [Group],
    /// Settings.
    settings: &'a Settings,
    /// Costs so far.
    costs: &'a mut Costs,
    /// Largest of the forces at the start of the phase, by body.
    at_start: Vec<f64>,
    /// References of the step.
    given: Given,
    /// Sizes of the last correction, by body.
    changes: Vec<Change>,
    /// What ran away in the last evaluation.
    runaway: Option<Runaway>,
    /// What the last evaluation asked the laws for.
    tangents: Operator,
    /// Data that decide whether the matrix is kept.
    kept: Kept,
    /// Forces of the domain at the end of the step if its boundary stays where it is.
    domain_forces: Vec<f64>,
    /// Displacement increments of the step that are committed already, by place; when what is left of it starts, and
    /// how long that takes.
    base: Option<(Vec<f64>, (f64, f64))>,
    /// Room for displacements and forces by degree of freedom; the forces are zero between
    /// evaluations.
    displacement: Vec<f64>,
    force: Vec<f64>,
    /// Viscous steps under viscous control are single corrections.
    takes_single_corrections: bool,
    /// Who may want to stop the step, and when it was last asked for.
    stop: Stop,
    asked: Instant,
}

impl<'a> Newton<'a> {
    /// Iterations on these elements and equations.
    pub fn new(
        (system, places): (&'a System, &'a Places),
        domain: Option<&'a LinearDomain>,
        (solver, matrix): (&'a mut LinearSolver, &'a mut Matrix),
        groups: &'a mut [Group],
        settings: &'a Settings,
        costs: &'a mut Costs,
    ) -> Self {
        matrix.is_constant = system.is_constant(groups);
        Self {
            system,
            places,
            domain,
            solver,
            matrix,
            groups,
            settings,
            costs,
            at_start: Vec::new(),
            given: Given::default(),
            changes: Vec::new(),
            runaway: None,
            tangents: Operator::None,
            kept: Kept::default(),
            domain_forces: Vec::new(),
            base: None,
            displacement: vec![0.0; system.n_dofs()],
            force: vec![0.0; system.n_dofs()],
            takes_single_corrections: false,
            stop: Stop::never(),
            asked: Instant::now(),
        }
    }

    /// The same iterations, to be stopped when asked.
    #[must_use]
    pub fn stopped_by(mut self, stop: &Stop) -> Self {
        self.stop = stop.clone();
        self
    }

    /// The same iterations, with viscous steps under viscous control that are single corrections, or not.
    #[must_use]
    pub fn taking_single_corrections(mut self, singly: bool) -> Self {
        self.takes_single_corrections = singly;
        self
    }

    /// Ends a step that is to stop: once in every iteration, before its laws are called.
    fn may_go_on(&mut self) -> Result<(), StepFailure> {
        let now = Instant::now();
        self.stop
            .beat(now - std::mem::replace(&mut self.asked, now));
        if self.stop.is_urgent() {
            return Err(Reason::Stopped.into());
        }
        Ok(())
    }

    /// Factorises the matrix from the tangents that the groups hold, as an interrupted run had it.
    ///
    /// # Errors
    /// It is singular.
    pub fn restore_matrix(&mut self) -> Result<(), StepFailure> {
        self.factorise_tangents()?;
        self.matrix.hold();
        Ok(())
    }

    /// Seeks equilibrium at the end of a step, starting from a guess of the displacement
    /// increments or, without one, from the tangent at the start.
    ///
    /// # Errors
    /// No equilibrium within the allowed iterations, or a law or the equations failed.
    pub fn step(
        &mut self,
        loads: &Loads,
        [lambda_start, lambda_end]: [f64; 2],
        clock: Clock,
        guess: Option<Guess>,
    ) -> Result<StepSuccess, StepFailure> {
        self.set_out(loads);
        self.go_on(loads, [lambda_start, lambda_end], clock, guess)
    }

    /// The same in two halves, the first of which starts from a guess and is
    /// committed. It returns the whole step, with the iterations of the second half.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_in_halves(
        &mut self,
        loads: &Loads,
        [lambda_start, lambda_end]: [f64; 2],
        clock: Clock,
        guess: Option<Guess>,
    ) -> Result<StepSuccess, StepFailure> {
        let middle = f64::midpoint(lambda_start, lambda_end);
        let half = self.step(loads, [lambda_start, middle], clock, guess)?;
        self.commit(&half.increment, clock.period(middle, lambda_end - middle));
        let base = self.base.take();
        self.set_out(loads);
        self.base = base;
        let guess = Guess {
            increment: half.increment.iter().map(|u| 2.0 * u).collect(),
            contraction: None,
            was_motion: false,
        };
        self.go_on(loads, [lambda_start, lambda_end], clock, Some(guess))
    }

    fn go_on(
        &mut self,
        loads: &Loads,
        [lambda_start, lambda_end]: [f64; 2],
        clock: Clock,
        guess: Option<Guess>,
    ) -> Result<StepSuccess, StepFailure> {
        let contraction = guess.as_ref().and_then(|guess| guess.contraction);
        let is_expected = guess.as_ref().is_some_and(|guess| guess.was_motion);
        self.kept.contraction = contraction.unwrap_or(f64::INFINITY);
        if let Some(domain) = self.domain {
            self.domain_forces = domain.forces_at(lambda_end);
        }
        let external = loads.external(lambda_end);
        let period = clock.period(lambda_start, lambda_end - lambda_start);
        let task = Task {
            external: self.places.gather(&external),
            imposed: self.imposed(&external),
            prescribed: self
                .places
                .gather(&loads.prescribed_increments(lambda_start, lambda_end)),
            period,
        };
        let guess = guess.map(|guess| guess.increment);
        let mut control = LoadControl::new(self, task, guess, is_expected);
        let mut iterations = Vec::new();
        let outcome = self.iterate(&mut control, &mut iterations);
        self.end(outcome.is_ok());
        match outcome {
            Ok(equilibrium) => {
                let viscous = &control.viscous;
                let relaxed = control.relaxation.is_under_way() || viscous.has_arrived();
                let was_motion = viscous.lets_expect_another();
                let open = self.open(&equilibrium.state.balance, &iterations);
                Ok(StepSuccess {
                    was_kept: self.keeps(),
                    was_motion,
                    open,
                    ..equilibrium.reached(iterations, relaxed)
                })
            }
            Err(failure) => Err(self.explained(failure, iterations, lambda_start, period)),
        }
    }

    /// Seeks equilibrium at this distance along the path from load factor `from`, starting from a
    /// guess of the displacement increments and of the load factor's. Returns the load factor too.
    ///
    /// # Errors
    /// No equilibrium within the allowed iterations, or a law or the equations failed.
    pub fn step_along(
        &mut self,
        loads: &Loads,
        (from, clock): (f64, Clock),
        (measure, distance): (&Measure, f64),
        guess: (Vec<f64>, f64),
    ) -> Result<(StepSuccess, f64), StepFailure> {
        self.set_out(loads);
        let mut control = ArcLength::new(self, loads, (from, clock), (measure, distance), guess);
        let mut iterations = Vec::new();
        match self.iterate(&mut control, &mut iterations) {
            Ok(equilibrium) => {
                let reached = from + equilibrium.state.rise;
                Ok((equilibrium.reached(iterations, false), reached))
            }
            Err(failure) => Err(self.explained(failure, iterations, from, clock.period(from, 0.0))),
        }
    }

    /// Begins a step under these loads.
    fn set_out(&mut self, loads: &Loads) {
        let bodies = &self.places.bodies;
        self.at_start = if bodies.n == 1 {
            vec![loads.scale]
        } else {
            norms(&bodies.of_dof, bodies.n, &loads.largest)
        };
        self.given = Given::default();
        self.changes = Vec::new();
        self.runaway = None;
        self.base = None;
        self.begin();
    }
}

impl Equilibrium {
    /// Outcome of a step.
    fn reached(self, iterations: Vec<Iteration>, relaxed: bool) -> StepSuccess {
        let balance = self.state.balance;
        StepSuccess {
            increment: self.state.increment,
            iterations,
            unreliable: balance.unreliable,
            relaxed,
            was_kept: false,
            was_motion: false,
            round_off: self.round_off,
            tolerated: self.tolerated,
            scales: balance.scales,
            open: None,
        }
    }
}

/// 2-norm.
pub(crate) fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
