//! Viscous relaxation: from a step that Newton iterations cannot finish to an equilibrium.
//!
//! Newton's method assumes an equilibrium nearby. In a material whose flow is not associated, or
//! whose contacts open, the branch of equilibria may end where one point reaches another piece of
//! its law: followed on, neither piece leads to an equilibrium. Iterations then alternate between
//! the two for ever, however small the step (the residual of the cycle is proportional to the
//! step). A real body moves on quickly there, until it finds the next stable equilibrium. The
//! relaxation follows that motion with a
//! viscosity proportional to the elastic stiffness,
//!
//!   α K_e u̇ = r(u),    an implicit step of unit time: (K + α K_e) δ = r.
//!
//! It starts from the elastic response to the step. The residual may grow. If that leads nowhere, the motion starts
//! where Newton iterations stood still. Time steps grow as the motion slows down, since α follows the residual
//! (pseudo-transient continuation: C. T. Kelley, D. E. Keyes, SIAM J. Numer. Anal. 35, 1998). The motion leaves
//! unstable equilibria and ends at a stable one. Newton iterations are tried whenever the residual has fallen; they
//! alone decide on convergence, by the same tolerances. The motion changes the path within the step only: laws still
//! see one increment from the last equilibrium.

use super::Newton;
use super::failure::{Iterations, Reason, StepFailure};
use super::outcome::Iteration;
use super::residual::{Balance, Task};
use crate::settings::Settings;
use algebra::threads;
use law::Operator;

/// α at first. With flow along m and yield along n, enclosing an angle θ (in energy), the symmetric part
/// of D + α D_e is positive definite for α above (1/cos θ − 1)/2. This value was found by trial:
/// the chambers with Mohr–Coulomb sand settle with it; 0.1 and 1 are much slower there.
const VISCOSITY: f64 = 0.05;
/// Largest α.
const MOST: f64 = 0.2;
/// Least and largest factor by which α follows the residual from one viscous step to the next.
const FOLLOWS: [f64; 2] = [0.3, 2.0];
/// Newton iterations are tried each time the residual has fallen to this fraction.
const FALL: f64 = 0.1;
/// Viscous steps of one motion.
const MAX_STEPS: usize = 40;
/// A motion leads away if the residuals of this many last viscous steps are all more than this multiple of the least
/// one before them. Found by trial: of 169 motions that led to Newton iterations, with the bored pile on 1 917 quads
/// and 24 random piles, none had done so, and a quarter of the viscous steps of all others came after. With ten steps
/// one would have been lost.
const LEADS_AWAY: (usize, f64) = (12, 3.0);
/// Newton iterations without a new least residual that count as a standstill.
const STANDSTILL: usize = 6;
/// Entries of a matrix that one thread takes at a time.
const PER_TASK: usize = 1 << 16;
/// Iterations before a standstill is looked for.
const FIRST: usize = 10;
/// What a new least residual must be below, relative to the old one.
const PROGRESS: f64 = 0.9;

/// Statistics of relaxation in a step.
#[derive(Debug)]
pub(super) struct Relaxation {
    course: Course,
    /// Where the last series of Newton iterations starts.
    first: usize,
    /// Where Newton iterations first came to a standstill: displacement increments, and how many
    /// iterations they were.
    standstill: (Vec<f64>, usize),
}

#[derive(Debug)]
enum Course {
    /// The settings want none.
    Off,
    /// Newton iterations have not come to a standstill yet.
    Ready,
    UnderWay(Motion),
    /// It led nowhere. Newton iterations had to go on alone.
    InVain,
}

/// A motion under way.
#[derive(Debug)]
struct Motion {
    /// Elastic stiffness, in the matrix's pattern; without the domain.
    elastic: Vec<f64>,
    /// Displacement increments reached.
    increment: Vec<f64>,
    /// It started where Newton iterations stood still, as the one from the elastic answer led nowhere.
    is_second: bool,
    /// Viscous steps so far.
    steps: usize,
}

impl Relaxation {
    /// The relaxation of a step to a given load factor.
    pub(super) fn new(settings: &Settings) -> Self {
        // Methods that keep their matrix are slow without having come to an end. Arc-length control
        // has a way of its own to leave a branch.
        let is_wanted =
            settings.relaxation && settings.control.relaxes() && settings.method.is_newton();
        Self {
            course: if is_wanted {
                Course::Ready
            } else {
                Course::Off
            },
            first: 0,
            standstill: (Vec::new(), 0),
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

    /// Whether it led to the present state.
    pub(super) fn is_under_way(&self) -> bool {
        matches!(self.course, Course::UnderWay(_))
    }

    /// Whether it was tried and led nowhere.
    pub(super) fn was_in_vain(&self) -> bool {
        matches!(self.course, Course::InVain)
    }

    /// Whether it may lead away from a state that no correction can be computed for.
    pub(super) fn is_at_hand(&self) -> bool {
        matches!(self.course, Course::Ready)
    }

    /// If Newton iterations stall, or at a state that no correction can be computed for (`is_singular`), the
    /// state that they go on from: a relaxed one or, if absent, that of the first standstill. `None` where they
    /// get on, and where nothing leads away from a singular state.
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
        let series = self.series(iterations);
        let is_due = is_singular || stands_still(series);
        if matches!(self.course, Course::Off | Course::InVain) || !is_due {
            return Ok(None);
        }
        if matches!(self.course, Course::Ready) {
            self.standstill = (increment.to_vec(), series.len());
            let motion = newton.start_motion(task);
            self.course = motion.map_or(Course::InVain, Course::UnderWay);
        }
        while let Course::UnderWay(motion) = &mut self.course {
            if let Ok(relaxed) = newton.relax(motion, task, iterations) {
                self.first = iterations.len() - 1;
                return Ok(Some(relaxed));
            }
            newton.may_go_on()?;
            if motion.is_second {
                break;
            }
            motion.increment.clone_from(&self.standstill.0);
            motion.is_second = true;
            motion.steps = 0;
        }
        newton.may_go_on()?;
        self.course = Course::InVain;
        if is_singular {
            return Ok(None);
        }
        // Newton iterations go on where they stood, for as many as are left to them.
        let (increment, so_many) = std::mem::take(&mut self.standstill);
        let balance = newton.evaluate(&increment, task, Operator::Consistent)?;
        self.first = iterations.len() - so_many;
        Ok(Some((increment, balance)))
    }
}

/// Factor by which α follows a residual that has changed in this ratio.
pub(super) fn follows(ratio: f64) -> f64 {
    let [least, most] = FOLLOWS;
    ratio.clamp(least, most)
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
    let residuals = |part: &[Iteration]| least(part.iter().map(|iteration| iteration.residual));
    residuals(&iterations[start..]) > PROGRESS * residuals(&iterations[..start])
}

/// Whether a motion that left these residuals, viscous step by viscous step, leads away from equilibrium.
fn leads_away(residuals: &[f64]) -> bool {
    let (last, multiple) = LEADS_AWAY;
    let Some((before, last)) = residuals
        .len()
        .checked_sub(last)
        .map(|start| residuals.split_at(start))
    else {
        return false;
    };
    let least_before = least(before.iter().copied());
    least_before.is_finite() && least(last.iter().copied()) > multiple * least_before
}

fn least(residuals: impl Iterator<Item = f64>) -> f64 {
    residuals.fold(f64::INFINITY, f64::min)
}

impl Newton<'_> {
    /// The motion from the elastic answer to the step; `None` if a law has no elastic
    /// operator or elasticity alone leaves the equations singular.
    fn start_motion(&mut self, task: &Task) -> Option<Motion> {
        let still = vec![0.0; task.external.len()];
        let before = self.evaluate(&still, task, Operator::Elastic).ok()?;
        let elastic = self.stiffness().to_vec();
        self.factorise(elastic.clone()).ok()?;
        Some(Motion {
            elastic,
            increment: self.answer_to(&before.residual, task).ok()?,
            is_second: false,
            steps: 0,
        })
    }

    /// Carries a motion on until the residual has fallen enough to try Newton iterations.
    ///
    /// # Errors
    /// The residual did not fall, or a law or the equations failed.
    fn relax(
        &mut self,
        motion: &mut Motion,
        task: &Task,
        iterations: &mut Vec<Iteration>,
    ) -> Result<(Vec<f64>, Balance), StepFailure> {
        let mut balance = self.evaluate(&motion.increment, task, Operator::Consistent)?;
        let mut largest = balance.relative;
        let mut viscosity = VISCOSITY;
        let mut residuals = Vec::new();
        while motion.steps < MAX_STEPS {
            self.may_go_on()?;
            motion.steps += 1;
            let correction =
                self.viscous_correction(&balance.residual, (viscosity, &motion.elastic))?;
            for (u, d) in motion.increment.iter_mut().zip(&correction) {
                *u += d;
            }
            let before = balance.relative;
            balance = self.evaluate(&motion.increment, task, Operator::Consistent)?;
            let taken = self.took_to(&balance, &correction, &motion.increment, 1.0);
            iterations.push(Iteration { viscosity, ..taken });
            viscosity = (follows(balance.relative / before) * viscosity).min(MOST);
            largest = largest.max(balance.relative);
            if balance.relative < before && balance.relative <= FALL * largest {
                return Ok((motion.increment.clone(), balance));
            }
            residuals.push(balance.relative);
            if leads_away(&residuals) {
                break;
            }
        }
        let correction = iterations.last().and_then(|last| last.correction);
        let unmet = self.unmet(&balance, correction);
        Err(Reason::Unmet(Iterations::Relaxation(motion.steps), unmet).into())
    }

    /// Solves (K + α K_e) δ = residual with the tangents of the last evaluation, divided by 1 + α. The entries of
    /// elastic ground then equal those of K_e bit for bit, whatever α, so their Schur complements are reused.
    pub(super) fn viscous_correction(
        &mut self,
        residual: &[f64],
        (viscosity, elastic): (f64, &[f64]),
    ) -> Result<Vec<f64>, StepFailure> {
        let share = 1.0 / (1.0 + viscosity);
        let mut values = self.solver.room();
        let stiffness = self.stiffness();
        values.resize(stiffness.len(), 0.0);
        let parts = values.chunks_mut(PER_TASK).zip(stiffness.chunks(PER_TASK));
        threads::each(
            parts.zip(elastic.chunks(PER_TASK)),
            |((values, stiffness), elastic)| {
                for ((value, &now), elastic) in values.iter_mut().zip(stiffness).zip(elastic) {
                    *value = if now.to_bits() == elastic.to_bits() {
                        now
                    } else {
                        share * (now + viscosity * elastic)
                    };
                }
            },
        );
        self.factorise(values)?;
        let residual: Vec<f64> = residual.iter().map(|r| share * r).collect();
        self.solve(&residual, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_given_up_where_it_stays_far_above_its_least_residual() {
        let (last, multiple) = LEADS_AWAY;
        let away = |far: f64, n: usize| -> bool {
            let mut residuals = vec![1e-2, 1e-4];
            residuals.extend(std::iter::repeat_n(far, n));
            leads_away(&residuals)
        };
        assert!(away(1.01 * multiple * 1e-4, last));
        // It may yet come back, or stands still near its least.
        assert!(!away(1.0, last - 1));
        assert!(!away(0.99 * multiple * 1e-4, last));
        // Nothing was nearer before.
        assert!(!leads_away(&vec![1.0; last]));
    }

    #[test]
    fn a_motion_that_comes_back_goes_on() {
        let (last, _) = LEADS_AWAY;
        let mut residuals = vec![1e-4];
        residuals.extend(std::iter::repeat_n(1.0, last - 1));
        residuals.push(1e-4);
        assert!(!leads_away(&residuals));
        residuals.extend(std::iter::repeat_n(1.0, last));
        assert!(leads_away(&residuals));
    }
}
