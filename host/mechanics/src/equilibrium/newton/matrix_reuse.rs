//! The kept matrix: as long as corrections with it take nearly all of the residual away, the matrix of
//! an earlier iteration, or of the step before, is not replaced.
//!
//! If factorising is expensive, corrections with the matrix of the step before, and with the first one that replaces
//! it, may also be slow. They are [accelerated](super::acceleration), and the matrix is replaced only if they still
//! stall.
//!
//! Whether a new matrix is wanted is known before a state is evaluated; only then are laws asked for tangents.

use super::Newton;
use super::acceptance::STALE;
use super::failure::StepFailure;
use super::iterate::{Control, Correction, State};
use super::outcome::Iteration;
use super::residual::Task;
use crate::settings::Method;
use law::Operator;

/// A matrix is kept as long as each correction leaves no more than this fraction of the residual:
/// of equations with a condensed domain, and of all others. Found by trial: a few iterations more
/// are cheap where the laws of an interface are all there is to evaluate.
const FAST: [f64; 2] = [0.03, 0.01];

/// Factorising is expensive with a condensed domain if the unknowns of its boundary, to the third
/// power, exceed this many times the points that laws are called for. Found by trial: with 324
/// unknowns and 360 points slow iterations cost as much as the matrices they save; with 644 and 720
/// a run takes 0.87 of its time.
const DEAR: f64 = 2e5;
/// If so, another matrix costs as much as this many corrections. Between 8 and 30 the time of a run differs by 4 %.
const AS_MANY: f64 = 11.0;
/// The number of further corrections is predicted from this many last ones.
const LAST: usize = 3;

/// Data of a step that decide whether the matrix is kept.
#[derive(Debug)]
pub(in crate::equilibrium) struct Kept {
    /// How often the matrix has been renewed in this step.
    renewed: usize,
    /// Corrections may be slow until it is renewed for the second time.
    may_be_slow: bool,
    /// What the last evaluation asked the laws for.
    pub(super) tangents: Operator,
    /// It makes too little progress.
    pub(in crate::equilibrium) stalls: bool,
    /// Fraction of the residual that the next correction will probably leave.
    pub(in crate::equilibrium) contraction: f64,
}

impl Default for Kept {
    /// Nothing is known: no matrix is trusted.
    fn default() -> Self {
        Self {
            renewed: 0,
            may_be_slow: false,
            tangents: Operator::None,
            stalls: false,
            contraction: f64::INFINITY,
        }
    }
}

impl Newton<'_> {
    /// Begins a step: with the matrix of the last one only if an interrupted run would have it, too.
    pub(super) fn begin(&mut self) {
        self.kept.renewed = 0;
        self.kept.may_be_slow = false;
        self.equations.matrix.held &= self.equations.matrix.has_tangents;
        self.equations.solver.check_next();
    }

    /// Ends a step. What a failed one leaves behind belongs to no state; and a matrix that was
    /// factorised another way would not be so again.
    pub(in crate::equilibrium) fn end(&mut self, is_equilibrium: bool) {
        if !self.equations.matrix.is_constant {
            let may_stay = is_equilibrium || self.settings.method != Method::Auto;
            self.equations.matrix.has_tangents &=
                may_stay && !self.equations.solver.has_fallen_back();
        }
    }

    /// Whether the matrix is that of an earlier step, though another could be had.
    pub(super) fn is_stale(&self) -> bool {
        self.settings.method == Method::Auto
            && !self.equations.matrix.is_constant
            && self.kept.renewed == 0
    }

    /// Begins the step with slow corrections where they are cheaper than another matrix.
    pub(in crate::equilibrium) fn begin_slowly(&mut self) {
        let groups = self.groups.iter().enumerate();
        let called = groups.filter(|(number, _)| self.equations.system.includes(*number));
        let n_points: usize = called.map(|(_, group)| group.kinematics.n_points()).sum();
        let n = self.equations.places.boundary.len() as f64;
        let is_dear = self.equations.domain.is_some() && n * n * n > DEAR * n_points as f64;
        let is_auto = self.settings.method == Method::Auto;
        self.kept.may_be_slow = is_dear && is_auto && !self.equations.matrix.is_constant;
    }

    /// Whether corrections with the present matrix may be slow.
    pub(in crate::equilibrium) fn is_slow(&self) -> bool {
        self.kept.may_be_slow && self.kept.renewed <= 1
    }

    /// Whether corrections come from a matrix that is kept though another could be had.
    pub(in crate::equilibrium) fn keeps(&self) -> bool {
        self.is_stale() || self.is_slow()
    }

    /// Whether slow corrections have to end. Either the last ones `since` the present matrix predict more of them than
    /// a new matrix is worth, or the step has used more than half of its iterations.
    pub(in crate::equilibrium) fn is_too_slow(
        &self,
        iterations: &[Iteration],
        since: usize,
    ) -> bool {
        let is_half = 2 * iterations.len() > self.settings.max_iterations();
        let Some([before, .., last]) = iterations[since..].last_chunk::<{ LAST + 1 }>() else {
            return is_half;
        };
        let progress = (before.residual / last.residual).ln() / LAST as f64;
        let left = (last.residual / (STALE * self.settings.force_tolerance)).ln();
        is_half || progress.is_nan() || left > AS_MANY * progress
    }

    /// Whether the next correction needs another matrix.
    fn renews(&self) -> bool {
        !self.equations.matrix.held
            || !self.equations.matrix.is_constant
                && match self.settings.method {
                    Method::Auto if self.is_slow() => self.kept.stalls,
                    Method::Auto => {
                        self.kept.contraction > FAST[usize::from(self.equations.domain.is_none())]
                    }
                    Method::Newton => true,
                    Method::ModifiedNewton => self.kept.renewed == 0,
                    Method::InitialStress => false,
                    Method::QuasiNewton => self.kept.stalls,
                }
    }

    /// The request to laws in an evaluation that a correction follows.
    pub(in crate::equilibrium) fn operator(&self) -> Operator {
        match self.settings.method {
            _ if !self.renews() => Operator::None,
            Method::InitialStress => Operator::Elastic,
            _ => Operator::Consistent,
        }
    }

    /// Renews the matrix where the method wants it. `increment` is the state of the last
    /// evaluation, which is repeated if it left out the tangents. Says whether there is another
    /// matrix now.
    ///
    /// # Errors
    /// A law fails, or the matrix is singular.
    pub(in crate::equilibrium) fn prepare(
        &mut self,
        increment: &[f64],
        task: &Task,
    ) -> Result<bool, StepFailure> {
        if !self.renews() {
            return Ok(false);
        }
        let operator = self.operator();
        if self.kept.tangents != operator {
            self.evaluate(increment, task, operator)
                .map_err(StepFailure::from)?;
        }
        self.factorise_tangents()?;
        self.equations.matrix.hold();
        self.kept.renewed += 1;
        self.kept.stalls = false;
        Ok(true)
    }

    /// Lets the groups hold the consistent tangents of this state, which was evaluated last.
    ///
    /// # Errors
    /// A law fails.
    pub(in crate::equilibrium) fn tangents_at(
        &mut self,
        increment: &[f64],
        task: &Task,
    ) -> Result<(), StepFailure> {
        if self.kept.tangents != Operator::Consistent {
            self.evaluate(increment, task, Operator::Consistent)?;
        }
        Ok(())
    }

    /// Takes up what the last correction achieved, and renews the matrix where the method wants it.
    /// Says whether there is another one now.
    pub(in crate::equilibrium) fn renew(
        &mut self,
        iterations: &[Iteration],
        increment: &[f64],
        task: &Task,
    ) -> Result<bool, StepFailure> {
        let achieved = achieved(iterations);
        self.kept.contraction = achieved.unwrap_or(self.kept.contraction);
        let renewed = self.prepare(increment, task)?;
        if renewed && achieved.is_some() {
            // The residual will fall quadratically: r₃ / r₂ = (r₂ / r₁)².
            self.kept.contraction *= self.kept.contraction;
        }
        Ok(renewed)
    }

    /// One whole correction with the matrix of an earlier step. `None` if the matrix is not one, or
    /// if the residual grows: then the matrix of this state has taken its place.
    pub(in crate::equilibrium) fn correct_with_kept(
        &mut self,
        control: &impl Control,
        state: &State,
        task: &Task,
    ) -> Result<Option<(Iteration, State)>, StepFailure> {
        if !self.is_stale() || self.is_slow() {
            return Ok(None);
        }
        let correction = Correction {
            increment: self.correction_of(&state.balance)?,
            rise: 0.0,
        };
        let operator = self.operator();
        let moved = control.evaluate(self, state.moved_by(1.0, &correction), operator);
        let enough = control.line_search(self, state).enough;
        if let Ok(next) = moved
            && next.balance.relative <= enough
        {
            let taken = self.took(&next, &correction.increment, 1.0);
            return Ok(Some((taken, next)));
        }
        // The groups hold another state.
        self.kept.tangents = Operator::None;
        self.kept.contraction = f64::INFINITY;
        self.prepare(&state.increment, task)?;
        Ok(None)
    }
}

/// Fraction of the residual that the last correction left; `None` before the first one, infinite if
/// it was not taken as a whole.
fn achieved(iterations: &[Iteration]) -> Option<f64> {
    let [.., before, last] = iterations else {
        return None;
    };
    let is_whole = last.step_length >= 1.0 && last.viscosity <= 0.0;
    let ratio = last.residual / before.residual;
    Some(if is_whole && ratio.is_finite() {
        ratio
    } else {
        f64::INFINITY
    })
}
