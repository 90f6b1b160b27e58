//! The matrix that corrections are computed with: assembled, factorised, solved with.

use super::Newton;
use super::failure::{Reason, StepFailure};
use crate::assembly::Elements;
use crate::settings::Method;
use algebra::{LinearSolver, largest};
use law::Operator;
use rayon::prelude::*;
use std::time::Instant;

/// Entries that one thread looks at, at a time.
pub(super) const PER_TASK: usize = 1 << 16;

/// What the solver of a phase holds factorised.
#[derive(Debug, Default)]
pub struct Matrix {
    /// There is one to compute corrections with.
    pub(super) held: bool,
    /// The groups still keep the tangents it was assembled from.
    pub(super) has_tangents: bool,
    /// There is only one: all groups are linear.
    pub(super) is_constant: bool,
    /// Largest entry of the last one.
    largest: f64,
    /// The same of every body, where there are several.
    largest_by_body: Vec<f64>,
    /// What it was added up from.
    elements: Elements,
    /// The same equations once more, for what is asked beside the iterations.
    pub(super) beside: Option<LinearSolver>,
    /// Who is told beforehand how many bytes these take.
    announces: Option<Announces>,
}

/// Takes how many bytes a large piece of work needs, and what it is.
type Announces = fn(u64, &'static str);

impl Matrix {
    /// That of a run that goes on.
    pub fn resumed(largest: f64) -> Self {
        Self {
            largest,
            ..Self::default()
        }
    }

    /// Tells this function what large pieces of memory are needed later.
    #[must_use]
    pub fn announcing(self, announces: Option<Announces>) -> Self {
        Self { announces, ..self }
    }

    /// Says that the equations are about to be factorised once more, for what is asked beside the iterations.
    pub(super) fn announce_beside(&self, bytes: u64) {
        if let Some(announces) = self.announces {
            announces(bytes, "factorising the equations once more");
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
    /// Notes that laws are about to compute this operator.
    pub(super) fn will_compute(&mut self, operator: Operator) {
        self.tangents = Operator::None;
        if operator != Operator::None && !self.matrix.is_constant {
            self.matrix.has_tangents = false;
        }
    }

    /// The matrix from the tangents that the groups hold, without the domain.
    pub(super) fn stiffness(&mut self) -> Vec<f64> {
        let start = Instant::now();
        let mut values = self.solver.room();
        if self.matrix.is_constant {
            // It is not added up again.
            self.system.assemble(self.groups, &mut values);
        } else {
            self.system
                .assemble_after(&mut self.matrix.elements, self.groups, &mut values);
        }
        let of_domain = self.domain.map_or(0.0, |domain| domain.largest);
        let of_parts = values.par_chunks(PER_TASK).map(largest);
        self.matrix.largest = of_parts.reduce(|| of_domain, f64::max);
        let bodies = &self.places.bodies;
        if !bodies.of_equation.is_empty() {
            let mut by_body = vec![0.0_f64; bodies.n];
            for (column, &body) in bodies.of_equation.iter().enumerate() {
                let column = &values[self.system.pattern.places(column)];
                by_body[body as usize] = by_body[body as usize].max(largest(column));
            }
            if let Some(domain) = self.domain {
                let n = self.places.boundary.len();
                let columns = domain.stiffness().chunks_exact(n.max(1));
                for (&place, column) in self.places.boundary.iter().zip(columns) {
                    let body = bodies.of_place[place] as usize;
                    by_body[body] = by_body[body].max(largest(column));
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

    /// K_fp Δp with the tangents that the groups hold, by equation.
    pub(super) fn coupling(&mut self, prescribed: &[f64]) -> Vec<f64> {
        let start = Instant::now();
        let mut coupling = vec![0.0; self.places.free.len()];
        self.places.scatter(prescribed, &mut self.displacement);
        let (system, increment) = (self.system, &self.displacement);
        system.prescribed_forces(self.groups, increment, &mut coupling);
        self.costs.assembly += start.elapsed();
        coupling
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
        let coupling = match prescribed {
            Some(increment) => self.coupling(increment),
            None => vec![0.0; residual.len()],
        };
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
