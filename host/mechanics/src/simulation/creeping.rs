//! What leads the steps of an increment under `control = "auto"`: the load; where ever shorter steps by the load fail,
//! creep by short steps, to the end of the increment; by turns, where creep fails too. Where all of that has failed, short steps
//! in which bonds break one after another.

use crate::equilibrium::{Reason, Singularity, StepFailure};
use crate::settings::{Control, Settings};

/// Steps by the load that may fail in a row before creep leads. What flows in a motion that sets out from a whole increment stays in the
/// state: a pile in dilatant sand (φ = ψ = 36°) pushed by whole increments of creep carried 58 % more than by steps
/// of the load, and what was too much fell with the length of the steps.
const PATIENCE: usize = 5;
/// Longest step by creep, as a fraction of an increment.
pub(super) const LONGEST: f64 = 0.125;

/// Shortest one, where the load may not be cut any further: creep has some cuts of its own.
const SHORTEST: f64 = LONGEST / 8.0;

/// How often steps in which bonds break are begun with in an increment: with the shortest one; if bonds have broken in vain, with
/// the longest.
const RELEASES: usize = 2;

/// What leads the steps of an increment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lead {
    pub(super) control: Control,
    /// Creep may be tried.
    may_creep: bool,
    /// It failed in this increment.
    was_in_vain: bool,
    /// Steps that failed in a row.
    failures: usize,
    /// Bonds break one after another where iterations stand still.
    pub(super) releases: bool,
    /// How often that may be begun with.
    left: usize,
}

impl Lead {
    /// Of an increment that begins.
    pub(super) fn new(settings: &Settings) -> Self {
        let is_auto = settings.control == Control::Auto;
        let may_move = settings.relaxation && settings.method.is_newton();
        // A path of equilibrium has a way of its own to leave a branch.
        let may_release = may_move && settings.control != Control::ArcLength;
        Self {
            control: settings.control,
            may_creep: is_auto && may_move,
            was_in_vain: false,
            failures: 0,
            releases: false,
            left: if may_release { RELEASES } else { 0 },
        }
    }

    /// Whether steps are short: of a motion what flows stays, and of bonds those break that break first.
    pub(super) fn is_short(&self) -> bool {
        self.creeps() || self.releases
    }

    /// Turns to steps in which bonds break, if they may be begun with once more after a step that failed: the first one's
    /// length, as a load factor, between the `shortest` one and the longest of one of `n` increments.
    pub(super) fn release(&mut self, failure: &StepFailure, shortest: f64, n: f64) -> Option<f64> {
        let is_in_vain = self.releases && !failure.has_released;
        if self.left == 0 || is_in_vain || failure.failed().is_some() || is_free(failure) {
            return None;
        }
        self.left -= 1;
        let longest = LONGEST / n;
        let length = if self.releases {
            longest
        } else {
            shortest.min(longest)
        };
        self.releases = true;
        if self.may_creep {
            self.control = Control::Auto;
        }
        Some(length)
    }

    /// Whether steps by the load have failed as often in a row as creep waits for, this one included.
    pub(super) fn has_waited(&self) -> bool {
        !self.releases && self.failures + 1 >= PATIENCE
    }

    /// Whether creep leads where the load would have to.
    pub(super) fn creeps(&self) -> bool {
        self.may_creep && self.control == Control::Creep
    }

    /// Whether creep goes on with a step of this fraction of an increment after one that failed: where the load may
    /// not be cut so far (`is_out`), no other way is left.
    pub(super) fn stays(&self, is_out: bool, step: f64) -> bool {
        self.creeps() && is_out && step >= SHORTEST
    }

    /// Whether creep failed in this increment.
    pub(super) fn was_in_vain(&self) -> bool {
        self.was_in_vain
    }

    /// A step found an equilibrium.
    pub(super) fn goes_on(&mut self) {
        self.failures = 0;
    }

    /// Turns to what leads after a step that failed (the last one that may be tried, or not), and whether that is another one. Laws
    /// that fail want smaller steps by the load, and what moves freely is held by nothing.
    pub(super) fn turns(&mut self, failure: &StepFailure, was_last: bool) -> bool {
        let creeps = self.creeps();
        if is_free(failure) || failure.failed().is_some() && !creeps {
            return false;
        }
        self.failures += 1;
        if !self.may_creep || self.releases {
            return false;
        }
        let turns = if creeps || self.was_in_vain {
            creeps || failure.is_singular() && !was_last
        } else {
            was_last || self.failures >= PATIENCE
        };
        if turns {
            self.was_in_vain |= creeps;
            self.failures = 0;
            self.control = if creeps {
                Control::Auto
            } else {
                Control::Creep
            };
        }
        turns
    }
}

/// Whether a part of the model moves freely.
fn is_free(failure: &StepFailure) -> bool {
    let reason = &failure.reason;
    matches!(reason, Reason::Singular(Some((Singularity::Free, _))))
}
