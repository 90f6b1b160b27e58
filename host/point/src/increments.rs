//! A point on its way: increments, in as many steps as they take.

use crate::error::{Criterion, NoEquilibrium, Unmet};
use crate::frame::Frame;
use crate::ignored_input::IgnoredInput;
use crate::path::{Control, Segment};
use crate::search::{Fatal, Miss, Obstacle, Search};
use crate::state::{Goal, N_MAX, Point, Step, Vector};
use abi::Hypothesis;

/// Steps below this fraction of an increment are not tried.
const SMALLEST_STEP: f64 = 1.0 / (1 << 20) as f64;
/// Calls of the law after which an increment is given up.
const MAX_CALLS: usize = 1_000_000;

/// Why a walk halted.
#[derive(Debug)]
pub(crate) enum Halt {
    Shortfall(Box<Shortfall>),
    Fatal(Fatal),
    /// As asked.
    Asked,
}

impl From<Fatal> for Halt {
    fn from(failure: Fatal) -> Self {
        Self::Fatal(failure)
    }
}

/// A goal that was not reached.
#[derive(Debug)]
pub(crate) struct Shortfall {
    /// Fraction of the increment that was reached.
    reached: f64,
    /// Fluxes asked for at its end.
    asked: Vector,
    obstacle: Obstacle,
}

impl Shortfall {
    /// The same for whoever asked.
    pub(crate) fn told(self, hypothesis: Hypothesis) -> NoEquilibrium {
        let Self {
            reached,
            asked,
            obstacle,
        } = self;
        let criterion = |component: usize| {
            let name = obstacle.frame.component(component, hypothesis);
            if obstacle.is_restricted {
                Criterion::Restriction(component + 1)
            } else if obstacle.is_sprung(component) {
                Criterion::Stiffness { component: name }
            } else {
                Criterion::Flux {
                    component: name,
                    at_end: asked[component],
                }
            }
        };
        let unmet = |miss: Miss| Unmet {
            criterion: criterion(miss.component),
            found: miss.flux,
            goal: miss.goal,
            residual: miss.residual,
            tolerance: miss.tolerance,
        };
        NoEquilibrium {
            reached,
            unmet: obstacle.miss.map(unmet),
            refusal: obstacle.refusal,
        }
    }
}

/// A straight line of goals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ramp {
    pub(crate) from: Goal,
    to: Goal,
}

impl Ramp {
    /// The goal of increment k of n, the last one without rounding.
    pub(crate) fn goal(&self, k: usize, n: usize) -> Goal {
        between(&self.from, &self.to, k as f64 / n as f64)
    }
}

fn between(from: &Goal, to: &Goal, fraction: f64) -> Goal {
    if fraction >= 1.0 {
        return *to;
    }
    let on_line = |a: &Vector, b: &Vector| std::array::from_fn(|i| a[i] + (b[i] - a[i]) * fraction);
    Goal {
        gradient: on_line(&from.gradient, &to.gradient),
        flux: on_line(&from.flux, &to.flux),
    }
}

/// Fraction of an increment that the next step tries.
struct StepSize {
    fraction: f64,
    /// The last step was not a second try.
    may_grow: bool,
}

impl StepSize {
    /// The end of a step from there, without a crumb behind it.
    fn end_of_step(&self, done: f64) -> f64 {
        let end = done + self.fraction;
        if end > 1.0 - SMALLEST_STEP { 1.0 } else { end }
    }

    fn grow(&mut self) {
        if self.may_grow {
            self.fraction = (2.0 * self.fraction).min(1.0);
        }
        self.may_grow = true;
    }

    /// After a step of this length failed; the law may have asked for a factor.
    fn cut(&mut self, length: f64, factor: Option<f64>) {
        self.fraction = factor.map_or(0.5, |f| f.clamp(0.1, 0.9)) * length;
        self.may_grow = false;
    }
}

/// A point on its way.
#[derive(Debug)]
pub(crate) struct Walk<'a> {
    pub(crate) point: Point,
    pub(crate) search: Search<'a>,
    /// Gradient per increment of the last step, within a segment.
    rate: Option<Vector>,
    /// Fraction of the increment that the first step tries.
    first_step: f64,
    pub(crate) cut_backs: usize,
    pub(crate) ignored: IgnoredInput,
}

impl<'a> Walk<'a> {
    /// A point that has not moved yet.
    pub(crate) fn new(point: Point, search: Search<'a>) -> Self {
        Self {
            point,
            search,
            rate: None,
            first_step: 1.0,
            cut_backs: 0,
            ignored: IgnoredInput::default(),
        }
    }

    /// Gives the point, and the flux that is held, in other components.
    pub(crate) fn change_frame(&mut self, frame: Frame, held: &mut Vector) {
        let old = self.search.frame();
        if frame == old {
            return;
        }
        self.search.set_frame(frame);
        let point = &mut self.point;
        point.gradient = frame.gradient(&old.cartesian_gradient(&point.gradient));
        point.flux = frame.flux(&old.cartesian_flux(&point.flux));
        *held = frame.flux(&old.cartesian_flux(held));
    }

    /// The point in the components of the law.
    pub(crate) fn cartesian(&self) -> Point {
        let frame = self.search.frame();
        Point {
            gradient: frame.cartesian_gradient(&self.point.gradient),
            flux: frame.cartesian_flux(&self.point.flux),
            internal: self.point.internal.clone(),
        }
    }

    /// Starts a segment. `held` is the flux that components without control keep.
    pub(crate) fn enter(&mut self, segment: &Segment, n: usize, held: &Vector) -> Ramp {
        let from = Goal {
            gradient: self.point.gradient,
            flux: *held,
        };
        if let Some(restrictions) = &segment.restrictions {
            self.rate = None;
            self.first_step = 1.0;
            let gradient = from.gradient;
            let goal = |flux| Goal { gradient, flux };
            return Ramp {
                from: goal([0.0; N_MAX]),
                to: goal(self.search.restrict(restrictions, &self.point)),
            };
        }
        let mut to = from;
        let mut stiffness = [0.0; N_MAX];
        for i in 0..n {
            match segment.control[i] {
                Control::Keep => {}
                Control::Gradient(end) => to.gradient[i] = end,
                Control::Flux(end) => to.flux[i] = end,
                Control::GradientBy(change) => to.gradient[i] += change,
                Control::FluxBy(change) => to.flux[i] += change,
                Control::Stiffness(k) => stiffness[i] = k,
            }
        }
        let is_free = |control| !matches!(control, Control::Gradient(_) | Control::GradientBy(_));
        let free = (0..n).filter(|&i| is_free(segment.control[i]));
        self.search.control(free, stiffness, from.gradient);
        self.rate = None;
        self.first_step = 1.0;
        Ramp { from, to }
    }

    fn shortfall(reached: f64, to: &Goal, obstacle: Obstacle) -> Halt {
        Halt::Shortfall(Box::new(Shortfall {
            reached,
            asked: to.flux,
            obstacle,
        }))
    }

    /// Takes the step found, which is this fraction of the increment.
    fn commit(&mut self, length: f64) {
        let before = self.point.gradient;
        self.search.commit(&mut self.point);
        let after = &self.point.gradient;
        self.rate = Some(std::array::from_fn(|i| (after[i] - before[i]) / length));
    }

    /// Carries the point over one increment, given its start and its length, in as many steps as it takes.
    pub(crate) fn advance(
        &mut self,
        from: &Goal,
        to: &Goal,
        (time, time_increment): (f64, f64),
    ) -> Result<(), Halt> {
        let first_call = self.search.calls;
        self.search.anchor(to);
        let mut done = 0.0;
        let mut size = StepSize {
            fraction: self.first_step,
            may_grow: true,
        };
        while done < 1.0 {
            let end = size.end_of_step(done);
            let length = end - done;
            let goal = between(from, to, end);
            let step = Step {
                start: &self.point,
                goal: &goal,
                time: time + done * time_increment,
                time_increment: length * time_increment,
            };
            let guess = self.rate.map(|rate| rate.map(|rate| rate * length));
            if self.search.find(&step, guess.as_ref())? {
                self.ignored.step(self.search.is_ignored(&step)?);
                self.commit(length);
                done = end;
                size.grow();
                continue;
            }
            if self.search.stop.is_asked() {
                return Err(Halt::Asked);
            }
            let obstacle = self.search.take_obstacle();
            size.cut(length, obstacle.factor);
            self.cut_backs += 1;
            if size.fraction < SMALLEST_STEP || self.search.calls - first_call > MAX_CALLS {
                return Err(Self::shortfall(done, to, obstacle));
            }
        }
        self.first_step = size.fraction;
        let miss = self.search.unmet(&self.point, to);
        if miss.is_none() {
            return Ok(());
        }
        let mut obstacle = self.search.take_obstacle();
        obstacle.miss = miss;
        Err(Self::shortfall(1.0, to, obstacle))
    }
}
