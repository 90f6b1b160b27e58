//! Least squares within bounds, by the method of Levenberg and Marquardt.
//!
//! Minimises S(u) = Σ r_i(u)² over lower ≤ u ≤ upper. Each step solves the damped problem min ‖r + J
//! δ‖² + λ ‖D δ‖² by QR of the stacked matrix, which keeps the digits that normal equations lose. D
//! has the largest norms that the columns of J have had (Moré 1978), so that units do not matter. The
//! damping λ follows the ratio of the actual to the predicted reduction (Nielsen 1999). A variable at
//! a bound that the gradient points out of is left out of the step; what a step would carry beyond a
//! bound stays on it.

use nalgebra::{DMatrix, DVector};

/// The function that is fitted. `Error` ends the work; `None` says that there is no answer at this place.
pub(super) trait Problem {
    /// Why the work cannot go on.
    type Error;

    /// The residuals at a place.
    ///
    /// # Errors
    /// What ends the work.
    fn residuals(&mut self, u: &[f64]) -> Result<Option<DVector<f64>>, Self::Error>;

    /// Their derivatives at a place where they are `residuals`: a row for each, a column for each
    /// variable.
    ///
    /// # Errors
    /// What ends the work.
    fn jacobian(
        &mut self,
        u: &[f64],
        residuals: &DVector<f64>,
    ) -> Result<Option<DMatrix<f64>>, Self::Error>;
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settings {
    /// Relative reduction of the sum, found and foretold, below which it counts as least; what the
    /// residuals are known to.
    pub(super) reduction: f64,
    /// Relative size of a step below which it counts as nothing.
    pub(super) step: f64,
    /// Cosine of the angle between residuals and every column below which they count as orthogonal.
    pub(super) gradient: f64,
    /// Norm of a column up to which it is nothing but what derivatives are not known to: its variable is left alone.
    pub(super) least: f64,
    /// Most iterations.
    pub(super) iterations: usize,
    /// Longest change of a variable in a step: what is linear near a start says nothing of a plateau far away.
    pub(super) longest: f64,
}

/// How a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// At a minimum, within what was asked for.
    Converged,
    /// No step, however short, makes the sum smaller: residuals or derivatives are not exact enough
    /// to go on, or the sum has a kink there.
    Stalled,
    /// At a place from where every step, however short, leads to where there is no answer.
    Barred,
    /// There is no answer for the derivatives at the last place.
    NoDerivatives,
    /// After as many iterations as were allowed.
    Exhausted,
}

/// What was found.
#[derive(Clone, Debug)]
pub(super) struct Minimum {
    /// Where.
    pub(super) u: Vec<f64>,
    /// The residuals there.
    pub(super) residuals: DVector<f64>,
    /// Their derivatives there; those of the last place where there were any.
    pub(super) jacobian: DMatrix<f64>,
    /// Steps taken.
    pub(super) iterations: usize,
    /// Steps that were shortened because there was no answer at their end.
    pub(super) failures: usize,
    /// How it ended.
    pub(super) end: End,
}

impl Minimum {
    /// Sum of the squared residuals.
    pub(super) fn sum(&self) -> f64 {
        self.residuals.norm_squared()
    }
}

/// Damping beyond which steps are nothing.
const MOST_DAMPING: f64 = 1e16;
/// Relative difference of two sums that may be of rounding.
const ROUND_OFF: f64 = 1e-13;
/// A step is taken if it reduces the sum by at least this share of what was foretold.
const WORTH_IT: f64 = 1e-4;

/// The damping of steps, which follows how well the last one was foretold.
struct Damping {
    value: f64,
    growth: f64,
}

impl Damping {
    /// That of the first step.
    const FIRST: Self = Self {
        value: 1e-3,
        growth: 2.0,
    };

    /// After a step that was taken; `ratio`: the reduction found over that foretold.
    fn ease(&mut self, ratio: f64) {
        self.value *= (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0);
        self.growth = 2.0;
    }

    /// After a step that was not.
    fn raise(&mut self) {
        self.value *= self.growth;
        self.growth *= 2.0;
    }
}

/// Where a step leads.
struct Trial {
    u: Vec<f64>,
    /// `None`: there is no answer.
    residuals: Option<DVector<f64>>,
    /// How much smaller the sum is foretold to be there.
    foretold: f64,
    /// The reduction found over that foretold.
    ratio: f64,
    /// Whether the step counts as nothing.
    is_small: bool,
}

impl Minimum {
    /// Tries a step from here.
    fn attempt<P: Problem>(
        &self,
        problem: &mut P,
        step: &[f64],
        bounds: &[[f64; 2]],
        settings: Settings,
    ) -> Result<Trial, P::Error> {
        let (u, sum) = (&self.u, self.sum());
        let length = step.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
        let share = (settings.longest / length).min(1.0);
        let target = clamped(u.iter().zip(step).map(|(u, d)| u + share * d), bounds);
        let moved = DVector::from_iterator(u.len(), target.iter().zip(u).map(|(t, u)| t - u));
        let foretold = sum - (&self.residuals + &self.jacobian * &moved).norm_squared();
        let residuals = problem.residuals(&target)?;
        let found = residuals.as_ref().map(|there| sum - there.norm_squared());
        // What is left of the way to the minimum no sum can tell: such a step is taken for a good one.
        let is_blurred = |found: f64| found.abs() <= ROUND_OFF * sum && foretold <= ROUND_OFF * sum;
        let ratio = found.map_or(-1.0, |found| {
            if is_blurred(found) {
                1.0
            } else {
                found / foretold
            }
        });
        let is_still = |(d, u): (&f64, &f64)| d.abs() <= settings.step * (u.abs() + settings.step);
        Ok(Trial {
            is_small: moved.iter().zip(u).all(is_still),
            u: target,
            residuals,
            foretold,
            ratio,
        })
    }

    /// Takes steps from here until there is no better place. Returns how that ended.
    fn descend<P: Problem>(
        &mut self,
        problem: &mut P,
        bounds: &[[f64; 2]],
        settings: Settings,
    ) -> Result<End, P::Error> {
        let mut scale = vec![0.0_f64; self.u.len()];
        let mut damping = Damping::FIRST;
        // Whether a step since the last one that was taken had no answer at its end.
        let mut is_barred = false;
        while self.iterations < settings.iterations {
            let (sum, jacobian, residuals) = (self.sum(), &self.jacobian, &self.residuals);
            let free = free(&self.u, jacobian, residuals, bounds, settings.least);
            for (scale, column) in scale.iter_mut().zip(jacobian.column_iter()) {
                *scale = scale.max(column.norm());
            }
            if is_orthogonal(jacobian, residuals, &free, settings.gradient) {
                return Ok(End::Converged);
            }
            let step = step(jacobian, residuals, &scale, &free, damping.value);
            let trial = self.attempt(problem, &step, bounds, settings)?;
            self.failures += usize::from(trial.residuals.is_none());
            is_barred |= trial.residuals.is_none();
            let (foretold, ratio) = (trial.foretold, trial.ratio);
            let is_worth_it = foretold > 0.0 && ratio > WORTH_IT;
            let taken = trial.residuals.filter(|_| is_worth_it);
            let is_taken = taken.is_some();
            // What is foretold is below what the residuals are known to: there is no better place.
            let is_least = foretold <= settings.reduction * sum && !(is_taken && ratio > 2.0);
            if let Some(residuals) = taken {
                self.iterations += 1;
                (self.u, self.residuals) = (trial.u, residuals);
                let Some(derivatives) = problem.jacobian(&self.u, &self.residuals)? else {
                    return Ok(End::NoDerivatives);
                };
                self.jacobian = derivatives;
                damping.ease(ratio);
            } else {
                damping.raise();
            }
            match (is_least || trial.is_small, is_barred) {
                (true, true) => return Ok(End::Barred),
                (true, false) => return Ok(End::Converged),
                _ if is_taken => is_barred = false,
                _ if damping.value > MOST_DAMPING => return Ok(End::Stalled),
                _ => {}
            }
        }
        Ok(End::Exhausted)
    }
}

/// Looks for a minimum from `start`; `None` if there is no answer at the start, or no derivatives.
///
/// # Errors
/// What ends the work.
pub(super) fn minimise<P: Problem>(
    problem: &mut P,
    start: &[f64],
    bounds: &[[f64; 2]],
    settings: Settings,
) -> Result<Option<Minimum>, P::Error> {
    let u: Vec<f64> = clamped(start.iter().copied(), bounds);
    let Some(residuals) = problem.residuals(&u)? else {
        return Ok(None);
    };
    let Some(jacobian) = problem.jacobian(&u, &residuals)? else {
        return Ok(None);
    };
    let mut at = Minimum {
        u,
        residuals,
        jacobian,
        iterations: 0,
        failures: 0,
        end: End::Exhausted,
    };
    at.end = at.descend(problem, bounds, settings)?;
    Ok(Some(at))
}

/// Within the bounds.
fn clamped(u: impl Iterator<Item = f64>, bounds: &[[f64; 2]]) -> Vec<f64> {
    let within = |(u, [lower, upper]): (f64, &[f64; 2])| u.max(*lower).min(*upper);
    u.zip(bounds).map(within).collect()
}

/// The variables that may move: seen by the residuals, and not at a bound that the way down leads out of.
pub(super) fn free(
    u: &[f64],
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    bounds: &[[f64; 2]],
    least: f64,
) -> Vec<usize> {
    let may_move = |&i: &usize| {
        let column = jacobian.column(i);
        let gradient = column.dot(residuals);
        let [lower, upper] = bounds[i];
        let is_out = u[i] <= lower && gradient > 0.0 || u[i] >= upper && gradient < 0.0;
        lower < upper && !is_out && column.norm() > least
    };
    (0..u.len()).filter(may_move).collect()
}

fn is_orthogonal(
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    free: &[usize],
    cosine: f64,
) -> bool {
    free.iter().all(|&i| {
        let column = jacobian.column(i);
        column.dot(residuals).abs() <= cosine * column.norm() * residuals.norm()
    })
}

/// The damped step of the free variables; 0 of the others.
fn step(
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    scale: &[f64],
    free: &[usize],
    damping: f64,
) -> Vec<f64> {
    let (m, n) = (residuals.len(), free.len());
    let scale = |i: usize| if scale[i] > 0.0 { scale[i] } else { 1.0 };
    let stacked = DMatrix::from_fn(m + n, n, |row, k| {
        if row < m {
            jacobian[(row, free[k])] / scale(free[k])
        } else if row - m == k {
            damping.sqrt()
        } else {
            0.0
        }
    });
    let mut right = DVector::zeros(m + n);
    right.rows_mut(0, m).copy_from(&-residuals);
    let qr = stacked.qr();
    qr.q_tr_mul(&mut right);
    let mut step = vec![0.0; jacobian.ncols()];
    // Damping keeps the triangle regular.
    let solved = qr
        .r()
        .solve_upper_triangular(&right.rows(0, n).into_owned());
    for (k, &i) in free.iter().enumerate() {
        step[i] = solved.as_ref().map_or(0.0, |solved| solved[k]) / scale(i);
    }
    step
}

#[cfg(test)]
mod tests;
