//! What leads the steps of an increment under `control = "auto"`: the load; creep, where short steps by the load
//! fail; the load again, where creep does.

use super::PhaseRecord;
use crate::equilibrium::{Reason, Singularity, StepFailure};
use crate::settings::{Control, Settings};

/// What leads the steps of an increment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lead {
    pub(super) control: Control,
    /// Creep may still be tried.
    may_creep: bool,
}

/// What leads instead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// Creep, by whole increments.
    ToCreep,
    /// The load, by steps that go on to be cut: a limit of what can be carried is approached.
    ToLoad,
}

impl Lead {
    /// Of an increment that begins.
    pub(super) fn new(settings: &Settings, record: &PhaseRecord) -> Self {
        let is_auto = settings.control == Control::Auto;
        Self {
            control: if record.crept_from.is_some() {
                Control::Creep
            } else {
                settings.control
            },
            may_creep: is_auto && settings.relaxation && settings.method.is_newton(),
        }
    }

    /// What leads from here on, if a short step failed and something else is left to be tried. Laws that fail
    /// want smaller steps, and what moves freely is held by nothing.
    pub(super) fn turn(&mut self, failure: &StepFailure) -> Option<Turn> {
        let is_free = matches!(
            failure.reason,
            Reason::Singular(Some((Singularity::Free, _)))
        );
        if !self.may_creep || failure.failed().is_some() || is_free {
            return None;
        }
        if self.control == Control::Creep {
            *self = Self {
                control: Control::Auto,
                may_creep: false,
            };
            Some(Turn::ToLoad)
        } else {
            self.control = Control::Creep;
            Some(Turn::ToCreep)
        }
    }
}
