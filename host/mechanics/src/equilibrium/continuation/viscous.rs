//! Viscous motions: from a step that Newton iterations cannot finish to an equilibrium.
//!
//! Newton's method assumes an equilibrium nearby. In a material whose flow is not associated, or
//! whose contacts open, the branch of equilibria may end where one point reaches another piece of
//! its law: followed on, neither piece leads to an equilibrium. Iterations then alternate between
//! the two for ever, however small the step (the residual of the cycle is proportional to the
//! step). A real body moves on quickly there, until it finds the next stable equilibrium. That
//! motion is followed here, in one of two ways that the settings choose:
//!
//! - **Viscous relaxation** repeats one increment from the last equilibrium. Newton iterations take over whenever the
//!   residual has fallen, and decide on convergence.
//! - **Viscous control** commits the states of the motion: laws see the path of a viscous body to its equilibrium.
//!
//! When one of them is tried, and what follows from where it leads, stands here. [How it moves](super::viscous_motion)
//! is one algorithm.

use super::viscous_motion::Course;
use crate::equilibrium::newton::{Balance, Iteration, Motion, Newton, StepFailure, Task};
use crate::settings::{Control, Settings};
use law::Operator;

/// Newton iterations without a new least residual that count as a standstill.
const STANDSTILL: usize = 6;
/// Iterations before a standstill is looked for.
const FIRST: usize = 10;
/// What a new least residual must be below, relative to the old one.
const PROGRESS: f64 = 0.9;
/// After a motion of more viscous steps under viscous control, the next step probably needs one too.
const SHORT: usize = 3;

/// The viscous motion of a step.
#[derive(Debug)]
pub(super) struct Viscous {
    /// Which one the settings want, if any.
    wanted: Option<Motion>,
    trial: Trial,
    /// The last step was a motion under viscous control: this one begins with it.
    is_expected: bool,
    /// The first iterate, where it did not come from the tangent: viscous control starts from it.
    guess: Option<Vec<f64>>,
    /// Where the last series of Newton iterations starts.
    first: usize,
    /// Where Newton iterations first came to a standstill: displacement increments, and how many
    /// iterations they were.
    standstill: (Vec<f64>, usize),
}

/// State of a viscous motion.
#[derive(Debug)]
enum Trial {
    /// Newton iterations have not come to a standstill yet.
    Ready,
    /// Newton iterations go on from a relaxed state; what they stall at is relaxed further.
    UnderWay(Course),
    /// Viscous control led to the present state, an equilibrium, in this many viscous steps.
    Arrived(usize),
    /// It led nowhere. Newton iterations had to go on alone.
    InVain,
}

impl Viscous {
    /// The motion of a step to a given load factor, after one that was a motion of viscous control or not.
    pub(super) fn new(settings: &Settings, is_expected: bool) -> Self {
        // Methods that keep their matrix are slow without having come to an end. Arc-length control
        // has a way of its own to leave a branch.
        let is_relaxed = settings.relaxation && settings.control.relaxes();
        let wanted = if settings.control == Control::Viscous {
            Some(Motion::Viscous)
        } else {
            is_relaxed.then_some(Motion::Relaxation)
        };
        let wanted = wanted.filter(|_| settings.method.is_newton());
        Self {
            wanted,
            trial: Trial::Ready,
            is_expected: is_expected && wanted == Some(Motion::Viscous),
            guess: None,
            first: 0,
            standstill: (Vec::new(), 0),
        }
    }

    /// Whether laws see one increment from the last equilibrium, with any method that has consistent tangents.
    pub(super) fn relaxes(&self) -> bool {
        self.wanted == Some(Motion::Relaxation)
    }

    /// Takes note of a first iterate that did not come from the tangent.
    pub(super) fn starts_from(&mut self, increment: &[f64]) {
        if self.wanted == Some(Motion::Viscous) {
            self.guess = Some(increment.to_vec());
        }
    }

    /// The last series of Newton iterations, with the state that it started from. A relaxed state
    /// is allowed as many as the first one was.
    pub(super) fn series<'i>(&self, iterations: &'i [Iteration]) -> &'i [Iteration] {
        iterations.get(self.first..).unwrap_or_default()
    }

    /// Newton iterations start from this one: those before it had another matrix.
    pub(super) fn starts_at(&mut self, iteration: usize) {
        self.first = iteration;
    }

    /// Whether it led to the present state, or to the one that the present iterations started from.
    pub(super) fn has_led_here(&self) -> bool {
        matches!(self.trial, Trial::UnderWay(_) | Trial::Arrived(_))
    }

    /// Whether it led to the present state, which is an equilibrium.
    pub(super) fn has_arrived(&self) -> bool {
        matches!(self.trial, Trial::Arrived(_))
    }

    /// Whether the next step should begin with viscous control.
    pub(super) fn lets_expect_another(&self) -> bool {
        matches!(self.trial, Trial::Arrived(steps) if steps > SHORT)
    }

    /// The motion that was tried and led nowhere.
    pub(super) fn in_vain(&self) -> Option<Motion> {
        self.wanted.filter(|_| matches!(self.trial, Trial::InVain))
    }

    /// Whether it may lead away from a state that no correction can be computed for.
    pub(super) fn is_at_hand(&self) -> bool {
        self.wanted.is_some() && matches!(self.trial, Trial::Ready)
    }

    /// Whether Newton iterations have come to a standstill, or to a state that no correction can be computed for
    /// (`is_singular`), and a motion may lead on.
    fn is_due(&self, iterations: &[Iteration], is_singular: bool) -> bool {
        let series = self.series(iterations);
        let is_expected = self.is_expected && series.len() == 1;
        let may_lead = matches!(self.trial, Trial::Ready | Trial::UnderWay(_));
        may_lead && (is_singular || is_expected || stands_still(series))
    }

    /// If Newton iterations stall, or at a state that no correction can be computed for (`is_singular`), the
    /// state that they go on from: the one that a motion leads to, or that of the first standstill if it leads
    /// nowhere. `None` where they get on, and where nothing leads away from a singular state.
    ///
    /// # Errors
    /// The step is stopped, or a law fails.
    pub(super) fn relieve(
        &mut self,
        newton: &mut Newton<'_>,
        task: &Task,
        (increment, is_singular): (&[f64], bool),
        iterations: &mut Vec<Iteration>,
    ) -> Result<Option<(Vec<f64>, Balance)>, StepFailure> {
        let Some(motion) = self.wanted.filter(|_| self.is_due(iterations, is_singular)) else {
            return Ok(None);
        };
        if matches!(self.trial, Trial::Ready) {
            let so_many = match motion {
                Motion::Relaxation => self.series(iterations).len(),
                Motion::Viscous => iterations.len(),
            };
            self.standstill = (increment.to_vec(), so_many);
        }
        let reached = match motion {
            Motion::Relaxation => self.relax(newton, task, iterations)?,
            Motion::Viscous => self.move_on(newton, task, iterations),
        };
        if reached.is_some() {
            return Ok(reached);
        }
        newton.may_go_on()?;
        self.trial = Trial::InVain;
        if is_singular && motion == Motion::Relaxation {
            return Ok(None);
        }
        // Newton iterations go on where they stood, for as many as are left to them.
        let (increment, so_many) = std::mem::take(&mut self.standstill);
        let balance = newton.evaluate(&increment, task, Operator::Consistent)?;
        self.first = iterations.len() - so_many;
        Ok(Some((increment, balance)))
    }

    /// The state that viscous relaxation leads to: from the elastic answer to the step or, if that leads nowhere, from
    /// where Newton iterations stood still.
    ///
    /// # Errors
    /// The step is stopped.
    fn relax(
        &mut self,
        newton: &mut Newton<'_>,
        task: &Task,
        iterations: &mut Vec<Iteration>,
    ) -> Result<Option<(Vec<f64>, Balance)>, StepFailure> {
        if matches!(self.trial, Trial::Ready) {
            let course = Course::start(newton, task, Motion::Relaxation, None);
            self.trial = course.map_or(Trial::InVain, Trial::UnderWay);
        }
        while let Trial::UnderWay(course) = &mut self.trial {
            if let Ok(Some(balance)) = course.follow(newton, task, iterations) {
                self.first = iterations.len() - 1;
                return Ok(Some((course.increment.clone(), balance)));
            }
            newton.may_go_on()?;
            if course.is_second {
                break;
            }
            course.begin_again(&self.standstill.0);
        }
        Ok(None)
    }

    /// The equilibrium that viscous control leads to; if it leads to none, the state is that at the start of the step
    /// again.
    fn move_on(
        &mut self,
        newton: &mut Newton<'_>,
        task: &Task,
        iterations: &mut Vec<Iteration>,
    ) -> Option<(Vec<f64>, Balance)> {
        let committed = newton.committed();
        let guess = self.guess.as_deref();
        if let Ok(mut course) = Course::start(newton, task, Motion::Viscous, guess)
            && let Ok(Some(balance)) = course.follow(newton, task, iterations)
        {
            self.trial = Trial::Arrived(course.steps);
            return Some((course.increment, balance));
        }
        newton.restore(committed);
        None
    }
}

/// Whether these Newton iterations have come to a standstill.
pub(super) fn stands_still(iterations: &[Iteration]) -> bool {
    let Some(start) = iterations
        .len()
        .checked_sub(STANDSTILL)
        .filter(|_| iterations.len() >= FIRST)
    else {
        return false;
    };
    let least = |part: &[Iteration]| {
        let residuals = part.iter().map(|iteration| iteration.residual);
        residuals.fold(f64::INFINITY, f64::min)
    };
    least(&iterations[start..]) > PROGRESS * least(&iterations[..start])
}
