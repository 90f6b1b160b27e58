//! Which matrix the corrections are computed with, and when it is renewed.

use super::{Newton, Reason, StepFailure, Task};
use crate::settings::Method;
use law::Operator;
use std::time::Instant;

/// A matrix is kept as long as each correction leaves no more than this fraction of the residual:
/// of equations beside a condensed domain, and of all others. Found by trial: a few iterations more
/// are cheap where the laws of an interface are all there is to evaluate.
const FAST: [f64; 2] = [0.03, 0.01];

/// What the solver of a phase holds factorised.
#[derive(Debug, Default)]
pub struct Matrix {
    /// There is one to compute corrections with.
    held: bool,
    /// The groups still keep the tangents it was assembled from.
    has_tangents: bool,
    /// There is only one: all groups are linear.
    pub(super) is_constant: bool,
    /// Largest entry of the last one.
    pub(super) largest: f64,
    /// The same of every body, where there are several.
    largest_by_body: Vec<f64>,
}

impl Matrix {
    /// That of a run that goes on.
    pub fn resumed(largest: f64) -> Self {
        Self {
            largest,
            ..Self::default()
        }
    }

    /// Largest entry; residuals are measured against it where no force has ever acted.
    pub fn largest(&self) -> f64 {
        self.largest
    }

    /// Largest entry of the equations of a body.
    pub(super) fn largest_of(&self, body: usize) -> f64 {
        let known = self.largest_by_body.get(body);
        known.copied().unwrap_or(self.largest)
    }

    pub(super) fn hold(&mut self) {
        self.held = true;
        self.has_tangents = true;
    }

    /// Whether this matrix outlives the step under this method.
    pub fn is_kept(&self, method: Method) -> bool {
        let outlives = !matches!(method, Method::Newton | Method::ModifiedNewton);
        self.held && self.has_tangents && (self.is_constant || outlives)
    }
}

impl Newton<'_> {
    /// Begins a step: with the matrix of the last one only if an interrupted run would have it, too.
    pub(super) fn begin(&mut self) {
        self.renewed = false;
        self.matrix.held &= self.matrix.has_tangents;
        self.solver.check_next();
    }

    /// Ends a step. What a failed one leaves behind belongs to no state; and a matrix that was
    /// factorised another way would not be so again.
    pub(super) fn end(&mut self, is_equilibrium: bool) {
        if !self.matrix.is_constant {
            let may_stay = is_equilibrium || self.settings.method != Method::Auto;
            self.matrix.has_tangents &= may_stay && !self.solver.has_fallen_back();
        }
    }

    /// Whether the matrix is that of an earlier step, though another could be had.
    pub(super) fn is_stale(&self) -> bool {
        self.settings.method == Method::Auto && !self.matrix.is_constant && !self.renewed
    }

    /// Whether the next correction needs another matrix.
    fn renews(&self) -> bool {
        !self.matrix.held
            || !self.matrix.is_constant
                && match self.settings.method {
                    Method::Auto => self.contraction > FAST[usize::from(self.domain.is_none())],
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
            self.matrix.has_tangents = false;
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
                .map_err(StepFailure::from)?;
        }
        let values = self.stiffness();
        self.factorise(values, 1.0)?;
        self.matrix.hold();
        self.renewed = true;
        self.stalls = false;
        Ok(true)
    }

    /// The matrix from the tangents that the groups hold, without the domain.
    pub(super) fn stiffness(&mut self) -> Vec<f64> {
        let start = Instant::now();
        let mut values = Vec::new();
        self.system.assemble(self.groups, &mut values);
        let largest = |largest: f64, value: &f64| largest.max(value.abs());
        let of_domain = self.domain.map_or(0.0, |domain| domain.largest);
        self.matrix.largest = values.iter().fold(of_domain, largest);
        let bodies = &self.places.bodies;
        if !bodies.of_equation.is_empty() {
            let mut by_body = vec![0.0; bodies.n];
            for (column, &body) in bodies.of_equation.iter().enumerate() {
                let column = &values[self.system.pattern.places(column)];
                by_body[body as usize] = column.iter().fold(by_body[body as usize], largest);
            }
            if let Some(domain) = self.domain {
                let n = self.places.boundary.len();
                let columns = domain.stiffness().chunks_exact(n.max(1));
                for (&place, column) in self.places.boundary.iter().zip(columns) {
                    let body = bodies.of_place[place] as usize;
                    by_body[body] = column.iter().fold(by_body[body], largest);
                }
            }
            self.matrix.largest_by_body = by_body;
        }
        self.costs.assembly += start.elapsed();
        values
    }

    /// Factorises a matrix with a multiple of the domain's stiffness.
    ///
    /// # Errors
    /// It is singular.
    pub(super) fn factorise(&mut self, values: Vec<f64>, share: f64) -> Result<(), StepFailure> {
        let start = Instant::now();
        self.matrix.held = false;
        let outcome = self.solver.factorise_with(values, share);
        self.costs.equations += start.elapsed();
        self.costs.factorisations += 1;
        outcome.map_err(|_| Reason::Singular(None).into())
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
            self.places.scatter(increment, &mut self.displacement);
            let (system, increment) = (self.system, &self.displacement);
            system.prescribed_forces(self.groups, increment, &mut coupling);
        }
        self.costs.assembly += start.elapsed();
        let start = Instant::now();
        let right: Vec<f64> = residual.iter().zip(&coupling).map(|(r, c)| r - c).collect();
        let solution = self.solver.solve(&right);
        self.costs.equations += start.elapsed();
        let solution = solution.map_err(|_| StepFailure::from(Reason::Singular(None)))?;
        let mut correction = vec![0.0; self.places.n()];
        for (&place, value) in self.places.free.iter().zip(solution) {
            correction[place] = value;
        }
        self.places.follow(&mut correction);
        Ok(correction)
    }
}
