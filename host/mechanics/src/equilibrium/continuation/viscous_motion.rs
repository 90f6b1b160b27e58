//! How a viscous motion moves, from the elastic answer to a step towards an equilibrium.
//!
//! **Viscous relaxation** follows the motion with a viscosity proportional to the elastic stiffness,
//!
//!   α K_e u̇ = r(u),    an implicit step of unit time: (K + α K_e) δ = r.
//!
//! The residual may grow. Time steps grow as the motion slows down, since α follows the residual (pseudo-transient
//! continuation: C. T. Kelley, D. E. Keyes, SIAM J. Numer. Anal. 35, 1998). The motion leaves unstable equilibria and
//! ends near a stable one. It changes the path within the step only: laws still see one increment from the last
//! equilibrium.
//!
//! Under **viscous control** the motion is a path. The stress of the law gets an additional overstress of Duvaut–Lions
//! type (G. Duvaut, J. L. Lions 1972; J. C. Simo, J. G. Kennedy, S. Govindjee, Int. J. Numer. Meth. Engng 26, 1988),
//!
//!   σ = σ_law + s, ṡ = D_e ε̇ − σ̇_law − s/τ,
//!
//! whose nodal forces are the residual r of σ_law. With α = τ/Δt an implicit step of time Δt from the committed state
//! is
//!
//!   r(Δu) = α (K_e Δu − Δf),    tangent K + α K_e,
//!
//! with the step's change Δf of the forces in the first viscous step and zero afterwards, while the body comes to rest.
//! Every viscous step is solved and **its state committed**: laws see the path of a viscous body to its equilibrium.
//! Let θ be the angle between yield and flow in energy. Above α = (1/cos θ − 1)/2 a step's matrix is positive definite
//! and its solution unique. If a viscous step is linear, nothing yields or unloads any more, and α falls, finally to
//! zero: a Newton correction. The same tolerances decide. The accepted state is an equilibrium of the laws alone,
//! without overstress.
//!
//! If a point loses its traction by breaking, a viscous step may have no solution. Intact, the point opens. Open, the
//! force it no longer carries moves the body so that it closes; its law sees one increment from the start of the
//! viscous step and finds it intact. Iterations alternate between both, with any viscosity and however short the step.
//! A real point stays broken. So as the last resort each viscous step is **one correction**, and its state is committed
//! whatever the residual. Broken points stay broken, the residual drives the next step, and α follows it as in viscous
//! relaxation.

use crate::assembly::norms;
use crate::equilibrium::newton::{Balance, Iteration, Motion, Newton, StepFailure, Task, norm};
use law::Operator;

/// α at first, and where states change. The chambers with Mohr–Coulomb sand and the bored pile settle
/// with it. Relaxation is much slower there with 0.1 and 1; a quarter of it leads viscous control of the pile to other
/// equilibria, with more dilation.
const VISCOSITY: f64 = 0.05;
/// Largest α: of relaxation, and under viscous control.
const MOST: [f64; 2] = [0.2, 1.0];
/// Least and largest factor by which α follows the residual from one correction to the next.
const FOLLOWS: [f64; 2] = [0.3, 2.0];
/// Factor by which α grows where a viscous step found no answer.
const FAILED: f64 = 3.0;
/// Corrections of a viscous step that are many, and those that are too many. With less than the first viscosity, many
/// are too many.
const MANY: usize = 3;
const TOO_MANY: usize = 8;
/// Residual of the equation of a viscous step, relative to the residual of the laws or to the force
/// tolerance.
const INNER: f64 = 0.1;
const NEGLIGIBLE: f64 = 0.3;
/// α below this counts as none under viscous control.
const LEAST: f64 = 1e-3;
/// Lengths of a correction that are tried.
const LENGTHS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// Newton iterations are tried each time relaxation has lowered the residual to this fraction.
const FALL: f64 = 0.1;
/// Viscous steps of one motion: of relaxation, and under viscous control.
const MAX_STEPS: [usize; 2] = [40, 200];
/// Relaxation leads away if the residuals of this many last viscous steps are all more than this multiple of the least
/// one before them. Found by trial: of 169 motions that led to Newton iterations, with the bored pile on 1 917 quads
/// and 24 random piles, none had done so, and a quarter of the viscous steps of all others came after. With ten steps
/// one would have been lost.
const LEADS_AWAY: (usize, f64) = (12, 3.0);
/// Viscous control leads nowhere if this many viscous steps have not brought the residual down to half; of single
/// corrections more, since every point that breaks raises it.
const IDLE: [usize; 2] = [40, 120];

/// A motion under way.
#[derive(Debug)]
pub(super) struct Course {
    /// Elastic stiffness, in the matrix's pattern; without the domain.
    elastic: Vec<f64>,
    /// Displacement increments of the step that are reached, by place.
    pub(super) increment: Vec<f64>,
    viscosity: f64,
    /// Under viscous control: where the present viscous step starts.
    overstress: Option<Overstress>,
    /// It started where Newton iterations stood still, as the one from the elastic answer led nowhere.
    pub(super) is_second: bool,
    /// Viscous steps so far.
    pub(super) steps: usize,
}

/// Start of a viscous step under viscous control.
#[derive(Debug)]
struct Overstress {
    /// K_e of the prescribed displacements less Δf, by equation; nil after the first viscous step.
    given: Vec<f64>,
    /// Displacement increments of the step up to the last viscous step, by place; none in the first
    /// one.
    from: Vec<f64>,
}

/// How a viscous step went that was solved.
#[derive(Clone, Copy, Debug, Default)]
struct Went {
    corrections: usize,
    /// A correction was shortened.
    is_cut: bool,
    /// It found its answer with another viscosity only.
    is_repeated: bool,
}

impl Course {
    /// A motion from the elastic answer to a step or, if there is one, from a guess.
    ///
    /// # Errors
    /// A law has no elastic operator, or elasticity alone leaves the equations singular.
    pub(super) fn start(
        newton: &mut Newton<'_>,
        task: &Task,
        motion: Motion,
        guess: Option<&[f64]>,
    ) -> Result<Self, StepFailure> {
        let still = vec![0.0; task.external.len()];
        let before = newton.evaluate(&still, task, Operator::Elastic)?;
        let elastic = newton.stiffness().to_vec();
        let overstress = (motion == Motion::Viscous).then(|| {
            let coupling = newton.coupling(&task.prescribed);
            let pairs = coupling.iter().zip(&before.residual);
            Overstress {
                given: pairs.map(|(coupling, change)| coupling - change).collect(),
                from: still,
            }
        });
        let increment = if let Some(guess) = guess {
            guess.to_vec()
        } else {
            newton.factorise(elastic.clone())?;
            newton.answer_to(&before.residual, &task.prescribed)?
        };
        Ok(Self {
            elastic,
            increment,
            viscosity: VISCOSITY,
            overstress,
            is_second: false,
            steps: 0,
        })
    }

    /// The same motion, now from another state.
    pub(super) fn begin_again(&mut self, increment: &[f64]) {
        self.increment = increment.to_vec();
        self.is_second = true;
        self.steps = 0;
    }

    /// Carries the motion on: relaxation until the residual has fallen enough to try Newton iterations, viscous
    /// control to an equilibrium, with the states of all viscous steps but the last one committed. `None` if it leads
    /// nowhere.
    ///
    /// # Errors
    /// The step is stopped, or a law or the equations failed.
    pub(super) fn follow(
        &mut self,
        newton: &mut Newton<'_>,
        task: &Task,
        iterations: &mut Vec<Iteration>,
    ) -> Result<Option<Balance>, StepFailure> {
        let is_controlled = self.overstress.is_some();
        self.viscosity = VISCOSITY;
        let mut balance = newton.evaluate(&self.increment, task, Operator::Consistent)?;
        let start = balance.relative;
        let mut residuals: Vec<f64> = Vec::new();
        while self.steps < MAX_STEPS[usize::from(is_controlled)] {
            self.steps += 1;
            let before = balance.relative;
            let went = if is_controlled && !newton.takes_single_corrections {
                let went = self.solve_step(newton, &mut balance, task, iterations)?;
                let Some(went) = went else {
                    return Ok(None);
                };
                Some(went)
            } else {
                self.correct_once(newton, &mut balance, task, iterations)?;
                None
            };
            residuals.push(balance.relative);
            let ratio = balance.relative / before;
            let has_ended = if let Some(overstress) = &self.overstress {
                self.has_come_to_rest(newton, overstress, &balance, ratio)
            } else {
                let largest = residuals.iter().copied().fold(start, f64::max);
                balance.relative < before && balance.relative <= FALL * largest
            };
            if has_ended {
                // Nothing of K + α K_e is left to the steps that follow viscous control.
                newton.equations.matrix.held &= !is_controlled;
                return Ok(Some(balance));
            }
            let leads_nowhere = if is_controlled {
                is_idle(&residuals, newton.takes_single_corrections)
            } else {
                leads_away(&residuals)
            };
            if leads_nowhere {
                break;
            }
            if let Some(overstress) = &mut self.overstress {
                // The first viscous step takes the time of the step.
                let (start, length) = task.period;
                newton.commit(&self.increment, (start + length, 0.0));
                overstress.from.clone_from(&self.increment);
                overstress.given.fill(0.0);
            }
            self.viscosity = match went {
                Some(went) => self.viscosity_after(&went),
                None => self.viscosity_by(ratio),
            };
        }
        Ok(None)
    }

    /// One correction of a viscous step, whatever it leaves.
    ///
    /// # Errors
    /// The step is stopped, or a law or the equations failed.
    fn correct_once(
        &mut self,
        newton: &mut Newton<'_>,
        balance: &mut Balance,
        task: &Task,
        iterations: &mut Vec<Iteration>,
    ) -> Result<(), StepFailure> {
        newton.may_go_on()?;
        let residual = self.residual(newton, &self.increment, balance);
        let correction = self.correction(newton, &residual)?;
        let next = moved(&self.increment, 1.0, &correction);
        let at = newton.evaluate(&next, task, Operator::Consistent)?;
        iterations.push(self.taken(newton, (&at, &next), &correction, 1.0));
        (self.increment, *balance) = (next, at);
        Ok(())
    }

    /// Solves one viscous step, with a larger viscosity where that of the motion leads to no answer. `None` if none
    /// does.
    ///
    /// # Errors
    /// The step is stopped, or a law or the equations failed with the largest viscosity too.
    fn solve_step(
        &mut self,
        newton: &mut Newton<'_>,
        balance: &mut Balance,
        task: &Task,
        iterations: &mut Vec<Iteration>,
    ) -> Result<Option<Went>, StepFailure> {
        let start = self.increment.clone();
        let mut is_repeated = false;
        loop {
            match self.try_step(newton, balance, task, iterations) {
                Ok(Some(went)) => {
                    return Ok(Some(Went {
                        is_repeated,
                        ..went
                    }));
                }
                Err(failure) if failure.is_stop() => return Err(failure),
                _ if self.viscosity >= MOST[1] => return Ok(None),
                _ => {
                    is_repeated = true;
                    self.viscosity = (FAILED * self.viscosity).clamp(LEAST, MOST[1]);
                    self.increment.clone_from(&start);
                    *balance = newton.evaluate(&start, task, Operator::Consistent)?;
                }
            }
        }
    }

    /// The same with this viscosity; `None` if it leads to no answer.
    fn try_step(
        &mut self,
        newton: &mut Newton<'_>,
        balance: &mut Balance,
        task: &Task,
        iterations: &mut Vec<Iteration>,
    ) -> Result<Option<Went>, StepFailure> {
        let mut went = Went::default();
        let is_low = self.viscosity < VISCOSITY;
        let most = if is_low { MANY } else { TOO_MANY };
        let mut residual = self.residual(newton, &self.increment, balance);
        while went.corrections < most {
            newton.may_go_on()?;
            went.corrections += 1;
            let correction = self.correction(newton, &residual)?;
            let size = norm(&residual);
            for length in LENGTHS {
                let next = moved(&self.increment, length, &correction);
                let at = newton.evaluate(&next, task, Operator::Consistent)?;
                residual = self.residual(newton, &next, &at);
                // The shortest is taken whatever it leaves.
                if norm(&residual) < size || length <= LENGTHS[LENGTHS.len() - 1] {
                    went.is_cut |= length < 1.0;
                    if went.is_cut && is_low {
                        return Ok(None);
                    }
                    iterations.push(self.taken(newton, (&at, &next), &correction, length));
                    (self.increment, *balance) = (next, at);
                    break;
                }
            }
            let is_negligible = || {
                let share = relative(newton, &residual, &balance.scales);
                share <= NEGLIGIBLE * newton.settings.force_tolerance
            };
            if norm(&residual) <= INNER * norm(&balance.residual) || is_negligible() {
                return Ok(Some(went));
            }
        }
        Ok(None)
    }

    /// A correction of this length, for the log.
    fn taken(
        &self,
        newton: &mut Newton<'_>,
        (at, increment): (&Balance, &[f64]),
        correction: &[f64],
        length: f64,
    ) -> Iteration {
        Iteration {
            viscosity: self.viscosity,
            ..newton.took_to(at, correction, increment, length)
        }
    }

    /// What drives the motion, by equation: r or, under viscous control, r − α (K_e Δu − Δf).
    fn residual(&self, newton: &Newton<'_>, increment: &[f64], balance: &Balance) -> Vec<f64> {
        let Some(Overstress { given, from }) = &self.overstress else {
            return balance.residual.clone();
        };
        let pairs = increment.iter().zip(from);
        let moved: Vec<f64> = pairs.map(|(u, u_0)| u - u_0).collect();
        let forces = self.elastic_forces(newton, &moved);
        let sums = forces.iter().zip(given);
        let pairs = balance.residual.iter().zip(sums);
        pairs
            .map(|(r, (force, given))| r - self.viscosity * (force + given))
            .collect()
    }

    /// K_e of displacements of the free places, by equation; with the domain.
    fn elastic_forces(&self, newton: &Newton<'_>, moved: &[f64]) -> Vec<f64> {
        let mut by_place = vec![0.0; moved.len()];
        if let Some(domain) = newton.equations.domain {
            let boundary = &newton.equations.places.boundary;
            let moved: Vec<f64> = boundary.iter().map(|&place| moved[place]).collect();
            let mut forces = vec![0.0; boundary.len()];
            domain.add_product(&moved, &mut forces);
            for (&place, force) in boundary.iter().zip(forces) {
                by_place[place] = force;
            }
        }
        let free = &newton.equations.places.free;
        let moved: Vec<f64> = free.iter().map(|&place| moved[place]).collect();
        let mut forces = newton
            .equations
            .system
            .pattern
            .multiply(&self.elastic, &moved);
        for (force, &place) in forces.iter_mut().zip(free) {
            *force += by_place[place];
        }
        forces
    }

    /// Solves (K + α K_e) δ = residual with the tangents of the last evaluation.
    fn correction(
        &self,
        newton: &mut Newton<'_>,
        residual: &[f64],
    ) -> Result<Vec<f64>, StepFailure> {
        newton.factorise_regularised(&self.elastic, self.viscosity)?;
        newton.regularised_answer(residual, self.viscosity)
    }

    /// Whether a viscous step under viscous control ends in equilibrium: by the residual, and by what is left of the
    /// way if residuals go on falling in this ratio. The first step's ratio says nothing.
    fn has_come_to_rest(
        &self,
        newton: &Newton<'_>,
        overstress: &Overstress,
        balance: &Balance,
        ratio: f64,
    ) -> bool {
        let ratio = if self.steps == 1 { 1.0 } else { ratio };
        let left = if self.viscosity > 0.0 {
            ratio / (1.0 - ratio).max(f64::MIN_POSITIVE)
        } else {
            1.0
        };
        let way = left * norm(&moved(&self.increment, -1.0, &overstress.from));
        let tolerance = newton.settings.displacement_tolerance;
        balance.relative <= newton.settings.force_tolerance
            && !balance.away.contains(&true)
            && (tolerance.is_infinite() || way <= tolerance * norm(&self.increment))
    }

    /// The viscosity after a single correction that changed the residual in this ratio. Under viscous control at least
    /// a little where it grew.
    fn viscosity_by(&self, ratio: f64) -> f64 {
        let [least, most] = FOLLOWS;
        let factor = ratio.clamp(least, most);
        if self.overstress.is_none() {
            return (factor * self.viscosity).min(MOST[0]);
        }
        let now = if ratio > 1.0 {
            self.viscosity.max(LEAST)
        } else {
            self.viscosity
        };
        let next = factor * now;
        if next < LEAST { 0.0 } else { next.min(MOST[1]) }
    }

    /// The viscosity after a viscous step that was solved like this. If one correction was enough, it falls; if it is
    /// then below its first value, a harder viscous step is repeated with a larger one.
    fn viscosity_after(&self, went: &Went) -> f64 {
        let [falls, rises] = FOLLOWS;
        if went.is_cut || went.corrections > MANY {
            (rises * self.viscosity).clamp(VISCOSITY, MOST[1])
        } else if went.corrections == 1 && !went.is_repeated {
            let less = falls * self.viscosity;
            if less < LEAST { 0.0 } else { less }
        } else if self.viscosity < VISCOSITY {
            self.viscosity
        } else {
            (self.viscosity / rises).max(VISCOSITY)
        }
    }
}

/// Whether viscous control, which left these residuals, does not come to rest.
fn is_idle(residuals: &[f64], by_single_corrections: bool) -> bool {
    let steps = IDLE[usize::from(by_single_corrections)];
    let before = residuals.len().checked_sub(steps + 1);
    before.is_some_and(|before| residuals[residuals.len() - 1] > 0.5 * residuals[before])
}

/// Whether relaxation, which left these residuals, leads away from equilibrium.
fn leads_away(residuals: &[f64]) -> bool {
    let (last, multiple) = LEADS_AWAY;
    let Some((before, last)) = residuals
        .len()
        .checked_sub(last)
        .map(|start| residuals.split_at(start))
    else {
        return false;
    };
    let least = |residuals: &[f64]| residuals.iter().copied().fold(f64::INFINITY, f64::min);
    least(before).is_finite() && least(last) > multiple * least(before)
}

/// A residual by equation relative to these forces by body.
fn relative(newton: &Newton<'_>, residual: &[f64], scales: &[f64]) -> f64 {
    let bodies = &newton.equations.places.bodies;
    let sizes = norms(&bodies.of_equation, bodies.n, residual);
    let pairs = sizes.iter().zip(scales);
    pairs.fold(0.0, |largest, (size, &scale)| {
        if scale > 0.0 {
            largest.max(size / scale)
        } else {
            largest
        }
    })
}

/// u + length d.
fn moved(u: &[f64], length: f64, d: &[f64]) -> Vec<f64> {
    u.iter().zip(d).map(|(u, d)| u + length * d).collect()
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
