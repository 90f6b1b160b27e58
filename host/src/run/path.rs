//! Arc-length control: along the path of equilibrium to the load that could not be reached by load
//! increments.

use super::{PhaseEquations, Run};
use crate::case::{Control, Method, SolverInput};
use crate::checkpoint::PhaseCourse;
use crate::error::{Error, Place};
use crate::output::{IncrementRecord, PhaseRecord, Results};
use crate::run::{EASY, Noting, Observer};
use crate::solver::{Guess, Measure, Newton, StepFailure, StepSuccess};

/// Steps along the path within one increment, at most.
const MAX_STEPS: usize = 500;
/// First step, as a fraction of what the points moved in a whole load increment.
const FIRST: f64 = 0.25;
/// A step is halved at most so many times.
const HALVINGS: i32 = 12;
/// A step by the load has leapt where the points move faster than this, relative to the last step.
const LEAP: f64 = 4.0;
/// Growth of a step after an easy one.
const GROWTH: f64 = 1.5;

/// How a path ends.
pub(super) enum PathEnd {
    /// At the load that was sought.
    Reached,
    /// No equilibrium was found; with the highest load factor that was reached.
    Stopped(Box<StepFailure>, f64),
}

/// A path on its way.
struct Course {
    /// Distance of the next step, and that of a whole increment of the load.
    distance: f64,
    whole: f64,
    /// Load factors it has been at.
    lowest: f64,
    highest: f64,
}

impl Run<'_> {
    /// Follows the path of equilibrium until the load factor reaches `target` from below, in
    /// increments of 1/`n`.
    ///
    /// # Errors
    /// Results cannot be written, or the linear groups are not in equilibrium.
    #[expect(clippy::too_many_arguments, reason = "what a phase works on, apart")]
    pub(super) fn follow_path(
        &mut self,
        place: &Place,
        [n, target]: [f64; 2],
        phase: &mut PhaseCourse,
        equations: &mut PhaseEquations,
        record: &mut PhaseRecord,
        results: &mut Results,
        observer: &mut Noting<'_>,
        done: &mut IncrementRecord,
    ) -> Result<PathEnd, Error> {
        let start = phase.lambda;
        let Some(mut course) = self.set_out(phase, equations, n) else {
            let reason = "no non-linear group deforms: there is no path to follow";
            let failure = StepFailure::because(reason.to_owned());
            return Ok(PathEnd::Stopped(Box::new(failure), start));
        };
        for _ in 0..MAX_STEPS {
            let from = phase.lambda;
            let mut step = self.advance(phase, course.distance, equations, record);
            if let Ok((beyond, lambda)) = &step
                && *lambda >= target
            {
                // Onto the target itself, by the load.
                done.iterations += beyond.iterations.len();
                let ratio = (target - from) / (lambda - from);
                let guess = Guess {
                    increment: beyond.increment.iter().map(|u| ratio * u).collect(),
                    contraction: None,
                };
                let ends = [from, target];
                let onto = self.attempt(&phase.loads, ends, Some(guess), equations, record);
                step = onto.map(|success| (success, target));
            }
            match step {
                Ok((success, lambda)) => {
                    let is_easy = success.iterations.len() as f64
                        <= EASY * self.file().solver.max_iterations() as f64;
                    self.take_over(
                        success, lambda, place, phase, equations, record, results, done,
                    )?;
                    record.arc_length += 1;
                    if lambda >= target {
                        // Not so short that the next increment starts with next to nothing.
                        phase.step = (target - from).clamp(FIRST / n, 1.0 / n);
                        observer.warning(&format!(
                            "{place}: the load could not simply rise from {start:.4} of the phase; \
                             the path of equilibrium was followed between {:.4} and {:.4} \
                             (path.csv)",
                            course.lowest, course.highest
                        ));
                        return Ok(PathEnd::Reached);
                    }
                    course.highest = course.highest.max(lambda);
                    course.lowest = course.lowest.min(lambda);
                    if is_easy {
                        course.distance = (GROWTH * course.distance).min(course.whole);
                    }
                }
                Err(failure) if failure.is_stop => return Err(Self::stopped(place)),
                Err(failure) => {
                    results.iterations(place, from, &failure.iterations)?;
                    done.iterations += failure.iterations.len();
                    record.cut_backs += 1;
                    course.distance *= 0.5;
                    results.cut_back(place, from, course.distance, &failure.reason)?;
                    observer.cut_back(place, &failure.reason);
                    let smallest = FIRST * course.whole * f64::powi(2.0, -HALVINGS);
                    if failure.defect.is_some() || course.distance < smallest {
                        let reason = format!(
                            "{}; the path of equilibrium was followed from {start:.4} of the \
                             phase, between {:.4} and {:.4}",
                            failure.reason, course.lowest, course.highest
                        );
                        let failure = StepFailure { reason, ..failure };
                        return Ok(PathEnd::Stopped(Box::new(failure), course.highest));
                    }
                }
            }
        }
        let failure = StepFailure::because(format!(
            "the load does not rise beyond {:.4} of the phase: in {MAX_STEPS} steps along the \
             path of equilibrium it went down to {:.4} and is at {:.4}",
            course.highest, course.lowest, phase.lambda
        ));
        Ok(PathEnd::Stopped(Box::new(failure), course.highest))
    }

    /// A step by the load under arc-length control, unless it has leapt over a piece of the path:
    /// then the points that the path is measured by have moved much farther than in the last step.
    pub(super) fn without_leap(
        &self,
        attempt: Result<StepSuccess, StepFailure>,
        phase: &PhaseCourse,
        equations: &PhaseEquations,
        length: f64,
    ) -> Result<StepSuccess, StepFailure> {
        let success = attempt?;
        let followed = self.file().solver.control == Control::ArcLength;
        let last = phase.history.latest().filter(|_| followed);
        let Some((last_length, last)) = last else {
            return Ok(success);
        };
        let Some(measure) = Measure::new(&self.groups, &equations.places, last) else {
            return Ok(success);
        };
        let before = (measure.of(last) / last_length).abs();
        let now = (measure.of(&success.increment) / length).abs();
        if now <= LEAP * before {
            return Ok(success);
        }
        Err(StepFailure {
            iterations: success.iterations,
            ..StepFailure::because(format!(
                "the non-linear groups move {:.1} times as fast as in the last step, which may leap \
                 over a piece of the path of equilibrium",
                now / before
            ))
        })
    }

    /// A path from where the phase stands.
    fn set_out(&self, phase: &PhaseCourse, equations: &PhaseEquations, n: f64) -> Option<Course> {
        let (length, increment) = phase.history.latest()?;
        let measure = Measure::new(&self.groups, &equations.places, increment)?;
        let whole = measure.of(increment) / (n * length).abs();
        Some(Course {
            distance: FIRST * whole,
            whole,
            lowest: phase.lambda,
            highest: phase.lambda,
        })
    }

    /// One step along the path, guessed from the last one. Returns its load factor too.
    fn advance(
        &mut self,
        phase: &PhaseCourse,
        distance: f64,
        equations: &mut PhaseEquations,
        record: &mut PhaseRecord,
    ) -> Result<(StepSuccess, f64), StepFailure> {
        let last = phase.history.latest();
        let known = last.and_then(|(length, increment)| {
            Some((
                Measure::new(&self.groups, &equations.places, increment)?,
                length,
                increment,
            ))
        });
        let Some((measure, length, increment)) = known else {
            let reason = "no non-linear group deforms any more: the path ends";
            return Err(StepFailure::because(reason.to_owned()));
        };
        let ratio = distance / measure.of(increment);
        let guess = increment.iter().map(|u| ratio * u).collect();
        // The path turns: a matrix of another state is of no use there.
        let settings = SolverInput {
            method: Method::Newton,
            ..self.case.file.solver
        };
        let mut newton = Newton::new(
            (&equations.system, &equations.places),
            equations.domain.as_ref(),
            (&mut equations.solver, &mut equations.matrix),
            &mut self.groups,
            &settings,
            &mut record.costs,
        );
        newton = newton.stopped_by(&self.stop);
        let start = [phase.lambda, self.time];
        newton.step_along(
            &phase.loads,
            start,
            (&measure, distance),
            (guess, ratio * length),
        )
    }

    /// Writes a step in equilibrium into the path.
    pub(super) fn write_step(
        &mut self,
        place: &Place,
        phase: &PhaseCourse,
        equations: &mut PhaseEquations,
        record: &mut PhaseRecord,
        results: &mut Results,
        iterations: usize,
    ) -> Result<(), Error> {
        let lambda = phase.lambda;
        let looked_at = self.looked_at.0.clone();
        let reaction = self
            .complete(equations, &phase.loads, lambda, Some(&looked_at), record)
            .map_err(|why| Error::NoEquilibrium {
                message: format!("{place}: {why}"),
                hint: None,
            })?;
        let probes = self.probes.values(&self.snapshot(&reaction));
        self.probes.check(self.case, place, &probes)?;
        results.step(place, lambda, &probes, iterations)
    }
}
