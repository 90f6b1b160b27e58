//! Which matrix the corrections are computed with, and when it is renewed.

use super::{Newton, StepFailure, Task, failed_law, plain};
use crate::case::Method;
use crate::plugin::Operator;
use std::time::Instant;

/// What the solver of a phase holds factorised. As long as it is `held`, the groups keep the
/// tangents it was assembled from: evaluations then ask their laws for none.
#[derive(Debug, Default)]
pub struct Matrix {
    held: bool,
    /// There is only one: all groups are linear.
    pub(super) is_constant: bool,
    /// Largest entry.
    pub(super) largest: f64,
}

impl Matrix {
    pub(super) fn hold(&mut self) {
        self.held = true;
    }

    /// Whether this matrix outlives the step under this method.
    pub fn is_kept(&self, method: Method) -> bool {
        let outlives = matches!(method, Method::InitialStress | Method::QuasiNewton);
        self.held && (self.is_constant || outlives)
    }
}

impl Newton<'_> {
    /// Whether the next correction needs another matrix.
    fn renews(&self) -> bool {
        !self.matrix.held
            || !self.matrix.is_constant
                && match self.settings.method {
                    Method::Newton => true,
                    Method::ModifiedNewton => !self.renewed,
                    Method::InitialStress => false,
                    Method::QuasiNewton => self.stalls,
                }
    }

    /// What laws are asked for in an evaluation that a correction follows.
    pub(super) fn operator(&self) -> Operator {
        match self.settings.method {
            _ if !self.renews() => Operator::None,
            Method::InitialStress => Operator::Elastic,
            _ => Operator::Consistent,
        }
    }

    /// Notes that laws are about to compute this operator.
    pub(super) fn will_compute(&mut self, operator: Operator) {
        self.tangents = Operator::None;
        if operator != Operator::None && !self.matrix.is_constant {
            self.matrix.held = false;
        }
    }

    /// Renews the matrix where the method wants it. `increment` is the state of the last
    /// evaluation, which is repeated if it left out the tangents. Says whether there is another
    /// matrix now.
    ///
    /// # Errors
    /// A law fails, or the matrix is singular.
    pub(super) fn prepare(
        &mut self,
        increment: &[f64],
        task: &Task<'_>,
    ) -> Result<bool, StepFailure> {
        if !self.renews() {
            return Ok(false);
        }
        let operator = self.operator();
        if self.tangents != operator {
            self.evaluate(increment, task, operator)
                .map_err(failed_law)?;
        }
        let values = self.stiffness();
        self.factorise(values)?;
        self.matrix.held = true;
        self.renewed = true;
        self.stalls = false;
        Ok(true)
    }

    /// The matrix from the tangents that the groups hold.
    pub(super) fn stiffness(&mut self) -> Vec<f64> {
        let start = Instant::now();
        let mut values = Vec::new();
        self.system.assemble(self.groups, &mut values);
        if let Some(domain) = self.domain {
            self.system.add_domain(domain.stiffness(), &mut values);
        }
        let largest = |largest: f64, value: &f64| largest.max(value.abs());
        self.matrix.largest = values.iter().fold(0.0, largest);
        self.costs.assembly += start.elapsed();
        values
    }

    /// Factorises a matrix.
    ///
    /// # Errors
    /// It is singular.
    pub(super) fn factorise(&mut self, values: Vec<f64>) -> Result<(), StepFailure> {
        let start = Instant::now();
        self.matrix.held = false;
        let outcome = self.solver.factorise(values);
        self.costs.equations += start.elapsed();
        self.costs.factorisations += 1;
        outcome.map_err(|_| singular())
    }

    /// Solves K δ = residual − K_fp Δp with the factorised matrix.
    ///
    /// # Errors
    /// The matrix is singular.
    pub(super) fn solve(
        &mut self,
        residual: &[f64],
        prescribed: Option<&[f64]>,
    ) -> Result<Vec<f64>, StepFailure> {
        let start = Instant::now();
        let mut coupling = vec![0.0; residual.len()];
        if let Some(increment) = prescribed {
            self.system
                .prescribed_forces(self.groups, increment, &mut coupling);
        }
        self.costs.assembly += start.elapsed();
        let start = Instant::now();
        let right: Vec<f64> = residual.iter().zip(&coupling).map(|(r, c)| r - c).collect();
        let solution = self.solver.solve(&right);
        self.costs.equations += start.elapsed();
        let solution = solution.map_err(|_| singular())?;
        let mut correction = vec![0.0; self.system.n_dofs()];
        for (&dof, value) in self.system.free().iter().zip(solution) {
            correction[dof] = value;
        }
        self.system.follow(&mut correction);
        Ok(correction)
    }
}

fn singular() -> StepFailure {
    plain("the tangent matrix is singular: a part of the model can move freely")
}
