//! Newton iterations and a line search; with consistent tangents, or with a matrix that is kept.
//!
//! | | |
//! |---|---|
//! | [`iterate`] | the loop: predict, evaluate, accept, correct; what it asks the [`Control`] of a step |
//! | [`line_search`] | how far a correction is followed |
//! | [`residual`], [`matrix`] | evaluation; assembly, factorisation, solution |
//! | [`matrix_reuse`], [`acceleration`] | corrections with the matrix of an earlier state |
//! | [`acceptance`] | when a state counts as equilibrium, of numbers alone |
//! | [`convergence`], [`reference`], [`round_off`] | those numbers: sizes, references, what rounding leaves |
//! | [`failure`], [`failure_cause`] | why a step failed; what is found out about that |
//! | [`loads`], [`outcome`] | what goes in and what comes out |
//!
//! Displacements and forces are vectors by place ([`Places`]) unless stated otherwise.

mod acceleration;
mod acceptance;
mod convergence;
mod failure;
mod failure_cause;
mod iterate;
mod line_search;
mod loads;
mod matrix;
mod matrix_reuse;
mod outcome;
mod reference;
mod residual;
mod round_off;

pub(super) use acceleration::{Acceleration, dot};
pub use failure::{
    Criterion, Culprit, DomainFailure, Imbalance, Iterations, Motion, PointPlace, Reason, Runaway,
    Singularity, StepFailure, Symptom, Unmet,
};
pub(super) use iterate::{Control, Correction, Equilibrium, State};
pub(super) use line_search::{LineSearch, Otherwise};
pub use loads::Loads;
pub use matrix::Matrix;
pub(super) use matrix::noise;
pub use outcome::{Costs, Guess, Iteration, LedBy, Open, StepSuccess};
pub(super) use residual::{Balance, Task};
pub(super) use round_off::{ACCEPTED_ROUND_OFF, last_bit_scattered};
pub(crate) use round_off::{ROUND_OFF, STILL_SMALL, reference_of_round_off};

use super::condensation::LinearDomain;
use crate::assembly::{Places, System, norms};
use crate::group::Group;
use crate::settings::Settings;
use algebra::LinearSolver;
use law::Stop;
use matrix_reuse::Kept;
use reference::Reference;
use std::time::Instant;

/// The equations of a phase, with the matrix that is factorised.
#[derive(Debug)]
pub struct Equations<'a> {
    /// Unknowns of the groups that iterate.
    pub system: &'a System,
    /// Their places, and those of prescribed displacements.
    pub places: &'a Places,
    /// Linear groups, condensed to one element next to the system.
    pub domain: Option<&'a LinearDomain>,
    /// Factorises and solves.
    pub solver: &'a mut LinearSolver,
    /// What it holds.
    pub matrix: &'a mut Matrix,
}

/// What iterations work on.
#[derive(Debug)]
pub struct Newton<'a> {
    pub(super) equations: Equations<'a>,
    /// Elements and their state.
    groups: &'a mut [Group],
    pub(super) settings: &'a Settings,
    /// Costs so far.
    costs: &'a mut Costs,
    /// Reference sizes that residuals and corrections of the step are divided by.
    reference: Reference,
    /// Data that decide whether the matrix is kept.
    pub(super) kept: Kept,
    pub(super) start: Start,
    room: Room,
    /// Viscous steps under viscous control are single corrections.
    pub(super) takes_single_corrections: bool,
    /// Who may want to stop the step, and when it was last asked for.
    stop: (Stop, Instant),
}

/// The state from which displacement increments of a step are measured.
#[derive(Debug, Default)]
pub(super) struct Start {
    /// Forces of the domain at the end of the step if its boundary stays where it is.
    domain_forces: Vec<f64>,
    /// Nodal forces at the start of the phase, by place, if residuals are measured against their change.
    carried: Vec<f64>,
    /// Displacement increments of the step that are committed already, by place; when what is left of it starts, and
    /// how long that takes.
    pub(super) base: Option<(Vec<f64>, (f64, f64))>,
}

/// Room for displacements and forces by degree of freedom; the forces are zero between
/// evaluations.
#[derive(Debug)]
struct Room {
    displacement: Vec<f64>,
    force: Vec<f64>,
}

impl<'a> Newton<'a> {
    /// Iterations on these elements and equations.
    pub fn new(
        equations: Equations<'a>,
        groups: &'a mut [Group],
        settings: &'a Settings,
        costs: &'a mut Costs,
    ) -> Self {
        let system = equations.system;
        equations.matrix.is_constant = system.is_constant(groups);
        Self {
            equations,
            groups,
            settings,
            costs,
            reference: Reference::default(),
            kept: Kept::default(),
            start: Start::default(),
            room: Room {
                displacement: vec![0.0; system.n_dofs()],
                force: vec![0.0; system.n_dofs()],
            },
            takes_single_corrections: false,
            stop: (Stop::never(), Instant::now()),
        }
    }

    /// The same iterations, to be stopped when asked.
    #[must_use]
    pub fn stopped_by(mut self, stop: &Stop) -> Self {
        self.stop.0 = stop.clone();
        self
    }

    /// The same iterations, with viscous steps under viscous control that are single corrections, or not.
    #[must_use]
    pub fn taking_single_corrections(mut self, singly: bool) -> Self {
        self.takes_single_corrections = singly;
        self
    }

    /// Ends a step that is to stop: once in every iteration, before its laws are called.
    pub(super) fn may_go_on(&mut self) -> Result<(), StepFailure> {
        let now = Instant::now();
        let (stop, asked) = &mut self.stop;
        stop.beat(now - std::mem::replace(asked, now));
        if stop.is_urgent() {
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
        self.equations.matrix.hold();
        Ok(())
    }

    /// Begins a step under these loads.
    pub(super) fn set_out(&mut self, loads: &Loads) {
        let bodies = &self.equations.places.bodies;
        let at_start = if bodies.n == 1 {
            vec![loads.scale]
        } else {
            norms(&bodies.of_dof, bodies.n, &loads.largest)
        };
        self.reference = Reference::at_start(at_start);
        self.start.base = None;
        self.start.carried = if loads.carried.is_empty() {
            Vec::new()
        } else {
            let mut carried = self.equations.places.gather(&loads.carried);
            self.equations.places.fold(&mut carried);
            carried
        };
        self.begin();
    }
}

/// 2-norm.
pub(crate) fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
