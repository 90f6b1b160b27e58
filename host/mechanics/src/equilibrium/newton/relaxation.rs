//! Viscous relaxation: from a step that Newton iterations cannot finish to an equilibrium.
//!
//! Newton's method assumes an equilibrium nearby. In a material whose flow is not associated, or
//! whose contacts open, the branch of equilibria may end where one point reaches another piece of
//! its law: followed on, neither piece leads to an equilibrium. Iterations then alternate between
//! the two for ever, however small the step (the residual of the cycle is proportional to the
//! step). What a real body does there is to move on, quickly,
//! until it finds the next stable equilibrium. The relaxation follows that motion with a
//! viscosity proportional to the elastic stiffness,
//!
//!   α K_e u̇ = r(u),    an implicit step of unit time: (K + α K_e) δ = r,
//!
//! from the elastic answer to the step on, the residual growing where it must. It leaves
//! equilibria that are not stable and ends at one that is. Newton iterations are tried whenever
//! the residual has fallen; they alone decide on convergence, by the same tolerances. The motion
//! changes the path within the step only: laws still see one increment from the last equilibrium.

use super::{Balance, Iteration, Iterations, Newton, Reason, StepFailure, Task};
use law::Operator;

/// α. With flow along m and yield along n, enclosing an angle θ (in energy), the symmetric part
/// of D + α D_e is positive definite for α above (1/cos θ − 1)/2. This value was found by trial:
/// the chambers with Mohr–Coulomb sand settle with it; 0.1 and 1 are much slower there.
const VISCOSITY: f64 = 0.05;
/// Newton iterations are tried each time the residual has fallen to this fraction.
const FALL: f64 = 0.1;
/// Viscous steps within one step of the load.
const MAX_STEPS: usize = 200;
/// Newton iterations without a new least residual that count as a standstill.
const STANDSTILL: usize = 6;
/// Iterations before a standstill is looked for.
const FIRST: usize = 10;
/// What a new least residual must be below, relative to the old one.
const PROGRESS: f64 = 0.9;

/// A relaxation under way.
#[derive(Debug)]
pub(super) struct Relaxation {
    /// Elastic stiffness, in the matrix's pattern; without the domain.
    elastic: Vec<f64>,
    /// Displacement increments reached.
    increment: Vec<f64>,
    /// Viscous steps so far.
    steps: usize,
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
        part.iter()
            .fold(f64::INFINITY, |least, i| least.min(i.residual))
    };
    least(&iterations[start..]) > PROGRESS * least(&iterations[..start])
}

impl Newton<'_> {
    /// Starts a relaxation from the elastic answer to the step; `None` if a law has no elastic
    /// operator or elasticity alone leaves the equations singular.
    pub(super) fn start_relaxation(&mut self, task: &Task<'_>) -> Option<Relaxation> {
        let still = vec![0.0; task.external.len()];
        let before = self.evaluate(&still, task, Operator::Elastic).ok()?;
        let elastic = self.stiffness();
        self.factorise(elastic.clone(), 1.0).ok()?;
        let mut increment = self.solve(&before.residual, Some(task.prescribed)).ok()?;
        for (value, prescribed) in increment.iter_mut().zip(task.prescribed) {
            *value += prescribed;
        }
        self.places.follow(&mut increment);
        Some(Relaxation {
            elastic,
            increment,
            steps: 0,
        })
    }

    /// Carries a relaxation on until the residual has fallen enough to try Newton iterations.
    ///
    /// # Errors
    /// The residual did not fall, or a law or the equations failed.
    pub(super) fn relax(
        &mut self,
        relaxation: &mut Relaxation,
        task: &Task<'_>,
        iterations: &mut Vec<Iteration>,
    ) -> Result<(Vec<f64>, Balance), StepFailure> {
        let mut balance = self
            .evaluate(&relaxation.increment, task, Operator::Consistent)
            .map_err(StepFailure::from)?;
        let mut largest = balance.relative;
        while relaxation.steps < MAX_STEPS {
            self.may_go_on()?;
            relaxation.steps += 1;
            let correction = self.viscous_correction(&balance.residual, &relaxation.elastic)?;
            for (u, d) in relaxation.increment.iter_mut().zip(&correction) {
                *u += d;
            }
            let before = balance.relative;
            balance = self
                .evaluate(&relaxation.increment, task, Operator::Consistent)
                .map_err(StepFailure::from)?;
            let taken = self.took(&balance, &correction, &relaxation.increment, 1.0);
            iterations.push(Iteration {
                viscosity: VISCOSITY,
                ..taken
            });
            largest = largest.max(balance.relative);
            if balance.relative < before && balance.relative <= FALL * largest {
                return Ok((relaxation.increment.clone(), balance));
            }
        }
        let correction = iterations.last().and_then(|last| last.correction);
        let unmet = self.unmet(&balance, correction);
        Err(Reason::Unmet(Iterations::Relaxation(MAX_STEPS), unmet).into())
    }

    /// Solves (K + α K_e) δ = residual with the tangents of the last evaluation.
    fn viscous_correction(
        &mut self,
        residual: &[f64],
        elastic: &[f64],
    ) -> Result<Vec<f64>, StepFailure> {
        let mut values = self.stiffness();
        for (value, elastic) in values.iter_mut().zip(elastic) {
            *value += VISCOSITY * elastic;
        }
        self.factorise(values, 1.0 + VISCOSITY)?;
        self.solve(residual, None)
    }
}
