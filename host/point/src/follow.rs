//! Following the path: rows on the way, and what came of it.

use crate::driver::Driver;
use crate::error::{Cause, Error, Failure, NoEquilibrium, Place};
use crate::frame::Frame;
use crate::increments::{Halt, Walk};
use crate::path::{Control, Segment};
use crate::state::{Goal, Point, Vector};
use law::{Moment, words};

/// The state at the end of an increment, in the components of the law's hypothesis.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    /// Increment, counted through all segments; 0 is the initial state.
    pub increment: usize,
    /// Time at its end.
    pub time: f64,
    /// Jumps or strains.
    pub gradient: &'a [f64],
    /// Tractions or stresses.
    pub flux: &'a [f64],
    /// Internal variables.
    pub internal: &'a [f64],
    /// Calls of the law that the increment took.
    pub iterations: usize,
    /// Whether it is for the table: its [`Segment`] may say that not every one is.
    pub is_written: bool,
}

/// What came of a path that was followed to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Increments done.
    pub increments: usize,
    /// Calls of the law.
    pub calls: usize,
    /// Steps repeated with a smaller size.
    pub cut_backs: usize,
    /// The last state, in the order of [`Driver::columns`].
    pub last: Vec<f64>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// The path as far as it was followed.
struct Way<'a> {
    driver: &'a Driver,
    walk: Walk<'a>,
    /// Increments done.
    increment: usize,
    /// Time at the end of the last one.
    time: f64,
    /// The step.
    moment: Moment,
    /// The flux that components without control keep.
    held: Vector,
    warnings: Vec<String>,
    strayed: Option<String>,
    blurred: Option<String>,
}

impl Way<'_> {
    fn row<'a>(&self, point: &'a Point, iterations: usize, is_written: bool) -> Row<'a> {
        let n = self.driver.law.n_components();
        Row {
            increment: self.increment,
            time: self.time,
            gradient: &point.gradient[..n],
            flux: &point.flux[..n],
            internal: &point.internal,
            iterations,
            is_written,
        }
    }

    /// Follows a segment.
    fn follow<E: From<Error>>(
        &mut self,
        number: usize,
        sink: &mut impl FnMut(&Row<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let driver = self.driver;
        let segment = &driver.segments[number];
        self.walk.change_frame(segment.frame, &mut self.held);
        let n = driver.law.n_components();
        let ramp = self.walk.enter(segment, n, &self.held);
        if segment.first == 0 {
            self.moment.step_start = self.time;
            self.moment.step_length = driver.length_of_step(number);
        }
        let (start, share) = (self.time, segment.length() / segment.increments as f64);
        let mut goal = ramp.from;
        for k in 1..=segment.increments {
            let next = ramp.goal(k, segment.increments);
            let calls = self.walk.search.calls;
            self.walk.search.moment = Moment {
                step: segment.step,
                increment: (segment.first + k) as u32,
                ..self.moment
            };
            let place = Place::Increment {
                segment: number + 1,
                increment: k,
                of: segment.increments,
                row: self.increment + 1,
            };
            let reached = self.walk.advance(&goal, &next, (self.time, share));
            let point = self.walk.cartesian();
            self.walk.ignored.increment(place, &point.flux);
            reached.map_err(|halt| self.failure(halt, place))?;
            self.look_at(&next, place);
            self.increment += 1;
            self.time = start + k as f64 * share;
            let calls = self.walk.search.calls - calls;
            sink(&self.row(&point, calls, driver.is_written(number, k)))?;
            goal = next;
        }
        self.hold(segment, &goal);
        Ok(())
    }

    /// Notices a point that strayed or is blurred, the first one of each.
    fn look_at(&mut self, goal: &Goal, place: Place) {
        if self.blurred.is_none() {
            self.blurred = self.driver.blurred(&self.walk, goal, place);
        }
        if self.strayed.is_none() {
            self.strayed = self.driver.strayed(&self.walk, place);
        }
    }

    /// A flux that was led keeps its goal; what is left of its residual does not pile up.
    fn hold(&mut self, segment: &Segment, goal: &Goal) {
        for i in 0..self.driver.law.n_components() {
            self.held[i] = match segment.control[i] {
                Control::Keep | Control::Flux(_) | Control::FluxBy(_)
                    if segment.restrictions.is_none() =>
                {
                    goal.flux[i]
                }
                _ => self.walk.point.flux[i],
            };
        }
    }

    fn failure(&mut self, halt: Halt, place: Place) -> Error {
        let (law, mut warnings) = (&self.driver.law, std::mem::take(&mut self.warnings));
        warnings.extend(self.strayed.take());
        warnings.extend(self.walk.ignored.warning(law));
        let is_without_stiffness = self.walk.search.is_without_stiffness();
        if is_without_stiffness {
            warnings.push(format!(
                "law `{}` has no stiffness in the initial state: its operator is zero there, as that of a \
                 routine that leaves its tangent unset (DDSDDE of a UMAT), and no stress can be imposed by it",
                law.description().id
            ));
        }
        Error::from(Failure {
            warnings,
            is_without_stiffness,
            ..self.driver.failure(place, self.driver.cause(halt))
        })
    }

    /// What came of it at the end.
    fn course(mut self) -> Course {
        let (law, mut warnings) = (&self.driver.law, self.warnings);
        warnings.extend(self.strayed);
        warnings.extend(self.blurred);
        warnings.extend(self.walk.ignored.warning(law));
        self.walk.change_frame(Frame::Cartesian, &mut self.held);
        // Results that the law calls inaccurate.
        let (times, first) = self.walk.search.unreliable;
        if times > 0 {
            let id = &law.description().id;
            warnings.push(format!(
                "law `{id}` calls {times} updates unreliable; the first: {first}"
            ));
        }
        warnings.extend(law.take_notes());
        let n = law.n_components();
        let Point {
            gradient,
            flux,
            internal,
        } = &self.walk.point;
        let last = gradient[..n].iter().chain(&flux[..n]).chain(internal);
        Course {
            increments: self.increment,
            calls: self.walk.search.calls,
            cut_backs: self.walk.cut_backs,
            last: last.copied().collect(),
            warnings,
        }
    }
}

impl Driver {
    /// Names of gradients, fluxes and internal variables, in this order.
    pub fn columns(&self) -> Vec<String> {
        let hypothesis = self.law.hypothesis();
        let (gradient, flux) = words(hypothesis);
        let components = hypothesis.components();
        let named = |word| components.iter().map(move |c| format!("{word}_{c}"));
        let variables = &self.law.formulation().internal_variables;
        named(gradient)
            .chain(named(flux))
            .chain(variables.iter().map(|v| v.id.clone()))
            .collect()
    }

    /// Follows the path and hands out its rows, the initial state first, each as soon as it is
    /// reached. A `sink` that fails ends the way.
    ///
    /// # Errors
    /// [`Error::InitialState`] if the law refuses to start; [`Error::Failure`] with its [`Cause`]
    /// where a flux cannot be reached, the law cannot follow or breaks down, or the driver was asked
    /// to stop; whatever `sink` fails with.
    pub fn run<E: From<Error>>(
        &self,
        mut sink: impl FnMut(&Row<'_>) -> Result<(), E>,
    ) -> Result<Course, E> {
        let (point, search, warnings) = self.start()?;
        let mut way = Way {
            driver: self,
            held: point.flux,
            walk: Walk::new(point, search),
            increment: 0,
            time: 0.0,
            moment: Moment::default(),
            warnings,
            strayed: None,
            blurred: None,
        };
        sink(&way.row(&way.walk.point, 0, true))?;
        for number in 0..self.segments.len() {
            way.follow(number, &mut sink)?;
        }
        Ok(way.course())
    }

    /// Whether the increment `k` of a segment is for the table.
    fn is_written(&self, number: usize, k: usize) -> bool {
        let segment = &self.segments[number];
        let next = self.segments.get(number + 1);
        let ends = k == segment.increments && next.is_none_or(|next| next.step != segment.step);
        ends || (segment.first + k).is_multiple_of(segment.every)
    }

    /// How long the step takes that starts with a segment: one, or several that follow each other.
    pub(crate) fn length_of_step(&self, number: usize) -> f64 {
        let segments = self.segments.get(number..).unwrap_or_default();
        let step = segments.first().map(|segment| segment.step);
        let of_step = segments.iter().take_while(|s| Some(s.step) == step);
        of_step.map(Segment::length).sum()
    }

    /// What to say of a point that round-off keeps from its goal.
    fn blurred(&self, walk: &Walk<'_>, goal: &Goal, place: Place) -> Option<String> {
        if walk.search.is_restricted() {
            return None;
        }
        let miss = walk.search.blurred(&walk.point, goal)?;
        let hypothesis = self.law.hypothesis();
        let (gradient, flux) = words(hypothesis);
        Some(format!(
            "{place}: {flux} `{}` is {:.6e} where {:.6e} is asked for, and comes no nearer: law `{}` is so \
             stiff that rounding the {gradient} changes the {flux} by as much",
            walk.search.frame().component(miss.component, hypothesis),
            miss.flux,
            miss.goal,
            self.law.description().id
        ))
    }

    /// What to say of a point that went farther than what it was led to explains.
    fn strayed(&self, walk: &Walk<'_>, place: Place) -> Option<String> {
        let component = walk.search.strayed(&walk.point)?;
        let hypothesis = self.law.hypothesis();
        let (gradient, flux) = words(hypothesis);
        Some(format!(
            "{place}: {gradient} `{}` has to come to {:.3e} to meet its {flux}, which is all but the \
             strength of law `{}`",
            walk.search.frame().component(component, hypothesis),
            walk.point.gradient[component],
            self.law.description().id
        ))
    }

    /// The meaning of a halt.
    fn cause(&self, halt: Halt) -> Cause {
        let why = match halt {
            Halt::Asked => return Cause::Stopped,
            Halt::Fatal(failure) => return Cause::Law(*failure),
            Halt::Shortfall(shortfall) => shortfall.told(self.law.hypothesis()),
        };
        let refusal = why.refusal.as_ref();
        let breaks_down = refusal.is_some_and(|failure| self.law.breaks_down(failure));
        match why.refusal {
            Some(failure) if why.unmet.is_none() && breaks_down => Cause::LawInSmallSteps(*failure),
            refusal => Cause::NoEquilibrium(NoEquilibrium { refusal, ..why }),
        }
    }
}
