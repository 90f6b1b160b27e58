//! Steps whose load factor is given: the strategies of Newton's method under load control.
//!
//! A standstill is left by a [viscous motion](super::viscous). A kept matrix is tried before that of the present
//! state; slow corrections are accelerated.

use super::STEP_LENGTHS;
use super::regularised::{Regularised, STILL_MOVES, newton_leaves};
use super::viscous::{Viscous, stands_still};
use crate::equilibrium::newton::{
    Acceleration, Control, Correction, Iteration, LineSearch, Newton, Otherwise, State,
    StepFailure, Task, norm,
};
use crate::settings::Method;
use law::Operator;

/// A residual is tolerated only if none of this many last corrections was larger than [`STILL_MOVES`], relative to the
/// increment: what moves on is a mechanism, however small its residual.
const LAST: usize = 5;
/// It is not tolerated if the displacement increments are more than this many times those at the start of the
/// iterations.
const FAR: f64 = 5.0;

/// A step to a given load factor.
#[derive(Debug)]
pub(super) struct LoadControl {
    task: Task,
    /// Displacement increments to start from; the tangent at the start predicts them otherwise.
    guess: Option<Vec<f64>>,
    /// With a quasi-Newton matrix, and with others as long as slow corrections do.
    acceleration: Option<Acceleration>,
    /// Whether the settings want regularised corrections.
    regularises: bool,
    pub(super) regularised: Regularised,
    pub(super) viscous: Viscous,
    /// Displacement increments that left the least out of balance, and how much, relative.
    least: Option<(Vec<f64>, f64)>,
    /// Size of the first iterate's displacement increments.
    predicted: Option<f64>,
    /// No correction leads on from the present iterate: its tangent matrix is singular, or regularised corrections
    /// stand still.
    is_stuck: bool,
}

impl LoadControl {
    /// A step to this end.
    pub(super) fn new(
        newton: &mut Newton<'_>,
        task: Task,
        guess: Option<Vec<f64>>,
        is_expected: bool,
    ) -> Self {
        newton.begin_slowly();
        let is_quasi = newton.settings.method == Method::QuasiNewton;
        let is_slow = is_quasi || newton.is_slow();
        Self {
            task,
            guess,
            acceleration: is_slow.then(Acceleration::default),
            regularises: newton.settings.regularisation,
            regularised: Regularised::new(is_expected),
            viscous: Viscous::new(newton.settings, is_expected),
            least: None,
            predicted: None,
            is_stuck: false,
        }
    }

    /// The correction of an iterate with the matrix there is.
    fn correction(
        &mut self,
        newton: &mut Newton<'_>,
        state: &State,
    ) -> Result<Correction, StepFailure> {
        let correction = newton.correction_of(&state.balance)?;
        Ok(Correction {
            increment: match &mut self.acceleration {
                Some(acceleration) => acceleration.improve(correction),
                None => correction,
            },
            rise: 0.0,
        })
    }
}

impl Control for LoadControl {
    fn predict(&mut self, newton: &mut Newton<'_>) -> Result<State, StepFailure> {
        let from_tangent = self.guess.is_none();
        let increment = match self.guess.take() {
            Some(guess) => newton.completed(guess, &self.task.prescribed),
            None => match self.predicted(newton) {
                // What lies ahead may have a stiffness all the same.
                Err(failure) if failure.is_singular() && self.viscous.is_at_hand() => {
                    self.is_stuck = true;
                    let still = vec![0.0; self.task.external.len()];
                    newton.completed(still, &self.task.prescribed)
                }
                predicted => predicted?,
            },
        };
        newton.starts_from(&increment, from_tangent);
        if !from_tangent {
            self.viscous.starts_from(&increment);
        }
        let operator = newton.operator();
        self.evaluate(newton, (increment, self.task.period.1), operator)
    }

    fn evaluate(
        &self,
        newton: &mut Newton<'_>,
        (increment, rise): (Vec<f64>, f64),
        operator: Operator,
    ) -> Result<State, StepFailure> {
        newton.state_at(increment, rise, (&self.task, operator))
    }

    fn accept(
        &self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &[Iteration],
    ) -> Option<f64> {
        if self.viscous.has_arrived() || self.regularised.has_settled {
            return Some(0.0);
        }
        if newton.is_equilibrium(&state.balance, iterations.last()?) {
            return Some(0.0);
        }
        // What rounding leaves is looked for only where iterations lead no further: it costs two
        // evaluations.
        let series = self.series(iterations);
        let is_plain = newton.settings.method.is_newton() && !self.regularised.has_begun();
        let ends = is_plain && stands_still(series) || self.is_over(newton, iterations);
        let last = iterations.last()?;
        let is_round_off =
            ends && newton.is_round_off(&state.increment, (&state.balance, last), &self.task);
        is_round_off.then_some(state.balance.relative)
    }

    fn correct(
        &mut self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &mut Vec<Iteration>,
    ) -> Result<State, StepFailure> {
        if self.regularised.has_begun() && self.regularised.is_over(newton.settings, iterations) {
            self.give_way();
        }
        if !self.regularised.has_begun()
            && let Some(state) = self.relieved(newton, state, iterations)?
        {
            return Ok(state);
        }
        match self.corrected(newton, state, iterations) {
            Err(failure) if failure.is_singular() && self.viscous.is_at_hand() => {
                if self.has_settled(newton, state) {
                    return Err(failure);
                }
                if self.may_regularise() {
                    self.regularised.has_tried_newton(false);
                    match self.regularised_from_least(newton, state, iterations) {
                        Err(failure) if failure.is_singular() => {}
                        corrected => return corrected,
                    }
                }
                self.give_way();
                self.relieved(newton, state, iterations)?.ok_or(failure)
            }
            corrected => corrected,
        }
    }

    fn line_search(&self, newton: &Newton<'_>, from: &State) -> LineSearch {
        LineSearch {
            lengths: &STEP_LENGTHS,
            // Below the tolerance the residual may grow: there it is round-off.
            enough: from.balance.relative.max(newton.settings.force_tolerance),
            otherwise: Otherwise::Best,
        }
    }

    fn series<'i>(&self, iterations: &'i [Iteration]) -> &'i [Iteration] {
        self.viscous.series(iterations)
    }

    fn is_over(&self, newton: &Newton<'_>, iterations: &[Iteration]) -> bool {
        // Relaxation follows regularised corrections.
        !self.regularised.has_begun() && newton.is_over(self.series(iterations))
    }

    fn has_settled(&self, newton: &mut Newton<'_>, state: &State) -> bool {
        newton.has_settled(&state.increment, &state.balance, &self.task)
    }

    fn note(&mut self, state: &State) {
        let residual = state.balance.relative;
        let size = norm(&state.increment);
        // What goes far beyond what was predicted runs away, whatever it leaves out of balance.
        if size > FAR * *self.predicted.get_or_insert(size) {
            return;
        }
        let is_least = self
            .least
            .as_ref()
            .is_none_or(|(_, least)| residual < *least);
        if is_least && !state.balance.away.contains(&true) {
            self.least = Some((state.increment.clone(), residual));
        }
    }

    fn tolerate(
        &mut self,
        newton: &mut Newton<'_>,
        iterations: &[Iteration],
    ) -> Result<Option<State>, StepFailure> {
        let last = iterations.len().saturating_sub(LAST);
        let corrections = iterations[last..].iter().filter_map(|i| i.correction);
        let largest = corrections.fold(0.0, f64::max);
        let tolerated = newton.settings.tolerated_residual;
        let Some((increment, _)) = self.least.take().filter(|(_, least)| *least <= tolerated)
        else {
            return Ok(None);
        };
        // Methods that keep their matrix are slow without having come to an end.
        if largest > STILL_MOVES || !newton.settings.method.is_newton() {
            return Ok(None);
        }
        // Corrections with a share of the elastic stiffness are small along a mechanism too.
        if self.regularised.has_given_way
            && newton_leaves(newton, &self.task, &increment)? > STILL_MOVES
        {
            return Ok(None);
        }
        let at = (increment, self.task.period.1);
        let state = self.evaluate(newton, at, Operator::None)?;
        Ok(Some(state).filter(|state| state.balance.relative <= tolerated))
    }

    fn give_up(
        &self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &[Iteration],
    ) -> StepFailure {
        let correction = iterations.last().and_then(|last| last.correction);
        let in_vain = self.viscous.in_vain();
        // The state before the first correction is one of the series.
        let n = self.series(iterations).len().saturating_sub(1);
        newton.no_equilibrium(self, state, &self.task, (n, correction), in_vain)
    }
}

impl LoadControl {
    /// Displacement increments that the tangent at the start predicts.
    fn predicted(&self, newton: &mut Newton<'_>) -> Result<Vec<f64>, StepFailure> {
        let still = vec![0.0; self.task.external.len()];
        let operator = newton.operator();
        let balance = newton.evaluate(&still, &self.task, operator)?;
        newton.prepare(&still, &self.task)?;
        newton.answer_to(&balance.residual, &self.task.prescribed)
    }

    /// The state that a motion leads to where Newton iterations get on no further. `None` where they do.
    fn relieved(
        &mut self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &mut Vec<Iteration>,
    ) -> Result<Option<State>, StepFailure> {
        let is_singular = std::mem::take(&mut self.is_stuck);
        let from = (state.increment.as_slice(), is_singular);
        let reached = self.viscous.relieve(newton, &self.task, from, iterations)?;
        Ok(reached.map(|(increment, balance)| State {
            increment,
            rise: state.rise,
            balance,
        }))
    }

    /// The state that a correction of this one leads to.
    fn corrected(
        &mut self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &mut Vec<Iteration>,
    ) -> Result<State, StepFailure> {
        if self.regularised.has_begun() && !self.regularised.lets_try_newton() {
            return self.regularised_correction(newton, state, iterations);
        }
        if self.may_regularise() && self.regularised.is_due(self.series(iterations)) {
            return self.regularised_from_least(newton, state, iterations);
        }
        if let Some(acceleration) = &self.acceleration {
            newton.kept.stalls = if newton.is_slow() {
                newton.is_too_slow(iterations, acceleration.begins())
            } else {
                acceleration.stalls(iterations)
            };
        }
        if newton.renew(self.series(iterations), &state.increment, &self.task)?
            && self.acceleration.is_some()
        {
            // What moves with another matrix achieved says nothing of this one.
            let here = iterations.len() - 1;
            let is_quasi = newton.settings.method == Method::QuasiNewton;
            let goes_on = is_quasi || newton.is_slow();
            self.acceleration = goes_on.then(|| Acceleration::since(here));
            if !goes_on {
                self.viscous.starts_at(here);
            }
        }
        if let Some((taken, next)) = newton.correct_with_kept(self, state, &self.task)? {
            iterations.push(taken);
            return Ok(next);
        }
        if self.may_regularise() && self.regularised.is_expected() {
            return self.corrected_firmly(newton, state, iterations);
        }
        let correction = self.correction(newton, state)?;
        let size = norm(&correction.increment) / norm(&state.increment).max(f64::MIN_POSITIVE);
        let ends = newton.probably_ends(state.balance.relative, size);
        let (taken, next) = newton.search(self, state, &correction, ends)?;
        if let Some(acceleration) = &mut self.acceleration {
            acceleration.took(&correction.increment, taken.step_length);
        }
        iterations.push(taken);
        Ok(next)
    }

    /// Leaves the rest of the step to viscous relaxation. Regularised corrections are small along a mechanism too: what
    /// they led to is not tolerated.
    fn give_way(&mut self) {
        if self.regularised.has_begun() {
            self.least = None;
        }
        self.regularised.give_way();
        self.is_stuck = true;
    }

    /// Whether regularised corrections may take over.
    fn may_regularise(&self) -> bool {
        self.regularises
            && !self.regularised.has_given_way
            && self.acceleration.is_none()
            && self.viscous.relaxes()
            && self.viscous.is_at_hand()
    }

    /// The state that a whole Newton correction leads to or, if that is not near enough, a regularised one.
    fn corrected_firmly(
        &mut self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &mut Vec<Iteration>,
    ) -> Result<State, StepFailure> {
        let correction = self.correction(newton, state)?;
        let size = norm(&correction.increment) / norm(&state.increment).max(f64::MIN_POSITIVE);
        let operator = if newton.probably_ends(state.balance.relative, size) {
            Operator::None
        } else {
            newton.operator()
        };
        let at = state.moved_by(1.0, &correction);
        match self.evaluate(newton, at, operator) {
            Err(failure) if failure.is_stop() => return Err(failure),
            Ok(next)
                if !next.balance.away.contains(&true)
                    && (next.balance.relative <= newton.settings.force_tolerance
                        || self
                            .regularised
                            .takes(next.balance.relative / state.balance.relative)) =>
            {
                self.regularised.has_tried_newton(true);
                iterations.push(newton.took(&next, &correction.increment, 1.0));
                return Ok(next);
            }
            _ => {}
        }
        self.regularised.has_tried_newton(false);
        iterations.push(Iteration {
            step_length: 0.0,
            ..newton.took(state, &correction.increment, 0.0)
        });
        self.regularised
            .take_over(newton, &self.task, state, iterations)?;
        self.regularised_correction(newton, state, iterations)
    }

    /// The state that a regularised correction leads to from the iterate with the least residual or, without one, from
    /// this one.
    fn regularised_from_least(
        &mut self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &mut Vec<Iteration>,
    ) -> Result<State, StepFailure> {
        let increment = match &self.least {
            Some((increment, _)) if !self.regularised.has_begun() => increment.clone(),
            _ => state.increment.clone(),
        };
        let state = self.evaluate(newton, (increment, state.rise), Operator::None)?;
        self.regularised
            .take_over(newton, &self.task, &state, iterations)?;
        self.regularised_correction(newton, &state, iterations)
    }

    /// The state that a regularised correction leads to.
    fn regularised_correction(
        &mut self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &mut Vec<Iteration>,
    ) -> Result<State, StepFailure> {
        let mut regularised = std::mem::replace(&mut self.regularised, Regularised::new(false));
        let corrected = regularised.correct(newton, (&*self, &self.task), state);
        self.regularised = regularised;
        let (taken, next) = corrected?;
        iterations.push(taken);
        Ok(next)
    }
}
