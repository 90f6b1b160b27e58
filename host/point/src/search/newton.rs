//! Newton's method with the law's tangent, and the way out of zones where the flux does not answer.

use super::acceptance::{MAX_POLISH, Verdict};
use super::norm::{largest, norm};
use super::{Fatal, Search};
use crate::state::{Step, Vector};
use std::mem::swap;

const MAX_NEWTON: usize = 40;
const MAX_HALVINGS: usize = 10;
/// Doublings and bisections on the way out of a zone where the flux does not answer.
const MAX_DOUBLINGS: usize = 100;
const MAX_BISECTIONS: usize = 60;

impl Search<'_> {
    /// Newton's method with a line search. The solution, or the best sample, is in `base`.
    pub(super) fn newton(&mut self, step: &Step<'_>, guess: Vector) -> Result<bool, Fatal> {
        if !self.evaluate(step, guess, self.tangent)? {
            return Ok(false);
        }
        swap(&mut self.base, &mut self.trial);
        let mut polish = 0;
        for _ in 0..MAX_NEWTON {
            match self.base.verdict {
                Verdict::Tight => return Ok(true),
                Verdict::Close if polish == MAX_POLISH => return Ok(true),
                Verdict::Close => polish += 1,
                Verdict::Far => {}
            }
            let d = self.descent(&self.base.operator, &self.base.residual);
            if !self.line_search(step, &d)? && !self.escape(step, &d)? {
                break;
            }
        }
        Ok(self.base.verdict != Verdict::Far)
    }

    /// Moves `base` along d as far as the residual falls enough. `false`: it does not fall.
    fn line_search(&mut self, step: &Step<'_>, d: &Vector) -> Result<bool, Fatal> {
        let mut fraction = 1.0;
        for _ in 0..MAX_HALVINGS {
            let Some(gradient) = self.moved(d, fraction) else {
                return Ok(false);
            };
            if self.evaluate(step, gradient, self.tangent)?
                && self.trial.norm <= (1.0 - 1e-4 * fraction) * self.base.norm
            {
                swap(&mut self.base, &mut self.trial);
                return Ok(true);
            }
            fraction *= 0.5;
        }
        Ok(false)
    }

    /// Moves `base` along the elastic answer to what the step d leaves of the residual, until the
    /// residual falls. `false`: it does not fall.
    fn escape(&mut self, step: &Step<'_>, d: &Vector) -> Result<bool, Fatal> {
        let left = self.left_over(d);
        let direction = self.descent(&self.elastic, &left);
        let longest = 8.0
            * (largest(&step.start.gradient)
                + largest(&self.base.point.gradient)
                + largest(&direction));
        let enough = 0.9 * self.base.norm;
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut fraction = 1.0;
        for _ in 0..MAX_DOUBLINGS + MAX_BISECTIONS {
            let Some(gradient) = self.moved(&direction, fraction) else {
                return Ok(false);
            };
            let answers = if self.evaluate(step, gradient, self.tangent)? {
                if self.trial.norm <= enough {
                    swap(&mut self.base, &mut self.trial);
                    return Ok(true);
                }
                let turned: f64 = (0..self.n_free)
                    .map(|k| self.trial.residual[k] * left[k])
                    .sum();
                turned <= 0.0
            } else {
                true
            };
            if answers {
                high = fraction;
            } else {
                low = fraction;
            }
            fraction = if high.is_finite() {
                0.5 * (low + high)
            } else {
                2.0 * fraction
            };
            let resolved = high.is_finite() && high - low <= 1e-15 * high;
            if resolved || fraction * largest(&direction) > longest {
                return Ok(false);
            }
        }
        Ok(false)
    }

    /// The residual after a step d of `base`, to first order; the whole of it where that
    /// is next to nothing.
    fn left_over(&self, d: &Vector) -> Vector {
        let mut left = self.base.residual;
        for (k, &i) in self.free[..self.n_free].iter().enumerate() {
            let answer: f64 = self.free[..self.n_free]
                .iter()
                .map(|&j| self.base.operator[i * self.n + j] * d[j])
                .sum();
            left[k] += answer + self.stiffness[i] * d[i];
        }
        if norm(&left[..self.n_free]) > 1e-3 * self.base.norm {
            left
        } else {
            self.base.residual
        }
    }
}
