//! Arc-length control: along the path of equilibrium to the load that could not be reached by load
//! increments.

use super::{PhaseEquations, Run};
use crate::checkpoint::PhaseCourse;
use crate::error::{Error, Place};
use crate::output::{PhaseRecord, Results};
use crate::run::{EASY, Noting, Observer};
use crate::solver::{Measure, Newton, StepFailure, StepSuccess};

/// Steps along the path within one increment, at most.
const MAX_STEPS: usize = 500;
/// First step, as a fraction of what the points moved in a whole load increment.
const FIRST: f64 = 0.25;
/// A step is halved at most so many times.
const HALVINGS: i32 = 12;
/// Growth of a step after an easy one.
const GROWTH: f64 = 1.5;

/// How a path ends.
pub(super) enum PathEnd {
    /// At the load that was sought, after so many iterations.
    Reached(usize),
    /// No equilibrium was found.
    Stopped(Box<StepFailure>),
}

/// A path on its way.
struct Course {
    /// Distance of the next step, and that of a whole increment of the load.
    distance: f64,
    whole: f64,
    /// Load factors it has been at.
    lowest: f64,
    highest: f64,
    /// Iterations so far.
    spent: usize,
}

impl Run<'_> {
    /// Follows the path of equilibrium until the load factor reaches `target` from below, in
    /// increments of 1/`n`.
    ///
    /// # Errors
    /// Results cannot be written, or the linear groups are not in equilibrium.
    #[expect(clippy::too_many_arguments, reason = "what a phase works on, apart")]
    pub(super) fn follow(
        &mut self,
        place: &Place,
        [n, target]: [f64; 2],
        phase: &mut PhaseCourse,
        equations: &mut PhaseEquations,
        record: &mut PhaseRecord,
        results: &mut Results,
        observer: &mut Noting<'_>,
    ) -> Result<PathEnd, Error> {
        let settings = &self.case.file.solver;
        let easy = EASY * settings.method.max_iterations() as f64;
        let start = phase.lambda;
        let stopped = |reason: String| {
            let failure = StepFailure::because(reason);
            Ok(PathEnd::Stopped(Box::new(failure)))
        };
        let Some(mut course) = self.set_out(phase, n) else {
            let reason = "no non-linear group deforms: there is no path to follow";
            return stopped(reason.to_owned());
        };
        for _ in 0..MAX_STEPS {
            let from = phase.lambda;
            match self.go(phase, course.distance, equations, record) {
                Ok((success, lambda)) if lambda < target => {
                    results.iterations(place, lambda, &success.iterations)?;
                    let iterations = success.iterations.len();
                    course.spent += iterations;
                    course.highest = course.highest.max(lambda);
                    course.lowest = course.lowest.min(lambda);
                    record.arc_length += 1;
                    self.arrive(success, phase, equations, lambda);
                    self.step(place, phase, equations, record, results, iterations)?;
                    if iterations as f64 <= easy {
                        course.distance = (GROWTH * course.distance).min(course.whole);
                    }
                }
                Ok((beyond, lambda)) => {
                    course.spent += beyond.iterations.len();
                    // Onto the target itself, by the load.
                    let guess = (lambda - from, beyond.increment);
                    let ends = [from, target];
                    let onto = self.attempt(&phase.loads, ends, Some(&guess), equations, record);
                    let Ok(success) = onto else {
                        course.distance *= 0.5;
                        continue;
                    };
                    results.iterations(place, target, &success.iterations)?;
                    let iterations = success.iterations.len();
                    self.arrive(success, phase, equations, target);
                    phase.step = (target - from).min(1.0 / n);
                    self.step(place, phase, equations, record, results, iterations)?;
                    observer.warning(&format!(
                        "{place}: the load could not simply rise from {start:.4} of the phase; the \
                         path of equilibrium was followed between {:.4} and {:.4} (path.csv)",
                        course.lowest, course.highest
                    ));
                    return Ok(PathEnd::Reached(course.spent + iterations));
                }
                Err(failure) => {
                    results.iterations(place, from, &failure.iterations)?;
                    course.spent += failure.iterations.len();
                    record.cut_backs += 1;
                    results.cut_back(place, from, course.distance, &failure.reason)?;
                    observer.cut_back(place, &failure.reason);
                    course.distance *= 0.5;
                    let smallest = FIRST * course.whole * f64::powi(2.0, -HALVINGS);
                    if failure.defect.is_some() || course.distance < smallest {
                        let reason = format!(
                            "{}; the path of equilibrium was followed from {start:.4} of the \
                             phase, between {:.4} and {:.4}",
                            failure.reason, course.lowest, course.highest
                        );
                        let failure = StepFailure { reason, ..failure };
                        return Ok(PathEnd::Stopped(Box::new(failure)));
                    }
                }
            }
        }
        stopped(format!(
            "the load does not rise beyond {:.4} of the phase: in {MAX_STEPS} steps along the path of \
             equilibrium it went down to {:.4} and is at {:.4}",
            course.highest, course.lowest, phase.lambda
        ))
    }

    /// A path from where the phase stands.
    fn set_out(&self, phase: &PhaseCourse, n: f64) -> Option<Course> {
        let (length, increment) = phase.last.as_ref()?;
        let measure = Measure::new(&self.groups, increment)?;
        let whole = measure.of(increment) / (n * length).abs();
        Some(Course {
            distance: FIRST * whole,
            whole,
            lowest: phase.lambda,
            highest: phase.lambda,
            spent: 0,
        })
    }

    /// One step along the path, guessed from the last one. Returns its load factor too.
    fn go(
        &mut self,
        phase: &PhaseCourse,
        distance: f64,
        equations: &mut PhaseEquations,
        record: &mut PhaseRecord,
    ) -> Result<(StepSuccess, f64), StepFailure> {
        let last = phase.last.as_ref();
        let known = last.and_then(|(length, increment)| {
            Some((Measure::new(&self.groups, increment)?, length, increment))
        });
        let Some((measure, length, increment)) = known else {
            let reason = "no non-linear group deforms any more: the path ends";
            return Err(StepFailure::because(reason.to_owned()));
        };
        let ratio = distance / measure.of(increment);
        let guess = increment.iter().map(|u| ratio * u).collect();
        let mut newton = Newton::new(
            &equations.system,
            equations.domain.as_ref(),
            (&mut equations.solver, &mut equations.matrix),
            &mut self.groups,
            &self.case.file.solver,
            &mut record.costs,
        );
        let start = [phase.lambda, self.time];
        newton.follow(
            &phase.loads,
            start,
            (&measure, distance),
            (guess, ratio * length),
        )
    }

    /// Takes over a step to load factor λ.
    fn arrive(
        &mut self,
        success: StepSuccess,
        phase: &mut PhaseCourse,
        equations: &mut PhaseEquations,
        lambda: f64,
    ) {
        self.accept(&success, &phase.loads, equations, lambda);
        phase.last = Some((lambda - phase.lambda, success.increment));
        phase.lambda = lambda;
    }

    /// Writes a step in equilibrium into the path.
    pub(super) fn step(
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
        results.step(place, lambda, &probes, iterations)
    }
}
