//! Arc-length control: along the path of equilibrium to the load that could not be reached by load
//! increments.

use super::steps::{EASY, Progress};
use super::until::Verdict;
use super::{Simulation, State, UnderWay, Warning, Watch, When, go_on, stopped};
use crate::equilibrium::{Guess, Measure, Newton, Reason, StepFailure, StepSuccess};
use crate::error::{Error, Place};
use crate::settings::{Control, Method, Settings};

/// Steps along the path within one increment, at most.
const MAX_STEPS: usize = 500;
/// First step, as a fraction of what the points moved in a whole load increment.
const FIRST: f64 = 0.25;
/// Maximum number of halvings of a step.
const HALVINGS: i32 = 12;
/// A step by the load has leapt where the points move faster than this, relative to the last step.
const LEAP: f64 = 4.0;
/// Growth of a step after an easy one.
const GROWTH: f64 = 1.5;

/// A path that has gone back beyond the start of the phase by more of it than this runs the other way. A snap-back may
/// pass the start where earlier phases have loaded what gives way.
const BACK: f64 = 1.0;

/// How a path ends.
pub(super) enum PathEnd {
    /// At the load that was sought.
    Reached,
    /// No equilibrium was found; with the highest load factor that was reached.
    Stopped(Box<StepFailure>, f64),
}

/// A path on its way.
struct Course<'p> {
    place: &'p Place,
    /// Increments of the phase, and the load factor that is sought.
    n: f64,
    target: f64,
    /// Load factor where it starts.
    start: f64,
    /// Distance of the next step, and that of a whole increment of the load.
    distance: f64,
    whole: f64,
    /// Load factors it has been at.
    lowest: f64,
    highest: f64,
    /// Steps taken.
    steps: usize,
}

impl Course<'_> {
    fn between(&self) -> [f64; 2] {
        [self.lowest, self.highest]
    }

    /// It ends without equilibrium.
    fn stops(&self, failure: impl Into<StepFailure>) -> PathEnd {
        PathEnd::Stopped(Box::new(failure.into()), self.highest)
    }
}

impl Simulation {
    /// Follows the path of equilibrium until the load factor reaches the second number of `goal` from below, in as
    /// many increments of the phase as the first one.
    ///
    /// # Errors
    /// The observer stopped the run, or the linear groups are not in equilibrium.
    pub(super) fn follow_path(
        &mut self,
        place: &Place,
        goal: [f64; 2],
        phase: &mut UnderWay,
        watch: &mut dyn Watch,
        done: &mut Progress,
    ) -> Result<PathEnd, Error> {
        let Some(mut course) = self.set_out(phase, place, goal) else {
            let reason = Reason::NothingDeforms { any_more: false };
            let highest = phase.course.lambda;
            return Ok(PathEnd::Stopped(Box::new(reason.into()), highest));
        };
        for _ in 0..MAX_STEPS {
            let before = self.before_step(phase);
            let end = match self.advance_to_target(phase, &course, done) {
                Ok((_, lambda)) if lambda < -BACK => Some(course.stops(Reason::RanBack {
                    steps: course.steps,
                    highest: course.highest,
                    to: lambda,
                })),
                Ok(step) => self.take_path_step(step, before, &mut course, phase, watch, done)?,
                Err(failure) => shorten(failure, &mut course, phase, watch, done)?,
            };
            if let Some(end) = end {
                return Ok(end);
            }
        }
        Ok(course.stops(Reason::LoadDoesNotRise {
            steps: MAX_STEPS,
            between: course.between(),
            at: phase.course.lambda,
        }))
    }

    /// One step along the path, or onto the target itself where that is nearer. Returns its load factor too.
    fn advance_to_target(
        &mut self,
        phase: &mut UnderWay,
        course: &Course<'_>,
        done: &mut Progress,
    ) -> Result<(StepSuccess, f64), StepFailure> {
        let (from, target) = (phase.course.lambda, course.target);
        let (beyond, lambda) = self.advance(phase, course.distance)?;
        if lambda < target {
            return Ok((beyond, lambda));
        }
        done.iterations += beyond.iterations.len();
        let ratio = (target - from) / (lambda - from);
        let guess = Guess {
            increment: beyond.increment.iter().map(|u| ratio * u).collect(),
            contraction: None,
            was_motion: false,
        };
        let way = (Control::ArcLength, false);
        let onto = self.attempt(phase, way, [from, target], Some(guess));
        onto.map(|success| (success, target))
    }

    /// Takes over a step along the path. Returns the end of the path if it is there.
    fn take_path_step(
        &mut self,
        (success, lambda): (StepSuccess, f64),
        before: Option<State<'static>>,
        course: &mut Course<'_>,
        phase: &mut UnderWay,
        watch: &mut dyn Watch,
        done: &mut Progress,
    ) -> Result<Option<PathEnd>, Error> {
        let (place, from) = (course.place, phase.course.lambda);
        let most = self.problem.settings.max_iterations() as f64;
        let is_easy = success.iterations.len() as f64 <= EASY * most;
        self.take_over(success, lambda, place, phase, watch, done)?;
        phase.record.arc_length += 1;
        match self.look_after_step(place, phase, before, watch)? {
            Verdict::GoesOn => {}
            Verdict::Ends => return Ok(Some(PathEnd::Reached)),
            Verdict::Again(part) => {
                course.distance *= part;
                return Ok(None);
            }
        }
        course.steps += 1;
        if lambda >= course.target {
            // Not so short that the next increment starts with next to nothing.
            let n = course.n;
            phase.course.step = (course.target - from).clamp(FIRST / n, 1.0 / n);
            watch.warning(&Warning::FollowedPath {
                place: place.clone(),
                from: course.start,
                range: course.between(),
            });
            return Ok(Some(PathEnd::Reached));
        }
        course.highest = course.highest.max(lambda);
        course.lowest = course.lowest.min(lambda);
        if is_easy {
            course.distance = (GROWTH * course.distance).min(course.whole);
        }
        Ok(None)
    }

    /// A step by the load under arc-length control, unless it has leapt over a piece of the path. In a leap the points
    /// that measure the path move much farther per load than in the last step.
    pub(super) fn without_leap(
        &self,
        attempt: Result<StepSuccess, StepFailure>,
        phase: &UnderWay,
        length: f64,
    ) -> Result<StepSuccess, StepFailure> {
        let success = attempt?;
        let followed = self.problem.settings.control == Control::ArcLength;
        let last = phase.course.history.latest().filter(|_| followed);
        let Some((last_length, last)) = last else {
            return Ok(success);
        };
        let Some(measure) = Measure::new(&self.groups, &phase.equations.places, last) else {
            return Ok(success);
        };
        let before = (measure.of(last) / last_length).abs();
        let now = (measure.of(&success.increment) / length).abs();
        if now <= LEAP * before {
            return Ok(success);
        }
        Err(StepFailure {
            iterations: success.iterations,
            ..Reason::Leap(now / before).into()
        })
    }

    /// A path from where the phase stands.
    fn set_out<'p>(
        &self,
        phase: &UnderWay,
        place: &'p Place,
        [n, target]: [f64; 2],
    ) -> Option<Course<'p>> {
        let (length, increment) = phase.course.history.latest()?;
        let measure = Measure::new(&self.groups, &phase.equations.places, increment)?;
        let whole = measure.of(increment) / (n * length).abs();
        let start = phase.course.lambda;
        Some(Course {
            place,
            n,
            target,
            start,
            distance: FIRST * whole,
            whole,
            lowest: start,
            highest: start,
            steps: 0,
        })
    }

    /// One step along the path, guessed from the last one. Returns its load factor too.
    fn advance(
        &mut self,
        phase: &mut UnderWay,
        distance: f64,
    ) -> Result<(StepSuccess, f64), StepFailure> {
        let (course, equations) = (&phase.course, &mut phase.equations);
        let last = course.history.latest();
        let known = last.and_then(|(length, increment)| {
            Some((
                Measure::new(&self.groups, &equations.places, increment)?,
                length,
                increment,
            ))
        });
        let Some((measure, length, increment)) = known else {
            return Err(Reason::NothingDeforms { any_more: true }.into());
        };
        let ratio = distance / measure.of(increment);
        let guess = increment.iter().map(|u| ratio * u).collect();
        // The path turns: a matrix of another state is of no use there.
        let settings = Settings {
            method: Method::Newton,
            ..self.problem.settings
        };
        let clock = self.clock(phase.number);
        let (equations, costs) = (equations.iterated(), &mut phase.record.costs);
        let mut newton =
            Newton::new(equations, &mut self.groups, &settings, costs).stopped_by(&self.stop);
        newton.step_along(
            &course.loads,
            (course.lambda, clock),
            (&measure, distance),
            (guess, ratio * length),
        )
    }

    /// Hands out a step in equilibrium, within an increment.
    pub(super) fn hand_out_step(
        &mut self,
        place: &Place,
        phase: &mut UnderWay,
        iterations: usize,
        watch: &mut dyn Watch,
    ) -> Result<(), Error> {
        let lambda = phase.course.lambda;
        let looked_at = watch.looks_at(When::Step, &self.groups);
        self.complete(phase, looked_at.as_ref())
            .map_err(|reason| self.incomplete(phase, place, lambda, reason))?;
        go_on(watch.step(place, lambda, iterations, &self.snapshot()))
    }
}

/// Halves the distance after a step without equilibrium. Returns the end of the path if it is too short then.
fn shorten(
    failure: StepFailure,
    course: &mut Course<'_>,
    phase: &mut UnderWay,
    watch: &mut dyn Watch,
    done: &mut Progress,
) -> Result<Option<PathEnd>, Error> {
    let (place, from) = (course.place, phase.course.lambda);
    if failure.is_stop() {
        return Err(stopped(place));
    }
    go_on(watch.iterations(place, from, &failure.iterations))?;
    done.iterations += failure.iterations.len();
    phase.record.cut_backs += 1;
    course.distance *= 0.5;
    go_on(watch.cut_back(place, from, course.distance, &failure.reason))?;
    let smallest = FIRST * course.whole * f64::powi(2.0, -HALVINGS);
    if failure.defect().is_some() {
        return Ok(Some(course.stops(failure)));
    }
    if course.distance >= smallest {
        return Ok(None);
    }
    let reason = Reason::Followed {
        end: Box::new(failure.reason),
        start: course.start,
        between: course.between(),
    };
    Ok(Some(course.stops(StepFailure { reason, ..failure })))
}
