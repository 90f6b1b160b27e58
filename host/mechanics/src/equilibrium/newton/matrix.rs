//! The matrix that corrections are computed with: assembled, factorised, solved with.

use super::Newton;
use super::failure::{Reason, StepFailure};
use super::residual::Balance;
use crate::assembly::{Elements, System};
use crate::group::Group;
use crate::settings::Method;
use algebra::{LastMatrix, LinearSolver, Singular, largest, threads};
use law::Operator;
use std::time::Instant;

/// Residual that corrections may leave, relative to the forces in play: rounding leaves as much. Also a share of what
/// is tolerated.
const NOISE: f64 = 1e-12;
const LEFT: f64 = 1e-3;
/// Entries of a matrix that one thread takes at a time.
const PER_TASK: usize = 1 << 16;

/// Share of the forces in play that each of `n` entries of a residual may have if all together are noise.
pub(in crate::equilibrium) fn noise(n: usize, force_tolerance: f64) -> f64 {
    NOISE.min(LEFT * force_tolerance) / (n.max(1) as f64).sqrt()
}

/// Kind of the sum of the groups' tangents.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Sum {
    /// Another matrix than its last one.
    #[default]
    Another,
    /// Its last matrix.
    Last,
    /// It was its last matrix before tangents were added up once more.
    Next,
}

/// What the solver of a phase holds factorised.
#[derive(Debug, Default)]
pub struct Matrix {
    /// There is one to compute corrections with.
    pub(in crate::equilibrium) held: bool,
    /// The groups still keep the tangents it was assembled from.
    pub(super) has_tangents: bool,
    /// There is only one: all groups are linear.
    pub(super) is_constant: bool,
    /// Largest entry of the last one.
    largest: f64,
    /// The same of every body, where there are several.
    largest_by_body: Vec<f64>,
    /// The sum of the groups' tangents.
    elements: Elements,
    sum: Sum,
    /// The same equations again, for questions outside the iterations.
    pub(super) beside: Option<LinearSolver>,
    /// Callback that receives beforehand the bytes they take.
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

    /// Announces that the equations will be factorised again, for a question outside the iterations.
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

    /// A matrix that starts from what this one has kept of the elements, until [`Self::put_back`].
    #[must_use]
    pub fn lend(&mut self) -> Self {
        Self {
            elements: std::mem::take(&mut self.elements),
            ..Self::resumed(self.largest)
        }
    }

    /// Takes that back. The solver, with which others were factorised, gets its last matrix again if the next step
    /// begins with it.
    pub fn put_back(&mut self, lent: Self, solver: &mut LinearSolver, last: Option<LastMatrix>) {
        self.elements = lent.elements;
        let wanted = self.held && self.has_tangents;
        self.restore(solver, last, wanted);
    }

    /// Factorises the last matrix of the solver again, if there were others and it is still `wanted`.
    pub(super) fn restore(
        &mut self,
        solver: &mut LinearSolver,
        last: Option<LastMatrix>,
        wanted: bool,
    ) {
        if let Some(last) = last {
            self.held = solver.put_back(last, wanted).is_ok() && wanted;
            self.sum = Sum::Another;
        }
    }

    pub(super) fn hold(&mut self) {
        self.held = true;
        self.has_tangents = true;
    }

    /// Whether it is made of the tangents that the groups hold now.
    pub(super) fn is_of_tangents(&self, system: &System, groups: &[Group]) -> bool {
        self.held && self.sum == Sum::Last && system.is_sum_of_tangents(&self.elements, groups)
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
        self.kept.tangents = Operator::None;
        if operator != Operator::None && !self.equations.matrix.is_constant {
            self.equations.matrix.has_tangents = false;
        }
    }

    /// The matrix from the tangents that the groups hold, without the domain.
    pub(in crate::equilibrium) fn stiffness(&mut self) -> &[f64] {
        let start = Instant::now();
        let matrix = &mut *self.equations.matrix;
        self.equations
            .system
            .assemble_after(&mut matrix.elements, self.groups);
        matrix.sum = match matrix.sum {
            Sum::Last => Sum::Next,
            _ => Sum::Another,
        };
        let columns = matrix.elements.largest();
        let of_domain = self.equations.domain.map_or(0.0, |domain| domain.largest);
        matrix.largest = of_domain.max(largest(columns));
        let bodies = &self.equations.places.bodies;
        if !bodies.of_equation.is_empty() {
            let mut by_body = vec![0.0_f64; bodies.n];
            for (&of_column, &body) in columns.iter().zip(&bodies.of_equation) {
                by_body[body as usize] = by_body[body as usize].max(of_column);
            }
            if let Some(domain) = self.equations.domain {
                let n = self.equations.places.boundary.len();
                let columns = domain.stiffness().chunks_exact(n.max(1));
                for (&place, column) in self.equations.places.boundary.iter().zip(columns) {
                    let body = bodies.of_place[place] as usize;
                    by_body[body] = by_body[body].max(largest(column));
                }
            }
            matrix.largest_by_body = by_body;
        }
        self.costs.assembly += start.elapsed();
        matrix.elements.values()
    }

    /// Factorises the matrix from the tangents that the groups hold.
    ///
    /// # Errors
    /// It is singular.
    pub(super) fn factorise_tangents(&mut self) -> Result<(), StepFailure> {
        self.stiffness();
        let start = Instant::now();
        let elements = &mut self.equations.matrix.elements;
        let outcome = if self.equations.matrix.is_constant {
            // It is not added up again.
            self.equations.solver.factorise(elements.take())
        } else if self.equations.matrix.sum == Sum::Next {
            self.equations
                .solver
                .factorise_changed(elements.values(), elements.changed())
        } else {
            let mut values = self.equations.solver.room();
            values.clear();
            values.extend_from_slice(elements.values());
            self.equations.solver.factorise(values)
        };
        self.factorised(start, outcome)?;
        self.equations.matrix.sum = Sum::Last;
        Ok(())
    }

    /// Factorises a matrix that follows from tangents that the groups held.
    ///
    /// # Errors
    /// It is singular.
    pub(in crate::equilibrium) fn factorise(
        &mut self,
        values: Vec<f64>,
    ) -> Result<(), StepFailure> {
        let start = Instant::now();
        let outcome = self.equations.solver.factorise(values);
        self.factorised(start, outcome)
    }

    /// Factorises (K + α K_e) / (1 + α) with the tangents of the last evaluation. The entries of elastic ground then
    /// equal those of K_e bit for bit, whatever α, so their Schur complements are reused.
    ///
    /// # Errors
    /// It is singular.
    pub(in crate::equilibrium) fn factorise_regularised(
        &mut self,
        elastic: &[f64],
        alpha: f64,
    ) -> Result<(), StepFailure> {
        let share = 1.0 / (1.0 + alpha);
        let mut values = self.equations.solver.room();
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
                        share * (now + alpha * elastic)
                    };
                }
            },
        );
        self.factorise(values)
    }

    /// Solves (K + α K_e) δ = residual with that matrix.
    ///
    /// # Errors
    /// The matrix is singular.
    pub(in crate::equilibrium) fn regularised_answer(
        &mut self,
        residual: &[f64],
        alpha: f64,
    ) -> Result<Vec<f64>, StepFailure> {
        let share = 1.0 / (1.0 + alpha);
        let residual: Vec<f64> = residual.iter().map(|r| share * r).collect();
        self.solve(&residual, None)
    }

    fn factorised(
        &mut self,
        start: Instant,
        outcome: Result<(), Singular>,
    ) -> Result<(), StepFailure> {
        self.equations.matrix.held = false;
        self.equations.matrix.sum = Sum::Another;
        self.costs.equations += start.elapsed();
        self.costs.factorisations += 1;
        outcome.map_err(|_| Reason::Singular(None).into())
    }

    /// K_fp Δp with the tangents that the groups hold, by equation.
    pub(in crate::equilibrium) fn coupling(&mut self, prescribed: &[f64]) -> Vec<f64> {
        let start = Instant::now();
        let mut coupling = vec![0.0; self.equations.places.free.len()];
        self.equations
            .places
            .scatter(prescribed, &mut self.room.displacement);
        let (system, increment) = (self.equations.system, &self.room.displacement);
        system.prescribed_forces(self.groups, increment, &mut coupling);
        self.costs.assembly += start.elapsed();
        coupling
    }

    /// The correction that takes away what is out of balance, with the matrix there is, by place.
    ///
    /// Entries of the residual that all together are noise are left: where ground stays elastic the first
    /// corrections leave no others, and the solver has less to eliminate.
    ///
    /// # Errors
    /// The matrix is singular.
    pub(in crate::equilibrium) fn correction_of(
        &mut self,
        balance: &Balance,
    ) -> Result<Vec<f64>, StepFailure> {
        let of_equation = &self.equations.places.bodies.of_equation;
        let share = noise(balance.residual.len(), self.settings.force_tolerance);
        let left: Vec<f64> = balance.scales.iter().map(|scale| share * scale).collect();
        let entries = balance.residual.iter().enumerate();
        let residual: Vec<f64> = entries
            .map(|(equation, &entry)| {
                let body = of_equation.get(equation).map_or(0, |&body| body as usize);
                let is_left = left.get(body).is_some_and(|left| entry.abs() <= *left);
                if is_left { 0.0 } else { entry }
            })
            .collect();
        self.solve(&residual, None)
    }

    /// Solves K δ = residual − K_fp Δp with the factorised matrix.
    ///
    /// # Errors
    /// The matrix is singular.
    pub(in crate::equilibrium) fn solve(
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
        let solution = self.equations.solver.solve(&right);
        self.costs.equations += start.elapsed();
        let solution = solution.map_err(|_| StepFailure::from(Reason::Singular(None)))?;
        let mut correction = vec![0.0; self.equations.places.n()];
        for (&place, value) in self.equations.places.free.iter().zip(solution) {
            correction[place] = value;
        }
        self.equations.places.follow(&mut correction);
        Ok(correction)
    }
    /// Displacement increments that answer a residual with the matrix there is, these prescribed ones included.
    ///
    /// # Errors
    /// The matrix is singular.
    pub(in crate::equilibrium) fn answer_to(
        &mut self,
        residual: &[f64],
        prescribed: &[f64],
    ) -> Result<Vec<f64>, StepFailure> {
        let mut increment = self.solve(residual, Some(prescribed))?;
        for (value, prescribed) in increment.iter_mut().zip(prescribed) {
            *value += prescribed;
        }
        self.equations.places.follow(&mut increment);
        Ok(increment)
    }
}
