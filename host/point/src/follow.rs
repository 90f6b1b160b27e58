//! Following the path: rows on the way, and what came of it.

use crate::driver::Driver;
use crate::error::{Cause, Error, NoEquilibrium, Place, Warning};
use crate::frame::Frame;
use crate::increments::{Halt, Walk};
use crate::path::{Control, Segment};
use crate::state::{Goal, Point};
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
    pub warnings: Vec<Warning>,
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
        let (point, search, mut warnings) = self.start()?;
        let mut walk = Walk::new(point, search);
        let (mut strayed, mut blurred) = (None, None);
        let n = self.law.n_components();
        let mut row = |point: &Point, (increment, time), iterations, is_written| {
            sink(&Row {
                increment,
                time,
                gradient: &point.gradient[..n],
                flux: &point.flux[..n],
                internal: &point.internal,
                iterations,
                is_written,
            })
        };
        row(&walk.point, (0, 0.0), 0, true)?;
        let mut increment = 0;
        let mut time = 0.0;
        let mut moment = Moment::default();
        let mut held = walk.point.flux;
        for (number, segment) in self.segments.iter().enumerate() {
            walk.change_frame(segment.frame, &mut held);
            let ramp = walk.enter(segment, n, &held);
            if segment.first == 0 {
                moment.step_start = time;
                moment.step_length = self.length_of_step(number);
            }
            let (start, share) = (time, segment.length() / segment.increments as f64);
            let mut goal = ramp.from;
            for k in 1..=segment.increments {
                let next = ramp.goal(k, segment.increments);
                let calls = walk.search.calls;
                walk.search.moment = Moment {
                    step: segment.step,
                    increment: (segment.first + k) as u32,
                    ..moment
                };
                let place = Place::Increment {
                    segment: number + 1,
                    increment: k,
                    of: segment.increments,
                    row: increment + 1,
                };
                let reached = walk.advance(&goal, &next, (time, share));
                let point = walk.cartesian();
                if walk.is_ignored {
                    walk.silence.ignored(place, &point.flux);
                }
                if let Err(halt) = reached {
                    warnings.extend(strayed);
                    warnings.extend(walk.silence.warning(&self.law));
                    if walk.search.is_without_stiffness() {
                        let law = self.law.description().id.clone();
                        warnings.push(Warning::NoStiffness { law });
                    }
                    return Err(self.failure(place, self.cause(halt), warnings).into());
                }
                if blurred.is_none() {
                    blurred = self.blurred(&walk, &next, place);
                }
                if strayed.is_none() {
                    strayed = self.strayed(&walk, place);
                }
                increment += 1;
                time = start + k as f64 * share;
                let calls = walk.search.calls - calls;
                row(&point, (increment, time), calls, self.is_written(number, k))?;
                goal = next;
            }
            // A flux that was led keeps its goal; what is left of its residual does not pile up.
            for i in 0..n {
                held[i] = match segment.control[i] {
                    _ if segment.restrictions.is_some() => walk.point.flux[i],
                    Control::Keep | Control::Flux(_) | Control::FluxBy(_) => goal.flux[i],
                    Control::Gradient(_) | Control::GradientBy(_) | Control::Stiffness(_) => {
                        walk.point.flux[i]
                    }
                };
            }
        }
        warnings.extend(strayed);
        warnings.extend(blurred);
        warnings.extend(walk.silence.warning(&self.law));
        walk.change_frame(Frame::Cartesian, &mut held);
        warnings.extend(self.unreliable(&walk));
        warnings.extend(self.law.take_notes().into_iter().map(Warning::Note));
        let Point {
            gradient,
            flux,
            internal,
        } = &walk.point;
        let last = gradient[..n].iter().chain(&flux[..n]).chain(internal);
        Ok(Course {
            increments: increment,
            calls: walk.search.calls,
            cut_backs: walk.cut_backs,
            last: last.copied().collect(),
            warnings,
        })
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

    /// What to say of results that the law calls inaccurate.
    fn unreliable(&self, walk: &Walk<'_>) -> Option<Warning> {
        let (times, first) = &walk.search.unreliable;
        (*times > 0).then(|| Warning::Unreliable {
            law: self.law.description().id.clone(),
            times: *times,
            first: first.clone(),
        })
    }

    /// What to say of a point that round-off keeps from its goal.
    fn blurred(&self, walk: &Walk<'_>, goal: &Goal, place: Place) -> Option<Warning> {
        if walk.search.is_restricted() {
            return None;
        }
        let miss = walk.search.blurred(&walk.point, goal)?;
        let hypothesis = self.law.hypothesis();
        Some(Warning::Blurred {
            place,
            law: self.law.description().id.clone(),
            hypothesis,
            component: walk.search.frame().component(miss.component, hypothesis),
            found: miss.flux,
            goal: miss.goal,
        })
    }

    /// What to say of a point that went farther than what it was led to explains.
    fn strayed(&self, walk: &Walk<'_>, place: Place) -> Option<Warning> {
        let component = walk.search.strayed(&walk.point)?;
        let hypothesis = self.law.hypothesis();
        Some(Warning::Strayed {
            place,
            law: self.law.description().id.clone(),
            hypothesis,
            component: walk.search.frame().component(component, hypothesis),
            gradient: walk.point.gradient[component],
        })
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
