//! The loop: predict, evaluate, accept, correct.
//!
//! The quantity that a step holds fixed is its [`Control`]: the load factor at its end, or the distance along the
//! path of equilibrium. The loop asks it for everything that depends on that.

use super::Newton;
use super::failure::StepFailure;
use super::line_search::LineSearch;
use super::outcome::Iteration;
use super::residual::{Balance, Task};
use law::Operator;

/// An iterate.
#[derive(Debug)]
pub(in crate::equilibrium) struct State {
    /// Displacement increments, by place.
    pub(in crate::equilibrium) increment: Vec<f64>,
    /// Increment of the load factor.
    pub(in crate::equilibrium) rise: f64,
    /// What that leaves out of balance.
    pub(in crate::equilibrium) balance: Balance,
}

impl Correction {
    /// Displacements at a load factor that stays.
    pub(in crate::equilibrium) fn by(increment: Vec<f64>) -> Self {
        let rise = 0.0;
        Self { increment, rise }
    }
}

impl State {
    /// Displacement increments and load factor after this fraction of a correction.
    pub(in crate::equilibrium) fn moved_by(
        &self,
        length: f64,
        correction: &Correction,
    ) -> (Vec<f64>, f64) {
        let pairs = self.increment.iter().zip(&correction.increment);
        (
            pairs.map(|(u, d)| u + length * d).collect(),
            self.rise + length * correction.rise,
        )
    }
}

/// The correction of an iterate.
#[derive(Debug)]
pub(in crate::equilibrium) struct Correction {
    /// To the displacement increments, by place.
    pub(in crate::equilibrium) increment: Vec<f64>,
    /// To the load factor.
    pub(in crate::equilibrium) rise: f64,
}

/// An iterate that is accepted.
#[derive(Debug)]
pub(in crate::equilibrium) struct Equilibrium {
    pub(in crate::equilibrium) state: State,
    /// The relative residual if it had to be taken for round-off; else 0.
    pub(in crate::equilibrium) round_off: f64,
    /// The relative residual if it is tolerated above the tolerance; else 0.
    pub(in crate::equilibrium) tolerated: f64,
}

impl Equilibrium {
    /// One that meets the tolerances, or round-off.
    pub(in crate::equilibrium) fn at(state: State, round_off: f64) -> Self {
        let tolerated = 0.0;
        Self {
            state,
            round_off,
            tolerated,
        }
    }
}

/// What a step holds fixed, and what follows for its iterations.
pub(in crate::equilibrium) trait Control {
    /// The first iterate.
    fn predict(&mut self, newton: &mut Newton<'_>) -> Result<State, StepFailure>;

    /// The iterate at these displacement increments and this increment of the load factor.
    fn evaluate(
        &self,
        newton: &mut Newton<'_>,
        at: (Vec<f64>, f64),
        operator: Operator,
    ) -> Result<State, StepFailure>;

    /// Whether an iterate is accepted: with how much of its residual taken for round-off.
    fn accept(
        &self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &[Iteration],
    ) -> Option<f64>;

    /// The next iterate. Adds the statistics to those of the iterations.
    fn correct(
        &mut self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &mut Vec<Iteration>,
    ) -> Result<State, StepFailure>;

    /// How far a correction is followed from here.
    fn line_search(&self, newton: &Newton<'_>, from: &State) -> LineSearch;

    /// The iterations that count towards the largest number allowed.
    fn series<'i>(&self, iterations: &'i [Iteration]) -> &'i [Iteration] {
        iterations
    }

    /// Whether no more iterations are allowed.
    fn is_over(&self, newton: &Newton<'_>, iterations: &[Iteration]) -> bool {
        newton.is_over(self.series(iterations))
    }

    /// Whether an iterate that no correction can be computed for is in equilibrium all the same.
    fn has_settled(&self, _newton: &mut Newton<'_>, _state: &State) -> bool {
        false
    }

    /// Takes note of an iterate.
    fn note(&mut self, _state: &State) {}

    /// An iterate that is tolerated where iterations have come to their end without meeting the
    /// tolerances.
    ///
    /// # Errors
    /// A law fails at it, though it did not before.
    fn tolerate(
        &mut self,
        _newton: &mut Newton<'_>,
        _iterations: &[Iteration],
    ) -> Result<Option<State>, StepFailure> {
        Ok(None)
    }

    /// The failure of iterations that have reached their limit.
    fn give_up(
        &self,
        newton: &mut Newton<'_>,
        state: &State,
        iterations: &[Iteration],
    ) -> StepFailure;
}

impl Newton<'_> {
    /// Seeks equilibrium under this control.
    ///
    /// # Errors
    /// No equilibrium within the allowed iterations, or a law or the equations failed.
    pub(in crate::equilibrium) fn iterate(
        &mut self,
        control: &mut impl Control,
        iterations: &mut Vec<Iteration>,
    ) -> Result<Equilibrium, StepFailure> {
        let mut state = control.predict(self)?;
        iterations.push(Iteration::first(&state.balance));
        loop {
            self.may_go_on()?;
            if let Some(round_off) = control.accept(self, &state, iterations) {
                return Ok(Equilibrium::at(state, round_off));
            }
            control.note(&state);
            if control.is_over(self, iterations) {
                return self.end_of(control, &state, iterations);
            }
            let before = iterations.len();
            let next = match control.correct(self, &state, iterations) {
                Err(failure) if failure.is_singular() && control.has_settled(self, &state) => {
                    return Ok(Equilibrium::at(state, 0.0));
                }
                corrected => corrected?,
            };
            // Numbers have come to their end far away: nothing leads back.
            if !next.balance.relative.is_finite() {
                iterations.truncate(before);
                return self.end_of(control, &state, iterations);
            }
            state = next;
        }
    }

    /// The iterate at these displacement increments and this increment of the load factor.
    ///
    /// # Errors
    /// A law fails.
    pub(in crate::equilibrium) fn state_at(
        &mut self,
        increment: Vec<f64>,
        rise: f64,
        (task, operator): (&Task, Operator),
    ) -> Result<State, StepFailure> {
        let balance = self.evaluate(&increment, task, operator)?;
        Ok(State {
            increment,
            rise,
            balance,
        })
    }

    /// Displacement increments with those of prescribed and tied degrees of freedom.
    pub(in crate::equilibrium) fn completed(
        &self,
        mut increment: Vec<f64>,
        prescribed: &[f64],
    ) -> Vec<f64> {
        for &place in &self.equations.places.prescribed {
            increment[place] = prescribed[place];
        }
        self.equations.places.follow(&mut increment);
        increment
    }

    /// The outcome of iterations that end at this state: a tolerated state or a failure.
    fn end_of(
        &mut self,
        control: &mut impl Control,
        state: &State,
        iterations: &[Iteration],
    ) -> Result<Equilibrium, StepFailure> {
        if let Some(state) = control.tolerate(self, iterations)? {
            let tolerated = state.balance.relative;
            return Ok(Equilibrium {
                tolerated,
                ..Equilibrium::at(state, 0.0)
            });
        }
        Err(control.give_up(self, state, iterations))
    }

    /// Whether no more iterations are allowed. The state before the first correction is one of the
    /// series.
    pub(in crate::equilibrium) fn is_over(&self, series: &[Iteration]) -> bool {
        series.len() > self.settings.max_iterations()
    }
}
