//! Convergence of an iterate, by [what is asked of it](super::acceptance): the sizes of a residual
//! and of a correction, body by body, are handed there.

use super::Newton;
use super::acceptance::{Criteria, Measures, STALE};
use super::failure::{Criterion, Unmet};
use super::iterate::State;
use super::outcome::{Iteration, Open};
use super::residual::{Balance, Task};
use super::round_off::EXACT;
use crate::settings::Convergence;
use law::Operator;
use std::collections::BTreeMap;

impl Newton<'_> {
    /// Notes a correction, or a fraction of it, that was taken.
    pub(in crate::equilibrium) fn took(
        &mut self,
        at: &State,
        correction: &[f64],
        length: f64,
    ) -> Iteration {
        self.took_to(&at.balance, correction, &at.increment, length)
    }

    /// The same, by what it led to: a balance and displacement increments.
    pub(in crate::equilibrium) fn took_to(
        &mut self,
        at: &Balance,
        correction: &[f64],
        moved: &[f64],
        length: f64,
    ) -> Iteration {
        self.reference.changes = self.changes(correction, moved);
        // Of several bodies one that is at rest has nothing to correct.
        let criteria = self.criteria(false);
        let moving = self
            .measures(at, length >= 1.0)
            .into_iter()
            .zip(&self.reference.changes);
        let relative = moving
            .filter(|(measures, _)| {
                self.reference.changes.len() == 1 || !measures.is_exact(criteria)
            })
            .map(|(_, change)| change.relative)
            .fold(0.0, f64::max);
        Iteration::of(at, relative, length)
    }

    /// Criteria of a state, corrected with the matrix of an earlier step or not.
    fn criteria(&self, is_stale: bool) -> Criteria {
        Criteria {
            force: self.settings.force_tolerance,
            displacement: self.settings.displacement_tolerance,
            is_stale,
        }
    }

    /// The bodies after an iteration, with a whole Newton correction or not.
    fn measures(&self, balance: &Balance, is_whole: bool) -> Vec<Measures> {
        let bodies = balance.by_body.iter().zip(&balance.away).enumerate();
        bodies
            .map(|(body, (&residual, &is_away))| {
                let change = self.reference.changes.get(body).copied();
                Measures {
                    residual,
                    whole: change.filter(|_| is_whole),
                    beyond: change.map_or(0.0, |change| change.beyond),
                    is_away,
                }
            })
            .collect()
    }

    /// Whether an iteration has ended in equilibrium.
    pub(in crate::equilibrium) fn is_equilibrium(
        &self,
        balance: &Balance,
        last: &Iteration,
    ) -> bool {
        let bodies = self.in_equilibrium(balance, last);
        bodies.into_iter().all(|is_there| is_there)
    }

    /// Bodies in equilibrium after an iteration.
    pub(super) fn in_equilibrium(&self, balance: &Balance, last: &Iteration) -> Vec<bool> {
        let criteria = self.criteria(last.correction.is_some() && self.keeps());
        let is_whole =
            last.correction.is_some() && last.step_length >= 1.0 && last.viscosity <= 0.0;
        let bodies = self.measures(balance, is_whole).into_iter();
        bodies.map(|body| body.is_equilibrium(criteria)).collect()
    }

    /// Open corrections and forces of a state that the residual alone has accepted.
    pub(in crate::equilibrium) fn open(
        &self,
        balance: &Balance,
        iterations: &[Iteration],
    ) -> Option<Open> {
        if self.settings.convergence != Convergence::Force {
            return None;
        }
        let bodies = &self.equations.places.bodies;
        let body_of = |equation: usize| match bodies.of_equation.get(equation) {
            Some(&body) => body as usize,
            None => 0,
        };
        let mut squares: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        let by_equation = self.equations.system.free().iter().zip(&balance.residual);
        for (equation, (&dof, force)) in by_equation.enumerate() {
            *squares.entry((body_of(equation), dof / 2)).or_default() += force * force;
        }
        let nodes_of = |body: usize| squares.keys().filter(|(of, _)| *of == body).count();
        let allowed: Vec<f64> = (balance.scales.iter().enumerate())
            .map(|(body, scale)| {
                let mean_square = scale * scale / nodes_of(body).max(1) as f64;
                self.settings.force_tolerance.powi(2) * mean_square
            })
            .collect();
        let is_off = |((body, _), square): &(&(usize, usize), &f64)| **square > allowed[*body];
        Some(Open {
            residual: balance.relative,
            force: balance.relative * balance.scales.iter().copied().fold(0.0, f64::max),
            correction: iterations.last()?.correction.unwrap_or(0.0),
            nodes: squares.iter().filter(is_off).count(),
        })
    }

    /// Whether a correction of this relative size will probably be the last one.
    pub(in crate::equilibrium) fn probably_ends(&self, residual: f64, correction: f64) -> bool {
        let expected = residual * self.kept.contraction;
        let tolerance = self.settings.force_tolerance;
        expected <= EXACT * tolerance
            || (expected <= tolerance && correction <= self.settings.displacement_tolerance)
    }

    /// Whether a state with a singular tangent is in equilibrium nevertheless, judged with the matrix at the start of
    /// the step. Example: a layer has just lost contact and with it its stiffness, and the residual is round-off. The
    /// trial state stays.
    pub(in crate::equilibrium) fn has_settled(
        &mut self,
        increment: &[f64],
        balance: &Balance,
        task: &Task,
    ) -> bool {
        let criteria = Criteria {
            is_stale: true,
            ..self.criteria(true)
        };
        if balance.relative > STALE * criteria.force {
            return false;
        }
        let still = vec![0.0; increment.len()];
        let operator = self.operator();
        let settled = self.evaluate(&still, task, operator).is_ok() && {
            self.factorise_tangents().is_ok() && {
                self.equations.matrix.hold();
                self.solve(&balance.residual, None).is_ok_and(|correction| {
                    self.reference.changes = self.changes(&correction, increment);
                    let bodies = self.measures(balance, true);
                    bodies.iter().all(|body| body.is_equilibrium(criteria))
                })
            }
        };
        settled && self.evaluate(increment, task, Operator::None).is_ok()
    }

    /// Both criteria at a state.
    pub(in crate::equilibrium) fn unmet(
        &self,
        balance: &Balance,
        correction: Option<f64>,
    ) -> Unmet {
        let residual_tolerance = self.settings.force_tolerance;
        Unmet {
            failed: if balance.away.contains(&true) {
                Criterion::Distance
            } else if balance.relative <= residual_tolerance {
                Criterion::Correction
            } else {
                Criterion::Residual
            },
            residual: balance.relative,
            residual_tolerance,
            correction,
            correction_tolerance: self.settings.displacement_tolerance,
        }
    }
}
