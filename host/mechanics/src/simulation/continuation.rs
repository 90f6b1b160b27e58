//! Control of the steps of an increment. Under `control = "auto"` the load leads first. If ever shorter steps by the
//! load fail, viscous control leads by short steps to the end of the increment; if it fails too, both lead by turns.
//! The last resort, also under `control = "viscous"`, is viscous control by single corrections, if interfaces may
//! break. They also begin where bonds opened in several failed steps of an increment; if they then fail, the control
//! before them leads again.

use crate::equilibrium::{Reason, Singularity, StepFailure};
use crate::settings::{Control, Settings};

/// Steps by the load that may fail in a row before viscous control leads. Plastic flow during a motion over a
/// whole increment stays in the state: a pile in dilatant sand (φ = ψ = 36°), pushed by whole
/// increments of viscous control, carried 58 % more than under load control. The excess fell with
/// the length of the steps.
const PATIENCE: usize = 5;
/// Steps of an increment that may fail where a bond opens. Shorter steps fail too: the bond breaks at the end of the
/// longest step that finds equilibrium. After two of them a pile that is pulled off its base finds no way on.
const OPENINGS: usize = 3;
/// Longest step under viscous control, as a fraction of an increment.
pub(super) const LONGEST: f64 = 0.125;

/// The shortest one if the load may not be cut any further: viscous control has its own cuts.
const SHORTEST: f64 = LONGEST / 8.0;

/// How often single corrections may begin in an increment: with the shortest step, then with the longest.
const BEGINNINGS: usize = 2;

/// Control that leads the steps of an increment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lead {
    pub(super) control: Control,
    /// Viscous control may be tried.
    may_be_viscous: bool,
    /// It failed in this increment.
    was_in_vain: bool,
    /// Steps that failed in a row.
    failures: usize,
    /// Steps that failed where a bond opened.
    openings: usize,
    /// Control and length of the next step, as a load factor, before single corrections that began because bonds opened.
    before_early: Option<(Control, f64)>,
    /// Viscous control goes by single corrections.
    pub(super) singly: bool,
    /// How often that may be begun with.
    beginnings: usize,
}

impl Lead {
    /// For an increment that begins.
    pub(super) fn new(settings: &Settings) -> Self {
        let is_auto = settings.control == Control::Auto;
        let is_newton = settings.method.is_newton();
        let may_be_viscous = is_auto && settings.relaxation && is_newton;
        let is_viscous = settings.control == Control::Viscous && is_newton;
        Self {
            control: settings.control,
            may_be_viscous,
            was_in_vain: false,
            failures: 0,
            openings: 0,
            before_early: None,
            singly: false,
            beginnings: if may_be_viscous || is_viscous {
                BEGINNINGS
            } else {
                0
            },
        }
    }

    /// Turns to viscous control by single corrections after a failed step, if it may begin. Returns the length of the
    /// first step as a load factor: the `shortest` at first, then the longest of one of `n` increments.
    pub(super) fn begins_singly(
        &mut self,
        failure: &StepFailure,
        shortest: f64,
        n: f64,
    ) -> Option<f64> {
        if self.beginnings == 0 || failure.failed().is_some() || is_free(failure) {
            return None;
        }
        self.beginnings -= 1;
        let longest = LONGEST / n;
        let length = if self.singly {
            longest
        } else {
            shortest.min(longest)
        };
        self.singly = true;
        self.control = Control::Viscous;
        Some(length)
    }

    /// Whether enough steps have failed in a row, this one included, to turn from the load to another way.
    pub(super) fn has_waited(&self) -> bool {
        !self.singly && self.failures + 1 >= PATIENCE
    }

    /// Whether enough steps of the increment, this one included, have failed where a bond opens.
    pub(super) fn opens_bonds(&mut self, failure: &StepFailure) -> bool {
        self.openings += usize::from(failure.opens_bond);
        failure.opens_bond && !self.singly && self.openings == OPENINGS
    }

    /// Turns to single corrections because bonds opened; `step` is the length that the next step would have had. Returns
    /// the length of the first one.
    pub(super) fn begins_early(&mut self, step: f64, shortest: f64, n: f64) -> Option<f64> {
        if self.beginnings == 0 {
            return None;
        }
        self.before_early = Some((self.control, step));
        (self.singly, self.control) = (true, Control::Viscous);
        Some(shortest.min(LONGEST / n))
    }

    /// Turns back from single corrections that began because bonds opened. Returns the length of the next step.
    pub(super) fn turns_back(&mut self) -> Option<f64> {
        let (control, step) = self.before_early.take()?;
        (self.singly, self.control) = (false, control);
        Some(step)
    }

    /// Whether single corrections end with a next step of this fraction of an increment: they may not be begun with
    /// again.
    pub(super) fn is_at_its_end(&self, step: f64) -> bool {
        self.singly && self.beginnings == 0 && step < SHORTEST
    }

    /// Whether steps are short.
    pub(super) fn is_short(&self) -> bool {
        self.is_viscous() || self.singly
    }

    /// Whether viscous control leads where the load would have to.
    pub(super) fn is_viscous(&self) -> bool {
        self.may_be_viscous && self.control == Control::Viscous && !self.singly
    }

    /// Whether viscous control goes on with a step of this fraction of an increment after one that failed: where the
    /// load may not be cut so far (`is_out`), no other way is left.
    pub(super) fn stays(&self, is_out: bool, step: f64) -> bool {
        self.is_viscous() && is_out && step >= SHORTEST
    }

    /// Whether viscous control failed in this increment.
    pub(super) fn was_in_vain(&self) -> bool {
        self.was_in_vain
    }

    /// A step found an equilibrium.
    pub(super) fn goes_on(&mut self) {
        self.failures = 0;
    }

    /// Turns to what leads after a step that failed (the last one that may be tried, or not), and whether that is
    /// another one. Laws that fail want smaller steps by the load, and what moves freely is held by nothing.
    pub(super) fn turns(&mut self, failure: &StepFailure, was_last: bool) -> bool {
        let is_viscous = self.is_viscous();
        if is_free(failure) || failure.failed().is_some() && !is_viscous {
            return false;
        }
        self.failures += 1;
        if !self.may_be_viscous || self.singly {
            return false;
        }
        let turns = if is_viscous || self.was_in_vain {
            is_viscous || failure.is_singular() && !was_last
        } else {
            was_last || self.failures >= PATIENCE
        };
        if turns {
            self.was_in_vain |= is_viscous;
            self.failures = 0;
            self.control = if is_viscous {
                Control::Auto
            } else {
                Control::Viscous
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
