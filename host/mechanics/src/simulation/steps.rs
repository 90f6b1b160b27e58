//! Steps from equilibrium to equilibrium up to the end of an increment: how long they are, and what follows where
//! one finds none.

use super::arc_length::PathEnd;
use super::continuation::{self, Lead};
use super::until::Verdict;
use super::{Simulation, UnderWay, Warning, Watch, go_on, stopped};
use crate::equilibrium::{Guess, LedBy, Newton, StepFailure, StepSuccess};
use crate::error::{Error, Place};
use crate::group::Group;
use crate::settings::{Control, Settings};

/// Step, as a fraction of an increment, below which arc-length control takes over, if a step may
/// be halved so often.
const PATIENCE: f64 = 0.2;
/// Fastest growth of steps after a cut-back.
const REGROWTH: f64 = 2.0;
/// Share of the method's own limit of iterations up to which a step counts as easy, so that the
/// next one may be larger.
pub(super) const EASY: f64 = 0.34;
/// Smallest and largest reduction of a step at a cut-back.
const CUT: [f64; 2] = [0.1, 0.5];

/// Results of an increment on its way.
#[derive(Debug, Default)]
pub(super) struct Progress {
    pub(super) iterations: usize,
    pub(super) unreliable: Option<String>,
}

/// An increment on its way.
struct Way<'p> {
    place: &'p Place,
    /// Increments of the phase.
    n: usize,
    /// Load factor at its end.
    target: f64,
    /// Smallest step.
    smallest: f64,
    /// So many iterations are few.
    easy: f64,
    lead: Lead,
    /// A step was cut back.
    was_cut: bool,
    done: Progress,
}

/// What follows a step that found no equilibrium and may be cut.
enum Then {
    /// A shorter one.
    Shorter,
    /// The path of equilibrium, on which the load may fall.
    Path,
    /// Viscous control, which leads from here on.
    Viscous,
    /// Viscous control by single corrections, from here on, with a first step of this length.
    Singly(f64),
    /// The control before single corrections, with a step of this length.
    Back(f64),
    /// Nothing.
    End,
}

impl Simulation {
    /// Steps up to the end of an increment, one of `n`; as many as it takes.
    pub(super) fn reach(
        &mut self,
        place: &Place,
        n: usize,
        phase: &mut UnderWay,
        watch: &mut dyn Watch,
    ) -> Result<Progress, Error> {
        let settings = self.settings();
        let mut way = Way {
            place,
            n,
            target: if place.increment == n {
                1.0
            } else {
                place.increment as f64 / n as f64
            },
            smallest: 1.0 / n as f64 / f64::powi(2.0, settings.max_halvings as i32),
            easy: EASY * settings.method.max_iterations() as f64,
            lead: Lead::new(&settings),
            was_cut: false,
            done: Progress::default(),
        };
        while phase.course.lambda < way.target && !phase.course.is_over {
            if phase.course.lambda >= phase.course.loads.leg[1] {
                self.turn(place, phase)?;
            }
            let step = way.next(phase);
            let before = self.before_step(phase);
            let guess = phase.course.history.guess(step[1] - step[0]);
            let attempt = self.attempt(phase, (way.lead.control, way.lead.singly), step, guess);
            match self.without_leap(attempt, phase, step[1] - step[0]) {
                Ok(success) => {
                    self.go_forward(success, step, &mut way, phase, watch)?;
                    let verdict = self.look_after_step(place, phase, before, watch)?;
                    if let Verdict::Again(part) = verdict {
                        phase.course.step = part * (step[1] - step[0]);
                    }
                }
                Err(failure) => self.go_otherwise(failure, step, &mut way, phase, watch)?,
            }
        }
        Ok(way.done)
    }

    /// Goes on from a step that found equilibrium.
    fn go_forward(
        &mut self,
        success: StepSuccess,
        step: [f64; 2],
        way: &mut Way<'_>,
        phase: &mut UnderWay,
        watch: &mut dyn Watch,
    ) -> Result<(), Error> {
        self.look_after(&success, (self.clock(phase.number), step), watch);
        if success.led_by != LedBy::Newton {
            self.note_motion(&success, step, way.lead.control, (way.place, phase), watch);
        }
        // Of a motion, and of what is tolerated, more is said already.
        if way.was_cut && success.led_by != LedBy::Viscous && success.tolerated == 0.0 {
            self.note_cut_back(&success, step, (way.place, phase), watch);
        }
        way.lead.goes_on();
        // A motion takes many iterations, and steps of any length.
        if success.was_motion || success.iterations.len() as f64 <= way.easy {
            phase.course.step = (REGROWTH * way.longest(phase)).min(1.0 / way.n as f64);
        }
        self.take_over(success, step[1], way.place, phase, watch, &mut way.done)
    }

    /// Goes on from a step that found none: once more with other tangents, with a shorter one, along the path of
    /// equilibrium, under viscous control.
    ///
    /// # Errors
    /// There is no way on, or whoever watches wants no more.
    fn go_otherwise(
        &mut self,
        failure: StepFailure,
        step: [f64; 2],
        way: &mut Way<'_>,
        phase: &mut UnderWay,
        watch: &mut dyn Watch,
    ) -> Result<(), Error> {
        let place = way.place;
        if failure.is_stop() {
            return Err(stopped(place));
        }
        let [start, end] = step;
        go_on(watch.iterations(place, end, &failure.iterations))?;
        way.done.iterations += failure.iterations.len();
        if self.look_after_failure(&failure, (self.clock(phase.number), step), watch) {
            return Ok(());
        }
        phase.record.cut_backs += 1;
        let factor = failure.factor().unwrap_or(CUT[1]).clamp(CUT[0], CUT[1]);
        phase.course.step = factor * (end - start);
        go_on(watch.cut_back(place, end, phase.course.step, &failure.reason))?;
        match self.after(&failure, way, phase) {
            Then::Shorter => {
                way.was_cut = true;
                Ok(())
            }
            Then::Back(step) => {
                phase.course.step = step;
                Ok(())
            }
            Then::End => Err(self.cannot_go_on(phase, place, start, failure)),
            Then::Path => {
                let goal = [way.n as f64, way.target.min(phase.course.loads.leg[1])];
                match self.follow_path(place, goal, phase, watch, &mut way.done)? {
                    PathEnd::Reached => Ok(()),
                    PathEnd::Stopped(failure, highest) => {
                        Err(self.cannot_go_on(phase, place, highest, *failure))
                    }
                }
            }
            Then::Singly(step) => {
                way.was_cut = false;
                phase.course.step = step;
                if phase.record.singly_from.is_none() {
                    phase.record.singly_from = Some(place.increment);
                    watch.warning(&Warning::SingleCorrections(place.clone()));
                }
                Ok(())
            }
            Then::Viscous => {
                way.was_cut = false;
                if !way.lead.was_in_vain() {
                    phase.course.step = continuation::LONGEST / way.n as f64;
                }
                if phase.record.viscous_from.is_none() {
                    phase.record.viscous_from = Some(place.increment);
                    watch.warning(&Warning::TurnedViscous(place.clone()));
                }
                Ok(())
            }
        }
    }

    /// What follows a step that failed, the next one being that of the phase's course.
    fn after(&self, failure: &StepFailure, way: &mut Way<'_>, phase: &UnderWay) -> Then {
        let (step, n) = (phase.course.step, way.n as f64);
        if let Some(step) = way.lead.turns_back() {
            return Then::Back(step);
        }
        if way.lead.opens_bonds(failure)
            && let Some(step) = way.lead.begins_early(step, way.smallest, n)
        {
            return Then::Singly(step);
        }
        let follows = self.settings().control == Control::ArcLength
            && phase.course.history.latest().is_some();
        let is_small = step < way.smallest.max(PATIENCE / n);
        let is_out = step < way.smallest;
        let stays = way.lead.stays(is_out, step * n);
        // Where single corrections have led before, nothing else is tried first.
        let again = phase.record.singly_from.is_some() && way.lead.has_waited();
        let turns = !stays && !again && way.lead.turns(failure, is_out);
        let is_over = is_out && !stays && !(turns && way.lead.is_viscous());
        let is_over = is_over || way.lead.is_at_its_end(step * n);
        if failure.defect().is_some() {
            Then::End
        } else if follows && is_small {
            Then::Path
        } else if (again || is_over)
            && self.groups.iter().any(Group::may_break)
            && let Some(step) = way.lead.begins_singly(failure, way.smallest, n)
        {
            Then::Singly(step)
        } else if turns && way.lead.is_viscous() {
            Then::Viscous
        } else if is_over {
            Then::End
        } else {
            Then::Shorter
        }
    }

    /// Goes on to the next leg of the phase's course, from a complete state.
    fn turn(&mut self, place: &Place, phase: &mut UnderWay) -> Result<(), Error> {
        let lambda = phase.course.lambda;
        self.complete(phase, None)
            .map_err(|reason| self.incomplete(phase, place, lambda, reason))?;
        if self.next_leg(phase.number, &mut phase.course)
            && let Some(domain) = &mut phase.equations.domain
        {
            let internal = domain.internal_forces(&self.groups);
            let loads = &phase.course.loads;
            let tolerance = self.problem.settings.force_tolerance;
            domain.start(&self.groups, internal, loads, &self.displacement, tolerance);
        }
        Ok(())
    }

    /// Takes over a step that reached equilibrium at load factor λ, with its warnings.
    pub(super) fn take_over(
        &mut self,
        success: StepSuccess,
        lambda: f64,
        place: &Place,
        phase: &mut UnderWay,
        watch: &mut dyn Watch,
        done: &mut Progress,
    ) -> Result<(), Error> {
        let iterations = success.iterations.len();
        // Whoever wants no more has the state of this equilibrium: viscous control has committed its way to it.
        let flow = watch.iterations(place, lambda, &success.iterations);
        done.iterations += iterations;
        let record = &mut phase.record;
        let is_met = success.round_off <= self.problem.settings.force_tolerance;
        if success.round_off > 0.0 && is_met {
            let last = success.iterations.last().and_then(|last| last.correction);
            let above = last.filter(|left| *left > self.settings().displacement_tolerance);
            record.unsettled = record.unsettled.max(above.unwrap_or(0.0));
        }
        record.round_off = record.round_off.max(success.round_off);
        let tolerance = self.problem.settings.force_tolerance;
        let scale = success.scales.iter().copied().fold(0.0, f64::max);
        let residual = success.iterations.last().map_or(0.0, |last| last.residual);
        record.residual_force = record.residual_force.max(residual * scale);
        if success.tolerated > 0.0 {
            record.tolerated += 1;
            record.tolerated_residual = record.tolerated_residual.max(success.tolerated);
            let force = success.tolerated * scale;
            record.tolerated_force = record.tolerated_force.max(force);
            if record.tolerated == 1 {
                watch.warning(&Warning::Tolerated {
                    place: place.clone(),
                    residual: success.tolerated,
                    force,
                    tolerance,
                });
            }
        }
        if let Some(open) = &success.open
            && open.correction > self.problem.settings.displacement_tolerance
        {
            record.by_force += 1;
            record.open = record.open.and(open);
        }
        if let Some(why) = &success.unreliable {
            record.unreliable += 1;
            done.unreliable.get_or_insert_with(|| why.clone());
        }
        self.accept(&success, phase, lambda);
        let course = &mut phase.course;
        course.history.add(lambda - course.lambda, success);
        course.lambda = lambda;
        go_on(flow)?;
        if self.problem.settings.control == Control::ArcLength {
            self.hand_out_step(place, phase, iterations, watch)?;
        }
        Ok(())
    }

    /// One step; from a guess if there is one, else from the tangent.
    pub(super) fn attempt(
        &mut self,
        phase: &mut UnderWay,
        (control, singly): (Control, bool),
        [from, to]: [f64; 2],
        guess: Option<Guess>,
    ) -> Result<StepSuccess, StepFailure> {
        let settings = Settings {
            control,
            ..self.settings()
        };
        let clock = self.clock(phase.number);
        let (equations, costs) = (phase.equations.iterated(), &mut phase.record.costs);
        let mut newton = Newton::new(equations, &mut self.groups, &settings, costs)
            .stopped_by(&self.stop)
            .taking_single_corrections(singly);
        newton.step(&phase.course.loads, [from, to], clock, guess)
    }
}

impl Way<'_> {
    /// Length that the next step may have.
    fn longest(&self, phase: &UnderWay) -> f64 {
        let step = phase.course.step;
        if self.lead.is_short() {
            step.min(continuation::LONGEST / self.n as f64)
        } else {
            step
        }
    }

    /// Start and end of the next step.
    fn next(&self, phase: &UnderWay) -> [f64; 2] {
        let target = self.target.min(phase.course.loads.leg[1]);
        let (start, step) = (phase.course.lambda, self.longest(phase));
        // A remainder that is hardly longer than the step is taken at once.
        let end = if target - start <= 1.0001 * step {
            target
        } else {
            start + step
        };
        [start, end]
    }
}
