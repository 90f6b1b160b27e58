//! Steps from one equilibrium to the next: what a step holds fixed, and how it leaves a place where Newton
//! iterations come to a standstill.
//!
//! | | |
//! |---|---|
//! | [`load_step`] | steps to a given load factor |
//! | [`arc_length`] | steps along the path of equilibrium, whose load factor is unknown |
//! | [`regularised`] | corrections with a share of the elastic stiffness, where Newton iterations get on slowly |
//! | [`viscous`], [`viscous_motion`] | from a standstill to an equilibrium: when, and how |

mod arc_length;
mod load_step;
mod regularised;
mod viscous;
mod viscous_motion;

pub use arc_length::Measure;

use super::newton::{Equilibrium, Guess, LedBy, Loads, Newton, StepFailure, StepSuccess};
use arc_length::ArcLength;
use load_step::LoadControl;

/// Lengths of a correction that line searches try; along a path all but the last one.
const STEP_LENGTHS: [f64; 5] = [1.0, 0.5, 0.25, 0.125, 0.0625];

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

impl Newton<'_> {
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
        let base = self.start.base.take();
        self.set_out(loads);
        self.start.base = base;
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
        self.take_domain_forces(lambda_end);
        let prescribed = loads.prescribed_increments(lambda_start, lambda_end);
        let prescribed = self.equations.places.gather(&prescribed);
        let period = clock.period(lambda_start, lambda_end - lambda_start);
        let task = self.task(&loads.external(lambda_end), prescribed, period);
        let guess = guess.map(|guess| guess.increment);
        let mut control = LoadControl::new(self, task, guess, is_expected);
        let mut iterations = Vec::new();
        let outcome = self.iterate(&mut control, &mut iterations);
        self.end(outcome.is_ok());
        match outcome {
            Ok(equilibrium) => {
                let viscous = &control.viscous;
                let open = self.open(&equilibrium.state.balance, &iterations);
                Ok(StepSuccess {
                    led_by: if viscous.has_led_here() {
                        LedBy::Viscous
                    } else if control.regularised.has_begun() {
                        LedBy::Regularised
                    } else {
                        LedBy::Newton
                    },
                    was_kept: self.keeps(),
                    was_motion: viscous.lets_expect_another() || control.regularised.has_begun(),
                    open,
                    ..equilibrium.reached(iterations)
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
                Ok((equilibrium.reached(iterations), reached))
            }
            Err(failure) => Err(self.explained(failure, iterations, from, clock.period(from, 0.0))),
        }
    }
}

impl Equilibrium {
    /// Outcome of a step.
    fn reached(self, iterations: Vec<super::Iteration>) -> StepSuccess {
        let balance = self.state.balance;
        StepSuccess {
            increment: self.state.increment,
            iterations,
            unreliable: balance.unreliable,
            led_by: LedBy::Newton,
            was_kept: false,
            was_motion: false,
            round_off: self.round_off,
            tolerated: self.tolerated,
            scales: balance.scales,
            open: None,
        }
    }
}
