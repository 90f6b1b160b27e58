//! What leads the steps of an increment under `control = "auto"`: the load; creep, where steps by the load fail; the
//! load again by ever shorter steps, where creep fails too, and creep by such steps from singular tangents.

use crate::equilibrium::{Reason, Singularity, StepFailure};
use crate::settings::{Control, Settings};

/// Steps by the load, or by creep, that may fail in an increment before the other one leads. With one by the load,
/// `chamber_oriented` finds an equilibrium in which its shaft slides all along, as its closed form wants it; creep
/// leads it to another one.
const PATIENCE: usize = 2;
/// Creep leads the next increment, too, where its steps took no more iterations than so many times those after which
/// a step by the load is given up: as many as its Newton iterations and motions take in vain.
const CHEAP: usize = 4;

/// What leads the steps of an increment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lead {
    pub(super) control: Control,
    /// Creep may be tried at all.
    may_creep: bool,
    /// It was, by whole increments.
    has_crept: bool,
    /// It was in vain.
    was_in_vain: bool,
    /// Steps that failed under this lead.
    failures: usize,
}

/// What leads instead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// Creep, by whole increments.
    ToCreep,
    /// The other one, by steps that go on to be cut.
    ToOther,
}

impl Lead {
    /// Of an increment that begins; with creep, if it led the last one (`creeps`).
    pub(super) fn new(settings: &Settings, creeps: bool) -> Self {
        let is_auto = settings.control == Control::Auto;
        Self {
            control: if creeps {
                Control::Creep
            } else {
                settings.control
            },
            may_creep: is_auto && settings.relaxation && settings.method.is_newton(),
            has_crept: creeps,
            was_in_vain: false,
            failures: 0,
        }
    }

    /// What leads from here on, after a step that failed. Laws that fail want smaller steps, and what moves freely
    /// is held by nothing.
    pub(super) fn turn(&mut self, failure: &StepFailure, was_last: bool) -> Option<Turn> {
        let is_free = matches!(
            failure.reason,
            Reason::Singular(Some((Singularity::Free, _)))
        );
        if !self.may_creep || failure.failed().is_some() || is_free {
            return None;
        }
        self.failures += 1;
        let is_over = was_last || self.failures >= PATIENCE;
        let creeps = self.control == Control::Creep;
        let turn = match (creeps, self.has_crept) {
            (false, false) if is_over => Turn::ToCreep,
            (false, true) if failure.is_singular() => Turn::ToOther,
            (true, _) if is_over || self.was_in_vain => Turn::ToOther,
            _ => return None,
        };
        *self = Self {
            control: if creeps {
                Control::Auto
            } else {
                Control::Creep
            },
            has_crept: true,
            was_in_vain: self.was_in_vain || creeps,
            failures: 0,
            ..*self
        };
        Some(turn)
    }

    /// Whether creep should lead the next increment, after a step of so many iterations.
    pub(super) fn goes_on(&self, settings: &Settings, iterations: usize) -> bool {
        let creeps = self.may_creep && self.control == Control::Creep;
        creeps && iterations <= CHEAP * settings.max_iterations()
    }
}
