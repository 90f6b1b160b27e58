//! How others follow a simulation: results, progress, checkpoints, requests to stop.

use super::warning::Warning;
use super::{PhaseRecord, Reached, Snapshot, State};
use crate::equilibrium::{Iteration, Reason};
use crate::error::Place;
use crate::group::Group;
use law::Stop;
use std::ops::ControlFlow;

/// An increment that reached equilibrium.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Increment {
    /// Which.
    pub place: Place,
    /// Increments of its phase.
    pub of: usize,
    /// Time at its end: that of the phases before it, and its own share of its phase's.
    pub time: f64,
    /// Iterations, failed attempts included.
    pub iterations: usize,
    /// Why a law called a result inaccurate, if one did.
    pub unreliable: Option<String>,
}

/// A state that is about to be looked at.
#[derive(Clone, Copy, Debug)]
pub enum When<'w> {
    /// A step along the path of equilibrium, within an increment.
    Step,
    /// The end of an increment.
    Increment {
        /// Which.
        place: &'w Place,
        /// Increments of its phase.
        of: usize,
    },
}

/// A part of a model that is looked at; the rest of a linear domain may stay where it was.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Part {
    /// For every group, whether its stresses and strains are.
    pub groups: Vec<bool>,
    /// For every group, the other elements whose stresses and strains are, ascending.
    pub elements: Vec<Vec<usize>>,
    /// Degrees of freedom whose displacements are.
    pub dofs: Vec<usize>,
}

/// Whoever follows a simulation. What answers with [`ControlFlow::Break`] ends it with
/// [`Error::Halted`](crate::Error::Halted), after the last state of equilibrium was handed out.
pub trait Watch {
    /// A phase begins, with this number of increments.
    fn phase(&mut self, _name: &str, _increments: usize) {}

    /// An attempt at a step up to a load factor of the phase came to its end, with equilibrium or
    /// without.
    fn iterations(
        &mut self,
        _place: &Place,
        _load_factor: f64,
        _iterations: &[Iteration],
    ) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// A step is repeated with a smaller length, `next` of the phase.
    fn cut_back(
        &mut self,
        _place: &Place,
        _load_factor: f64,
        _next: f64,
        _reason: &Reason,
    ) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// What will be looked at in a state; `None`: everything.
    fn looks_at(&self, _when: When<'_>, _groups: &[Group]) -> Option<Part> {
        None
    }

    /// An increment reached equilibrium.
    fn increment(&mut self, _increment: &Increment, _state: &Snapshot<'_>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// A step of an increment under arc-length control reached equilibrium at this load factor.
    fn step(
        &mut self,
        _place: &Place,
        _load_factor: f64,
        _iterations: usize,
        _state: &Snapshot<'_>,
    ) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// The last state of equilibrium of a phase that cannot go on.
    fn last_equilibrium(
        &mut self,
        _place: &Place,
        _load_factor: f64,
        _time: f64,
        _state: &Snapshot<'_>,
    ) {
    }

    /// The ground was found at rest but for this share of its weight, which the first phase carries to
    /// equilibrium.
    fn at_rest(&mut self, _phase: &str, _share: f64) {}

    /// The value of a quantity that may end this phase; `None` where it is not there, or not known.
    fn quantity(&mut self, _phase: &str, _name: &str, _state: &Snapshot<'_>) -> Option<f64> {
        None
    }

    /// A phase ends before its time, since its quantity has reached its value.
    fn reached(&mut self, _end: &Reached) {}

    /// A phase has ended, or cannot go on.
    fn phase_ends(&mut self, _record: PhaseRecord) {}

    /// Something that should be known.
    fn warning(&mut self, _warning: &Warning) {}

    /// Whether [`Self::state`] is wanted after this increment, which may be the last before the
    /// simulation `stops` as asked.
    fn wants_state(&self, _stops: bool) -> bool {
        false
    }

    /// All that is needed to go on from here.
    fn state(&mut self, _state: &State<'_>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// A request to stop: after the current increment, or within it if that takes long.
    fn stop(&self) -> Stop {
        Stop::never()
    }
}

/// Nobody watches.
impl Watch for () {}
