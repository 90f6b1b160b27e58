//! Fixed-point iterations with the elastic operator, accelerated after Anderson (type II).

use super::acceptance::{MAX_POLISH, Verdict};
use super::direction::FLAT;
use super::{Fatal, Search};
use crate::state::{N_MAX, Step, Vector};
use nalgebra::{SMatrix, SVector};
use std::mem::swap;

const MAX_RELAXATIONS: usize = 160;
/// Newton is tried again after this many fixed-point iterations.
const NEWTON_EVERY: usize = 8;
/// Differences that Anderson's acceleration remembers.
const MEMORY: usize = 4;

impl Search<'_> {
    /// Fixed-point iterations with the elastic operator.
    pub(super) fn relax(&mut self, step: &Step<'_>, guess: Vector) -> Result<bool, Fatal> {
        if !self.evaluate(step, guess, self.relaxation)? {
            return Ok(false);
        }
        swap(&mut self.base, &mut self.trial);
        let mut history = History::default();
        let mut damping = 1.0;
        let mut polish = 0;
        for k in 1..=MAX_RELAXATIONS {
            match self.base.verdict {
                Verdict::Tight => return Ok(true),
                Verdict::Close if polish == MAX_POLISH => return Ok(true),
                Verdict::Close => polish += 1,
                Verdict::Far => {}
            }
            let f = self.descent(&self.base.operator, &self.base.residual);
            let d = history.accelerated(&f, damping);
            let Some(gradient) = self.moved(&d, 1.0) else {
                break;
            };
            if !self.evaluate(step, gradient, self.relaxation)?
                || self.trial.norm > 2.0 * self.base.norm
            {
                if history.is_empty() {
                    damping *= 0.5;
                    if damping < 1e-3 {
                        break;
                    }
                }
                history.forget();
                continue;
            }
            let f_new = self.descent(&self.trial.operator, &self.trial.residual);
            history.add(&d, &f, &f_new);
            damping = f64::min(1.0, 2.0 * damping);
            swap(&mut self.base, &mut self.trial);
            if k % NEWTON_EVERY == 0 && self.base.verdict == Verdict::Far {
                let gradient = self.base.point.gradient;
                if self.newton(step, gradient)? {
                    return Ok(true);
                }
                if !self.evaluate(step, gradient, self.relaxation)? {
                    break;
                }
                swap(&mut self.base, &mut self.trial);
            }
        }
        Ok(self.base.verdict != Verdict::Far)
    }
}

/// The last steps x and the differences of f = −E⁻¹ r over them.
#[derive(Debug, Default)]
struct History {
    steps: [Vector; MEMORY],
    changes: [Vector; MEMORY],
    n: usize,
}

impl History {
    fn is_empty(&self) -> bool {
        self.n == 0
    }

    fn forget(&mut self) {
        self.n = 0;
    }

    fn add(&mut self, step: &Vector, f: &Vector, f_new: &Vector) {
        self.steps.rotate_right(1);
        self.changes.rotate_right(1);
        self.steps[0] = *step;
        self.changes[0] = std::array::from_fn(|i| f_new[i] - f[i]);
        self.n = MEMORY.min(self.n + 1);
    }

    /// f + … : the step that would cancel f if f were linear in what is remembered.
    fn accelerated(&self, f: &Vector, damping: f64) -> Vector {
        if self.n == 0 {
            return f.map(|f| damping * f);
        }
        let changes = SMatrix::<f64, N_MAX, MEMORY>::from_fn(|i, k| {
            if k < self.n { self.changes[k][i] } else { 0.0 }
        });
        let right = SVector::<f64, N_MAX>::from_column_slice(f);
        let svd = changes.svd(true, true);
        let threshold = FLAT * svd.singular_values.max();
        let Ok(weights) = svd.solve(&right, threshold) else {
            return *f;
        };
        std::array::from_fn(|i| {
            let correction: f64 = (0..self.n)
                .map(|k| weights[k] * (self.steps[k][i] + self.changes[k][i]))
                .sum();
            f[i] - correction
        })
    }
}
