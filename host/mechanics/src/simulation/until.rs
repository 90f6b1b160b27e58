//! Phases that end where a quantity reaches a value.
//!
//! Whoever watches measures the quantity after every step. A step that leads too far is taken back, and a shorter one
//! is taken, by the secant of the quantity.

use super::{Simulation, State, UnderWay, Warning, Watch, When};
use crate::error::{Error, Place};
use crate::problem::Until;
use std::fmt;

/// How far beyond the value a phase may end, and is led, as a part of the change from its start.
const WITHIN: f64 = 8e-3;
const AIM: f64 = 3e-3;
/// The same for what rounding leaves.
const ROUND_OFF: f64 = 1e-9;
/// Half of the last digit of a value that is shown.
const SHOWN: f64 = 5e-7;
/// Shortest and longest part of a step that is taken again.
const PART: [f64; 2] = [0.02, 0.98];
/// Repeated steps after which the next ones are halved, and the largest number of repeated steps.
const HALVED: usize = 8;
const MOST: usize = 40;

/// A phase that has ended before its time, since its quantity has reached its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Reached {
    /// The phase.
    pub phase: String,
    /// Its last increment; 0: it had reached it at its start.
    pub increment: usize,
    /// Increments that it would have.
    pub of: usize,
    /// What was asked for.
    pub until: Until,
    /// The quantity at the end.
    pub value: f64,
    /// Share of the phase's time at its end.
    pub part: f64,
}

impl fmt::Display for Reached {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            phase,
            increment,
            of,
            until: Until { quantity, reaches },
            value,
            part,
        } = self;
        if *increment == 0 {
            write!(f, "phase {phase}: no increment: `{quantity}` is ")?;
            return if is_at(*value, *reaches) {
                write!(f, "already {reaches} at its start")
            } else {
                write!(f, "{value:.6} at its start, already beyond {reaches}")
            };
        }
        write!(
            f,
            "phase {phase}: ends with increment {increment} of {of}, at {part:.4} of its course: `{quantity}` has \
             reached {reaches}, it is {value:.6}"
        )
    }
}

/// Whether a value is one that was asked for, to the digits that are shown.
fn is_at(value: f64, asked: f64) -> bool {
    (value - asked).abs() <= SHOWN.max(ROUND_OFF * asked.abs())
}

/// What follows a step.
pub(super) enum Verdict {
    /// The next one.
    GoesOn,
    /// The end of the phase.
    Ends,
    /// It was taken back: this part of it follows.
    Again(f64),
}

impl Simulation {
    /// The state before a step, if its phase may end with it.
    pub(super) fn before_step(&self, phase: &mut UnderWay) -> Option<State<'static>> {
        self.problem.phases[phase.number].until.as_ref()?;
        phase.note_course(self.settings().method);
        let state = self.state_in(phase).into_owned();
        phase.course.domain = None;
        Some(state)
    }

    /// Measures the quantity at the start of a phase, which may be the phase's end.
    pub(super) fn look_at_start(&mut self, watch: &mut dyn Watch) {
        let Some(mut phase) = self.under_way.take() else {
            return;
        };
        if let Some(until) = self.problem.phases[phase.number].until.clone() {
            let name = &self.problem.phases[phase.number].name;
            let value = watch.quantity(name, &until.quantity, &self.snapshot());
            phase.course.measured = value.map(|value| [value; 2]);
            let near = |value: &f64| (value - until.reaches).abs() <= ROUND_OFF * value.abs();
            if let Some(value) = value.filter(near) {
                phase.course.is_over = true;
                watch.reached(&self.reached(&phase, until, value));
            }
        }
        self.under_way = Some(phase);
    }

    /// Measures the quantity after a step, and says what follows. `before`: the state before the step.
    pub(super) fn look_after_step(
        &mut self,
        place: &Place,
        phase: &mut UnderWay,
        before: Option<State<'static>>,
        watch: &mut dyn Watch,
    ) -> Result<Verdict, Error> {
        let until = self.problem.phases[phase.number].until.clone();
        let (Some(until), Some(mut before)) = (until, before) else {
            return Ok(Verdict::GoesOn);
        };
        let lambda = phase.course.lambda;
        let looked_at = watch.looks_at(When::Step, &self.groups);
        self.complete(phase, looked_at.as_ref())
            .map_err(|reason| self.incomplete(phase, place, lambda, reason))?;
        let value = watch.quantity(&place.phase, &until.quantity, &self.snapshot());
        let Some(value) = value.filter(|value| value.is_finite()) else {
            return Ok(Verdict::GoesOn);
        };
        let Some([first, last]) = phase.course.measured else {
            phase.course.measured = Some([value; 2]);
            return Ok(Verdict::GoesOn);
        };
        // From 0 at the start to 1 where it is reached.
        let share = |value: f64| (value - first) / (until.reaches - first);
        let starts = before.part_of_phase() <= 0.0;
        if starts && share(value) < -ROUND_OFF && first.abs() > until.reaches.abs() {
            // It was beyond, and goes away from it.
            self.go_back(phase, before)?;
            phase.course.is_over = true;
            watch.reached(&self.reached(phase, until, first));
            return Ok(Verdict::Ends);
        }
        if share(value) < 1.0 - ROUND_OFF {
            phase.course.measured = Some([first, value]);
            return Ok(Verdict::GoesOn);
        }
        let tries = before.taken_back();
        if share(value) <= 1.0 + WITHIN || tries >= MOST {
            phase.course.measured = Some([first, value]);
            phase.course.is_over = true;
            return Ok(Verdict::Ends);
        }
        let secant = (1.0 + AIM - share(last)) / (share(value) - share(last));
        let part = if tries < HALVED { secant } else { 0.5 };
        before.take_back_again(phase.equations.counted_in(&phase.record));
        self.go_back(phase, before)?;
        Ok(Verdict::Again(part.clamp(PART[0], PART[1])))
    }

    fn go_back(&mut self, phase: &mut UnderWay, before: State<'static>) -> Result<(), Error> {
        self.go_to(before)?;
        if let Some(back) = self.under_way.take() {
            *phase = back;
        }
        Ok(())
    }

    /// Says where a phase has ended, if it has ended for its quantity; or that this has not reached its value.
    pub(super) fn tell_end(&self, phase: &UnderWay, watch: &mut dyn Watch) {
        let input = &self.problem.phases[phase.number];
        let Some(until) = input.until.clone() else {
            return;
        };
        let [_, value] = phase.course.measured.unwrap_or([f64::NAN; 2]);
        if !phase.course.is_over {
            let phase = input.name.clone();
            watch.warning(&Warning::NotReached {
                phase,
                until,
                last: value,
            });
        } else if phase.course.increment > 0 {
            watch.reached(&self.reached(phase, until, value));
        }
    }

    fn reached(&self, phase: &UnderWay, until: Until, value: f64) -> Reached {
        let input = &self.problem.phases[phase.number];
        Reached {
            phase: input.name.clone(),
            increment: phase.course.increment,
            of: input.increments,
            until,
            value,
            part: phase.course.lambda,
        }
    }
}
